//! What the host does for a plugin during a call. All services are thread-safe.

use crate::image::ViewImages;
use crate::kinds::Error;
use resurvey_schema::{ClassId, ClassTable, Descriptor, GridPoint, Pose, Wgs84};

/// A set of class indices.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ClassSet(pub [u64; 4]);

impl ClassSet {
    /// Adds `class`.
    pub fn insert(&mut self, class: ClassId) {
        self.0[usize::from(class.0 >> 6)] |= 1 << (class.0 & 63);
    }

    /// Whether `class` is in the set.
    pub fn contains(&self, class: ClassId) -> bool {
        self.0[usize::from(class.0 >> 6)] >> (class.0 & 63) & 1 == 1
    }
}

/// Severity of a log line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Level {
    /// The run cannot be trusted.
    Warning,
    /// Of interest to the user.
    Info,
    /// Of interest to the author.
    Debug,
}

/// How views are compared with the photo by the host, at its own speed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CompareRequest {
    /// Every `stride`-th pixel of the photo along u and v; the rays are exactly those pixels' rays.
    pub stride: u32,
    /// A pixel whose photo class is in here (or void) is not compared.
    pub ignored_in_photo: ClassSet,
    /// A pixel whose view class is in here is not compared.
    pub ignored_in_view: ClassSet,
    /// Tolerance of the boundary counts, full-size pixels; 0 leaves them out (and zero).
    pub boundary_tolerance_px: f64,
}

/// Counts of one class over the compared pixels of one view.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(C)]
pub struct ClassCounts {
    /// Pixels of the class in the photo, |A|.
    pub photo: u32,
    /// Pixels of the class in the view, |B|.
    pub view: u32,
    /// Pixels of the class in both, |A∩B|.
    pub both: u32,
    /// Boundary pixels of the class in the photo.
    pub photo_boundary: u32,
    /// Of these, how many have a boundary pixel of the view within the tolerance.
    pub photo_boundary_matched: u32,
    /// Boundary pixels of the class in the view.
    pub view_boundary: u32,
    /// Of these, how many have a boundary pixel of the photo within the tolerance.
    pub view_boundary_matched: u32,
}

/// Counts of every class (index = class index) for one view.
pub type ViewCounts = Vec<ClassCounts>;

/// How panoramas are compared with the photo: one rendering per position, headings as column shifts.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PanoramaRequest {
    /// Pitch of every candidate, radians.
    pub pitch_rad: f64,
    /// Roll of every candidate, radians.
    pub roll_rad: f64,
    /// First heading, radians; rounded to a whole column.
    pub first_yaw_rad: f64,
    /// Columns between neighbouring headings.
    pub yaw_step_columns: u32,
    /// Number of headings.
    pub yaw_count: u32,
    /// Columns over the full circle.
    pub columns: u32,
    /// A cell whose photo class is in here (or void) is not compared.
    pub ignored_in_photo: ClassSet,
    /// A cell whose view class is in here is not compared.
    pub ignored_in_view: ClassSet,
}

/// What a ray hits first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RayHit {
    /// The point.
    pub point: GridPoint,
    /// Distance along the ray, metres.
    pub range_m: f64,
    /// Unit normal of the surface, turned towards the ray's origin: E, N, H.
    pub normal: [f64; 3],
    /// Class there.
    pub class: ClassId,
    /// Feature id of the descriptor hit; `None` for the base map.
    pub fid: Option<u64>,
}

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
