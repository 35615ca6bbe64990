//! Camera intrinsics as plugins see them.

/// How a camera maps directions to pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum CameraModel {
    /// u = fx·x/z + cx, v = fy·y/z + cy.
    Pinhole,
    /// Pinhole with Brown's radial and tangential distortion: k1 k2 p1 p2 k3.
    Brown,
    /// Equidistant fisheye with k1…k4 (Kannala & Brandt, as OpenCV has it).
    Fisheye,
}

impl CameraModel {
    /// Its name in files.
    pub fn name(self) -> &'static str {
        match self {
            Self::Pinhole => "pinhole",
            Self::Brown => "brown",
            Self::Fisheye => "fisheye",
        }
    }
}

/// Checked intrinsics: sizes above zero, finite numbers, focal lengths above zero.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intrinsics {
    /// The model.
    pub model: CameraModel,
    /// Columns, pixels.
    pub width: u32,
    /// Rows, pixels.
    pub height: u32,
    /// Focal length along u, pixels.
    pub fx: f64,
    /// Focal length along v, pixels.
    pub fy: f64,
    /// Principal point, pixels; the centre of the first pixel is 0.5.
    pub cx: f64,
    /// Principal point, pixels.
    pub cy: f64,
    /// As the model says; unused ones are zero.
    pub distortion: [f64; 5],
}
