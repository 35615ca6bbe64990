//! What is drawn over an image of the photo: numbers of regions, and the points that were measured.

use super::base64::png_address;
use maud::{Markup, html};
use nalgebra::Vector3;
use resurvey_core::camera::{Camera, camera_from_world};
use resurvey_core::update::Change;
use resurvey_schema::{ChangeRegion, Descriptor, DynamicDescriptor, GridPoint, PixelBox, Pose};

/// Points along one edge, so that edges bend with the lens.
const EDGE_POINTS: u32 = 12;
/// Least room around a change in its detail, pixels.
const LEAST_AROUND_PX: f64 = 14.0;

/// Where things of the map appear in the photo.
pub struct Overlay<'a> {
    camera: &'a Camera,
    pose: Pose,
    /// Size of letters, pixels of the photo.
    letter_px: f64,
}

impl<'a> Overlay<'a> {
    /// Over the photo of `camera` at `pose`.
    pub fn new(camera: &'a Camera, pose: Pose) -> Self {
        Self { camera, pose, letter_px: f64::from(camera.width()) / 30.0 }
    }

    /// The numbers of `regions`, beside each.
    pub fn regions(&self, regions: &[ChangeRegion]) -> Markup {
        let (width, height) = (f64::from(self.camera.width()), f64::from(self.camera.height()));
        self.svg(&html! {
            @for (index, region) in regions.iter().enumerate() {
                @let bounds = region.bounds;
                @let middle = f64::from(bounds.left + bounds.right) / 2.0;
                @let above = f64::from(bounds.top) - 0.35 * self.letter_px;
                @let y = if above > 1.2 * self.letter_px { above } else { f64::from(bounds.bottom) + self.letter_px };
                text class="mark" x=(tenth(middle.clamp(self.letter_px, width - self.letter_px)))
                    y=(tenth(y.min(height - 4.0))) text-anchor="middle" { (index + 1) }
            }
        })
    }

    /// The descriptors of `changes`: corners numbered as they are stored, or the ground contact with the box on it.
    pub fn points(&self, changes: &[Change]) -> Markup {
        self.svg(&html! { @for change in changes { (self.change(change)) } })
    }

    /// The part of the photo around `change`; `None` where nothing of it is in the photo.
    pub fn part(&self, change: &Change) -> Option<PixelBox> {
        let states = match change {
            Change::Add(after) => vec![after],
            Change::Modify { before, after, .. } => vec![before, after],
            Change::Remove { before, .. } => vec![before],
        };
        let points = states.into_iter().flat_map(|state| match state {
            Descriptor::Material(material) => material.corners.to_vec(),
            Descriptor::Dynamic(object) => box_of(object).as_flattened().to_vec(),
        });
        let pixels: Vec<[f64; 2]> = points.filter_map(|point| self.pixel(point)).collect();
        let side = |axis: usize, end: u32| {
            let least = pixels.iter().map(|pixel| pixel[axis]).fold(f64::INFINITY, f64::min);
            let most = pixels.iter().map(|pixel| pixel[axis]).fold(f64::NEG_INFINITY, f64::max);
            let around = (0.35 * (most - least)).max(LEAST_AROUND_PX);
            let end = f64::from(end);
            ((least - around).clamp(0.0, end).floor() as u32, (most + around).clamp(0.0, end).ceil() as u32)
        };
        let ((left, right), (top, bottom)) = (side(0, self.camera.width()), side(1, self.camera.height()));
        (!pixels.is_empty() && right > left && bottom > top).then_some(PixelBox { left, top, right, bottom })
    }

    /// `png`, which shows the photo inside `bounds`, with the points of `change` on it.
    pub fn detail(&self, png: &[u8], bounds: PixelBox, change: &Change) -> Markup {
        let (width, height) = (bounds.width(), bounds.height());
        let letter_px = f64::from(width.max(height)) / 15.0;
        let close = Overlay { letter_px, ..*self };
        html! {
            svg class="overlay detail" viewBox={ (bounds.left) " " (bounds.top) " " (width) " " (height) } role="img"
                aria-label="The photo around the change" style=(close.style()) {
                image href=(png_address(png)) x=(bounds.left) y=(bounds.top) width=(width) height=(height) {}
                (close.change(change))
            }
        }
    }

    fn svg(&self, contents: &Markup) -> Markup {
        let (width, height) = (self.camera.width(), self.camera.height());
        html! {
            svg class="overlay" viewBox={ "0 0 " (width) " " (height) } aria-hidden="true" style=(self.style()) { (contents) }
        }
    }

    fn style(&self) -> String {
        format!("font-size:{}px;--thick:{:.2}px", tenth(self.letter_px), self.letter_px / 9.0)
    }

    fn change(&self, change: &Change) -> Markup {
        match change {
            Change::Add(after) => self.descriptor(after, "added"),
            Change::Modify { before, after, .. } => {
                html! { (self.descriptor(before, "before")) (self.descriptor(after, "modified")) }
            }
            Change::Remove { before, .. } => self.descriptor(before, "removed"),
        }
    }

    fn descriptor(&self, descriptor: &Descriptor, class: &str) -> Markup {
        match descriptor {
            Descriptor::Material(material) => {
                let corners = material.corners.map(|corner| self.pixel(corner));
                html! {
                    path class={ "outline " (class) } d=(self.outline(&material.corners)) {}
                    @for (index, corner) in corners.into_iter().enumerate() {
                        @if let Some(at) = corner {
                            (self.dot(at, class))
                            // The earlier state has no numbers: they would stand on those of the later one.
                            @if class != "before" {
                                // Away from the middle: 1 and 4 to the left, 3 and 4 above.
                                @let left = matches!(index, 0 | 3);
                                @let side = if left { -0.45 } else { 0.45 };
                                @let down = if index < 2 { 1.05 } else { -0.35 };
                                text class={ "mark " (class) } x=(tenth(at[0] + side * self.letter_px))
                                    y=(tenth(at[1] + down * self.letter_px)) text-anchor=(if left { "end" } else { "start" }) {
                                    (index + 1)
                                }
                            }
                        }
                    }
                }
            }
            Descriptor::Dynamic(object) => {
                let [low, high] = box_of(object);
                html! {
                    path class={ "outline thin " (class) } d=(self.outline(&low)) {}
                    path class={ "outline thin " (class) } d=(self.outline(&high)) {}
                    @for (low, high) in low.into_iter().zip(high) {
                        path class={ "outline thin " (class) } d=(self.line(&[low, high])) {}
                    }
                    @if let Some(at) = self.pixel(object.position) { (self.dot(at, class)) }
                }
            }
        }
    }

    fn dot(&self, [u, v]: [f64; 2], class: &str) -> Markup {
        html! { circle class={ "dot " (class) } cx=(tenth(u)) cy=(tenth(v)) r=(tenth(self.letter_px / 4.5)) {} }
    }

    /// Path around `corners`, as far as the camera sees them.
    fn outline(&self, corners: &[GridPoint; 4]) -> String {
        let [a, b, c, d] = *corners;
        self.line(&[a, b, c, d, a])
    }

    fn line(&self, points: &[GridPoint]) -> String {
        let mut path = String::new();
        let mut is_down = false;
        for pair in points.windows(2) {
            for step in 0..=EDGE_POINTS {
                match self.pixel(between(pair[0], pair[1], f64::from(step) / f64::from(EDGE_POINTS))) {
                    Some([u, v]) => {
                        path += &format!("{}{} {}", if is_down { 'L' } else { 'M' }, tenth(u), tenth(v));
                        is_down = true;
                    }
                    None => is_down = false,
                }
            }
        }
        path
    }

    /// Where `point` appears; `None` behind the camera, and so far outside the image that no edge of it is worth drawing.
    fn pixel(&self, point: GridPoint) -> Option<[f64; 2]> {
        let from = self.pose.position;
        let offset = Vector3::new(
            point.easting_m - from.easting_m,
            point.northing_m - from.northing_m,
            point.height_m - from.height_m,
        );
        let [u, v] = self.camera.project(camera_from_world(&self.pose) * offset)?;
        let reach = 4.0 * f64::from(self.camera.width().max(self.camera.height()));
        (u.abs() < reach && v.abs() < reach).then_some([u, v])
    }
}

/// Corners of the box that an object fills, low and high, its heading left out.
fn box_of(object: &DynamicDescriptor) -> [[GridPoint; 4]; 2] {
    let at = object.position;
    let [along, across, up] = object.size_m;
    [0.0, up].map(|height| {
        [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)].map(|(east, north)| {
            let (east, north) = (east * across / 2.0, north * along / 2.0);
            GridPoint::new(at.easting_m + east, at.northing_m + north, at.height_m + height)
        })
    })
}

fn between(from: GridPoint, to: GridPoint, share: f64) -> GridPoint {
    let at = |from: f64, to: f64| from + share * (to - from);
    GridPoint::new(at(from.easting_m, to.easting_m), at(from.northing_m, to.northing_m), at(from.height_m, to.height_m))
}

/// A coordinate of a drawing, to a tenth.
pub fn tenth(value: f64) -> String {
    let text = format!("{value:.1}");
    text.strip_suffix(".0").map_or(text.clone(), str::to_owned)
}
