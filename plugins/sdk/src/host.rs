//! What the host does for a plugin during a call. All services are thread-safe.

use crate::image::ViewImages;
use crate::kinds::Error;
use resurvey_schema::service::{ClassCounts, CompareRequest, Level, PanoramaRequest, RayHit, ViewCounts};
use resurvey_schema::{ClassTable, Descriptor, GridPoint, Pose, Wgs84};

/// The services of the host.
pub trait Host: Sync {
    /// The map's class table.
    fn classes(&self) -> &ClassTable;

    /// One view per pose with the capture's camera, every `stride`-th pixel; descriptors placed on the map when
    /// `with_descriptors`.
    fn render(&self, stride: u32, with_descriptors: bool, poses: &[Pose]) -> Result<Vec<ViewImages>, Error>;

    /// Counts of every class for one view per pose against the capture's photo.
    fn compare_views(&self, request: &CompareRequest, poses: &[Pose]) -> Result<Vec<ViewCounts>, Error>;

    /// Counts for every position, heading and class (in this nesting; boundary counts are zero) against the photo.
    fn compare_panoramas(&self, request: &PanoramaRequest, positions: &[GridPoint]) -> Result<Vec<ClassCounts>, Error>;

    /// Whether each position lies inside a solid building.
    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, Error>;

    /// Unit directions (E, N, H) of the rays through pixel coordinates, for the capture's camera at `pose`.
    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, Error>;

    /// Pixel coordinates of points for the capture's camera at `pose`; `None` behind the camera or outside the model.
    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, Error>;

    /// The first surface each ray hits within `limit_m`; descriptors count when `with_descriptors`.
    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, Error>;

    /// Descriptors whose anchor is within `radius_m` of `point`, by rising feature id.
    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, Error>;

    /// Height of the first surface of the base map below `point`, metres; `None` when there is none.
    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, Error>;

    /// Grid position of a WGS84 position.
    fn grid_from_wgs84(&self, position: Wgs84) -> Result<GridPoint, Error>;

    /// WGS84 position of a grid position.
    fn wgs84_from_grid(&self, point: GridPoint) -> Result<Wgs84, Error>;

    /// Runs `task(0)…task(count - 1)` on the host's threads.
    fn parallel_for(&self, count: usize, task: &(dyn Fn(usize) + Sync)) -> Result<(), Error>;

    /// Writes a line to the host's log.
    fn log(&self, level: Level, text: &str);

    /// Tells the user how far the call is, 0–1.
    fn progress(&self, fraction: f64);

    /// Whether the user wants the call to end; a plugin returns within 200 ms.
    fn cancelled(&self) -> bool;
}
