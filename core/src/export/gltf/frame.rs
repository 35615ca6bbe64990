//! Where an export's numbers start and which way its axes point.

use crate::crs::{CrsError, GridPoint, LocalOrigin};

pub(super) use crate::mesh::GLTF_FROM_GRID as GLTF_FROM_MAP;

/// Smallest box around grid points; all of them finite.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Extent {
    bounds: Option<([f64; 3], [f64; 3])>,
}

impl Extent {
    /// Around `points`; fails at the first that is not finite.
    pub(super) fn around(points: impl IntoIterator<Item = GridPoint>) -> Result<Self, CrsError> {
        let mut extent = Self::default();
        for point in points {
            if !point.is_finite() {
                return Err(CrsError::NotFinite { found: point.into() });
            }
            extent.take(point.into(), point.into());
        }
        Ok(extent)
    }

    /// Around both.
    pub(super) fn join(&mut self, other: &Self) {
        if let Some((low, high)) = other.bounds {
            self.take(low, high);
        }
    }

    fn take(&mut self, low: [f64; 3], high: [f64; 3]) {
        let (own_low, own_high) = self.bounds.unwrap_or((low, high));
        self.bounds = Some((
            std::array::from_fn(|axis| own_low[axis].min(low[axis])),
            std::array::from_fn(|axis| own_high[axis].max(high[axis])),
        ));
    }

    /// Middle of the box; zero for an empty one.
    fn middle(&self) -> GridPoint {
        let (low, high) = self.bounds.unwrap_or_default();
        std::array::from_fn(|axis| low[axis] / 2.0 + high[axis] / 2.0).into()
    }

    /// Origin of an export: above the middle in plan at the lowest height, in whole metres.
    pub(super) fn export_origin(&self) -> Result<LocalOrigin, CrsError> {
        let (low, _) = self.bounds.unwrap_or_default();
        let middle = self.middle();
        LocalOrigin::new(GridPoint::new(middle.easting_m.round(), middle.northing_m.round(), low[2].floor()))
    }

    /// Translation of a node, in whole metres from the export's origin and so exact in `f32`, and the origin of its
    /// vertices, which keeps their offsets below half the size of the box.
    pub(super) fn node_origin(&self, export: &LocalOrigin) -> Result<([f32; 3], LocalOrigin), CrsError> {
        let translation_m = export.to_whole_metres(self.middle())?;
        Ok((translation_m, LocalOrigin::new(export.to_grid(translation_m))?))
    }
}
