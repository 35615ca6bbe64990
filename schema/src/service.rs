//! Plain values that the host's services take and return.

use crate::class::ClassId;
use crate::localization::Alignment;
use crate::position::{GridPoint, Pose};

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

/// A feature that can be seen in a view: a descriptor of the map's version.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct ViewFeature {
    /// Feature id in the map.
    pub fid: u64,
    /// Its class.
    pub class: ClassId,
}

/// A pose with its uncertainty.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseEstimate {
    /// The pose.
    pub pose: Pose,
    /// Covariance over easting (m), northing (m), yaw (rad).
    pub covariance: [[f64; 3]; 3],
    /// 1σ of the height, metres.
    pub height_sigma_m: f64,
    /// 1σ of pitch and roll, radians.
    pub tilt_sigma_rad: f64,
    /// What the matcher found out about all six degrees of freedom, the map and the labels; `None` when it does not say.
    pub alignment: Option<Alignment>,
}

/// The phone's rough pose with its uncertainty, in the map frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prior {
    /// The rough pose.
    pub pose: Pose,
    /// 1σ of the position in plan, metres.
    pub position_sigma_m: f64,
    /// 1σ of the height, metres.
    pub height_sigma_m: f64,
    /// 1σ of the heading, radians.
    pub yaw_sigma_rad: f64,
    /// 1σ of pitch and roll, radians.
    pub tilt_sigma_rad: f64,
}
