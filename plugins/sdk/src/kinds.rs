//! The kinds of plugin, one trait each.

use crate::host::Host;
use crate::image::{Comparison, ImageRef, View};
use resurvey_schema::service::Prior;
use resurvey_schema::{ChangeRegion, Intrinsics, Localization, Proposal};
use serde::de::DeserializeOwned;

/// Why a plugin could not answer; the text says what was expected and what was found. `"…".into()` and `?` on a `Result`
/// with a text make one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Error(pub String);

impl std::fmt::Display for Error {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(&self.0)
    }
}

impl std::error::Error for Error {}

impl From<String> for Error {
    fn from(text: String) -> Self {
        Self(text)
    }
}

impl From<&str> for Error {
    fn from(text: &str) -> Self {
        Self(text.to_owned())
    }
}

/// What every plugin has. `NAME` is lower case with dashes; `SETTINGS` is a flat JSON schema whose `default`s the host
/// fills in, so that `Settings` is always complete.
pub trait Plugin: Send + Sized + 'static {
    /// Name on the command line.
    const NAME: &'static str;
    /// Version of the plugin.
    const VERSION: &'static str;
    /// One sentence for `plugins list`.
    const SUMMARY: &'static str;
    /// JSON schema of the settings.
    const SETTINGS: &'static str;
    /// The settings, checked and completed by the host.
    type Settings: DeserializeOwned;

    /// An instance; never called from two threads at once.
    fn create(settings: Self::Settings) -> Result<Self, Error>;
}

/// A labelled photo and its prior.
#[derive(Clone, Copy, Debug)]
pub struct Photo<'a> {
    /// Class per pixel; 255 is void.
    pub labels: ImageRef<'a, u8>,
    /// The camera.
    pub camera: Intrinsics,
    /// The rough pose.
    pub prior: Prior,
}

/// A matcher in `score` form: the host makes candidates, renders and searches; the plugin scores one view.
pub trait Scorer: Plugin {
    /// Similarity of photo and view, 0–1, higher is better; both have the same size.
    fn score(&mut self, photo: ImageRef<'_, u8>, view: &View<'_>) -> Result<f64, Error>;
}

/// A matcher in `search` form: the plugin drives its own search through the host's services.
pub trait Searcher: Plugin {
    /// The pose of the photo; an error when there is no answer.
    fn search(&mut self, host: &dyn Host, photo: &Photo<'_>) -> Result<Localization, Error>;
}

/// A change detector.
pub trait Detector: Plugin {
    /// Regions in which photo and view differ.
    fn detect(&mut self, host: &dyn Host, comparison: &Comparison<'_>) -> Result<Vec<ChangeRegion>, Error>;
}

/// A descriptor estimator.
pub trait Estimator: Plugin {
    /// What each region means for the map. Several proposals for one region are allowed (two chairs that touch).
    fn estimate(
        &mut self,
        host: &dyn Host,
        comparison: &Comparison<'_>,
        regions: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, Error>;
}

/// A segmenter.
pub trait Segmenter: Plugin {
    /// The class of each pixel of `photo` (red, green, blue; sRGB), row by row without padding: an index of
    /// `host.classes()`, or 255 where it is none of them. Of the host, only the class table, `parallel_for`, `log`,
    /// `progress` and `cancelled` are there: nobody knows yet where the photo was taken.
    fn segment(&mut self, host: &dyn Host, photo: ImageRef<'_, [u8; 3]>) -> Result<Vec<u8>, Error>;
}
