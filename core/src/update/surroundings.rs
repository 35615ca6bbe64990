//! The part of a version that a capture can see.

use super::UpdateError;
use crate::localize::World;
use crate::mesh::{Object, decode_mesh};
use crate::store::Snapshot;
use crate::version::{BoxMm, FeatureState};
use resurvey_schema::GridPoint;

/// What is further than this from the prior is not drawn, metres: the search reaches 40 m, and at 400 m a pixel of a
/// phone's wide lens is more than a metre.
pub const REACH_M: f64 = 450.0;
/// Heights that belong to a place, metres above and below.
const REACH_UP_M: f64 = 2000.0;

/// Everything of `snapshot` within [`REACH_M`] of `place`; an error when there is nothing.
pub fn world_around(snapshot: &Snapshot<'_>, place: GridPoint) -> Result<World, UpdateError> {
    let GridPoint { easting_m: e, northing_m: n, height_m: h } = place;
    let region = BoxMm::new(
        GridPoint::new(e - REACH_M, n - REACH_M, h - REACH_UP_M),
        GridPoint::new(e + REACH_M, n + REACH_M, h + REACH_UP_M),
    )?;
    let (mut objects, mut descriptors) = (Vec::new(), Vec::new());
    for feature in snapshot.features(Some(&region))? {
        let fid = feature.fid.0;
        match feature.state {
            FeatureState::Descriptor(descriptor) => descriptors.push((fid, descriptor)),
            FeatureState::Object { name, geometry, .. } => {
                let mesh = decode_mesh(&snapshot.geometry(geometry)?)
                    .map_err(|source| UpdateError::Geometry { fid, source })?;
                objects.push((fid, Object { name, mesh }));
            }
        }
    }
    if objects.is_empty() {
        return Err(UpdateError::NothingThere { reach_m: REACH_M, easting_m: e, northing_m: n });
    }
    let lent: Vec<(u64, &Object)> = objects.iter().map(|(fid, object)| (*fid, object)).collect();
    Ok(World::new(place, &lent, descriptors, snapshot.classes().clone()))
}
