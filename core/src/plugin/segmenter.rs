//! Segmenters (Lee & Hsu, §3.3) as the rest of core calls them: a photo in, a class per pixel out.
#![allow(unsafe_code)]

use super::error::PluginError;
use super::info::PluginInfo;
use super::kinds::Body;
use super::open::Plugin;
use super::services::Services;
use super::settings::Settings;
use super::{lend, line};
use crate::image::{LabelImage, RgbImage};
use resurvey_schema::abi::{self, Growing};

/// An instance of a segmenter.
#[derive(Debug)]
pub struct Segmenter(Body);

impl Segmenter {
    pub(super) fn create(plugin: Plugin, settings: &Settings) -> Result<Self, PluginError> {
        Body::create(plugin, settings).map(Self)
    }

    /// Which plugin it is.
    pub fn info(&self) -> &PluginInfo {
        self.0.plugin().info()
    }

    /// The class of each pixel of `photo`, all of them classes of the map or void.
    pub fn segment(&mut self, services: &dyn Services, photo: &RgbImage) -> Result<LabelImage, PluginError> {
        match &mut self.0 {
            Body::Here(instance) => {
                let picture = abi::Picture { pixels: lend::image(photo), ..abi::Picture::new() };
                // SAFETY: the photo is borrowed for longer than the call.
                unsafe { line::segment(instance, services, &picture) }
            }
            Body::Apart(instance) => instance.segment(services, photo),
        }
    }

    /// As [`Matcher::finish`](super::Matcher::finish).
    pub fn finish(&mut self) -> Result<(), PluginError> {
        self.0.finish()
    }
}
