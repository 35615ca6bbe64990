//! What stands around the plan: title, colour bar, scale bar, north arrow, and the key with its numbers.

use super::canvas::{Area, Canvas, Point, joined, outline};
use super::cells::Cells;
use super::colours::{INK, PAPER, viridis};
use super::markers::{Marker, draw_ellipse_sample, draw_shape, principal_sigmas_m};
use super::plan::{Plan, hatch};
use super::scale::{ScoreScale, round_below};
use super::text::{DETAIL, LABEL, TITLE, fitted, width_px, write, write_on_plan};
use super::{HeatMap, SIZE_PX};
use resurvey_schema::Pose;

/// Left edge of the column beside the plan, pixels.
const COLUMN_PX: f64 = 666.0;

/// Left edge of words in that column, pixels.
const WORDS_PX: f64 = 706.0;

/// The colour bar, pixels.
const BAR_PX: Area = Area { left: 668, top: 92, right: 692, bottom: 292 };

/// Longest scale bar, pixels.
const SCALE_BAR_PX: f64 = 180.0;

/// What the key tells about.
pub(super) struct Key<'a> {
    pub input: &'a HeatMap<'a>,
    pub cells: &'a Cells,
    pub scale: &'a ScoreScale,
    pub plan: &'a Plan,
}

/// Draws all that stands around the plan.
pub(super) fn draw(canvas: &mut Canvas, key: &Key<'_>) {
    let Area { left, top, right, bottom } = key.plan.area;
    draw_frame(canvas, key.plan.area);
    let room_px = f64::from(SIZE_PX.0) - 2.0 * f64::from(left);
    write(canvas, [f64::from(left), 44.0], &TITLE, &fitted(key.input.title, &TITLE, room_px));
    if key.cells.len() == 0 {
        let words = "no position was scored";
        let start = [key.plan.area.centre()[0] - width_px(words, &LABEL) / 2.0, f64::from(top) + 36.0];
        write_on_plan(canvas, start, &LABEL, words);
    }
    draw_scale_bar(canvas, [f64::from(left), f64::from(bottom) + 20.0], key.plan.px_per_m);
    let words = positions_text(key.cells);
    write(canvas, [f64::from(right) - width_px(&words, &DETAIL), f64::from(bottom) + 26.0], &DETAIL, &words);
    draw_north_arrow(canvas, [862.0, 92.0]);
    draw_colour_bar(canvas, key);
    draw_entries(canvas, key);
}

fn draw_frame(canvas: &mut Canvas, Area { left, top, right, bottom }: Area) {
    let [left, top, right, bottom] = [left, top, right, bottom].map(f64::from);
    let corners =
        [[left - 0.5, top - 0.5], [right + 0.5, top - 0.5], [right + 0.5, bottom + 0.5], [left - 0.5, bottom + 0.5]];
    canvas.stroke(&outline(&corners), 1.0, INK);
}

fn positions_text(cells: &Cells) -> String {
    match cells.len() {
        0 => String::new(),
        1 => "1 position".to_owned(),
        count => format!("{count} positions, every {}", length_text(cells.spacing_m())),
    }
}

/// A bar of a round length, half dark, half bright, with its length.
fn draw_scale_bar(canvas: &mut Canvas, [x, y]: Point, px_per_m: f64) {
    let length_m = round_below(SCALE_BAR_PX / px_per_m);
    let length_px = length_m * px_per_m;
    let box_of = |from: f64, to: f64| [[from, y - 4.0], [to, y - 4.0], [to, y + 4.0], [from, y + 4.0]];
    canvas.fill(&box_of(x, x + length_px), INK);
    canvas.fill(&box_of(x + length_px / 2.0, x + length_px - 1.5).map(|[x, v]| [x, y + (v - y) * 0.625]), PAPER);
    write(canvas, [x + length_px + 12.0, y + 6.0], &LABEL, &length_text(length_m));
}

fn draw_north_arrow(canvas: &mut Canvas, [x, y]: Point) {
    let tip = [x, y - 18.0];
    canvas.fill(&[tip, [x + 10.0, y + 18.0], [x, y + 10.0]], INK);
    canvas.fill(&[tip, [x - 10.0, y + 18.0], [x, y + 10.0]], PAPER);
    canvas.stroke(&outline(&[tip, [x + 10.0, y + 18.0], [x, y + 10.0], [x - 10.0, y + 18.0]]), 1.6, INK);
    write(canvas, [x - width_px("N", &LABEL) / 2.0, y + 42.0], &LABEL, "N");
}

fn draw_colour_bar(canvas: &mut Canvas, key: &Key<'_>) {
    let Area { left, top, right, bottom } = BAR_PX;
    let [left, top, right, bottom] = [left, top, right, bottom].map(f64::from);
    write(canvas, [COLUMN_PX, 76.0], &LABEL, "Score");
    for row in BAR_PX.top..BAR_PX.bottom {
        let share = 1.0 - (f64::from(row) + 0.5 - top) / (bottom - top);
        canvas.fill_rect([left, f64::from(row)], [right, f64::from(row) + 1.0], viridis(share));
    }
    draw_frame(canvas, BAR_PX);
    let height = |score: f64| bottom - key.scale.share(score) * (bottom - top);
    for (score, words) in key.scale.ticks() {
        let y = height(score);
        canvas.stroke(&joined(&[[right, y], [right + 6.0, y]]), 1.4, INK);
        write(canvas, [WORDS_PX, y + DETAIL.capital_px / 2.0], &DETAIL, &words);
    }
    let swatch = Area { left: 668, top: 310, right: 692, bottom: 326 };
    hatch(canvas, swatch);
    draw_frame(canvas, swatch);
    write(canvas, [WORDS_PX, 324.0], &DETAIL, "no candidate position");
}

/// The key: a sample of each marker, its name and its numbers.
fn draw_entries(canvas: &mut Canvas, key: &Key<'_>) {
    let (input, sample_px) = (key.input, COLUMN_PX + 14.0);
    let mut y = 376.0;
    draw_shape(canvas, Marker::Prior, [sample_px, y - 6.0]);
    y = write_entry(canvas, y, "Prior", &[heading_text(&input.prior)]);

    let mut numbers = vec![heading_text(&input.estimate)];
    numbers.extend(input.score.is_finite().then(|| format!("score {:.3}", input.score)));
    numbers.push(format!("from prior {}", difference_text(&input.prior, &input.estimate)));
    draw_shape(canvas, Marker::Estimate, [sample_px, y - 6.0]);
    y = write_entry(canvas, y, "Estimate", &numbers);

    if let Some([major_m, minor_m]) = principal_sigmas_m(&input.covariance) {
        draw_ellipse_sample(canvas, [sample_px, y - 6.0]);
        let mut numbers = vec![format!("1σ is {} × {}", distance_text(major_m), distance_text(minor_m))];
        let yaw_deg = input.covariance[2][2].sqrt().to_degrees();
        numbers.extend(yaw_deg.is_finite().then(|| format!("heading 1σ is {yaw_deg:.2}°")));
        y = write_entry(canvas, y, "1σ and 3σ ellipses", &numbers);
    }
    if let Some(truth) = &input.truth {
        let numbers = [heading_text(truth), format!("error {}", difference_text(truth, &input.estimate))];
        draw_shape(canvas, Marker::Truth, [sample_px, y - 6.0]);
        write_entry(canvas, y, "Truth", &numbers);
    }
}

/// Writes a name and its numbers from baseline `y` down; returns the baseline of the next entry.
fn write_entry(canvas: &mut Canvas, y: f64, name: &str, numbers: &[String]) -> f64 {
    write(canvas, [WORDS_PX, y], &LABEL, name);
    let mut baseline = y;
    for line in numbers {
        baseline += 20.0;
        write(canvas, [WORDS_PX, baseline], &DETAIL, line);
    }
    baseline + 38.0
}

fn heading_text(pose: &Pose) -> String {
    let tenths = (pose.yaw_rad.to_degrees().rem_euclid(360.0) * 10.0).round() % 3600.0;
    format!("heading {:.1}°", tenths / 10.0)
}

/// How far apart two poses are in plan and in heading.
fn difference_text(from: &Pose, to: &Pose) -> String {
    let turn_deg = (to.yaw_rad - from.yaw_rad).to_degrees();
    let turn_deg = (turn_deg + 180.0).rem_euclid(360.0) - 180.0;
    format!("{}, {:.1}°", distance_text(from.position.plan_distance_m(&to.position)), turn_deg.abs())
}

/// A measured distance, to the centimetre while that says something.
pub(super) fn distance_text(distance_m: f64) -> String {
    match distance_m {
        0.0..100.0 => format!("{distance_m:.2} m"),
        100.0..10_000.0 => format!("{distance_m:.0} m"),
        _ => format!("{:.0} km", distance_m / 1000.0),
    }
}

/// A round length without zeros after the last digit that counts.
fn length_text(length_m: f64) -> String {
    if length_m >= 1000.0 {
        return format!("{} km", (length_m / 10.0).round() / 100.0);
    }
    format!("{} m", (length_m * 1000.0).round() / 1000.0)
}
