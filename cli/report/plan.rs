//! The place from above: buildings, prior, pose, what the camera sees, and the descriptors that change.

use super::footprint::{Line, footprints};
use super::overlay::tenth;
use super::sheet::Sheet;
use maud::{Markup, html};
use resurvey_core::camera::world_from_camera;
use resurvey_core::update::Change;
use resurvey_schema::{Descriptor, GridPoint, Pose};

/// Size of the drawing.
const SIZE: [f64; 2] = [640.0, 520.0];
/// Room for the numbers of the grid: left and below.
const MARGIN: f64 = 24.0;
/// The least that is shown along each axis, metres.
const LEAST_M: f64 = 24.0;
/// Room around what must be seen, metres.
const AROUND_M: f64 = 8.0;
/// Furniture is cut this far below the camera, metres.
const LOWER_CUT_M: f64 = 1.1;
/// Longest scale bar.
const BAR: f64 = 170.0;
/// Colours of changes are those of the overlay: classes of the style sheet.
const KINDS: [(&str, &str); 3] = [("added", "added"), ("modified", "modified"), ("removed", "removed")];

/// Easting and northing to places of the drawing.
struct Frame {
    west_m: f64,
    north_m: f64,
    per_m: f64,
}

impl Frame {
    /// The frame that holds all of `points`, at one scale along both axes.
    fn around(points: &[[f64; 2]]) -> Self {
        let least = |axis: usize| points.iter().map(|point| point[axis]).fold(f64::INFINITY, f64::min) - AROUND_M;
        let most = |axis: usize| points.iter().map(|point| point[axis]).fold(f64::NEG_INFINITY, f64::max) + AROUND_M;
        let spans = [0, 1].map(|axis| (most(axis) - least(axis)).max(LEAST_M));
        let per_m = (SIZE[0] / spans[0]).min(SIZE[1] / spans[1]);
        let middle = [0, 1].map(|axis| (least(axis) + most(axis)) / 2.0);
        Self { west_m: middle[0] - SIZE[0] / per_m / 2.0, north_m: middle[1] + SIZE[1] / per_m / 2.0, per_m }
    }

    fn at(&self, [east_m, north_m]: [f64; 2]) -> [f64; 2] {
        [(east_m - self.west_m) * self.per_m, (self.north_m - north_m) * self.per_m]
    }

    fn bounds(&self) -> [[f64; 2]; 2] {
        let [width_m, height_m] = SIZE.map(|size| size / self.per_m);
        [[self.west_m, self.north_m - height_m], [self.west_m + width_m, self.north_m]]
    }

    fn holds(&self, point: GridPoint) -> bool {
        let [x, y] = self.at(flat(point));
        (0.0..SIZE[0]).contains(&x) && (0.0..SIZE[1]).contains(&y)
    }
}

fn flat(point: GridPoint) -> [f64; 2] {
    [point.easting_m, point.northing_m]
}

/// The plan of `sheet`; north is up.
pub fn plan(sheet: &Sheet<'_>) -> Markup {
    let pose = sheet.located.localization.pose;
    let frame = Frame::around(&places(sheet));
    let height_m = pose.position.height_m;
    let cut = |height_m: f64| footprints(sheet.world.scene(false), height_m, frame.bounds());
    let (walls, low) = (cut(height_m), cut(height_m - LOWER_CUT_M));
    let touched: Vec<u64> = sheet.resolution.changes.iter().filter_map(fid_of).collect();
    let (width, height) = (SIZE[0] + MARGIN, SIZE[1] + MARGIN);
    html! {
        svg class="plan" viewBox={ (tenth(-MARGIN)) " 0 " (tenth(width)) " " (tenth(height)) } role="img"
            aria-label="Plan view, north up" {
            defs { clipPath id="plan-clip" { rect width=(tenth(SIZE[0])) height=(tenth(SIZE[1])) {} } }
            rect class="ground" width=(tenth(SIZE[0])) height=(tenth(SIZE[1])) {}
            (grid(&frame))
            g clip-path="url(#plan-clip)" {
                (wedge(sheet, &frame, &pose))
                path class="low" d=(path(&low, &frame)) {}
                path class="wall" d=(path(&walls, &frame)) {}
                @for (fid, descriptor) in sheet.world.descriptors() {
                    @if !touched.contains(fid) && frame.holds(descriptor.anchor()) {
                        (shape(descriptor, &frame, "present"))
                    }
                }
                (prior(sheet, &frame))
                @for change in &sheet.resolution.changes { (drawn(change, &frame)) }
                (camera(&frame, &pose))
            }
            (labels(sheet, &frame))
            rect class="frame" width=(tenth(SIZE[0])) height=(tenth(SIZE[1])) {}
            (scale_bar(&frame))
            (north())
        }
    }
}

/// The signs of the plan, in words.
pub fn key(sheet: &Sheet<'_>) -> Markup {
    let has = |kind: &str| sheet.resolution.changes.iter().any(|change| kind_of(change) == kind);
    html! {
        ul class="key" {
            li { svg class="sign" viewBox="0 0 24 14" { path class="cone" d="M3 12L21 2V12Z" {} circle class="camera" cx="5" cy="10" r="4" {} } "camera, and what it sees" }
            li { svg class="sign" viewBox="0 0 24 14" { path class="prior" d="M7 7h10M12 2v10" {} circle class="prior" cx="12" cy="7" r="6" {} } "prior of the phone, 1σ" }
            li { svg class="sign" viewBox="0 0 24 14" { path class="wall" d="M1 7H23" {} } "map at the height of the camera" }
            li { svg class="sign" viewBox="0 0 24 14" { path class="low" d="M1 7H23" {} } (LOWER_CUT_M) " m lower" }
            @if !sheet.world.descriptors().is_empty() {
                li { svg class="sign" viewBox="0 0 24 14" { path class="panel present" d="M1 7H23" {} } "descriptor of the map" }
            }
            @for (kind, words) in KINDS {
                @if has(kind) {
                    li { svg class="sign" viewBox="0 0 24 14" { path class={ "panel " (kind) } d="M1 7H23" {} } (words) }
                }
            }
        }
    }
}

/// What must be in the picture.
fn places(sheet: &Sheet<'_>) -> Vec<[f64; 2]> {
    let mut places = vec![flat(sheet.located.localization.pose.position), flat(sheet.capture.prior.pose.position)];
    for change in &sheet.resolution.changes {
        let states = match change {
            Change::Add(after) => vec![after],
            Change::Modify { before, after, .. } => vec![before, after],
            Change::Remove { before, .. } => vec![before],
        };
        for state in states {
            match state {
                Descriptor::Material(material) => places.extend(material.corners.map(flat)),
                Descriptor::Dynamic(object) => places.push(flat(object.position)),
            }
        }
    }
    places
}

fn fid_of(change: &Change) -> Option<u64> {
    match change {
        Change::Add(_) => None,
        Change::Modify { fid, .. } | Change::Remove { fid, .. } => Some(*fid),
    }
}

fn kind_of(change: &Change) -> &'static str {
    match change {
        Change::Add(_) => "added",
        Change::Modify { .. } => "modified",
        Change::Remove { .. } => "removed",
    }
}

fn path(lines: &[Line], frame: &Frame) -> String {
    let ends = lines.iter().map(|line| line.map(|end| frame.at(end)));
    // What is shorter than a dot of the drawing is not seen.
    let long = ends.filter(|[a, b]| (a[0] - b[0]).hypot(a[1] - b[1]) > 0.3);
    long.map(|[a, b]| format!("M{} {}L{} {}", tenth(a[0]), tenth(a[1]), tenth(b[0]), tenth(b[1]))).collect()
}

/// The part of the ground between the left and right border of the photo.
fn wedge(sheet: &Sheet<'_>, frame: &Frame, pose: &Pose) -> Markup {
    let camera = &sheet.capture.camera;
    let middle_row = f64::from(camera.height()) / 2.0;
    let from = frame.at(flat(pose.position));
    let columns = [0.0, 0.25, 0.5, 0.75, 1.0].map(|share| share * f64::from(camera.width()));
    let far = SIZE[0] + SIZE[1];
    let ends = columns.iter().filter_map(|column| {
        let ray = world_from_camera(pose) * camera.ray(*column, middle_row)?;
        let length = ray.x.hypot(ray.y);
        (length > 1e-3)
            .then(|| format!("L{} {}", tenth(from[0] + far * ray.x / length), tenth(from[1] - far * ray.y / length)))
    });
    let ends: String = ends.collect();
    html! { path class="cone" d={ "M" (tenth(from[0])) " " (tenth(from[1])) (ends) "Z" } {} }
}

fn camera(frame: &Frame, pose: &Pose) -> Markup {
    let [x, y] = frame.at(flat(pose.position));
    let (sin, cos) = pose.yaw_rad.sin_cos();
    html! {
        path class="heading" d={ "M" (tenth(x)) " " (tenth(y)) "L" (tenth(x + 26.0 * sin)) " " (tenth(y - 26.0 * cos)) } {}
        circle class="camera" cx=(tenth(x)) cy=(tenth(y)) r="6" {}
    }
}

fn prior(sheet: &Sheet<'_>, frame: &Frame) -> Markup {
    let prior = &sheet.capture.prior;
    let [x, y] = frame.at(flat(prior.pose.position));
    html! {
        circle class="prior" cx=(tenth(x)) cy=(tenth(y)) r=(tenth(prior.position_sigma_m * frame.per_m)) {}
        path class="prior" d={ "M" (tenth(x - 6.0)) " " (tenth(y)) "h12M" (tenth(x)) " " (tenth(y - 6.0)) "v12" } {}
    }
}

fn drawn(change: &Change, frame: &Frame) -> Markup {
    match change {
        Change::Add(after) => shape(after, frame, "added"),
        Change::Modify { before, after, .. } => {
            html! { (shape(before, frame, "before")) (shape(after, frame, "modified")) }
        }
        Change::Remove { before, .. } => shape(before, frame, "removed"),
    }
}

/// A rectangle on a wall is a line with its normal, an object a square of its size but never too small to see; 1σ around
/// either.
fn shape(descriptor: &Descriptor, frame: &Frame, class: &str) -> Markup {
    let [x, y] = frame.at(flat(descriptor.anchor()));
    let sigma = descriptor.sigma().map(|sigma| sigma.position_m * frame.per_m).filter(|radius| *radius > 5.0);
    html! {
        @if let Some(radius) = sigma { circle class={ "sigma " (class) } cx=(tenth(x)) cy=(tenth(y)) r=(tenth(radius)) {} }
        @match descriptor {
            Descriptor::Material(material) => {
                @let [a, b] = [material.corners[0], material.corners[1]].map(|corner| frame.at(flat(corner)));
                @let [east, north, _] = material.normal;
                path class={ "panel " (class) } d={ "M" (tenth(a[0])) " " (tenth(a[1])) "L" (tenth(b[0])) " " (tenth(b[1])) } {}
                path class={ "tick " (class) } d={ "M" (tenth(x)) " " (tenth(y)) "L" (tenth(x + 9.0 * east)) " " (tenth(y - 9.0 * north)) } {}
            },
            Descriptor::Dynamic(object) => {
                @let half = (object.size_m[0].max(object.size_m[1]) * frame.per_m / 2.0).max(3.5);
                rect class={ "object " (class) } x=(tenth(x - half)) y=(tenth(y - half)) width=(tenth(2.0 * half)) height=(tenth(2.0 * half)) {}
            },
        }
    }
}

/// Names of the changes, beside them; each further one a line lower where they stand close.
fn labels(sheet: &Sheet<'_>, frame: &Frame) -> Markup {
    let classes = sheet.world.classes();
    let mut taken: Vec<[f64; 2]> = Vec::new();
    html! {
        @for (index, change) in sheet.resolution.changes.iter().enumerate() {
            @let state = match change { Change::Add(after) | Change::Modify { after, .. } => after, Change::Remove { before, .. } => before };
            @let fid = sheet.document["changes"][index]["fid"].as_u64();
            @let [x, y] = frame.at(flat(state.anchor()));
            @let is_right = x < SIZE[0] * 0.7;
            @let y = free_line(&mut taken, x, (y - 12.0).clamp(18.0, SIZE[1] - 30.0));
            text class={ "mark " (kind_of(change)) } x=(tenth(if is_right { x + 12.0 } else { x - 12.0 })) y=(tenth(y))
                text-anchor=(if is_right { "start" } else { "end" }) {
                (classes.name(state.class())) @if let Some(fid) = fid { " " (fid) }
            }
        }
    }
}

/// The first line from `y` down on which nothing near `x` is written.
fn free_line(taken: &mut Vec<[f64; 2]>, x: f64, y: f64) -> f64 {
    const LINE: f64 = 18.0;
    let mut line = y;
    while taken.iter().any(|other| (other[0] - x).abs() < 110.0 && (other[1] - line).abs() < LINE) {
        line += LINE;
    }
    taken.push([x, line]);
    line
}

/// Lines every round number of metres, with their easting and northing at the border.
fn grid(frame: &Frame) -> Markup {
    let step_m = round_above(85.0 / frame.per_m);
    let [low, high] = frame.bounds();
    let lines = |axis: usize| {
        let first = (low[axis] / step_m).ceil() as i64;
        let last = (high[axis] / step_m).floor() as i64;
        (first..=last).map(move |index| index as f64 * step_m)
    };
    html! {
        @for east_m in lines(0) {
            @let [x, _] = frame.at([east_m, low[1]]);
            path class="grid" d={ "M" (tenth(x)) " 0V" (tenth(SIZE[1])) } {}
            @if x > 30.0 && x < SIZE[0] - 30.0 {
                text class="grid" x=(tenth(x)) y=(tenth(SIZE[1] + 17.0)) text-anchor="middle" { (format!("{east_m:.0}")) }
            }
        }
        @for north_m in lines(1) {
            @let [_, y] = frame.at([low[0], north_m]);
            path class="grid" d={ "M0 " (tenth(y)) "H" (tenth(SIZE[0])) } {}
            @if y > 30.0 && y < SIZE[1] - 30.0 {
                text class="grid" transform={ "translate(-8 " (tenth(y)) ") rotate(-90)" } text-anchor="middle" { (format!("{north_m:.0}")) }
            }
        }
    }
}

fn scale_bar(frame: &Frame) -> Markup {
    let length_m = round_below(BAR / frame.per_m);
    let length = length_m * frame.per_m;
    let y = SIZE[1] - 16.0;
    html! {
        g class="bar" transform={ "translate(14 " (tenth(y)) ")" } {
            rect class="halo" x="-6" y="-20" width=(tenth(length + 12.0)) height="30" rx="3" {}
            rect class="dark" width=(tenth(length / 2.0)) height="5" {}
            rect class="bright" x=(tenth(length / 2.0)) width=(tenth(length / 2.0)) height="5" {}
            text x="0" y="-6" text-anchor="start" { "0" }
            text x=(tenth(length)) y="-6" text-anchor="end" { (length_m) " m" }
        }
    }
}

fn north() -> Markup {
    html! {
        g class="north" transform={ "translate(" (tenth(SIZE[0] - 26.0)) " 32)" } {
            circle class="halo" r="24" {}
            path class="bright" d="M0 -14L7 12L0 6L-7 12Z" {}
            path class="dark" d="M0 -14L7 12L0 6Z" {}
            text y="-16" text-anchor="middle" { "N" }
        }
    }
}

/// 1, 2 or 5 times a power of ten: the greatest that is not above `value`.
fn round_below(value: f64) -> f64 {
    let power = 10_f64.powf(value.max(1e-6).log10().floor());
    [5.0, 2.0, 1.0].into_iter().map(|digit| digit * power).find(|round| *round <= value).unwrap_or(power)
}

/// The same: the least that is not below `value`.
fn round_above(value: f64) -> f64 {
    let power = 10_f64.powf(value.max(1e-6).log10().floor());
    [1.0, 2.0, 5.0, 10.0].into_iter().map(|digit| digit * power).find(|round| *round >= value).unwrap_or(power)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scale_bars_are_of_round_lengths() {
        for (value, below, above) in [(34.0, 20.0, 50.0), (5.0, 5.0, 5.0), (0.7, 0.5, 1.0), (99.0, 50.0, 100.0)] {
            assert!((round_below(value) - below).abs() < 1e-9 && (round_above(value) - above).abs() < 1e-9, "{value}");
        }
    }

    #[test]
    fn north_is_up_and_east_is_right_at_one_scale() {
        let frame = Frame::around(&[[835_600.0, 817_800.0], [835_700.0, 817_820.0]]);
        let [south_west, south_east, north_west] =
            [[835_600.0, 817_800.0], [835_610.0, 817_800.0], [835_600.0, 817_810.0]].map(|place| frame.at(place));
        assert!((south_east[0] - south_west[0] - 10.0 * frame.per_m).abs() < 1e-6);
        assert!((south_west[1] - north_west[1] - 10.0 * frame.per_m).abs() < 1e-6);
        assert!(south_west[0] > 0.0 && south_west[1] < SIZE[1]);
    }
}
