//! VPS matcher on the classes of pixels: the share of the compared pixels whose class is the same in photo and view.
//! The plainest score there is, and a strong baseline.
#![forbid(unsafe_code)]

use resurvey_plugin::{ClassList, Error, ImageRef, Plugin, Scorer, View, schema::ClassId};

resurvey_plugin::export_scorer!(Pixel);

/// The matcher.
pub struct Pixel {
    settings: Settings,
}

/// Its settings, complete.
#[derive(serde::Deserialize)]
pub struct Settings {
    hidden: ClassList,
}

impl Plugin for Pixel {
    const NAME: &'static str = "pixel";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Matches the classes of photo and view: share of equal pixels";
    const SETTINGS: &'static str = include_str!("settings.json");
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Scorer for Pixel {
    fn score(&mut self, photo: ImageRef<'_, u8>, view: &View<'_>) -> Result<f64, Error> {
        // Only the photo says what is compared, so that a view cannot gain by hiding what does not fit.
        let hidden: [bool; 256] =
            std::array::from_fn(|class| class as u8 == ClassId::VOID.0 || self.settings.hidden.contains(class as u8));
        let (mut equal, mut compared) = (0_u64, 0_u64);
        for v in 0..photo.height() {
            for (&photo, &view) in photo.row(v).iter().zip(view.labels.row(v)) {
                let counts = !hidden[usize::from(photo)] && view != ClassId::VOID.0;
                compared += u64::from(counts);
                equal += u64::from(counts && photo == view);
            }
        }
        if compared == 0 {
            return Err(Error("expected pixels to compare; all of photo or view are void or of a hidden class".into()));
        }
        Ok(equal as f64 / compared as f64)
    }
}

#[cfg(test)]
mod tests;
