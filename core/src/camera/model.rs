//! A validated camera: rays of pixels and pixels of directions.

use super::brown::Brown;
use super::fisheye::Fisheye;
use nalgebra::{Matrix3, Vector3};
use resurvey_schema::{CameraFile, CameraModel, Intrinsics};

/// Longest side of an image, pixels.
pub const MAX_SIDE_PX: u32 = 16_384;
/// Most pixels of an image: a view of more would need several gigabytes.
pub const MAX_PIXELS: u64 = 1 << 27;

/// Why a camera description cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum CameraError {
    /// The model is not known.
    #[error("camera.model: expected pinhole, brown or fisheye, found {found:?}")]
    UnknownModel {
        /// What the file says.
        found: String,
    },
    /// A side is zero or too long, or the image has too many pixels.
    #[error(
        "camera: expected 1 to {MAX_SIDE_PX} pixels a side and at most {MAX_PIXELS} in all, found {width} x {height}"
    )]
    Size {
        /// Columns.
        width: u32,
        /// Rows.
        height: u32,
    },
    /// Not exactly one of the two ways to say how wide the camera sees.
    #[error("camera: expected either fx, fy, cx, cy or diagonal_fov_deg, found {found}")]
    Focal {
        /// What the file has.
        found: String,
    },
    /// A number is out of its range.
    #[error("camera.{field}: expected {expected}, found {found}")]
    Number {
        /// Name of the field.
        field: &'static str,
        /// Its range.
        expected: &'static str,
        /// What the file says.
        found: f64,
    },
    /// The model has another number of distortion coefficients.
    #[error("camera.distortion: expected {expected} for model {model}, found {found} numbers")]
    DistortionLength {
        /// The model.
        model: &'static str,
        /// How many it has.
        expected: &'static str,
        /// How many the file has.
        found: usize,
    },
}

/// Intrinsics known to be usable.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Camera {
    intrinsics: Intrinsics,
    lens: Lens,
}

/// A camera known to keep straight lines straight: u = fx·x/z + cx, v = fy·y/z + cy.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pinhole {
    width: u32,
    height: u32,
    fx: f64,
    fy: f64,
    cx: f64,
    cy: f64,
}

impl Pinhole {
    /// Columns, pixels.
    pub fn width(&self) -> u32 {
        self.width
    }

    /// Rows, pixels.
    pub fn height(&self) -> u32 {
        self.height
    }

    /// Takes camera axes to homogeneous pixels (u·z, v·z, z).
    pub fn matrix(&self) -> Matrix3<f64> {
        Matrix3::new(self.fx, 0.0, self.cx, 0.0, self.fy, self.cy, 0.0, 0.0, 1.0)
    }

    /// Takes (u, v, 1) to the direction in camera axes whose z is 1.
    pub fn inverse(&self) -> Matrix3<f64> {
        let (fx, fy) = (1.0 / self.fx, 1.0 / self.fy);
        Matrix3::new(fx, 0.0, -self.cx * fx, 0.0, fy, -self.cy * fy, 0.0, 0.0, 1.0)
    }
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Lens {
    Pinhole,
    Brown(Brown),
    Fisheye(Fisheye),
}

impl Camera {
    /// The camera a capture file describes. `diagonal_fov_deg` is for pinhole and brown cameras (below 180°), where
    /// f = half diagonal / tan(fov/2), and for fisheye cameras (at most 360°), where f = half diagonal / (fov/2).
    pub fn from_file(file: &CameraFile) -> Result<Self, CameraError> {
        let model = match file.model.as_str() {
            "pinhole" => CameraModel::Pinhole,
            "brown" => CameraModel::Brown,
            "fisheye" => CameraModel::Fisheye,
            _ => return Err(CameraError::UnknownModel { found: file.model.clone() }),
        };
        check_size(file.width, file.height)?;
        let distortion = distortion_of(model, file.distortion.as_deref().unwrap_or(&[]))?;
        let [fx, fy, cx, cy] = focal_of(model, file)?;
        let (width, height) = (file.width, file.height);
        Self::new(Intrinsics { model, width, height, fx, fy, cx, cy, distortion })
    }

    /// The camera of `intrinsics`, checked.
    pub fn new(intrinsics: Intrinsics) -> Result<Self, CameraError> {
        check_size(intrinsics.width, intrinsics.height)?;
        for (field, found) in [("fx", intrinsics.fx), ("fy", intrinsics.fy)] {
            // The upper limit keeps products of coordinates finite.
            if !(found > 0.0 && found <= 1e9) {
                return Err(CameraError::Number { field, expected: "a number above 0 and at most 1e9", found });
            }
        }
        for (field, found) in [("cx", intrinsics.cx), ("cy", intrinsics.cy)] {
            if found.is_nan() || found.abs() > 1e9 {
                return Err(CameraError::Number { field, expected: "a number between -1e9 and 1e9", found });
            }
        }
        if let Some(&found) = intrinsics.distortion.iter().find(|value| !value.is_finite()) {
            return Err(CameraError::Number { field: "distortion", expected: "finite numbers", found });
        }
        let [k1, k2, k3, k4, _] = intrinsics.distortion;
        let lens = match intrinsics.model {
            CameraModel::Pinhole => Lens::Pinhole,
            CameraModel::Brown => Lens::Brown(Brown::new(intrinsics.distortion)),
            CameraModel::Fisheye => Lens::Fisheye(Fisheye::new([k1, k2, k3, k4])),
        };
        Ok(Self { intrinsics, lens })
    }

    /// The numbers behind it.
    pub fn intrinsics(&self) -> Intrinsics {
        self.intrinsics
    }

    /// Columns, pixels.
    pub fn width(&self) -> u32 {
        self.intrinsics.width
    }

    /// Rows, pixels.
    pub fn height(&self) -> u32 {
        self.intrinsics.height
    }

    /// Whether straight lines stay straight: a pinhole, or a Brown model without distortion.
    pub fn is_pinhole(&self) -> bool {
        match self.lens {
            Lens::Pinhole => true,
            Lens::Brown(_) => self.intrinsics.distortion.iter().all(|&value| value.abs() < f64::MIN_POSITIVE),
            Lens::Fisheye(_) => false,
        }
    }

    /// The camera as one that can be rasterised; `None` when it bends straight lines.
    pub fn pinhole(&self) -> Option<Pinhole> {
        let Intrinsics { width, height, fx, fy, cx, cy, .. } = self.intrinsics;
        self.is_pinhole().then_some(Pinhole { width, height, fx, fy, cx, cy })
    }

    /// Unit direction, camera axes, that is seen at (u, v); `None` where the lens shows nothing.
    pub fn ray(&self, u: f64, v: f64) -> Option<Vector3<f64>> {
        let Intrinsics { fx, fy, cx, cy, .. } = self.intrinsics;
        let seen = [(u - cx) / fx, (v - cy) / fy];
        let ray = match &self.lens {
            Lens::Pinhole => Vector3::new(seen[0], seen[1], 1.0).normalize(),
            Lens::Brown(brown) => {
                let [x, y] = brown.undistort(seen)?;
                Vector3::new(x, y, 1.0).normalize()
            }
            Lens::Fisheye(fisheye) => fisheye.direction(seen)?,
        };
        ray.iter().all(|value| value.is_finite()).then_some(ray)
    }

    /// Pixel coordinates of a point in camera axes, inside the image or not; `None` behind the camera and outside the
    /// range in which the lens is one to one.
    pub fn project(&self, point: Vector3<f64>) -> Option<[f64; 2]> {
        let Intrinsics { fx, fy, cx, cy, .. } = self.intrinsics;
        let flat = || (point.z > 0.0).then(|| [point.x / point.z, point.y / point.z]);
        let [x, y] = match &self.lens {
            Lens::Pinhole => flat()?,
            Lens::Brown(brown) => brown.distort(flat()?)?,
            Lens::Fisheye(fisheye) => fisheye.project(point)?,
        };
        let seen = [fx * x + cx, fy * y + cy];
        (seen[0].is_finite() && seen[1].is_finite()).then_some(seen)
    }

    /// The camera whose pixel (i, j) sees exactly along the full-size pixel (i·stride + stride/2, j·stride + stride/2),
    /// with as many pixels as lie inside. The stride is held so that at least one does.
    pub fn subsampled(&self, stride: u32) -> Self {
        let full = self.intrinsics;
        let stride = stride.clamp(1, (2 * full.width.min(full.height)).saturating_sub(1).max(1));
        let first = stride / 2;
        let step = f64::from(stride);
        let principal = |centre: f64| (centre - f64::from(first) - 0.5) / step + 0.5;
        let intrinsics = Intrinsics {
            width: (full.width - 1 - first) / stride + 1,
            height: (full.height - 1 - first) / stride + 1,
            fx: full.fx / step,
            fy: full.fy / step,
            cx: principal(full.cx),
            cy: principal(full.cy),
            ..full
        };
        Self { intrinsics, lens: self.lens }
    }
}

fn check_size(width: u32, height: u32) -> Result<(), CameraError> {
    let side = 1..=MAX_SIDE_PX;
    let fits = side.contains(&width) && side.contains(&height) && u64::from(width) * u64::from(height) <= MAX_PIXELS;
    if fits { Ok(()) } else { Err(CameraError::Size { width, height }) }
}

fn distortion_of(model: CameraModel, given: &[f64]) -> Result<[f64; 5], CameraError> {
    let (name, expected, fits) = match model {
        CameraModel::Pinhole => ("pinhole", "none", given.is_empty()),
        CameraModel::Brown => ("brown", "4 or 5 (k1 k2 p1 p2 and k3)", matches!(given.len(), 4 | 5)),
        CameraModel::Fisheye => ("fisheye", "4 (k1 k2 k3 k4)", given.len() == 4),
    };
    if !fits {
        return Err(CameraError::DistortionLength { model: name, expected, found: given.len() });
    }
    Ok(std::array::from_fn(|index| given.get(index).copied().unwrap_or(0.0)))
}

fn focal_of(model: CameraModel, file: &CameraFile) -> Result<[f64; 4], CameraError> {
    match (file.fx, file.fy, file.cx, file.cy, file.diagonal_fov_deg) {
        (Some(fx), Some(fy), Some(cx), Some(cy), None) => Ok([fx, fy, cx, cy]),
        (None, None, None, None, Some(fov_deg)) => {
            let limit_deg = if model == CameraModel::Fisheye { 360.0 } else { 180.0 };
            let field = "diagonal_fov_deg";
            if !(fov_deg > 0.0 && fov_deg < limit_deg) {
                let expected = if limit_deg < 200.0 { "between 0 and 180" } else { "between 0 and 360" };
                return Err(CameraError::Number { field, expected, found: fov_deg });
            }
            let (half_width, half_height) = (f64::from(file.width) / 2.0, f64::from(file.height) / 2.0);
            let half_rad = (fov_deg / 2.0).to_radians();
            let spread = if model == CameraModel::Fisheye { half_rad } else { half_rad.tan() };
            let focal_px = half_width.hypot(half_height) / spread;
            Ok([focal_px, focal_px, half_width, half_height])
        }
        (fx, fy, cx, cy, fov) => {
            let given = [("fx", fx), ("fy", fy), ("cx", cx), ("cy", cy), ("diagonal_fov_deg", fov)];
            let names: Vec<&str> = given.iter().filter(|(_, value)| value.is_some()).map(|(name, _)| *name).collect();
            let found = if names.is_empty() { "none of them".to_owned() } else { names.join(", ") };
            Err(CameraError::Focal { found })
        }
    }
}

/// The first positive argument at which `slope` is not above zero, infinite when there is none below 1000: distortion
/// polynomials turn where their slope changes sign.
pub(super) fn first_descent(slope: impl Fn(f64) -> f64) -> f64 {
    // Steps of 0.4 % see any turn that matters to a lens; slope(0) is 1.
    let mut low = 1e-3;
    while low < 1e3 {
        let high = low * 1.004;
        if slope(high) <= 0.0 {
            return bisect(low, high, |value| slope(value) <= 0.0);
        }
        low = high;
    }
    f64::INFINITY
}

/// The argument in 0…`limit` at which `rising`, which rises from 0 and is near its argument there, reaches `target`.
pub(super) fn invert_rising(rising: impl Fn(f64) -> f64, target: f64, limit: f64) -> Option<f64> {
    let mut high = target.min(limit);
    while rising(high) < target {
        if high >= limit || high > 1e6 {
            return None;
        }
        high = (high * 2.0).min(limit);
    }
    Some(bisect(0.0, high, |value| rising(value) >= target))
}

/// The smallest value at which `reached` holds, to the last bit, given that it holds at `high` and not at `low`.
fn bisect(mut low: f64, mut high: f64, reached: impl Fn(f64) -> bool) -> f64 {
    loop {
        let middle = low + (high - low) / 2.0;
        if middle <= low || middle >= high {
            return high;
        }
        if reached(middle) { high = middle } else { low = middle }
    }
}
