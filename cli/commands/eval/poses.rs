//! The poses of one matcher on the photos of one case: each photo is localized once for each state of the map.

use super::progress::Portion;
use crate::commands::crs_of;
use crate::commands::update::Work;
use crate::failure::Failure;
use crate::matching::MatchingTool;
use crate::tools::Choices;
use resurvey_core::capture::Capture;
use resurvey_core::localize::{Located, SceneServices, localize};
use resurvey_core::store::MapFile;
use resurvey_core::update::Change;
use resurvey_schema::Localization;

/// Which photo of a case.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Photo {
    /// The capture itself.
    First,
    /// The one in `second`.
    Second,
}

/// What one matcher answered to the photos of one case.
pub struct Poses<'a> {
    matcher: Option<&'a MatchingTool>,
    choices: &'a Choices,
    portion: &'a Portion<'a>,
    known: Vec<Known>,
}

/// An answer, and all that it depends on: the photo, and what had been changed on the case's map.
struct Known {
    photo: Photo,
    changed: Vec<Change>,
    answer: Result<Located, String>,
}

impl<'a> Poses<'a> {
    /// None yet.
    pub fn new(matcher: Option<&'a MatchingTool>, choices: &'a Choices, portion: &'a Portion<'a>) -> Self {
        Self { matcher, choices, portion, known: Vec::new() }
    }

    /// The pose of `photo`, which is that of `work`, on `map`, whose state is that of the case with `changed`.
    pub fn of(&mut self, photo: Photo, changed: &[Change], map: &MapFile, work: &Work) -> Result<Located, String> {
        let is_same = |known: &&Known| known.photo == photo && known.changed == changed;
        if let Some(known) = self.known.iter().find(is_same) {
            return known.answer.clone();
        }
        let answer = self.locate(map, work).map_err(|failure| failure.to_string());
        self.known.push(Known { photo, changed: changed.to_vec(), answer: answer.clone() });
        answer
    }

    fn locate(&self, map: &MapFile, work: &Work) -> Result<Located, Failure> {
        let Choices { gate, search, .. } = self.choices;
        let Some(tool) = self.matcher else { return Ok(Located::new(as_answer(&work.capture), gate)) };
        // A new instance each time: what one capture did to it is nothing to the next.
        let mut matcher = tool.matching()?;
        let services = SceneServices::new(&work.world, &work.capture, crs_of(map)?, self.portion);
        Ok(localize(&mut matcher, &services, gate, search)?)
    }
}

/// The phone's pose as an answer, as sure as the phone says.
fn as_answer(capture: &Capture) -> Localization {
    let prior = &capture.prior;
    let position_m2 = prior.position_sigma_m.powi(2);
    Localization {
        pose: prior.pose,
        score: 1.0,
        covariance: [[position_m2, 0.0, 0.0], [0.0, position_m2, 0.0], [0.0, 0.0, prior.yaw_sigma_rad.powi(2)]],
        alignment: None,
        runner_up: None,
        candidates: 1,
        skipped: 0,
        heat: Vec::new(),
    }
}
