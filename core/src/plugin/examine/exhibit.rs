//! What a plugin is shown in one call: photo, view, camera, pose and regions, whatever its kind takes of them.

use super::super::input::{ComparisonInput, PhotoInput, ViewImages};
use super::super::services::Services;
use super::finding::Finding;
use super::stage::{Place, Side};
use crate::image::{LabelImage, Raster, RgbImage, colours_of_labels};
use resurvey_schema::service::{PoseEstimate, Prior, ViewFeature};
use resurvey_schema::{Alignment, ChangeRegion, ClassId, GridPoint, Intrinsics, PixelBox, Pose};

/// A rendered view of its own.
pub(super) struct Seen {
    pub origin: GridPoint,
    pub labels: LabelImage,
    pub range_m: Raster<f32>,
    pub points: Raster<[f32; 3]>,
    pub features: Raster<u32>,
    pub feature_table: Vec<ViewFeature>,
}

impl Seen {
    /// The map as `services` show it from `pose`.
    pub(super) fn new(services: &dyn Services, pose: Pose) -> Result<Self, Finding> {
        let mut seen = None;
        let rendered = services.render(1, true, &[pose], &mut |view| {
            seen = Some(Self {
                origin: view.origin,
                labels: view.labels.clone(),
                range_m: view.range_m.clone(),
                points: view.points.clone(),
                features: view.features.clone(),
                feature_table: view.feature_table.to_vec(),
            });
        });
        let bug = |text: String| Finding::failed(format!("the toy place was not rendered: {text}"), "report this");
        rendered.map_err(|error| bug(error.to_string()))?;
        seen.ok_or_else(|| bug("no view came".to_owned()))
    }

    pub(super) fn images(&self) -> ViewImages<'_> {
        ViewImages {
            origin: self.origin,
            labels: &self.labels,
            range_m: &self.range_m,
            points: &self.points,
            features: &self.features,
            feature_table: &self.feature_table,
        }
    }
}

/// One call's worth of input.
pub(super) struct Exhibit<'a> {
    pub services: &'a dyn Services,
    pub photo: LabelImage,
    pub view: Seen,
    pub camera: Intrinsics,
    pub prior: Prior,
    pub estimate: PoseEstimate,
    pub regions: Vec<ChangeRegion>,
}

impl<'a> Exhibit<'a> {
    /// `side` of `place`, at the true pose, with the region in which its photo and its map differ.
    pub(super) fn new(place: &Place<'a>, side: Side<'a>) -> Result<Self, Finding> {
        let view = Seen::new(side.services, place.pose)?;
        let photo = side.photo.clone();
        let regions = difference(&photo, &view.labels, place.banner.class).into_iter().collect();
        let (camera, prior) = (place.camera, place.prior);
        Ok(Self { services: side.services, photo, view, camera, prior, estimate: surveyed(place.pose), regions })
    }

    pub(super) fn comparison(&self) -> ComparisonInput<'_> {
        let view = self.view.images();
        ComparisonInput { photo: &self.photo, view, camera: &self.camera, estimate: &self.estimate }
    }

    /// The photo in the colours of the classes.
    pub(super) fn picture(&self) -> RgbImage {
        colours_of_labels(&self.photo, self.services.classes())
    }

    pub(super) fn photo(&self) -> PhotoInput<'_> {
        PhotoInput { labels: &self.photo, camera: &self.camera, prior: &self.prior }
    }
}

/// A pose that is known as well as a surveyor knows it: 2 cm and 0.02°.
fn surveyed(pose: Pose) -> PoseEstimate {
    let (metres, radians) = (0.02, 0.02_f64.to_radians());
    let sigmas = [metres, metres, radians, metres, radians, radians];
    let diagonal = |row: usize, column: usize| if row == column { sigmas[row] * sigmas[row] } else { 0.0 };
    PoseEstimate {
        pose,
        covariance: std::array::from_fn(|row| std::array::from_fn(|column| diagonal(row, column))),
        height_sigma_m: metres,
        tilt_sigma_rad: radians,
        alignment: Some(Alignment {
            covariance: std::array::from_fn(|row| std::array::from_fn(|column| diagonal(row, column))),
            map_sigma_m: 0.01,
            label_sigma_px: 0.5,
        }),
    }
}

/// Where exactly one of photo and view shows `class`; void is never a change.
fn difference(photo: &LabelImage, view: &LabelImage, class: ClassId) -> Option<ChangeRegion> {
    let differs = |u: u32, v: u32| {
        let both = [photo.at(u, v), view.at(u, v)];
        both[0] != both[1] && both.contains(&class.0) && both[0] != ClassId::VOID.0
    };
    let all = (0..photo.height()).flat_map(|v| (0..photo.width()).map(move |u| (u, v)));
    let changed: Vec<(u32, u32)> = all.filter(|&(u, v)| differs(u, v)).collect();
    let &(first_u, first_v) = changed.first()?;
    let bounds = PixelBox {
        left: changed.iter().map(|(u, _)| *u).min()?,
        top: changed.iter().map(|(_, v)| *v).min()?,
        right: changed.iter().map(|(u, _)| *u).max()? + 1,
        bottom: changed.iter().map(|(_, v)| *v).max()? + 1,
    };
    let inside = (bounds.top..bounds.bottom).flat_map(|v| (bounds.left..bounds.right).map(move |u| (u, v)));
    let mask = inside.map(|(u, v)| u8::from(differs(u, v))).collect();
    let (before, after) = (view.at(first_u, first_v), photo.at(first_u, first_v));
    Some(ChangeRegion {
        class_before: ClassId(before),
        class_after: ClassId(after),
        bounds,
        mask,
        pixels: changed.len() as u32,
    })
}
