//! What a plugin answered, of whatever kind, so that two answers can be held against each other.

use crate::image::LabelImage;
use resurvey_schema::{ChangeRegion, ClassId, Localization, Proposal};

/// An answer that the host would take.
#[derive(Clone, Debug, PartialEq)]
pub(super) enum Answer {
    /// Of a matcher in `score` form.
    Score(f64),
    /// Of one in `search` form.
    Pose(Box<Localization>),
    /// Of a detector.
    Regions(Vec<ChangeRegion>),
    /// Of an estimator.
    Proposals(Vec<Proposal>),
    /// Of a segmenter.
    Labels(LabelImage),
    /// None, and the plugin's reason.
    Refused(String),
}

impl Answer {
    /// A few words.
    pub(super) fn words(&self) -> String {
        match self {
            Self::Score(score) => format!("score {score}"),
            Self::Pose(found) => {
                let at = found.pose.position;
                let yaw_deg = found.pose.yaw_rad.to_degrees();
                let (east, north, height) = (at.easting_m, at.northing_m, at.height_m);
                format!("E {east:.3} N {north:.3} H {height:.3}, heading {yaw_deg:.3}°, score {}", found.score)
            }
            Self::Regions(regions) => {
                let pixels: u64 = regions.iter().map(|region| u64::from(region.pixels)).sum();
                format!("{} regions of {pixels} px", regions.len())
            }
            Self::Proposals(proposals) => {
                let count = |wanted: fn(&Proposal) -> bool| proposals.iter().filter(|one| wanted(one)).count();
                let places = count(|one| matches!(one, Proposal::Place { .. }));
                let removals = count(|one| matches!(one, Proposal::Remove { .. }));
                format!("{places} to place, {removals} to remove, {} rejected", proposals.len() - places - removals)
            }
            Self::Labels(labels) => {
                let mut is_used = [false; 256];
                labels.values().iter().for_each(|label| is_used[usize::from(*label)] = true);
                let void = labels.values().iter().filter(|label| **label == ClassId::VOID.0).count();
                let classes = is_used[..usize::from(ClassId::VOID.0)].iter().filter(|is_used| **is_used).count();
                format!("{classes} classes, {void} of {} px void", labels.values().len())
            }
            Self::Refused(reason) => format!("no answer: {reason}"),
        }
    }

    /// How `other` differs; `None` when the two are the same.
    pub(super) fn difference(&self, other: &Self) -> Option<String> {
        if self == other {
            return None;
        }
        let (one, two) = (self.words(), other.words());
        Some(if one == two { format!("{one}, but with other details") } else { format!("{one} became {two}") })
    }
}
