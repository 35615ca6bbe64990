//! Whether four free sides are a rectangle's, as far as wandering contours let one tell.

use crate::quad::{CORRELATION_PX, Quad};
use crate::rectangle::{self, Corners};
use crate::requirement::{Unmet, at_most};
use crate::settings::Settings;
use nalgebra::Vector2;

/// Standard deviations of label noise that a difference must exceed its limit by: the largest of two sides and four
/// angles is above two of them by chance.
pub const NOISE_SIGMAS: f64 = 3.0;
/// Largest distance of a contour from the corners of its rectangle, share of the root of its area. That of an ellipse is
/// 0.16.
const MAX_CORNER_GAP: f64 = 0.1;
/// Requirements on shape widen with what label noise alone would cause, at most to this multiple.
const MAX_WIDENING: f64 = 4.0;

/// Requires that opposite sides are equal and angles right on the wall, where `corners` puts the window's pixels.
pub fn is_rectangle(
    quad: &Quad,
    settings: &Settings,
    corners: impl Fn(&Corners) -> Option<Corners>,
) -> Result<(), Unmet> {
    let Some(found) = corners(&quad.corners) else { return Ok(()) };
    let (mut side_variance, mut angle_variance) = (0.0, 0.0);
    for pixels in shaken(quad, settings.label_jitter_px) {
        let moved = pixels.and_then(|pixels| corners(&pixels));
        let change =
            |of: fn(&Corners) -> f64| moved.as_ref().map_or(f64::INFINITY, |moved| (of(moved) - of(&found)).powi(2));
        side_variance += change(rectangle::side_difference);
        angle_variance += change(rectangle::angle_difference_deg);
    }
    let widened = |limit: f64, variance: f64| (limit + NOISE_SIGMAS * variance.sqrt()).min(MAX_WIDENING * limit);
    let limit = widened(settings.max_side_difference, side_variance);
    at_most("rectangle", rectangle::side_difference(&found), limit, "ratio")?;
    let limit_deg = widened(settings.max_angle_difference_deg, angle_variance);
    at_most("rectangle", rectangle::angle_difference_deg(&found), limit_deg, "deg")
}

/// What wandering contours do: a side of the length over which they wander together is off by 1σ of the labels' jitter,
/// a longer one by less.
fn shaken(quad: &Quad, jitter_px: f64) -> impl Iterator<Item = Option<Corners>> + '_ {
    (0..4).flat_map(move |side| {
        let seen_px = (quad.length_px(side) * quad.visible[side]).max(1.0);
        let independent = (seen_px / CORRELATION_PX).max(1.0).sqrt();
        let sigma_px = quad.sides[side].rms_px.max(jitter_px) / independent;
        let turn_rad = 12f64.sqrt() * sigma_px / seen_px;
        [quad.shaken(side, sigma_px, 0.0), quad.shaken(side, 0.0, turn_rad)]
    })
}

/// Requires that the contour goes into the corners of its rectangle: on the mean over those that nothing hides, it comes
/// as near as noise lets it. `edge` is what of the contour is the thing's own, `hidden` the rest.
pub fn has_corners(
    corners: &Corners,
    edge: &[Vector2<f64>],
    hidden: &[Vector2<f64>],
    settings: &Settings,
) -> Result<(), Unmet> {
    let distance_px = |corner: &Vector2<f64>, points: &[Vector2<f64>]| {
        points.iter().map(|point| (point - corner).norm_squared()).fold(f64::INFINITY, f64::min).sqrt()
    };
    let gaps_px: Vec<f64> = corners
        .iter()
        .map(|corner| (distance_px(corner, edge), distance_px(corner, hidden)))
        .filter(|(edge_px, hidden_px)| edge_px <= hidden_px)
        .map(|(edge_px, _)| edge_px)
        .collect();
    let count = gaps_px.len().max(1) as f64;
    let area_px2 = ((corners[2] - corners[0]).perp(&(corners[3] - corners[1])) / 2.0).abs();
    let size_px = area_px2.sqrt().max(1.0);
    let noise = settings.label_jitter_px / count.sqrt() / size_px;
    let measured = gaps_px.iter().sum::<f64>() / count / size_px;
    at_most("rectangle", measured, MAX_CORNER_GAP + NOISE_SIGMAS * noise, "ratio")
}
