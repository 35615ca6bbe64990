//! How far, in pixels, a class edge of the view may lie from where the photo shows it although nothing changed.
//!
//! A pose error of e metres moves what is z metres away by f·e/z pixels, a rotation of a by f·a; walls of the map are off
//! too, and contours of the labels wander.

use crate::raster::Rasters;
use crate::settings::Settings;
use resurvey_plugin::{Comparison, PoseEstimate};

/// Tolerance per pixel, pixels. Where something near with a large tolerance may have moved over something far, the far
/// pixels have the near one's.
pub fn tolerance_px(comparison: &Comparison<'_>, rasters: &Rasters, settings: &Settings) -> Vec<u8> {
    let focal_px = comparison.camera.fx.max(comparison.camera.fy);
    let (position_m, angle_rad) = sigmas(&comparison.estimate);
    let sigmas = settings.tolerance_sigmas;
    let metres_squared = (sigmas * position_m).powi(2) + settings.map_tolerance_m.powi(2);
    let angles_squared = (sigmas * angle_rad).powi(2);
    let limit_px = f64::from(settings.max_tolerance_px);
    let own: Vec<u8> = rasters
        .range_m
        .iter()
        .map(|range_m| {
            let range_m = f64::from(*range_m).max(1e-3);
            let shift_px = focal_px * (metres_squared / (range_m * range_m) + angles_squared).sqrt();
            (settings.label_jitter_px + shift_px).min(limit_px).ceil() as u8
        })
        .collect();
    spread(&own, rasters.width, settings.max_tolerance_px)
}

/// 1σ of the position, metres, in its worst direction, and of the attitude, radians.
fn sigmas(estimate: &PoseEstimate) -> (f64, f64) {
    let [[ee, en, _], [_, nn, _], [_, _, yaw]] = estimate.covariance;
    let plan = (ee + nn) / 2.0 + ((ee - nn) / 2.0).hypot(en);
    let position_m = plan.max(0.0).sqrt().max(estimate.height_sigma_m);
    (position_m, yaw.max(0.0).sqrt().max(estimate.tilt_sigma_rad))
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
