//! A matcher: how well does one view of the map fit the photo? The host makes the candidate poses, renders and searches.
#![forbid(unsafe_code)]

use resurvey_plugin::{Error, ImageRef, Plugin, Scorer, View};

resurvey_plugin::export_scorer!(MyMatcher);

/// Share of the pixels whose class is the same in photo and view. Its fields are the settings, which the host checks and
/// completes from [`Plugin::SETTINGS`].
#[derive(serde::Deserialize)]
pub struct MyMatcher {
    void: u8,
}

impl Plugin for MyMatcher {
    const NAME: &'static str = "my-plugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Share of the pixels whose class is the same in photo and view";
    const SETTINGS: &'static str = r#"{"type": "object", "additionalProperties": false, "properties": {
        "void": {"type": "integer", "default": 255, "minimum": 0, "maximum": 255,
                 "description": "class of the photo that is not compared"}}}"#;
    type Settings = Self;

    fn create(settings: Self) -> Result<Self, Error> {
        Ok(settings)
    }
}

impl Scorer for MyMatcher {
    /// From 0 to 1, higher is better; photo and view have one size.
    fn score(&mut self, photo: ImageRef<'_, u8>, view: &View<'_>) -> Result<f64, Error> {
        let pixels = photo.rows().zip(view.labels.rows()).flat_map(|(photo, view)| photo.iter().zip(view));
        let compared = pixels.filter(|(photo, _)| **photo != self.void);
        match compared.fold((0, 0), |(same, all), (photo, view)| (same + u32::from(photo == view), all + 1)) {
            (_, 0) => Err("expected labels in the photo, found only void".into()),
            (same, all) => Ok(f64::from(same) / f64::from(all)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::toy::create;
    use resurvey_plugin::toy::trial::{Labels, OFF, best_candidate};

    /// Of this score alone: another has other numbers.
    #[test]
    fn the_score_is_the_share_of_equal_pixels() {
        let (photo, view) = (Labels::new(3, &[0, 0, 1, 255, 6, 6]), Labels::new(3, &[0, 1, 1, 1, 6, 6]));
        let mut matcher: MyMatcher = create("{}").unwrap();
        assert_eq!(photo.score(&mut matcher, &view), Ok(4.0 / 5.0));
    }

    #[test]
    fn the_camera_is_found_on_the_toy_street_corner() {
        let mut matcher: MyMatcher = create("{}").unwrap();
        assert_eq!(best_candidate(&mut matcher), Ok(OFF));
    }

    #[test]
    fn a_photo_without_labels_has_no_answer() {
        let mut matcher: MyMatcher = create("{}").unwrap();
        assert!(Labels::new(3, &[255; 6]).score(&mut matcher, &Labels::new(3, &[0; 6])).is_err());
    }
}
