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
/// What a step 1σ off loses against a nearer one, as a share of the samples.
const PER_SIGMA: f64 = 0.1;
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

/// Which way a surface faces, and which of the surfaces that face that way it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Facing {
    /// Up or down.
    Level,
    /// Sideways.
    Upright {
        /// Azimuth of the normal towards the camera, in steps of [`Facing::STEP_DEG`].
        angle: i32,
        /// Distance along that normal from the origin of the view, metres.
        offset: i32,
    },
}

impl Facing {
    const STEP_DEG: f32 = 5.0;
    /// Of a full step: walls along the axes and on whole metres do not lie on the border of two steps.
    const PHASE: f32 = 0.37;

    /// Azimuth in the middle of the steps that are called `angle`.
    pub fn radians(angle: i32) -> f64 {
        (f64::from(angle) + 0.5 - f64::from(Self::PHASE)) * f64::from(Self::STEP_DEG).to_radians()
    }

    /// A surface with `normal` (any sign) at `point`, seen from `eye`.
    fn new(normal: Vector3<f32>, point: Vector3<f32>, eye: Vector3<f32>) -> Self {
        let plan = normal.xy();
        let Some(plan) = plan.try_normalize(1e-6).filter(|_| normal.z.abs() <= 0.7 * normal.norm()) else {
            return Self::Level;
        };
        let towards = if plan.dot(&(point - eye).xy()) > 0.0 { -plan } else { plan };
        let angle = towards.x.atan2(towards.y).to_degrees() / Self::STEP_DEG;
        let offset = towards.dot(&point.xy());
        Self::Upright { angle: (angle + Self::PHASE).floor() as i32, offset: (offset + Self::PHASE).floor() as i32 }
    }
}

/// Every contour sample of `view`, which shows every `stride`-th pixel of the photo from `eye`.
pub fn contours(view: &ViewImages, eye: GridPoint, stride: u32, compared: &Compared) -> Vec<Edge> {
    let (width, height) = (view.width as usize, view.height as usize);
    let origin = view.origin;
    let eye = [eye.easting_m - origin.easting_m, eye.northing_m - origin.northing_m, eye.height_m - origin.height_m];
    let eye = Vector3::from(eye.map(|value| value as f32));
    let rim = WINDOW as usize;
    let pixels =
        (rim..height.saturating_sub(rim + 1)).flat_map(|v| (rim..width.saturating_sub(rim + 1)).map(move |u| [u, v]));
    let pairs = pixels.flat_map(|pixel| [[1, 0], [0, 1]].map(|across| (pixel, across)));
    pairs.filter_map(|(pixel, across)| edge(view, eye, (pixel, across), stride, compared)).collect()
}

/// The contour between a pixel and its neighbour `across`; `None` where there is none.
fn edge(
    view: &ViewImages,
    eye: Vector3<f32>,
    ([u, v], [du, dv]): ([usize; 2], [usize; 2]),
    stride: u32,
    compared: &Compared,
) -> Option<Edge> {
    let width = view.width as usize;
    let (from, to) = (view.labels[v * width + u], view.labels[(v + dv) * width + u + du]);
    if from == to || !compared.in_view(ClassId(from)) || !compared.in_view(ClassId(to)) {
        return None;
    }
    let (owner, facing) = owner(view, eye, [u, v], [du, dv])?;
    let normal = normal(view, [u as i32, v as i32], [du as i32, dv as i32], [from, to])?;
    let [east, north, up] = view.points[owner].map(f64::from);
    let origin = view.origin;
    let point = GridPoint::new(origin.easting_m + east, origin.northing_m + north, origin.height_m + up);
    // The strided view takes the pixel in the middle of each stride.
    let full = |index: usize, across: usize| {
        f64::from(index as u32 * stride + stride / 2) + 0.5 + 0.5 * f64::from(across as u32 * stride)
    };
    let pixel = [full(u, du), full(v, dv)];
    Some(Edge { point, range_m: f64::from(view.range_m[owner]), pixel, normal, from, to, facing })
}

/// The pixel of the two whose surface makes the contour: of two at the same place the upright one (a wall meets the
/// ground), otherwise the nearer; `None` where both are sky.
fn owner(view: &ViewImages, eye: Vector3<f32>, [u, v]: [usize; 2], [du, dv]: [usize; 2]) -> Option<(usize, Facing)> {
    let width = view.width as usize;
    let (here, there) = (v * width + u, (v + dv) * width + u + du);
    let (to_here, to_there) = (view.range_m[here], view.range_m[there]);
    let (nearer, further) = if to_here <= to_there { (here, there) } else { (there, here) };
    if !view.range_m[nearer].is_finite() {
        return None;
    }
    let of = |pixel: usize| {
        let away = if pixel == here { -1 } else { 1 };
        facing(view, eye, pixel, away * (dv * width + du) as isize, (du * width + dv) as isize)
    };
    let nearer_facing = of(nearer);
    let touching = view.range_m[further] - view.range_m[nearer] < 0.05 * view.range_m[nearer];
    if touching && nearer_facing == Facing::Level {
        return Some((further, of(further)));
    }
    Some((nearer, nearer_facing))
}

/// How the surface at `pixel` faces, from its neighbours `inward` on its own side of the contour and `along` it.
fn facing(view: &ViewImages, eye: Vector3<f32>, pixel: usize, inward: isize, along: isize) -> Facing {
    let at = |offset: isize| {
        let index = pixel.checked_add_signed(offset)?;
        Some(Vector3::from(*view.points.get(index)?))
    };
    let normal = (|| Some((at(2 * inward)? - at(0)?).cross(&(at(along)? - at(-along)?))))();
    let normal = normal.filter(|normal| normal.iter().all(|value| value.is_finite()));
    normal.map_or(Facing::Level, |normal| Facing::new(normal, Vector3::from(view.points[pixel]), eye))
}

/// Direction from class `from` to class `to` around the boundary between a pixel and its neighbour; `None` where they mix.
fn normal(view: &ViewImages, [u, v]: [i32; 2], [du, dv]: [i32; 2], [from, to]: [u8; 2]) -> Option<[f64; 2]> {
    let width = view.width as i32;
    let middle = [f64::from(u) + 0.5 * f64::from(du), f64::from(v) + 0.5 * f64::from(dv)];
    let mut sum = [0.0; 2];
    for y in v - WINDOW..=v + WINDOW {
        for x in u - WINDOW..=u + WINDOW {
            let class = view.labels[(y * width + x) as usize];
            let sign = if class == from { -1.0 } else { f64::from(u8::from(class == to)) };
            sum[0] += sign * (f64::from(x) - middle[0]);
            sum[1] += sign * (f64::from(y) - middle[1]);
        }
    }
    let length = sum[0].hypot(sum[1]);
    let is_clear = length > f64::from(WINDOW * WINDOW) && sum[0] * f64::from(du) + sum[1] * f64::from(dv) > 0.0;
    is_clear.then(|| sum.map(|value| value / length))
}

/// How far along its normal `edge` lies in the photo, pixels: the step between its classes that agrees best with the
/// samples around it, the nearer the better.
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
    let mut best: Option<(f64, i32)> = None;
    for (step, window) in (-reach..=reach).zip(sides.windows(2 * NEIGHBOURS as usize)) {
        if window.iter().any(Option::is_none) {
            continue;
        }
        let (near, far) = window.split_at(window.len() / 2);
        let of_side = |part: &[Option<i32>], side: i32| part.iter().filter(|found| **found == Some(side)).count();
        let share = (of_side(near, 1) + of_side(far, -1)) as f64 / window.len() as f64;
        let value = share - PER_SIGMA * (f64::from(step) / sigma_px).powi(2);
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
        Edge { point, range_m: 10.0, pixel: [u, 5.0], normal: [1.0, 0.0], from, to, facing: Facing::Level }
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
        assert_eq!(displacement(&image, &edge(8.0, 0, 1), 3.0, &nothing_ignored()), None);
        assert_eq!(displacement(&image, &edge(20.0, 1, 0), 3.0, &nothing_ignored()), None);
        assert_eq!(displacement(&image, &edge(20.0, 0, 2), 3.0, &nothing_ignored()), None);
    }
}
