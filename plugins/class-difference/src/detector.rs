//! The detector: from photo and view to regions.

use crate::judge::{Judge, Sight, different};
use crate::pairs::pair_regions;
use crate::raster::Rasters;
use crate::settings::{Profile, SCHEMA, Settings};
use crate::tolerance::Tolerance;
use resurvey_plugin::schema::ChangeRegion;
use resurvey_plugin::{Comparison, Detector, Error, Host, Plugin};

/// Detects changes as differences of class between photo and view.
pub struct ClassDifference {
    settings: Settings,
}

impl Plugin for ClassDifference {
    const NAME: &'static str = "class-difference";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "regions in which the photo has another class than the map, beyond the pose error";
    const SETTINGS: &'static str = SCHEMA;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Detector for ClassDifference {
    fn detect(&mut self, host: &dyn Host, comparison: &Comparison<'_>) -> Result<Vec<ChangeRegion>, Error> {
        let rasters = Rasters::new(comparison)?;
        match self.settings.profile {
            Profile::Paper => Ok(pair_regions(&rasters, host.classes())),
            Profile::Default => {
                let settings = &self.settings.for_photo(&comparison.estimate);
                let tolerance = &Tolerance::new(comparison, settings);
                let tolerance_px = &tolerance.per_pixel(&rasters);
                let judge = Judge { host, comparison, settings, rasters: &rasters, tolerance, tolerance_px };
                judge.regions(Sight::new(&rasters, tolerance_px, &different(&rasters, host.classes())))
            }
        }
    }
}
