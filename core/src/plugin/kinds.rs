//! Matchers, detectors and estimators as the rest of core calls them. Every answer is checked before it is given on.
#![allow(unsafe_code)]

use super::check::{self, Rules};
use super::error::PluginError;
use super::info::PluginInfo;
use super::input::{ComparisonInput, PhotoInput, ViewImages};
use super::instance::Instance;
use super::lend;
use super::open::Plugin;
use super::results::{self, Collected, Collector};
use super::service_table::ServiceTable;
use super::services::Services;
use super::settings::Settings;
use crate::image::LabelImage;
use resurvey_schema::abi::{self, Growing, STATUS_UNSUPPORTED, Status};
use resurvey_schema::{ChangeRegion, Localization, Proposal};

/// Who drives the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatcherForm {
    /// The host makes candidates and renders; the plugin scores one view.
    Score,
    /// The plugin, through the host's services.
    Search,
}

/// An instance of a matcher. For parallel work, make several.
#[derive(Debug)]
pub struct Matcher(Instance);

impl Matcher {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        Instance::create(plugin, settings).map(Self)
    }

    /// Which plugin it is.
    pub fn info(&self) -> &PluginInfo {
        self.0.plugin().info()
    }

    /// Which of the two calls it takes; a plugin with both is a search.
    pub fn form(&self) -> MatcherForm {
        if self.0.plugin().table().search.is_some() { MatcherForm::Search } else { MatcherForm::Score }
    }

    /// Similarity of photo and view, 0–1; both have one size.
    pub fn score(&mut self, photo: &LabelImage, view: &ViewImages<'_>) -> Result<f64, PluginError> {
        if let Some(text) = lend::view_conflict((photo.width(), photo.height()), view) {
            return Err(PluginError::InvalidInput { plugin: self.0.name(), text });
        }
        let (photo, view) = (lend::image(photo), lend::view(view));
        let mut score = f64::NAN;
        self.0.call(
            "score",
            || false,
            |table, instance, error| match table.score {
                // SAFETY: a function of the plugin's own table; instance, image, view, score and error live until it
                // returns, and `call` holds the instance alone.
                Some(function) => unsafe {
                    function(instance, &raw const photo, &raw const view, &raw mut score, error)
                },
                None => STATUS_UNSUPPORTED,
            },
        )?;
        check::ratio("score", score).map_err(|violation| self.0.invalid("score", violation))?;
        Ok(score)
    }

    /// The pose of `photo`.
    pub fn search(&mut self, services: &dyn Services, photo: &PhotoInput<'_>) -> Result<Localization, PluginError> {
        let (labels, camera) = (photo.labels, photo.camera);
        if (labels.width(), labels.height()) != (camera.width, camera.height) {
            let (w, h) = (labels.width(), labels.height());
            let text = format!("photo is {w}×{h}, its camera {}×{}", camera.width, camera.height);
            return Err(PluginError::InvalidInput { plugin: self.0.name(), text });
        }
        let rules = Rules { classes: services.classes(), width: camera.width, height: camera.height, regions: 0 };
        let (camera, prior) = (lend::camera(camera), lend::prior(photo.prior));
        let photo = abi::Photo {
            labels: lend::image(labels),
            camera: &raw const camera,
            prior: &raw const prior,
            ..abi::Photo::new()
        };
        let mut found = abi::Localization::new();
        let collected = collect(&mut self.0, "search", services, rules, |table, instance, context, error| {
            match table.search {
                // SAFETY: as in `score`.
                Some(function) => unsafe {
                    function(instance, context.services, &raw const photo, context.results, &raw mut found, error)
                },
                None => STATUS_UNSUPPORTED,
            }
        })?;
        let found = results::localization(&found, collected.heat);
        check::localization(&found).map_err(|violation| self.0.invalid("search", violation))?;
        Ok(found)
    }
}

/// An instance of a change detector.
#[derive(Debug)]
pub struct Detector(Instance);

impl Detector {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        Instance::create(plugin, settings).map(Self)
    }

    /// Which plugin it is.
    pub fn info(&self) -> &PluginInfo {
        self.0.plugin().info()
    }

    /// Regions in which photo and view differ, in the plugin's order.
    pub fn detect(
        &mut self,
        services: &dyn Services,
        input: &ComparisonInput<'_>,
    ) -> Result<Vec<ChangeRegion>, PluginError> {
        let lent = Lent::new(&self.0, input)?;
        let comparison = lent.comparison(input);
        let rules = rules(services, input, 0);
        let collected = collect(&mut self.0, "detect", services, rules, |table, instance, context, error| {
            match table.detect {
                // SAFETY: as in `Matcher::score`.
                Some(function) => unsafe {
                    function(instance, context.services, &raw const comparison, context.results, error)
                },
                None => STATUS_UNSUPPORTED,
            }
        })?;
        Ok(collected.regions)
    }
}

/// An instance of a descriptor estimator.
#[derive(Debug)]
pub struct Estimator(Instance);

impl Estimator {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        Instance::create(plugin, settings).map(Self)
    }

    /// Which plugin it is.
    pub fn info(&self) -> &PluginInfo {
        self.0.plugin().info()
    }

    /// What each region means for the map, in the plugin's order.
    pub fn estimate(
        &mut self,
        services: &dyn Services,
        input: &ComparisonInput<'_>,
        regions: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, PluginError> {
        let lent = Lent::new(&self.0, input)?;
        let comparison = lent.comparison(input);
        let records: Vec<_> = regions.iter().map(lend::region).collect();
        let rules = rules(services, input, regions.len());
        let collected = collect(&mut self.0, "estimate", services, rules, |table, instance, context, error| {
            match table.estimate {
                // SAFETY: as in `Matcher::score`; the regions and their masks live until it returns.
                Some(function) => unsafe {
                    function(
                        instance,
                        context.services,
                        &raw const comparison,
                        records.as_ptr(),
                        records.len(),
                        size_of::<abi::Region>(),
                        context.results,
                        error,
                    )
                },
                None => STATUS_UNSUPPORTED,
            }
        })?;
        Ok(collected.proposals)
    }
}

/// What a comparison points to.
struct Lent {
    view: abi::View,
    camera: abi::Camera,
    estimate: abi::PoseEstimate,
}

impl Lent {
    fn new(instance: &Instance, input: &ComparisonInput<'_>) -> Result<Self, PluginError> {
        if let Some(text) = lend::size_conflict(input) {
            return Err(PluginError::InvalidInput { plugin: instance.name(), text });
        }
        Ok(Self {
            view: lend::view(&input.view),
            camera: lend::camera(input.camera),
            estimate: lend::estimate(input.estimate),
        })
    }

    fn comparison(&self, input: &ComparisonInput<'_>) -> abi::Comparison {
        abi::Comparison {
            photo: lend::image(input.photo),
            view: &raw const self.view,
            camera: &raw const self.camera,
            estimate: &raw const self.estimate,
            ..abi::Comparison::new()
        }
    }
}

fn rules<'a>(services: &'a dyn Services, input: &ComparisonInput<'_>, regions: usize) -> Rules<'a> {
    Rules { classes: services.classes(), width: input.photo.width(), height: input.photo.height(), regions }
}

/// What the host lends to a call beside its input.
struct Context {
    services: *const abi::Services,
    results: *const abi::Results,
}

/// Runs a call that delivers results; a violation comes before whatever the plugin itself says.
fn collect(
    instance: &mut Instance,
    call: &'static str,
    services: &dyn Services,
    rules: Rules<'_>,
    body: impl FnOnce(&abi::Table, *mut abi::Instance, &Context, *mut abi::ErrorText) -> Status,
) -> Result<Collected, PluginError> {
    let (collector, table) = (Collector::new(rules), ServiceTable::new(services));
    let (results, service_table) = (collector.results(), table.table());
    let context = Context { services: &raw const service_table, results: &raw const results };
    let outcome =
        instance.call(call, || services.cancelled(), |table, pointer, error| body(table, pointer, &context, error));
    let mut collected = collector.finish();
    if let Some(violation) = collected.violation.take() {
        return Err(instance.invalid(call, violation));
    }
    outcome.map(|()| collected)
}
