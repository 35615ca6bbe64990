//! VPS matcher on edges: the class edges of photo and view by truncated, symmetric chamfer distance (Barrow et al.,
//! IJCAI 1977; Borgefors, PAMI 1988).
#![forbid(unsafe_code)]

mod contour;
mod distance;

use contour::{class_edges, depth_edges};
use distance::distances;
use resurvey_plugin::{ClassList, Error, ImageRef, Plugin, Scorer, View, schema::ClassId};

resurvey_plugin::export_scorer!(Edges);

/// The matcher.
pub struct Edges {
    settings: Settings,
    /// The photo of the last call: a search scores one photo against many views.
    photo: Option<Photo>,
}

/// Its settings, complete.
#[derive(serde::Deserialize)]
pub struct Settings {
    truncation: f64,
    depth_edges: bool,
    depth_jump: f64,
    hidden: ClassList,
}

/// A photo made ready.
struct Photo {
    labels: Vec<u8>,
    width: u32,
    /// Pixels whose class is neither void nor hidden.
    shown: Vec<bool>,
    edges: Vec<bool>,
    /// Distance of each pixel from the nearest edge.
    from_edge_px: Vec<f32>,
}

impl Plugin for Edges {
    const NAME: &'static str = "edges";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Matches the edges of classes and depth by chamfer distance";
    const SETTINGS: &'static str = include_str!("settings.json");
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings, photo: None })
    }
}

impl Scorer for Edges {
    fn score(&mut self, photo: ImageRef<'_, u8>, view: &View<'_>) -> Result<f64, Error> {
        let photo = match self.photo.take() {
            Some(known) if known.is(photo) => known,
            _ => Photo::new(photo, &self.settings.hidden),
        };
        let score = self.settings.score(&photo, view);
        self.photo = Some(photo);
        Ok(score)
    }
}

impl Settings {
    fn score(&self, photo: &Photo, view: &View<'_>) -> f64 {
        let (width, height) = (view.labels.width() as usize, view.labels.height() as usize);
        let limit_px = (self.truncation * (width as f64).hypot(height as f64)).max(1.0) as f32;
        let labels = values(view.labels);
        // What the photo hides it cannot show.
        let shown = shown(&labels, &self.hidden);
        let shown: Vec<bool> = shown.iter().zip(&photo.shown).map(|(here, there)| *here && *there).collect();
        let edges = class_edges(&labels, width, &shown);
        let missing_in_photo = mean(&edges, &photo.from_edge_px, limit_px);
        // Two walls of one class have no edge between them in a photo of classes, so that a jump of range asks for no
        // counterpart. It may explain an edge, where one of the walls has another class by now.
        let explaining = if self.depth_edges {
            let mut jumps = depth_edges(&values(view.range_m), width, self.depth_jump as f32);
            jumps.iter_mut().zip(&edges).for_each(|(jump, edge)| *jump |= edge);
            jumps
        } else {
            edges.clone()
        };
        let missing_in_view = mean(&photo.edges, &distances(&explaining, width), limit_px);
        match (missing_in_photo, missing_in_view) {
            (Some(in_photo), Some(in_view)) => 1.0 - f64::midpoint(in_photo, in_view),
            // Neither has an edge: they agree. One alone: nothing of it is found.
            (None, None) => 1.0,
            _ => 0.0,
        }
    }
}

/// Pixels of `labels` whose class is neither void nor `hidden`.
fn shown(labels: &[u8], hidden: &ClassList) -> Vec<bool> {
    labels.iter().map(|class| *class != ClassId::VOID.0 && !hidden.contains(*class)).collect()
}

impl Photo {
    fn new(photo: ImageRef<'_, u8>, hidden: &ClassList) -> Self {
        let (labels, width) = (values(photo), photo.width());
        let shown = shown(&labels, hidden);
        let edges = class_edges(&labels, width as usize, &shown);
        let from_edge_px = distances(&edges, width as usize);
        Self { labels, width, shown, edges, from_edge_px }
    }

    fn is(&self, photo: ImageRef<'_, u8>) -> bool {
        self.width == photo.width()
            && self.labels.len() == photo.width() as usize * photo.height() as usize
            && (0..photo.height())
                .zip(self.labels.chunks(self.width.max(1) as usize))
                .all(|(v, row)| row == photo.row(v))
    }
}

/// The pixels of `image` without padding, row by row.
fn values<T: Copy>(image: ImageRef<'_, T>) -> Vec<T> {
    (0..image.height()).flat_map(|v| image.row(v).iter().copied()).collect()
}

/// Mean over the marked `edges` of their distance from the other image's, at most `limit_px`, as a share of it; `None`
/// where there are none.
fn mean(edges: &[bool], from_edge_px: &[f32], limit_px: f32) -> Option<f64> {
    let (mut sum, mut count) = (0.0_f64, 0_u32);
    for (_, distance_px) in edges.iter().zip(from_edge_px).filter(|(edge, _)| **edge) {
        sum += f64::from(distance_px.min(limit_px));
        count += 1;
    }
    (count > 0).then(|| sum / f64::from(count) / f64::from(limit_px))
}

#[cfg(test)]
mod tests;
