//! Calls a plugin as the rest of the program does, with every check of the host.

use super::super::error::PluginError;
use super::super::info::Kind;
use super::super::kinds::{Detector, Estimator, Matcher, MatcherForm};
use super::super::open::Plugin;
use super::super::photo_services::PhotoServices;
use super::super::segmenter::Segmenter;
use super::super::services::Services;
use super::answer::Answer;
use super::exhibit::Exhibit;
use super::placeless::Behind;
use super::report::Report;

/// An instance of whatever kind, whose steps are reported.
pub(super) struct Asked<'a> {
    report: &'a Report,
    instance: Option<Instance>,
}

enum Instance {
    Matcher(Matcher),
    Detector(Detector),
    Estimator(Estimator),
    Segmenter(Segmenter),
}

impl<'a> Asked<'a> {
    /// An instance with the defaults, overruled by `given`.
    pub(super) fn new<'g>(
        plugin: &Plugin,
        given: impl IntoIterator<Item = (&'g str, &'g str)>,
        report: &'a Report,
    ) -> Result<Self, PluginError> {
        let settings = plugin.settings(given)?;
        report.step("in create");
        let instance = match plugin.info().kind {
            Kind::Matcher => Instance::Matcher(plugin.matcher(&settings)?),
            Kind::Detector => Instance::Detector(plugin.detector(&settings)?),
            Kind::Estimator => Instance::Estimator(plugin.estimator(&settings)?),
            Kind::Segmenter => Instance::Segmenter(plugin.segmenter(&settings)?),
        };
        Ok(Self { report, instance: Some(instance) })
    }

    /// What it answers to `exhibit`; that it has no answer is one.
    pub(super) fn ask(&mut self, exhibit: &Exhibit<'_>) -> Result<Answer, PluginError> {
        self.ask_with(exhibit, exhibit.services)
    }

    /// The same with other services.
    pub(super) fn ask_with(&mut self, exhibit: &Exhibit<'_>, services: &dyn Services) -> Result<Answer, PluginError> {
        let Some(instance) = &mut self.instance else { return Ok(Answer::Refused(String::new())) };
        let answer = match instance {
            Instance::Matcher(matcher) if matcher.form() == MatcherForm::Score => {
                self.report.step("in score");
                matcher.score(&exhibit.photo, &exhibit.view.images()).map(Answer::Score)
            }
            Instance::Matcher(matcher) => {
                self.report.step("in search");
                matcher.search(services, &exhibit.photo()).map(|found| Answer::Pose(Box::new(found)))
            }
            Instance::Detector(detector) => {
                self.report.step("in detect");
                detector.detect(services, &exhibit.comparison()).map(Answer::Regions)
            }
            Instance::Estimator(estimator) => {
                self.report.step("in estimate");
                estimator.estimate(services, &exhibit.comparison(), &exhibit.regions).map(Answer::Proposals)
            }
            Instance::Segmenter(segmenter) => {
                self.report.step("in segment");
                let listener = Behind(services);
                let services = PhotoServices::new(services.classes(), &listener);
                segmenter.segment(&services, &exhibit.picture()).map(Answer::Labels)
            }
        };
        match answer {
            Err(PluginError::Failed { text, .. }) => Ok(Answer::Refused(text)),
            other => other,
        }
    }
}

impl Drop for Asked<'_> {
    fn drop(&mut self) {
        self.report.step("in destroy");
        drop(self.instance.take());
        self.report.step("after destroy");
    }
}

/// Whether a plugin is a matcher in `score` form.
pub(super) fn is_scorer(plugin: &Plugin) -> bool {
    plugin.info().kind == Kind::Matcher && plugin.code().form() == MatcherForm::Score
}
