//! A picture to draw on with smooth edges: strokes, polygons, rectangles. Pixels from the top-left corner.

use crate::image::Raster;
use std::ops::Range;

/// A place on the picture, pixels, right and down from the top-left corner.
pub(super) type Point = [f64; 2];

/// Red, green, blue.
pub(super) type Colour = [u8; 3];

/// Half-open rectangle of pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Area {
    pub left: u32,
    pub top: u32,
    pub right: u32,
    pub bottom: u32,
}

impl Area {
    pub(super) fn centre(&self) -> Point {
        [f64::from(self.left + self.right) / 2.0, f64::from(self.top + self.bottom) / 2.0]
    }

    pub(super) fn width_px(&self) -> f64 {
        f64::from(self.right - self.left)
    }

    /// The columns and rows of this area that a box from `low` to `high` touches.
    fn touched(&self, low: Point, high: Point) -> (Range<u32>, Range<u32>) {
        let span = |low: f64, high: f64, from: u32, to: u32| {
            let within = |value: f64| (value.max(f64::from(from)).min(f64::from(to))) as u32;
            within(low.floor())..within(high.ceil())
        };
        (span(low[0], high[0], self.left, self.right), span(low[1], high[1], self.top, self.bottom))
    }
}

/// A picture and the area that drawing is confined to.
pub(super) struct Canvas {
    picture: Raster<Colour>,
    clip: Area,
}

impl Canvas {
    pub(super) fn new(width: u32, height: u32, paper: Colour) -> Self {
        let clip = Area { left: 0, top: 0, right: width, bottom: height };
        Self { picture: Raster::filled(width, height, paper), clip }
    }

    pub(super) fn picture(&self) -> &Raster<Colour> {
        &self.picture
    }

    /// Confines what follows to `area` of the picture.
    pub(super) fn clip_to(&mut self, area: Area) {
        let (right, bottom) = (area.right.min(self.picture.width()), area.bottom.min(self.picture.height()));
        self.clip = Area { left: area.left.min(right), top: area.top.min(bottom), right, bottom };
    }

    /// Lets what follows draw everywhere.
    pub(super) fn clip_to_all(&mut self) {
        self.clip = Area { left: 0, top: 0, right: self.picture.width(), bottom: self.picture.height() };
    }

    /// Fills whole pixels from `low` to `high`, both rounded; at least one pixel each way.
    pub(super) fn fill_rect(&mut self, low: Point, high: Point, colour: Colour) {
        let low = low.map(f64::round);
        let high = [high[0].round().max(low[0] + 1.0), high[1].round().max(low[1] + 1.0)];
        let (columns, rows) = self.clip.touched(low, high);
        for row in rows {
            for column in columns.clone() {
                self.picture.set(column, row, colour);
            }
        }
    }

    /// Draws `segments` as one line `width_px` wide with round ends; where they cross nothing shows twice.
    pub(super) fn stroke(&mut self, segments: &[[Point; 2]], width_px: f64, colour: Colour) {
        let reach = width_px / 2.0 + 0.5;
        let low = |[a, b]: &[Point; 2]| [a[0].min(b[0]) - reach, a[1].min(b[1]) - reach];
        let high = |[a, b]: &[Point; 2]| [a[0].max(b[0]) + reach, a[1].max(b[1]) + reach];
        let Some(whole) = segments
            .iter()
            .map(|segment| (low(segment), high(segment)))
            .reduce(|(la, ha), (lb, hb)| ([la[0].min(lb[0]), la[1].min(lb[1])], [ha[0].max(hb[0]), ha[1].max(hb[1])]))
        else {
            return;
        };
        let (columns, rows) = self.clip.touched(whole.0, whole.1);
        let width = columns.len();
        let mut cover = vec![0.0_f64; width * rows.len()];
        for segment in segments {
            let (own_columns, own_rows) = self.clip.touched(low(segment), high(segment));
            for row in own_rows {
                for column in own_columns.clone() {
                    let index = (row - rows.start) as usize * width + (column - columns.start) as usize;
                    let inside = (reach - distance(centre_of(column, row), segment)).clamp(0.0, 1.0);
                    cover[index] = cover[index].max(inside);
                }
            }
        }
        for (index, &share) in cover.iter().enumerate().filter(|(_, share)| **share > 0.0) {
            let (column, row) = (columns.start + (index % width) as u32, rows.start + (index / width) as u32);
            self.blend(column, row, colour, share);
        }
    }

    /// Fills the polygon `corners`, with 16 samples a pixel.
    pub(super) fn fill(&mut self, corners: &[Point], colour: Colour) {
        const SAMPLES: u32 = 4;
        let axis = |axis: usize| corners.iter().map(move |corner| corner[axis]);
        let low = [axis(0).fold(f64::INFINITY, f64::min), axis(1).fold(f64::INFINITY, f64::min)];
        let high = [axis(0).fold(f64::NEG_INFINITY, f64::max), axis(1).fold(f64::NEG_INFINITY, f64::max)];
        let (columns, rows) = self.clip.touched(low, high);
        for row in rows {
            for column in columns.clone() {
                let sample = |index: u32| (f64::from(index) + 0.5) / f64::from(SAMPLES);
                let inside = (0..SAMPLES * SAMPLES)
                    .map(|index| [sample(index % SAMPLES), sample(index / SAMPLES)])
                    .filter(|offset| holds(corners, [f64::from(column) + offset[0], f64::from(row) + offset[1]]))
                    .count();
                self.blend(column, row, colour, inside as f64 / f64::from(SAMPLES * SAMPLES));
            }
        }
    }

    fn blend(&mut self, column: u32, row: u32, colour: Colour, share: f64) {
        let under = self.picture.at(column, row);
        let mixed = |channel: usize| {
            let (old, new) = (f64::from(under[channel]), f64::from(colour[channel]));
            (old + (new - old) * share).round() as u8
        };
        self.picture.set(column, row, [mixed(0), mixed(1), mixed(2)]);
    }
}

/// The segments that join `points` one after the other; a single point is a dot.
pub(super) fn joined(points: &[Point]) -> Vec<[Point; 2]> {
    match points {
        [point] => vec![[*point, *point]],
        _ => points.windows(2).map(|pair| [pair[0], pair[1]]).collect(),
    }
}

/// The segments around the polygon `corners`.
pub(super) fn outline(corners: &[Point]) -> Vec<[Point; 2]> {
    let mut segments = joined(corners);
    if let (Some(first), Some(last)) = (corners.first(), corners.last()) {
        segments.push([*last, *first]);
    }
    segments
}

fn centre_of(column: u32, row: u32) -> Point {
    [f64::from(column) + 0.5, f64::from(row) + 0.5]
}

/// Distance from `point` to the segment, pixels.
fn distance(point: Point, [start, end]: &[Point; 2]) -> f64 {
    let along = [end[0] - start[0], end[1] - start[1]];
    let offset = [point[0] - start[0], point[1] - start[1]];
    let length2 = along[0] * along[0] + along[1] * along[1];
    let share =
        if length2 > 0.0 { ((offset[0] * along[0] + offset[1] * along[1]) / length2).clamp(0.0, 1.0) } else { 0.0 };
    let (across, down) = (offset[0] - share * along[0], offset[1] - share * along[1]);
    (across * across + down * down).sqrt()
}

/// Whether `point` is inside the polygon, by the even-odd rule.
fn holds(corners: &[Point], point: Point) -> bool {
    outline(corners).iter().fold(false, |inside, [a, b]| {
        let crosses = (a[1] > point[1]) != (b[1] > point[1])
            && point[0] < a[0] + (point[1] - a[1]) / (b[1] - a[1]) * (b[0] - a[0]);
        inside != crosses
    })
}
