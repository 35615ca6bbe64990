//! VPS matcher on semantic labels (Lee & Hsu, §3.4): every position and heading around the prior is compared on
//! panoramas, the best modes are refined on perspective views, and the spread of the likelihood says how sure it is.
#![forbid(unsafe_code)]

mod candidates;
mod doubt;
mod likeness;
mod mode;
mod refine;
mod settings;

use likeness::{Compared, Likeness};
use resurvey_plugin::schema::Localization;
use resurvey_plugin::{Error, Host, Photo, Plugin, Searcher};
pub use settings::Settings;

resurvey_plugin::export_searcher!(Semantic);

/// The matcher.
pub struct Semantic {
    settings: Settings,
}

impl Plugin for Semantic {
    const NAME: &'static str = "semantic";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Dice, Jaccard and boundary F1 of the class labels, coarse to fine";
    const SETTINGS: &'static str = include_str!("settings.schema.json");
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings: settings.resolved() })
    }
}

impl Searcher for Semantic {
    fn search(&mut self, host: &dyn Host, photo: &Photo<'_>) -> Result<Localization, Error> {
        let compared = Compared::new(host.classes(), &self.settings);
        let likeness = Likeness::new(&self.settings);
        let coarse = candidates::sweep(host, photo, &self.settings, &compared, &likeness)?;
        let mut modes = candidates::distinct_modes(&coarse, &self.settings);
        if modes.is_empty() {
            let (skipped, radius_m) = (coarse.skipped, self.settings.radius_m);
            return Err(Error(format!(
                "no candidate within {radius_m} m of the prior: {skipped} lie inside buildings; check the prior's position"
            )));
        }
        let objective = refine::Objective { host, photo, settings: &self.settings, compared: &compared, likeness };
        let refined =
            if self.settings.refine { objective.refine(&mut modes)? } else { objective.rescore(&mut modes)? };
        let covariance = objective.covariance(&refined)?;
        let best = &modes[0];
        Ok(Localization {
            pose: best.pose,
            score: best.score.clamp(0.0, 1.0),
            covariance,
            runner_up: doubt::runner_up(&modes, &self.settings),
            candidates: coarse.scored,
            skipped: coarse.skipped,
            heat: coarse.heat,
        })
    }
}
