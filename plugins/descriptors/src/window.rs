//! A virtual pinhole camera that looks at a region: whatever the real lens does, straight edges are straight in it, and
//! its pixel has the size of the real one there.

use nalgebra::{Vector2, Vector3};
use resurvey_plugin::schema::Pose;
use resurvey_plugin::{Error, Host};

/// A virtual camera at the place of the real one.
pub struct Window {
    axes: [Vector3<f64>; 3],
    focal_px: f64,
}

impl Window {
    /// A window that looks at pixel `centre` of the camera at `pose`; `None` when the lens has no ray there.
    pub fn new(host: &dyn Host, pose: &Pose, centre: Vector2<f64>) -> Result<Option<Self>, Error> {
        let [u, v] = [centre.x, centre.y];
        let rays = rays(host, pose, &[[u, v], [u + 1.0, v], [u, v + 1.0]])?;
        let [forward, right, down] = [rays[0], rays[1] - rays[0], rays[2] - rays[0]];
        let flat = |step: Vector3<f64>| step - forward * step.dot(&forward);
        let (right, down) = (flat(right), flat(down));
        let size = (right.norm() * down.norm()).sqrt();
        if !(size > 0.0 && size.is_finite()) {
            return Ok(None);
        }
        let right = right.normalize();
        Ok(Some(Self { axes: [right, forward.cross(&right), forward], focal_px: 1.0 / size }))
    }

    /// Where a ray's direction is seen; `None` behind the window.
    pub fn pixel(&self, direction: &Vector3<f64>) -> Option<Vector2<f64>> {
        let [right, down, forward] = &self.axes;
        let depth = direction.dot(forward);
        (depth > 1e-6).then(|| Vector2::new(direction.dot(right), direction.dot(down)) * (self.focal_px / depth))
    }

    /// The unit direction of a place in the window.
    pub fn ray(&self, pixel: &Vector2<f64>) -> Vector3<f64> {
        let [right, down, forward] = &self.axes;
        (forward + (right * pixel.x + down * pixel.y) / self.focal_px).normalize()
    }
}

/// Unit directions through pixel coordinates.
pub fn rays(host: &dyn Host, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<Vector3<f64>>, Error> {
    let rays = host.pixel_rays(pose, pixels)?;
    if rays.len() != pixels.len() {
        let (expected, found) = (pixels.len(), rays.len());
        return Err(Error(format!("expected {expected} rays from the host, found {found}")));
    }
    Ok(rays.into_iter().map(Vector3::from).collect())
}
