//! What a scene offers to a plugin during a call: the host's side of `trait Host` in the SDK.

use super::input::ViewImages;
use rayon::prelude::*;
use resurvey_schema::service::{ClassCounts, CompareRequest, Level, PanoramaRequest, RayHit};
use resurvey_schema::{ClassTable, Descriptor, GridPoint, Pose, Wgs84};

/// Why a service could not answer.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{0}")]
pub struct ServiceError(pub String);

/// The services of one call. The photo and the camera are those of the capture that the call is about.
pub trait Services: Sync {
    /// The map's class table.
    fn classes(&self) -> &ClassTable;

    /// Hands one view per pose to `receive`, in order: the capture's camera, every `stride`-th pixel.
    fn render(
        &self,
        stride: u32,
        with_descriptors: bool,
        poses: &[Pose],
        receive: &mut dyn FnMut(&ViewImages<'_>),
    ) -> Result<(), ServiceError>;

    /// Overwrites `counts[pose][class]`; the inner length is [`class_slots`].
    fn compare_views(
        &self,
        request: &CompareRequest,
        poses: &[Pose],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError>;

    /// Overwrites `counts[position][heading][class]`; boundary counts become zero.
    fn compare_panoramas(
        &self,
        request: &PanoramaRequest,
        positions: &[GridPoint],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError>;

    /// Whether each position lies inside a solid building.
    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, ServiceError>;

    /// Unit directions (E, N, H) of the rays through pixel coordinates, for the capture's camera at `pose`.
    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, ServiceError>;

    /// Pixel coordinates of points; `None` behind the camera or outside the model.
    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, ServiceError>;

    /// The first surface each ray hits within `limit_m`.
    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, ServiceError>;

    /// Descriptors whose anchor is within `radius_m` of `point`, by rising feature id.
    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, ServiceError>;

    /// Height of the first surface of the base map below `point`, metres; `None` when there is none.
    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, ServiceError>;

    /// Grid position of a WGS84 position.
    fn grid_from_wgs84(&self, position: Wgs84) -> Result<GridPoint, ServiceError>;

    /// WGS84 position of a grid position.
    fn wgs84_from_grid(&self, point: GridPoint) -> Result<Wgs84, ServiceError>;

    /// Runs `task(0)…task(count - 1)`, in any order, and returns when all are done.
    fn parallel_for(&self, count: usize, task: &(dyn Fn(usize) + Sync)) -> Result<(), ServiceError> {
        (0..count).into_par_iter().for_each(task);
        Ok(())
    }

    /// Takes a line for the log.
    fn log(&self, level: Level, text: &str);

    /// Takes how far the call is, 0–1.
    fn progress(&self, fraction: f64);

    /// Whether the call is to end.
    fn cancelled(&self) -> bool;
}

/// Where a run's messages go and whether it should end; the command line fills it in.
pub trait Listener: Sync {
    /// Takes a line for the log.
    fn log(&self, level: Level, text: &str);
    /// Takes how far the present stage is, 0–1.
    fn progress(&self, fraction: f64);
    /// Whether the run is to end.
    fn cancelled(&self) -> bool;
}

/// What a plugin is told when a service panics, which must not cross the line.
pub(super) const SERVICE_PANICKED: &str = "the host has a bug: its service panicked";

/// Counts per view in the comparisons: one more than the highest class index of `classes`.
pub fn class_slots(classes: &ClassTable) -> usize {
    classes.iter().map(|class| usize::from(class.index.0) + 1).max().unwrap_or(0)
}

type Checked = Result<(), ServiceError>;

fn wrong(what: &str) -> Checked {
    Err(ServiceError(what.to_owned()))
}

/// What every service asks of the positions it is given.
pub(super) fn finite_points(points: &[GridPoint]) -> Checked {
    if points.iter().all(GridPoint::is_finite) { Ok(()) } else { wrong("a position is not finite") }
}

/// What every service asks of the poses it is given.
pub(super) fn finite_poses(poses: &[Pose]) -> Checked {
    let finite = |pose: &Pose| <[f64; 6]>::from(*pose).iter().all(|value| value.is_finite());
    if poses.iter().all(finite) { Ok(()) } else { wrong("a pose is not finite") }
}

/// What every service asks of other numbers.
pub(super) fn finite(values: &[f64]) -> Checked {
    if values.iter().all(|value| value.is_finite()) { Ok(()) } else { wrong("a number is not finite") }
}

/// A stride of nothing would never end.
pub(super) fn some_stride(stride: u32) -> Checked {
    if stride > 0 { Ok(()) } else { wrong("the stride is 0; expected at least 1") }
}

/// A panorama of nothing has no headings.
pub(super) fn some_columns(columns: u32) -> Checked {
    if columns > 0 { Ok(()) } else { wrong("the panorama has 0 columns") }
}
