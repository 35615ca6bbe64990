//! How far, in pixels, a class edge of the view may lie from where the photo shows it although nothing changed.
//!
//! A pose error of e metres moves what is z metres away by f·e/z pixels, a rotation of a by f·a; walls of the map are off
//! too, and contours of the labels wander.

use crate::raster::Rasters;
use crate::settings::Settings;
use resurvey_plugin::{Comparison, PoseEstimate};

/// Tolerance as a function of range.
pub struct Tolerance {
    focal_px: f64,
    metres_squared: f64,
    angles_squared: f64,
    jitter_px: f64,
    limit_px: u8,
}

impl Tolerance {
    /// The tolerance for the pose and the camera of `comparison`.
    pub fn new(comparison: &Comparison<'_>, settings: &Settings) -> Self {
        let (position_m, angle_rad) = sigmas(&comparison.estimate);
        let sigmas = settings.tolerance_sigmas;
        Self {
            focal_px: comparison.camera.fx.max(comparison.camera.fy),
            metres_squared: (sigmas * position_m).powi(2) + settings.map_tolerance_m.powi(2),
            angles_squared: (sigmas * angle_rad).powi(2),
            jitter_px: settings.label_jitter_px,
            limit_px: settings.max_tolerance_px,
        }
    }

    /// Tolerance at `range_m`, pixels, without upper bound.
    pub fn at_px(&self, range_m: f64) -> f64 {
        let range_m = range_m.max(1e-3);
        self.jitter_px + self.focal_px * (self.metres_squared / (range_m * range_m) + self.angles_squared).sqrt()
    }

    /// Tolerance per pixel, pixels. Where something near with a large tolerance may have moved over something far, the
    /// far pixels have the near one's.
    pub fn per_pixel(&self, rasters: &Rasters) -> Vec<u8> {
        let limit_px = f64::from(self.limit_px);
        let own: Vec<u8> =
            rasters.range_m.iter().map(|range_m| self.at_px(f64::from(*range_m)).min(limit_px).ceil() as u8).collect();
        spread(&own, rasters.width, self.limit_px)
    }
}

/// 1σ of the position, metres, in its worst direction, and of the attitude, radians.
fn sigmas(estimate: &PoseEstimate) -> (f64, f64) {
    let [[ee, en, _], [_, nn, _], [_, _, yaw]] = estimate.covariance;
    let plan_m2 = (ee + nn) / 2.0 + ((ee - nn) / 2.0).hypot(en);
    let (height_m2, tilt_rad2) = match &estimate.alignment {
        Some(alignment) => (alignment.covariance[3][3], alignment.covariance[4][4].max(alignment.covariance[5][5])),
        None => (estimate.height_sigma_m.powi(2), estimate.tilt_sigma_rad.powi(2)),
    };
    (plan_m2.max(height_m2).max(0.0).sqrt(), yaw.max(tilt_rad2).max(0.0).sqrt())
}

/// Gives every pixel the largest tolerance of those that reach it, along columns and then rows.
fn spread(own: &[u8], width: usize, limit_px: u8) -> Vec<u8> {
    let mut vertical = own.to_vec();
    for reach in 1..=limit_px {
        let shift = usize::from(reach) * width;
        if shift >= own.len() {
            break;
        }
        keep_largest(&mut vertical[shift..], &own[..own.len() - shift], reach);
        keep_largest(&mut vertical[..own.len() - shift], &own[shift..], reach);
    }
    let mut both = vertical.clone();
    for (to, from) in both.chunks_exact_mut(width.max(1)).zip(vertical.chunks_exact(width.max(1))) {
        for reach in 1..=limit_px {
            let shift = usize::from(reach);
            if shift >= width {
                break;
            }
            keep_largest(&mut to[shift..], &from[..width - shift], reach);
            keep_largest(&mut to[..width - shift], &from[shift..], reach);
        }
    }
    both
}

fn keep_largest(to: &mut [u8], from: &[u8], reach: u8) {
    for (to, from) in to.iter_mut().zip(from) {
        let reaching = if *from >= reach { *from } else { 0 };
        *to = (*to).max(reaching);
    }
}
