//! VPS matcher on the skyline alone: how well the sky of the photo and the sky of the view cover each other
//! (intersection over union). The baseline of the field, and the shortest plugin to read.
#![forbid(unsafe_code)]

use resurvey_plugin::{Error, ImageRef, Plugin, Scorer, View, schema::ClassId};

resurvey_plugin::export_scorer!(Skyline);

/// The matcher.
pub struct Skyline {
    settings: Settings,
}

/// Its settings, complete.
#[derive(serde::Deserialize)]
pub struct Settings {
    sky_class: u8,
    ignore_foliage: bool,
    foliage_class: u8,
}

impl Plugin for Skyline {
    const NAME: &'static str = "skyline";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Matches the sky of photo and view: intersection over union";
    const SETTINGS: &'static str = include_str!("settings.json");
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Scorer for Skyline {
    fn score(&mut self, photo: ImageRef<'_, u8>, view: &View<'_>) -> Result<f64, Error> {
        let Settings { sky_class, ignore_foliage, foliage_class } = self.settings;
        let hidden = |class: u8| ignore_foliage && class == foliage_class;
        let (mut both, mut either) = (0_u64, 0_u64);
        for v in 0..photo.height() {
            for (&photo, &view) in photo.row(v).iter().zip(view.labels.row(v)) {
                let compared = photo != ClassId::VOID.0 && !hidden(photo) && !hidden(view);
                let (in_photo, in_view) = (photo == sky_class, view == sky_class);
                both += u64::from(compared && in_photo && in_view);
                either += u64::from(compared && (in_photo || in_view));
            }
        }
        // Neither shows sky: they agree.
        Ok(if either == 0 { 1.0 } else { both as f64 / either as f64 })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::toy::trial::Labels;

    const SKY: u8 = 6;
    const FOLIAGE: u8 = 7;
    const VOID: u8 = 255;

    fn score(ignore_foliage: bool, photo: [u8; 6], view: [u8; 6]) -> f64 {
        let mut skyline = Skyline { settings: Settings { sky_class: SKY, ignore_foliage, foliage_class: FOLIAGE } };
        Labels::new(3, &photo).score(&mut skyline, &Labels::new(3, &view)).unwrap()
    }

    #[test]
    fn the_score_is_the_intersection_over_the_union_of_the_skies() {
        // Two pixels in both skies, one in the photo's alone, one in the view's alone.
        let score = score(false, [SKY, SKY, SKY, 0, 0, 0], [SKY, SKY, 0, SKY, 0, 0]);
        assert!((score - 0.5).abs() < 1e-12);
    }

    #[test]
    fn a_view_matches_itself_best() {
        let photo = [SKY, 0, SKY, 0, 1, 2];
        assert!((score(true, photo, photo) - 1.0).abs() < 1e-12);
        assert!(score(true, photo, [SKY, 0, 0, 0, 1, 2]) < 1.0);
    }

    #[test]
    fn void_is_never_compared() {
        let score = score(false, [SKY, VOID, VOID, 0, 0, 0], [SKY, SKY, 0, 0, 0, 0]);
        assert!((score - 1.0).abs() < 1e-12);
    }

    #[test]
    fn foliage_hides_the_sky_unless_told_otherwise() {
        let (photo, view) = ([SKY, FOLIAGE, 0, 0, 0, 0], [SKY, SKY, 0, 0, 0, 0]);
        assert!((score(true, photo, view) - 1.0).abs() < 1e-12);
        assert!((score(false, photo, view) - 0.5).abs() < 1e-12);
    }

    #[test]
    fn two_images_without_sky_agree() {
        assert!((score(true, [0; 6], [0; 6]) - 1.0).abs() < 1e-12);
    }
}
