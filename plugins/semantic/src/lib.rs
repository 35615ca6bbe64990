//! VPS matcher on semantic labels (Lee & Hsu, §3.4): every position and heading around the prior is compared on
//! panoramas, the best modes are refined on perspective views, the best of these is aligned by its contours, and what
//! stays between the contours of photo and map says how sure it is.
#![forbid(unsafe_code)]

mod align;
mod candidates;
mod doubt;
mod edges;
mod likeness;
mod mixed;
mod mode;
mod parts;
mod refine;
mod settings;

use align::Alignment;
use candidates::Sweep;
use likeness::{Compared, Likeness};
use refine::Objective;
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
        let settings = &self.settings;
        let compared = Compared::new(host.classes(), settings);
        let likeness = Likeness::new(settings);
        let sweep = Sweep { host, photo, settings, compared: &compared, likeness: &likeness };
        let coarse = sweep.run()?;
        let mut modes = candidates::modes(&coarse, settings);
        if modes.is_empty() {
            let (skipped, radius_m) = (coarse.skipped, sweep.radius_m());
            return Err(Error(format!(
                "no candidate within {radius_m} m of the prior: {skipped} lie inside buildings; check the prior's position"
            )));
        }
        let objective = Objective { host, photo, settings, compared: &compared, likeness };
        let alignment = Alignment { host, photo, compared: &compared, use_prior: settings.use_prior };
        let (best, aligned) = if settings.refine {
            objective.refine(&mut modes)?;
            alignment.best_of(&objective, &mut modes)?
        } else {
            (objective.rescore(&mut modes, &sweep)?, None)
        };
        let aligned = aligned.map(doubt::with_floors);
        let covariance = match &aligned {
            Some(aligned) => doubt::in_plan(aligned),
            None => objective.covariance(&best)?,
        };
        let searched_m = sweep.radius_m().max(settings.spacing_m);
        let (covariance, aligned) = if best.pose.position.plan_distance_m(&photo.prior.pose.position) > searched_m {
            // It climbed out of the searched circle: what else lies outside was never compared.
            (doubt::unbounded(covariance, searched_m), None)
        } else {
            (covariance, aligned)
        };
        Ok(Localization {
            pose: best.pose,
            score: best.score.clamp(0.0, 1.0),
            covariance,
            alignment: aligned,
            runner_up: doubt::runner_up(&modes, settings),
            candidates: coarse.scored,
            skipped: coarse.skipped,
            heat: coarse.heat,
        })
    }
}
