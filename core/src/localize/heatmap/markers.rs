//! The poses on the plan: each has its own shape beside its colour, and a ray along its heading.

use super::HeatMap;
use super::canvas::{Area, Canvas, Colour, Point, joined, outline};
use super::colours::{ESTIMATE, INK, PAPER, PRIOR, TRUTH};
use super::key::distance_text;
use super::plan::Plan;
use super::text;
use resurvey_schema::Pose;

/// How far a marker stays inside the edge of the plan when its pose is beyond it, pixels.
const INSET_PX: f64 = 34.0;

/// Corners of an ellipse or circle as drawn.
const CORNERS: u32 = 96;

/// Rim of a line, pixels on each side.
const RIM_PX: f64 = 1.6;

/// What a marker stands for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Marker {
    /// A hollow circle.
    Prior,
    /// A cross.
    Estimate,
    /// A hollow diamond.
    Truth,
}

impl Marker {
    fn colour(self) -> Colour {
        match self {
            Self::Prior => PRIOR,
            Self::Estimate => ESTIMATE,
            Self::Truth => TRUTH,
        }
    }

    fn rim(self) -> Colour {
        match self {
            Self::Prior | Self::Estimate => PAPER,
            Self::Truth => INK,
        }
    }

    fn name(self) -> &'static str {
        match self {
            Self::Prior => "prior",
            Self::Estimate => "estimate",
            Self::Truth => "truth",
        }
    }

    /// Where the heading ray begins and ends, pixels from the centre: different lengths tell close poses apart.
    fn ray_px(self) -> [f64; 2] {
        match self {
            Self::Prior => [8.0, 44.0],
            Self::Estimate => [0.0, 56.0],
            Self::Truth => [14.0, 70.0],
        }
    }

    fn shape(self, [x, y]: Point) -> Vec<[Point; 2]> {
        match self {
            Self::Prior => outline(&ellipse([x, y], [[8.0, 0.0], [0.0, 8.0]])),
            Self::Estimate => vec![[[x - 11.0, y], [x + 11.0, y]], [[x, y - 11.0], [x, y + 11.0]]],
            Self::Truth => outline(&[[x, y - 14.0], [x + 14.0, y], [x, y + 14.0], [x - 14.0, y]]),
        }
    }
}

/// Draws the poses of `input` and the ellipses of its covariance.
pub(super) fn draw_all(canvas: &mut Canvas, plan: &Plan, input: &HeatMap<'_>) {
    let at = |pose: &Pose| plan.at(pose.position.easting_m, pose.position.northing_m);
    let estimate = at(&input.estimate);
    for sigmas in [3.0, 1.0] {
        if let Some(axes) = axes_px(&input.covariance, sigmas * plan.px_per_m) {
            let line = outline(&ellipse(estimate, axes));
            draw_line(canvas, &line, if sigmas > 2.0 { 1.4 } else { 2.0 }, Marker::Estimate);
        }
    }
    let poses = [
        (Marker::Truth, input.truth.as_ref()),
        (Marker::Prior, Some(&input.prior)),
        (Marker::Estimate, Some(&input.estimate)),
    ];
    let mut lines_taken = 0.0;
    for (marker, pose) in poses {
        let Some(pose) = pose else { continue };
        let other = if marker == Marker::Estimate { &input.prior } else { &input.estimate };
        let away_m = pose.position.plan_distance_m(&other.position);
        match edge(&plan.area, at(pose)) {
            None => draw(canvas, marker, at(pose), pose.yaw_rad),
            Some(edge) => {
                draw_at_edge(canvas, marker, edge);
                let label = format!("{}, {}", marker.name(), distance_text(away_m));
                let start = label_start(&plan.area, edge, text::width_px(&label, &text::LABEL), lines_taken);
                text::write_on_plan(canvas, start, &text::LABEL, &label);
                lines_taken += 1.0;
            }
        }
    }
}

/// Draws `marker` at `at` with a ray towards `yaw_rad`, clockwise from up.
pub(super) fn draw(canvas: &mut Canvas, marker: Marker, at: Point, yaw_rad: f64) {
    let mut lines = marker.shape(at);
    let (ahead, right) = ([yaw_rad.sin(), -yaw_rad.cos()], [yaw_rad.cos(), yaw_rad.sin()]);
    let place = |along: f64, aside: f64| {
        [at[0] + along * ahead[0] + aside * right[0], at[1] + along * ahead[1] + aside * right[1]]
    };
    let [start, end] = marker.ray_px();
    lines.extend(joined(&[place(start, 0.0), place(end, 0.0)]));
    lines.extend(joined(&[place(end - 7.0, -4.5), place(end, 0.0), place(end - 7.0, 4.5)]));
    draw_line(canvas, &lines, 2.2, marker);
}

/// Draws the shape of `marker` alone.
pub(super) fn draw_shape(canvas: &mut Canvas, marker: Marker, at: Point) {
    draw_line(canvas, &marker.shape(at), 2.2, marker);
}

/// Draws the two ellipses as the key shows them.
pub(super) fn draw_ellipse_sample(canvas: &mut Canvas, at: Point) {
    for (scale, width_px) in [(1.0, 1.4), (1.0 / 3.0, 2.0)] {
        let line = outline(&ellipse(at, [[13.0 * scale, 0.0], [0.0, 8.0 * scale]]));
        draw_line(canvas, &line, width_px, Marker::Estimate);
    }
}

/// A place at the edge, and the unit vector that points beyond it.
#[derive(Clone, Copy)]
struct Edge {
    at: Point,
    outward: Point,
}

/// Where to show what is at `at` when that is outside `area`.
fn edge(area: &Area, at: Point) -> Option<Edge> {
    let centre = area.centre();
    let (half, offset) = (area.width_px() / 2.0, [at[0] - centre[0], at[1] - centre[1]]);
    let farthest = offset[0].abs().max(offset[1].abs());
    if farthest <= half {
        return None;
    }
    let length = offset[0].hypot(offset[1]);
    let share = (half - INSET_PX) / farthest;
    Some(Edge {
        at: [centre[0] + offset[0] * share, centre[1] + offset[1] * share],
        outward: [offset[0] / length, offset[1] / length],
    })
}

fn draw_at_edge(canvas: &mut Canvas, marker: Marker, Edge { at, outward }: Edge) {
    draw_shape(canvas, marker, at);
    let place = |along: f64, aside: f64| {
        [at[0] + along * outward[0] - aside * outward[1], at[1] + along * outward[1] + aside * outward[0]]
    };
    let head = [place(32.0, 0.0), place(20.0, 8.0), place(20.0, -8.0)];
    canvas.stroke(&outline(&head), 2.0 * RIM_PX, marker.rim());
    canvas.fill(&head, marker.colour());
}

/// Where a label begins: inward of its marker, beside it at the left and right edges, below or above it at the others;
/// further in where `lines_taken` labels were put before.
fn label_start(area: &Area, Edge { at, outward }: Edge, width_px: f64, lines_taken: f64) -> Point {
    let inward_px = 22.0 + lines_taken * 24.0;
    let [x, y] = if outward[0].abs() > outward[1].abs() {
        [if outward[0] > 0.0 { at[0] - 22.0 - width_px } else { at[0] + 22.0 }, at[1] + 6.0 + lines_taken * 24.0]
    } else {
        [at[0] - width_px / 2.0, if outward[1] > 0.0 { at[1] - inward_px } else { at[1] + inward_px + 12.0 }]
    };
    let (least, most) = (f64::from(area.left) + 12.0, f64::from(area.right) - 12.0 - width_px);
    [x.min(most).max(least), y]
}

fn draw_line(canvas: &mut Canvas, lines: &[[Point; 2]], width_px: f64, marker: Marker) {
    canvas.stroke(lines, width_px + 2.0 * RIM_PX, marker.rim());
    canvas.stroke(lines, width_px, marker.colour());
}

/// Corners of the ellipse with half axes `axes` around `centre`.
fn ellipse(centre: Point, axes: [Point; 2]) -> Vec<Point> {
    let corner = |index: u32| {
        let (sin, cos) = (f64::from(index) / f64::from(CORNERS) * std::f64::consts::TAU).sin_cos();
        [centre[0] + cos * axes[0][0] + sin * axes[1][0], centre[1] + cos * axes[0][1] + sin * axes[1][1]]
    };
    (0..CORNERS).map(corner).collect()
}

/// Half axes on the picture of the covariance ellipse in plan, `px_per_sigma_m` pixels for a metre of σ.
fn axes_px(covariance: &[[f64; 3]; 3], px_per_sigma_m: f64) -> Option<[Point; 2]> {
    let [major, minor] = principal_sigmas_m(covariance)?;
    let (ee, en, nn) = (covariance[0][0], covariance[0][1], covariance[1][1]);
    let from_east_rad = (2.0 * en).atan2(ee - nn) / 2.0;
    let (sin, cos) = from_east_rad.sin_cos();
    let (long, short) = (major * px_per_sigma_m, minor * px_per_sigma_m);
    Some([[long * cos, -long * sin], [-short * sin, -short * cos]])
}

/// Greatest and least σ in plan, metres; `None` when the covariance is not positive.
pub(super) fn principal_sigmas_m(covariance: &[[f64; 3]; 3]) -> Option<[f64; 2]> {
    let (ee, en, nn) = (covariance[0][0], covariance[0][1], covariance[1][1]);
    let (mean, spread) = ((ee + nn) / 2.0, ((ee - nn) / 2.0).hypot(en));
    let (major, minor) = ((mean + spread).sqrt(), (mean - spread).sqrt());
    (minor > 0.0 && major.is_finite()).then_some([major, minor])
}
