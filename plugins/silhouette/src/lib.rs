//! VPS matcher on the silhouette of buildings: what is building and what is not, as intersection over union
//! (Jaccard 1901), the way maps without materials are matched.
#![forbid(unsafe_code)]

use resurvey_plugin::{ClassList, Error, ImageRef, Plugin, Scorer, View, schema::ClassId};

resurvey_plugin::export_scorer!(Silhouette);

/// The matcher.
pub struct Silhouette {
    settings: Settings,
}

/// Its settings, complete.
#[derive(serde::Deserialize)]
pub struct Settings {
    building: ClassList,
    hidden: ClassList,
}

impl Plugin for Silhouette {
    const NAME: &'static str = "silhouette";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Matches buildings against the rest: intersection over union";
    const SETTINGS: &'static str = include_str!("settings.json");
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Scorer for Silhouette {
    fn score(&mut self, photo: ImageRef<'_, u8>, view: &View<'_>) -> Result<f64, Error> {
        let Settings { building, hidden } = self.settings;
        let (mut both, mut either) = (0_u64, 0_u64);
        for v in 0..photo.height() {
            for (&photo, &view) in photo.row(v).iter().zip(view.labels.row(v)) {
                // Only the photo says what is compared, so that a view cannot gain by hiding what does not fit.
                let compared = photo != ClassId::VOID.0 && view != ClassId::VOID.0 && !hidden.contains(photo);
                let (in_photo, in_view) = (building.contains(photo), building.contains(view));
                both += u64::from(compared && in_photo && in_view);
                either += u64::from(compared && (in_photo || in_view));
            }
        }
        // Neither shows a building: they agree.
        Ok(if either == 0 { 1.0 } else { both as f64 / either as f64 })
    }
}

#[cfg(test)]
mod tests;
