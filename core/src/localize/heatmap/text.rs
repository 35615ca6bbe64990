//! Lettering: lines of text in the single-stroke alphabet.

use super::canvas::{Canvas, Colour, Point, joined};
use super::colours::{INK, PAPER, SOFT_INK};
use super::font::{CAPITAL_UNITS, GAP_UNITS, glyph};

/// Extra stroke around text on top of the plan, pixels on each side.
const HALO_PX: f64 = 2.5;

/// How a line of text looks.
#[derive(Clone, Copy)]
pub(super) struct Style {
    /// Height of a capital, pixels.
    pub capital_px: f64,
    pub stroke_px: f64,
    pub colour: Colour,
}

pub(super) const TITLE: Style = Style { capital_px: 15.0, stroke_px: 2.3, colour: INK };
pub(super) const LABEL: Style = Style { capital_px: 12.0, stroke_px: 1.9, colour: INK };
pub(super) const DETAIL: Style = Style { capital_px: 11.0, stroke_px: 1.5, colour: SOFT_INK };

/// Width of `line`, pixels.
pub(super) fn width_px(line: &str, style: &Style) -> f64 {
    let units: f64 = line.chars().map(|letter| glyph(letter).1 + GAP_UNITS).sum();
    (units - GAP_UNITS).max(0.0) * style.capital_px / CAPITAL_UNITS
}

/// Writes `line` with its lower left corner at `start`.
pub(super) fn write(canvas: &mut Canvas, start: Point, style: &Style, line: &str) {
    canvas.stroke(&segments(start, style, line), style.stroke_px, style.colour);
}

/// Writes `line` with a bright rim that keeps it readable on any ground.
pub(super) fn write_on_plan(canvas: &mut Canvas, start: Point, style: &Style, line: &str) {
    canvas.stroke(&segments(start, style, line), style.stroke_px + 2.0 * HALO_PX, PAPER);
    write(canvas, start, style, line);
}

/// The longest beginning of `line` that is at most `limit_px` wide, with `…` where it was cut.
pub(super) fn fitted(line: &str, style: &Style, limit_px: f64) -> String {
    if width_px(line, style) <= limit_px {
        return line.to_owned();
    }
    let mut kept = String::new();
    for letter in line.chars() {
        kept.push(letter);
        if width_px(&kept, style) + width_px(" …", style) > limit_px {
            kept.pop();
            break;
        }
    }
    format!("{}…", kept.trim_end())
}

fn segments(start: Point, style: &Style, line: &str) -> Vec<[Point; 2]> {
    let px = style.capital_px / CAPITAL_UNITS;
    let mut left = start[0];
    let mut segments = Vec::new();
    for letter in line.chars() {
        let (lines, units) = glyph(letter);
        let place = |point: &Point| [left + point[0] * px, start[1] + (point[1] - CAPITAL_UNITS) * px];
        for line in &lines {
            segments.extend(joined(&line.iter().map(place).collect::<Vec<Point>>()));
        }
        left += (units + GAP_UNITS) * px;
    }
    segments
}
