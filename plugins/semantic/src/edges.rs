//! Where the contours of the classes lie in the view and where they lie in the photo: residuals in pixels.
//!
//! Contours are followed as model-based trackers do (Harris & Stennett 1990; Drummond & Cipolla 2002): every sample of a
//! rendered contour looks for its counterpart in the photo along its normal.

use crate::likeness::Compared;
use nalgebra::Vector3;
use resurvey_plugin::schema::{ClassId, GridPoint};
use resurvey_plugin::{ImageRef, ViewImages};

/// Half-width of the window that gives a contour its direction, view pixels.
const WINDOW: i32 = 3;
/// Samples to each side of a step that must be of its classes, pixels.
const NEIGHBOURS: i32 = 6;
/// Least share of these samples that are.
const MIN_AGREEMENT: f64 = 0.75;
/// Contours further off than this many σ are other contours.
const REACH_SIGMAS: f64 = 2.5;

/// A sample of a contour between two classes in the view.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Edge {
    /// The nearer of the two surfaces there.
    pub point: GridPoint,
    /// Distance of that surface along the ray, metres.
    pub range_m: f64,
    /// Where it is in the photo's full-size pixels.
    pub pixel: [f64; 2],
    /// Unit normal in the image, from class `from` to class `to`.
    pub normal: [f64; 2],
    /// The class before the contour.
    pub from: u8,
    /// The class behind it.
    pub to: u8,
    /// Which way the surface faces.
    pub facing: Facing,
}

/// Which way a surface faces, roughly.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Up or down.
    Flat,
    /// Along one of four directions in plan, both ways.
    Upright(i32),
}

/// Every `step`-th contour sample of `view`, which shows every `stride`-th pixel of the photo.
pub fn contours(view: &ViewImages, stride: u32, step: usize, compared: &Compared) -> Vec<Edge> {
    let (width, height) = (view.width as usize, view.height as usize);
    let mut edges = Vec::new();
    let mut seen = 0;
    for v in WINDOW as usize..height.saturating_sub(WINDOW as usize + 1) {
        for u in WINDOW as usize..width.saturating_sub(WINDOW as usize + 1) {
            for (du, dv) in [(1, 0), (0, 1)] {
                let (here, there) = (v * width + u, (v + dv) * width + u + du);
                let (a, b) = (view.labels[here], view.labels[there]);
                if a == b || !compared.in_view(ClassId(a)) || !compared.in_view(ClassId(b)) {
                    continue;
                }
                seen += 1;
                if seen % step != 0 {
                    continue;
                }
                let Some((owner, facing)) = owner(view, [u, v], [du, dv]) else { continue };
                let Some(normal) = normal(view, [u as i32, v as i32], [du as i32, dv as i32], a, b) else { continue };
                let [east, north, up] = view.points[owner].map(f64::from);
                // The strided view takes the pixel in the middle of each stride.
                let full = |index: usize, across: usize| {
                    let centre = f64::from(index as u32 * stride + stride / 2) + 0.5;
                    centre + 0.5 * f64::from(across as u32 * stride)
                };
                let pixel = [full(u, du), full(v, dv)];
                edges.push(Edge {
                    point: GridPoint::new(
                        view.origin.easting_m + east,
                        view.origin.northing_m + north,
                        view.origin.height_m + up,
                    ),
                    range_m: f64::from(view.range_m[owner]),
                    pixel,
                    normal,
                    from: a,
                    to: b,
                    facing,
                });
            }
        }
    }
    edges
}

/// The pixel of the two whose surface makes the contour: of two at the same place the upright one (a wall meets the
/// ground), otherwise the nearer; `None` where both are sky.
fn owner(view: &ViewImages, [u, v]: [usize; 2], [du, dv]: [usize; 2]) -> Option<(usize, Facing)> {
    let width = view.width as usize;
    let (here, there) = (v * width + u, (v + dv) * width + u + du);
    let (to_here, to_there) = (view.range_m[here], view.range_m[there]);
    let (nearer, further) = if to_here <= to_there { (here, there) } else { (there, here) };
    if !view.range_m[nearer].is_finite() {
        return None;
    }
    let of = |pixel: usize| {
        let away = if pixel == here { -1 } else { 1 };
        facing(view, pixel, away * (dv * width + du) as isize, (du * width + dv) as isize)
    };
    let nearer_facing = of(nearer);
    let touching = view.range_m[further] - view.range_m[nearer] < 0.05 * view.range_m[nearer];
    if touching && nearer_facing == Facing::Flat {
        return Some((further, of(further)));
    }
    Some((nearer, nearer_facing))
}

/// How the surface at `pixel` faces, from its neighbours `inward` on its own side of the contour and `along` it.
fn facing(view: &ViewImages, pixel: usize, inward: isize, along: isize) -> Facing {
    let at = |offset: isize| {
        let index = pixel.checked_add_signed(offset)?;
        Some(Vector3::from(*view.points.get(index)?))
    };
    let normal = (|| Some((at(2 * inward)? - at(0)?).cross(&(at(along)? - at(-along)?))))();
    let Some(normal) = normal.and_then(|normal| normal.try_normalize(1e-9)) else { return Facing::Flat };
    if normal.z.abs() > 0.7 {
        return Facing::Flat;
    }
    let quarter = std::f32::consts::FRAC_PI_4;
    Facing::Upright((normal.x.atan2(normal.y) / quarter).round().rem_euclid(4.0) as i32)
}

/// Direction from class `a` to class `b` around the boundary between a pixel and its neighbour; `None` where they mix.
fn normal(view: &ViewImages, [u, v]: [i32; 2], [du, dv]: [i32; 2], a: u8, b: u8) -> Option<[f64; 2]> {
    let width = view.width as i32;
    let middle = [f64::from(u) + 0.5 * f64::from(du), f64::from(v) + 0.5 * f64::from(dv)];
    let mut sum = [0.0; 2];
    for y in v - WINDOW..=v + WINDOW {
        for x in u - WINDOW..=u + WINDOW {
            let class = view.labels[(y * width + x) as usize];
            let sign = if class == a { -1.0 } else { f64::from(u8::from(class == b)) };
            sum[0] += sign * (f64::from(x) - middle[0]);
            sum[1] += sign * (f64::from(y) - middle[1]);
        }
    }
    let length = sum[0].hypot(sum[1]);
    // Across: the neighbour must really lie on the far side.
    (length > f64::from(WINDOW * WINDOW) && sum[0] * f64::from(du) + sum[1] * f64::from(dv) > 0.0)
        .then(|| sum.map(|value| value / length))
}

/// How far along its normal `edge` lies in the photo, pixels: the step between its classes that agrees best with the
/// samples around it, where one `sigma_px` off counts as much as a tenth of the samples.
pub fn displacement(photo: &ImageRef<'_, u8>, edge: &Edge, sigma_px: f64, compared: &Compared) -> Option<f64> {
    let reach = (REACH_SIGMAS * sigma_px).ceil() as i32;
    let (width, height) = (f64::from(photo.width()), f64::from(photo.height()));
    // For a sample half a pixel from the possible steps: +1 the near class, −1 the far one, 0 another, `None` unknown.
    let side_at = |along: i32| {
        let along = f64::from(along) + 0.5;
        let (u, v) = (edge.pixel[0] + along * edge.normal[0], edge.pixel[1] + along * edge.normal[1]);
        if u < 0.0 || v < 0.0 || u >= width || v >= height {
            return None;
        }
        let class = photo.at(u as u32, v as u32);
        let side = if class == edge.from { 1 } else { -i32::from(class == edge.to) };
        compared.in_photo(ClassId(class)).then_some(side)
    };
    let sides: Vec<Option<i32>> = (-reach - NEIGHBOURS..reach + NEIGHBOURS).map(side_at).collect();
    let (before, after) = (NEIGHBOURS as usize, NEIGHBOURS as usize);
    let mut best: Option<(f64, i32)> = None;
    for (index, step) in (-reach..=reach).enumerate() {
        let window = &sides[index..index + before + after];
        if window.iter().any(Option::is_none) {
            continue;
        }
        let agree = |part: &[Option<i32>], side: i32| part.iter().filter(|found| **found == Some(side)).count();
        let agreed = agree(&window[..before], 1) + agree(&window[before..], -1);
        let share = agreed as f64 / window.len() as f64;
        let value = share - 0.1 * (f64::from(step) / sigma_px).powi(2);
        if share >= MIN_AGREEMENT && best.is_none_or(|(known, _)| value > known) {
            best = Some((value, step));
        }
    }
    best.map(|(_, step)| f64::from(step))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::likeness::tests::nothing_ignored;

    /// Class 0 left of column `step`, class 1 from it on.
    fn photo(step: usize) -> Vec<u8> {
        (0..40 * 10).map(|index| u8::from(index % 40 >= step)).collect()
    }

    fn edge(u: f64, from: u8, to: u8) -> Edge {
        let point = GridPoint::new(0.0, 0.0, 0.0);
        Edge { point, range_m: 10.0, pixel: [u, 5.0], normal: [1.0, 0.0], from, to, facing: Facing::Flat }
    }

    #[test]
    fn a_step_is_found_where_it_is() {
        let labels = photo(23);
        let image = ImageRef::new(&labels, 40, 10, 40).unwrap();
        let found = displacement(&image, &edge(20.0, 0, 1), 3.0, &nothing_ignored());
        assert_eq!(found, Some(3.0));
    }

    #[test]
    fn a_step_out_of_reach_or_of_other_classes_is_not_found() {
        let labels = photo(23);
        let image = ImageRef::new(&labels, 40, 10, 40).unwrap();
        assert_eq!(displacement(&image, &edge(12.0, 0, 1), 3.0, &nothing_ignored()), None);
        assert_eq!(displacement(&image, &edge(20.0, 1, 0), 3.0, &nothing_ignored()), None);
        assert_eq!(displacement(&image, &edge(20.0, 0, 2), 3.0, &nothing_ignored()), None);
    }
}
