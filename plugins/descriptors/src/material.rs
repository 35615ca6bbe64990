//! Material descriptors: the corners of a rectangle on a wall (Lee & Hsu, Eq. 15, Alg. 1), with every requirement of
//! Alg. 1 as a measured value beside its limit.

use crate::edges::is_true_edge;
use crate::fit::{self, EdgePoint, Fit, Sides};
use crate::outline::{ContourPoint, Outline};
use crate::plane::Plane;
use crate::quad::{self, Quad};
use crate::rectangle::{self, Corners};
use crate::requirement::{Stop, Unmet, at_least, at_most};
use crate::settings::Settings;
use crate::shape::{self, NOISE_SIGMAS};
use crate::sight::Sight;
use crate::spread::{Nudge, nudges, pose_sigmas};
use crate::window::{Window, rays};
use nalgebra::{Matrix2, Vector2, Vector3, Vector5};
use resurvey_plugin::schema::{ChangeRegion, ClassKind, MaterialDescriptor, Uncertainty};

/// Points to which a plane is fitted, at most.
const PLANE_POINTS: usize = 1500;
/// Standard deviations of the pose by which the plane's points keep away from the contour.
const POSE_SIGMAS: f64 = 2.0;
/// Smallest share of a region's size to which they keep.
const MIN_INNER: f64 = 0.5;
/// Pixels at which the fill is sampled, about.
const FILL_SAMPLES: f64 = 5000.0;
/// Share of the contour that may be hidden and still count as seen whole: label noise does that much.
const HIDDEN_NOISE: f64 = 0.1;
/// Smallest 1σ of labels' contours, pixels: labels have whole pixels.
const MIN_JITTER_PX: f64 = 0.3;
/// Share of the contour beyond each side of the box from which the fit starts.
const AROUND: f64 = 0.1;

/// What one region is measured with.
struct Measurement<'a> {
    sight: &'a Sight<'a>,
    region: &'a ChangeRegion,
    outline: &'a Outline,
    window: Window,
    /// True edges and the rest of the contour, in the window.
    contour: [Vec<Vector2<f64>>; 2],
    /// Four free sides, where they can be told.
    quad: Option<Quad>,
    plane: Plane,
    fit: Fit,
    corners: Corners,
}

/// Variance of what is measured.
#[derive(Default)]
struct Variance {
    centre_m2: f64,
    size_m2: f64,
    area_m4: f64,
}

/// The material descriptor of `region`.
pub fn measure(sight: &Sight<'_>, region: &ChangeRegion, outline: &Outline) -> Result<MaterialDescriptor, Stop> {
    let [width, height] = sight.size();
    at_most("captured-entirely", outline.border_pixels(width, height) as f64, 0.0, "px")?;
    let bounds = outline.bounds;
    let middle = |start: u32, end: u32| (f64::from(start) + f64::from(end)) / 2.0;
    let centre = Vector2::new(middle(bounds.left, bounds.right), middle(bounds.top, bounds.bottom));
    let shapeless = Unmet { requirement: "rectangle", measured: 0.0, limit: 4.0, unit: "sides" };
    let window = Window::new(sight.host, sight.pose(), centre)?.ok_or(shapeless)?;
    let [edge, hidden] = contour(sight, region, outline, &window)?;
    let hidden_share = hidden.len() as f64 / (edge.len() + hidden.len()).max(1) as f64;
    if !sight.settings.allow_partly_hidden {
        at_most("captured-entirely", hidden_share, HIDDEN_NOISE, "ratio")?;
    }
    let quad = quad::fit(&edge);
    if quad.is_none() {
        at_most("captured-entirely", hidden_share, HIDDEN_NOISE, "ratio")?;
    }
    let plane = wall(sight, outline)?;
    let free = quad.as_ref().and_then(|quad| corners(&window, &plane, &quad.corners, &Nudge::none()));
    let fit = fitted(sight.settings, &plane, &on_plane(&window, &plane, &edge), free.as_ref()).ok_or(shapeless)?;
    let seen = fit.visible.iter().copied().fold(1.0, f64::min);
    let min_seen = sight.settings.min_side_visible;
    if hidden_share > HIDDEN_NOISE {
        at_most("captured-entirely", 1.0 - seen, 1.0 - min_seen, "ratio")?;
    }
    at_least("rectangle", seen, min_seen, "ratio")?;
    // Where much is hidden, four free sides tell little.
    let quad = quad.filter(|_| hidden_share <= HIDDEN_NOISE);
    let corners = free.filter(|_| !sight.settings.regularise).unwrap_or_else(|| fit.sides.corners());
    Measurement { sight, region, outline, window, contour: [edge, hidden], quad, plane, fit, corners }.descriptor()
}

/// Contour points in the window as points on the plane; those that miss it are left out.
fn on_plane(window: &Window, plane: &Plane, edge: &[Vector2<f64>]) -> Vec<EdgePoint> {
    let at =
        |pixel: Vector2<f64>| plane.meet(&Vector3::zeros(), &window.ray(&pixel)).map(|point| plane.coordinates(&point));
    let point = |pixel: &Vector2<f64>| {
        let step = |by: Vector2<f64>| Some(at(pixel + by / 2.0)? - at(pixel - by / 2.0)?);
        let metres_per_px = Matrix2::from_columns(&[step(Vector2::x())?, step(Vector2::y())?]);
        Some(EdgePoint { at: at(*pixel)?, metres_per_px })
    };
    edge.iter().filter_map(point).collect()
}

/// The rectangle that `points` show. Banners hang level: what is within the tolerance of level, and of what label noise
/// does, is.
fn fitted(settings: &Settings, plane: &Plane, points: &[EdgePoint], free: Option<&Corners>) -> Option<Fit> {
    let jitter_px = settings.label_jitter_px.max(MIN_JITTER_PX);
    let mut starts: Vec<Sides> = Sides::around(points, AROUND).into_iter().collect();
    starts.extend(free.map(|corners| Sides::through(corners, 0.0)));
    let turned = free.map(|corners| Sides::through(corners, rectangle::tilt_rad(corners)));
    let any: Vec<Sides> = starts.iter().copied().chain(turned).collect();
    let fit = fit::best(points, &any, jitter_px, false)?;
    let tolerance_rad = settings.max_level_angle_deg.to_radians();
    let noise_rad = NOISE_SIGMAS * fit.covariance[(4, 4)].sqrt();
    let is_level = fit.sides.tilt_rad.abs() <= (tolerance_rad + noise_rad).min(2.0 * tolerance_rad);
    if !(plane.is_upright() && is_level) {
        return Some(fit);
    }
    starts.push(Sides::through(&fit.sides.corners(), 0.0));
    fit::best(points, &starts, jitter_px, true)
}

/// The contour in the window: true edges, and where something else ends the region.
fn contour(
    sight: &Sight<'_>,
    region: &ChangeRegion,
    outline: &Outline,
    window: &Window,
) -> Result<[Vec<Vector2<f64>>; 2], Stop> {
    let (edge, hidden): (Vec<_>, Vec<_>) =
        outline.contour().into_iter().partition(|point| is_true_edge(sight, outline, point, region.class_after));
    let seen = |points: Vec<ContourPoint>| {
        let pixels: Vec<[f64; 2]> = points.iter().map(|point| point.at.into()).collect();
        let rays = rays(sight.host, sight.pose(), &pixels)?;
        Ok::<_, Stop>(rays.iter().filter_map(|ray| window.pixel(ray)).collect())
    };
    Ok([seen(edge)?, seen(hidden)?])
}

/// The plane of the surface behind the region, from points far enough inside that a pose error leaves them on it.
fn wall(sight: &Sight<'_>, outline: &Outline) -> Result<Plane, Stop> {
    let pixels: Vec<[u32; 2]> = outline.pixels().collect();
    let sampled = pixels.iter().step_by(pixels.len().div_ceil(PLANE_POINTS).max(1));
    let count = sampled.clone().count().max(1) as f64;
    let centre = sampled.clone().map(|[u, v]| Vector2::new(f64::from(*u), f64::from(*v))).sum::<Vector2<f64>>() / count;
    let inner = inner_share(sight, outline, &centre);
    let point = |[u, v]: &[u32; 2]| {
        let pixel = centre + (Vector2::new(f64::from(*u), f64::from(*v)) - centre) * inner;
        sight.point(pixel.x.round() as i64, pixel.y.round() as i64)
    };
    let points: Vec<Vector3<f64>> = sampled.clone().filter_map(point).collect();
    let share = points.len() as f64 / count;
    let settings = sight.settings;
    at_least("on-a-surface", share, settings.plane_point_share, "ratio")?;
    let reach = |axis: usize| {
        let along = |pick: fn(f64, f64) -> f64, start| points.iter().map(|p| p[axis]).fold(start, pick);
        along(f64::max, f64::NEG_INFINITY) - along(f64::min, f64::INFINITY)
    };
    let diagonal_m = Vector3::new(reach(0), reach(1), reach(2)).norm();
    let limit_m = settings.max_plane_distance_m.max(settings.max_plane_distance_share * diagonal_m);
    let no_plane = Unmet { requirement: "coplanar", measured: 0.0, limit: 3.0, unit: "points" };
    let plane = Plane::through(&points, limit_m / 2.0).ok_or(no_plane)?;
    let mut distances_m: Vec<f64> = points.iter().map(|point| plane.distance_m(point).abs()).collect();
    distances_m.sort_by(f64::total_cmp);
    let last = distances_m.len() - 1;
    let measured_m = distances_m[((last as f64 * settings.plane_point_share).ceil() as usize).min(last)];
    at_most("coplanar", measured_m, limit_m, "m")?;
    Ok(plane)
}

/// Share of the region's size that is left when the pose error is taken off all around.
fn inner_share(sight: &Sight<'_>, outline: &Outline, centre: &Vector2<f64>) -> f64 {
    let range_m = sight.point(centre.x as i64, centre.y as i64).map_or(f64::INFINITY, |point| point.norm());
    let (position_m, angle_rad) = pose_sigmas(&sight.comparison.estimate);
    let focal_px = sight.comparison.camera.fx.max(sight.comparison.camera.fy);
    let shift_px = focal_px * (position_m / range_m.max(0.1)).hypot(angle_rad);
    let shorter_px = f64::from(outline.bounds.width().min(outline.bounds.height()));
    let share = 1.0 - 2.0 * POSE_SIGMAS * shift_px / shorter_px;
    if share.is_finite() { share.clamp(MIN_INNER, 1.0) } else { MIN_INNER }
}

impl Measurement<'_> {
    fn descriptor(&self) -> Result<MaterialDescriptor, Stop> {
        let settings = self.sight.settings;
        let at_infinity =
            Unmet { requirement: "within-range", measured: f64::MAX, limit: settings.max_range_m, unit: "m" };
        let range_m = self.corners.iter().map(|corner| self.plane.at(corner).norm()).fold(0.0, f64::max);
        at_most("within-range", range_m, settings.max_range_m, "m")?;
        let pixels = self.pixels().ok_or(at_infinity)?;
        at_most("rectangle", self.fit.misfit, settings.max_misfit, "ratio")?;
        self.fills(&pixels)?;
        let [edge, hidden] = &self.contour;
        shape::has_corners(&pixels, edge, hidden, settings)?;
        if let Some(quad) = &self.quad {
            shape::is_rectangle(quad, settings, |pixels| corners(&self.window, &self.plane, pixels, &Nudge::none()))?;
        }
        let sigma = self.sigma(&pixels)?;
        let points = self.corners.map(|corner| self.plane.at(&corner));
        at_most("uncertain", sigma.position_m, settings.max_position_sigma_m, "m")?;
        let area_share = sigma.area_m2.unwrap_or(f64::INFINITY) / rectangle::quad_area_m2(points);
        at_most("uncertain", area_share, settings.max_area_sigma_share, "ratio")?;
        Ok(MaterialDescriptor {
            class: self.region.class_after,
            corners: points.map(|point| self.sight.to_grid(&point)),
            normal: self.plane.normal.into(),
            sigma: Some(sigma),
        })
    }

    /// The corners in the window.
    fn pixels(&self) -> Option<Corners> {
        let pixel = |corner: &Vector2<f64>| self.window.pixel(&self.plane.at(corner));
        let [a, b, c, d] = &self.corners;
        Some([pixel(a)?, pixel(b)?, pixel(c)?, pixel(d)?])
    }

    /// 1σ by the labels' jitter and the pose together.
    fn sigma(&self, pixels: &Corners) -> Result<Uncertainty, Unmet> {
        let mut variance = Variance::of_fit(&self.fit);
        let no_pose = uncertain(f64::MAX, self.sight.settings.max_position_sigma_m);
        for nudge in nudges(&self.sight.comparison.estimate).ok_or(no_pose)? {
            variance.add(&self.corners, corners(&self.window, &self.plane, pixels, &nudge).as_ref());
        }
        // The wall may stand elsewhere along its normal, and the rays then meet it elsewhere.
        let wall_m = self.sight.comparison.estimate.alignment.map_or(0.0, |alignment| alignment.map_sigma_m);
        let nudge = Nudge { offset: -self.plane.normal * wall_m, ..Nudge::none() };
        variance.add(&self.corners, corners(&self.window, &self.plane, pixels, &nudge).as_ref());
        variance.centre_m2 += wall_m.powi(2);
        Ok(Uncertainty {
            position_m: variance.centre_m2.sqrt(),
            size_m: Some(variance.size_m2.sqrt()),
            area_m2: Some(variance.area_m4.sqrt()),
        })
    }

    /// Requires that the region fills the rectangle, what something nearer hides aside, and has little beyond it.
    fn fills(&self, corners: &Corners) -> Result<(), Stop> {
        let bounds = self.outline.bounds;
        let margin = |size: u32| i64::from(size / 4 + 4);
        let across = i64::from(bounds.left) - margin(bounds.width())..i64::from(bounds.right) + margin(bounds.width());
        let down = i64::from(bounds.top) - margin(bounds.height())..i64::from(bounds.bottom) + margin(bounds.height());
        let area = (across.end - across.start) as f64 * (down.end - down.start) as f64;
        let step = (area / FILL_SAMPLES).sqrt().ceil().max(1.0) as usize;
        let pixels: Vec<[i64; 2]> = down
            .step_by(step)
            .flat_map(|v| across.clone().step_by(step).map(move |u| [u, v]))
            .filter(|[u, v]| self.sight.photo(*u, *v).is_some())
            .collect();
        let centres: Vec<[f64; 2]> = pixels.iter().map(|pixel| pixel.map(|x| x as f64 + 0.5)).collect();
        let [mut filled, mut empty, mut hidden, mut beyond] = [0.0; 4];
        for ([u, v], ray) in pixels.iter().zip(rays(self.sight.host, self.sight.pose(), &centres)?) {
            let in_quad = self.window.pixel(&ray).is_some_and(|pixel| rectangle::contains(corners, &pixel));
            let photo = self.sight.photo(*u, *v);
            match (in_quad, self.outline.contains(*u, *v)) {
                (true, true) => filled += 1.0,
                (false, true) => beyond += 1.0,
                (true, false) if photo == Some(self.region.class_after) => filled += 1.0,
                (true, false) if self.may_hide(*u, *v) => hidden += 1.0,
                (true, false) => empty += 1.0,
                (false, false) => {}
            }
        }
        let settings = self.sight.settings;
        let share = |part: f64, rest: f64| part / f64::max(part + rest, 1.0);
        at_most("captured-entirely", share(hidden, filled + empty), 1.0 - settings.min_side_visible, "ratio")?;
        at_least("rectangle", share(filled, empty), settings.min_fill, "ratio")?;
        at_least("rectangle", share(filled, beyond), settings.min_fill, "ratio")?;
        Ok(())
    }

    fn may_hide(&self, u: i64, v: i64) -> bool {
        let (photo, view) = (self.sight.photo(u, v), self.sight.view(u, v));
        let in_front = photo.is_some_and(|class| self.sight.host.classes().kind(class) != ClassKind::Material);
        self.sight.settings.allow_partly_hidden && in_front && photo != view && photo != self.sight.sky
    }
}

/// Corners on the wall of `pixels` in the window, seen from a moved pose.
fn corners(window: &Window, plane: &Plane, pixels: &Corners, nudge: &Nudge) -> Option<Corners> {
    let corner = |pixel: &Vector2<f64>| {
        let point = plane.meet(&nudge.offset, &(nudge.turn * window.ray(pixel)))?;
        Some(plane.coordinates(&point))
    };
    let [a, b, c, d] = pixels;
    Some(rectangle::in_order([corner(a)?, corner(b)?, corner(c)?, corner(d)?]))
}

fn uncertain(measured: f64, limit: f64) -> Unmet {
    Unmet { requirement: "uncertain", measured, limit, unit: "m" }
}

impl Variance {
    fn of_fit(fit: &Fit) -> Self {
        let [width_m, height_m] = fit.sides.size_m();
        let of = |weights: [f64; 4]| {
            let [a, b, c, d] = weights;
            let weights = Vector5::new(a, b, c, d, 0.0);
            weights.dot(&(fit.covariance * weights))
        };
        let (width_m2, height_m2) = (of([-1.0, 1.0, 0.0, 0.0]), of([0.0, 0.0, -1.0, 1.0]));
        Self {
            centre_m2: of([0.5, 0.5, 0.0, 0.0]) + of([0.0, 0.0, 0.5, 0.5]),
            size_m2: width_m2.max(height_m2),
            area_m4: of([-height_m, height_m, -width_m, width_m]),
        }
    }

    /// Adds the squares of what moving a corner changes; nothing left to measure is an infinite change.
    fn add(&mut self, corners: &Corners, moved: Option<&Corners>) {
        let Some(moved) = moved else {
            self.centre_m2 = f64::INFINITY;
            self.area_m4 = f64::INFINITY;
            return;
        };
        let area = |corners: &Corners| (corners[2] - corners[0]).perp(&(corners[3] - corners[1])) / 2.0;
        let centre = |corners: &Corners| corners.iter().sum::<Vector2<f64>>() / 4.0;
        self.centre_m2 += (centre(moved) - centre(corners)).norm_squared();
        let ([w, h], [moved_w, moved_h]) = (rectangle::size_m(corners), rectangle::size_m(moved));
        self.size_m2 += ((moved_w - w).powi(2)).max((moved_h - h).powi(2));
        self.area_m4 += (area(moved) - area(corners)).powi(2);
    }
}
