//! What stands for plugins in processes where the system has no memory file that nobody can cut.

use super::crashes::CrashLog;
use super::declaration::Declared;
use super::error::{PluginError, Refusal, Stage};
use super::info::Digest;
use super::input::{ComparisonInput, PhotoInput, ViewImages};
use super::isolation::Isolation;
use super::kinds::{MakeView, MatcherForm};
use super::open::Plugin;
use super::services::Services;
use super::settings::{Settings, SettingsSchema};
use crate::image::{LabelImage, RgbImage};
use resurvey_schema::{ChangeRegion, Localization, Proposal};
use std::ffi::OsString;
use std::path::Path;
use std::sync::Arc;

/// The first argument of this program when it is to be the process of a plugin.
pub const SERVE: &str = "serve-plugin";

/// Says that this system cannot.
pub fn serve(_: impl IntoIterator<Item = OsString>) -> u8 {
    1
}

/// Nothing is compared where nothing is started.
#[derive(Clone, Debug)]
pub(super) struct Fingerprint;

impl Fingerprint {
    pub(super) fn of(path: &Path) -> std::io::Result<Self> {
        std::fs::metadata(path).map(|_| Self)
    }
}

/// A program that can never be.
#[derive(Debug)]
pub(super) enum Program {}

impl Program {
    pub(super) fn load(
        (path, _): (&Path, Fingerprint),
        _: Declared,
        _: Digest,
        _: (Arc<Isolation>, Option<CrashLog>),
    ) -> Result<(Self, SettingsSchema), PluginError> {
        let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
        let reason = "plugins run in a process of their own on Linux alone".to_owned();
        let advice = "if you trust a library fully, add --in-process".to_owned();
        Err(Refusal { name, path: Some(path.to_owned()), stage: Stage::File, reason, advice }.into())
    }

    pub(super) fn settings_schema(&self) -> &str {
        match *self {}
    }

    pub(super) fn form(&self) -> MatcherForm {
        match *self {}
    }
}

/// An instance that can never be.
#[derive(Debug)]
pub(super) enum Apart {}

impl Apart {
    pub(super) fn create(_: Plugin, program: Arc<Program>, _: &Settings) -> Result<Self, PluginError> {
        match *program {}
    }

    pub(super) fn plugin(&self) -> &Plugin {
        match *self {}
    }

    pub(super) fn finish(&mut self) -> Result<(), PluginError> {
        match *self {}
    }

    pub(super) fn scores(
        &mut self,
        _: &LabelImage,
        _: usize,
        _: &mut MakeView<'_>,
        _: &dyn Fn() -> bool,
    ) -> Result<Vec<f64>, PluginError> {
        match *self {}
    }

    pub(super) fn search(&mut self, _: &dyn Services, _: &PhotoInput<'_>) -> Result<Localization, PluginError> {
        match *self {}
    }

    pub(super) fn segment(&mut self, _: &dyn Services, _: &RgbImage) -> Result<LabelImage, PluginError> {
        match *self {}
    }

    pub(super) fn detect(
        &mut self,
        _: &dyn Services,
        _: &ComparisonInput<'_>,
    ) -> Result<Vec<ChangeRegion>, PluginError> {
        match *self {}
    }

    pub(super) fn estimate(
        &mut self,
        _: &dyn Services,
        _: &ComparisonInput<'_>,
        _: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, PluginError> {
        match *self {}
    }
}
