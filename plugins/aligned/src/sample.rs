//! Samples of a template made ready for moving: where they are, and where they go for a metre east, north or up.

use crate::template::Place;
use resurvey_class_difference::raster::Rasters;
use resurvey_plugin::schema::{GridPoint, Pose};
use resurvey_plugin::{Error, Host};

/// Step by which a point is moved to see where its pixel goes, metres a metre of range.
const STEP_SHARE: f64 = 0.01;

/// A pixel of the view that moves with a surface.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Column and row of its centre, pixels.
    pub at: [f64; 2],
    /// Pixels right and down for a metre east, north and up.
    pub per_metre: [[f64; 3]; 2],
    /// Its class in the view.
    pub class: u8,
    /// Unit direction to it, E, N, H.
    pub direction: [f64; 3],
    /// Its range, metres.
    pub range_m: f64,
}

impl Sample {
    /// The pixel it moves to with `move_m`; `None` outside of the image.
    pub fn moved(&self, move_m: [f64; 3], rasters: &Rasters) -> Option<usize> {
        let to = |axis: usize| {
            let [e, n, h] = self.per_metre[axis];
            (self.at[axis] + e * move_m[0] + n * move_m[1] + h * move_m[2]).floor()
        };
        let (u, v) = (to(0), to(1));
        let is_inside = u >= 0.0 && v >= 0.0 && u < rasters.width as f64 && v < rasters.height as f64;
        is_inside.then(|| v as usize * rasters.width + u as usize)
    }
}

/// The samples of `places`; those that cannot be moved a little without leaving the camera's model are left out.
pub fn samples(host: &dyn Host, pose: &Pose, rasters: &Rasters, places: &[Place]) -> Result<Vec<Sample>, Error> {
    let centre =
        |place: &Place| [(place.pixel % rasters.width) as f64 + 0.5, (place.pixel / rasters.width) as f64 + 0.5];
    let centres: Vec<[f64; 2]> = places.iter().map(centre).collect();
    let rays = host.pixel_rays(pose, &centres)?;
    let step_m = |place: &Place| STEP_SHARE * f64::from(place.range_m);
    let mut moved = Vec::with_capacity(3);
    for axis in 0..3 {
        let point = |(place, ray): (&Place, &[f64; 3])| {
            let mut offset = ray.map(|part| part * f64::from(place.range_m));
            offset[axis] += step_m(place);
            offset_from(pose.position, offset)
        };
        moved.push(host.project(pose, &places.iter().zip(&rays).map(point).collect::<Vec<_>>())?);
    }
    let sample = |(index, place): (usize, &Place)| {
        let at = *centres.get(index)?;
        let mut per_metre = [[0.0; 3]; 2];
        for (axis, moved) in moved.iter().enumerate() {
            let [u, v] = (*moved.get(index)?)?;
            per_metre[0][axis] = (u - at[0]) / step_m(place);
            per_metre[1][axis] = (v - at[1]) / step_m(place);
        }
        let is_sound = place.range_m > 0.0 && per_metre.iter().flatten().all(|part| part.is_finite());
        let class = rasters.view[place.pixel];
        let (direction, range_m) = (*rays.get(index)?, f64::from(place.range_m));
        is_sound.then_some(Sample { at, per_metre, class, direction, range_m })
    };
    Ok(places.iter().enumerate().filter_map(sample).collect())
}

/// The point `offset` metres away.
pub fn offset_from(GridPoint { easting_m, northing_m, height_m }: GridPoint, [e, n, h]: [f64; 3]) -> GridPoint {
    GridPoint::new(easting_m + e, northing_m + n, height_m + h)
}
