//! Matchers, detectors and estimators as the rest of core calls them. Every answer is checked before it is given on.
#![allow(unsafe_code)]

use super::check;
use super::error::PluginError;
use super::info::PluginInfo;
use super::input::{ComparisonInput, PhotoInput, ViewImages};
use super::instance::Instance;
use super::lend::{self, LentComparison};
use super::line;
use super::open::{Code, Plugin};
use super::process::Apart;
use super::services::Services;
use super::settings::Settings;
use crate::image::LabelImage;
use resurvey_schema::abi::{self, Growing};
use resurvey_schema::{ChangeRegion, Localization, Proposal};

/// Hands the view of this index to its second argument.
pub type MakeView<'a> = dyn FnMut(usize, &mut dyn FnMut(&ViewImages<'_>)) + 'a;

/// Who drives the search.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MatcherForm {
    /// The host makes candidates and renders; the plugin scores one view.
    Score,
    /// The plugin, through the host's services.
    Search,
}

/// An instance, in this process or another.
#[derive(Debug)]
pub(super) enum Body {
    Here(Box<Instance>),
    Apart(Box<Apart>),
}

impl Body {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        match plugin.code().clone() {
            Code::Here(table) => Ok(Self::Here(Box::new(Instance::create(plugin, table, settings)?))),
            Code::Apart(program) => Ok(Self::Apart(Box::new(Apart::create(plugin, program, settings)?))),
        }
    }

    pub(super) fn plugin(&self) -> &Plugin {
        match self {
            Self::Here(instance) => instance.plugin(),
            Self::Apart(instance) => instance.plugin(),
        }
    }

    pub(super) fn finish(&mut self) -> Result<(), PluginError> {
        match self {
            Self::Here(_) => Ok(()),
            Self::Apart(instance) => instance.finish(),
        }
    }

    fn not_called<T>(&self, text: String) -> Result<T, PluginError> {
        Err(PluginError::InvalidInput { plugin: self.plugin().info().name.clone(), text })
    }
}

/// An instance of a matcher. For parallel work, make several.
#[derive(Debug)]
pub struct Matcher(Body);

impl Matcher {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        Body::create(plugin, settings).map(Self)
    }

    /// Which plugin it is.
    pub fn info(&self) -> &PluginInfo {
        self.0.plugin().info()
    }

    /// Which of the two calls it takes; a plugin with both is a search.
    pub fn form(&self) -> MatcherForm {
        self.0.plugin().code().form()
    }

    /// Similarity of photo and view, 0–1; both have one size.
    pub fn score(&mut self, photo: &LabelImage, view: &ViewImages<'_>) -> Result<f64, PluginError> {
        if let Some(text) = lend::view_conflict((photo.width(), photo.height()), view) {
            return self.0.not_called(text);
        }
        match &mut self.0 {
            // SAFETY: photo and view are borrowed for longer than the call.
            Body::Here(instance) => unsafe { line::score(instance, &lend::image(photo), &lend::view(view)) },
            Body::Apart(instance) => Ok(instance.scores(photo, 1, &mut |_, take| take(view), &|| false)?[0]),
        }
    }

    /// Similarity of photo and `count` views, in order. `view` hands view `index` to its second argument; a plugin in
    /// another process scores one batch of them while the next is made. Once `cancelled` says so, it ends with an error.
    pub fn score_each(
        &mut self,
        photo: &LabelImage,
        count: usize,
        view: &mut MakeView<'_>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<f64>, PluginError> {
        if let Body::Apart(instance) = &mut self.0 {
            return instance.scores(photo, count, view, cancelled);
        }
        let mut scores = Vec::with_capacity(count);
        for index in 0..count {
            if cancelled() {
                return Err(PluginError::Cancelled { plugin: self.info().name.clone(), call: "score" });
            }
            let mut score = Ok(f64::NAN);
            view(index, &mut |view| score = self.score(photo, view));
            scores.push(score?);
        }
        Ok(scores)
    }

    /// The pose of `photo`.
    pub fn search(&mut self, services: &dyn Services, photo: &PhotoInput<'_>) -> Result<Localization, PluginError> {
        let (labels, camera) = (photo.labels, photo.camera);
        if (labels.width(), labels.height()) != (camera.width, camera.height) {
            let (w, h) = (labels.width(), labels.height());
            return self.0.not_called(format!("photo is {w}×{h}, its camera {}×{}", camera.width, camera.height));
        }
        let instance = match &mut self.0 {
            Body::Here(instance) => instance,
            Body::Apart(instance) => return instance.search(services, photo),
        };
        let (camera, prior) = (lend::camera(camera), lend::prior(photo.prior));
        let photo = abi::Photo {
            labels: lend::image(labels),
            camera: &raw const camera,
            prior: &raw const prior,
            ..abi::Photo::new()
        };
        // SAFETY: what the photo points to lives in this function, or is borrowed for longer.
        unsafe { line::search(instance, services, &photo) }
    }

    /// Ends the instance and says how that went; the next call makes it anew. A linked-in plugin is left as it is.
    pub fn finish(&mut self) -> Result<(), PluginError> {
        self.0.finish()
    }
}

/// An instance of a change detector.
#[derive(Debug)]
pub struct Detector(Body);

impl Detector {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        Body::create(plugin, settings).map(Self)
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
        if let Some(text) = lend::size_conflict(input) {
            return self.0.not_called(text);
        }
        let instance = match &mut self.0 {
            Body::Here(instance) => instance,
            Body::Apart(instance) => return instance.detect(services, input),
        };
        let lent = LentComparison::new(input);
        // SAFETY: what the comparison points to lives in this function, or is borrowed for longer.
        unsafe { line::detect(instance, services, &lent.record()) }
    }

    /// As [`Matcher::finish`].
    pub fn finish(&mut self) -> Result<(), PluginError> {
        self.0.finish()
    }
}

/// An instance of a descriptor estimator.
#[derive(Debug)]
pub struct Estimator(Body);

impl Estimator {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        Body::create(plugin, settings).map(Self)
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
        if let Some(text) = lend::size_conflict(input) {
            return self.0.not_called(text);
        }
        let proposals = match &mut self.0 {
            Body::Here(instance) => {
                let lent = LentComparison::new(input);
                let records: Vec<_> = regions.iter().map(lend::region).collect();
                // SAFETY: what comparison and records point to lives in this block, or is borrowed for longer.
                unsafe { line::estimate(instance, services, &lent.record(), &records) }?
            }
            Body::Apart(instance) => instance.estimate(services, input, regions)?,
        };
        check::in_sight(&proposals, input.estimate.pose.position).map_err(
            |check::Violation { field, value, expected }| PluginError::InvalidOutput {
                plugin: self.info().name.clone(),
                call: "estimate",
                field,
                value,
                expected,
            },
        )?;
        Ok(proposals)
    }

    /// As [`Matcher::finish`].
    pub fn finish(&mut self) -> Result<(), PluginError> {
        self.0.finish()
    }
}
