//! The labels of a photo, made by the segmenter that the command line names.

use crate::args::{LabelsFrom, PriorFrom};
use crate::console::Console;
use crate::failure::Failure;
use crate::tools::{self, Choices};
use resurvey_core::capture::{CapturePhoto, LabelledPhoto};
use resurvey_core::plugin::{PhotoServices, Registry, Segmenter};
use resurvey_core::version::PluginUse;
use resurvey_schema::ClassTable;
use std::path::{Path, PathBuf};

/// A segmenter and the photo that it is for.
pub struct Segmenting {
    segmenter: Segmenter,
    photo: PathBuf,
    /// How the evidence records it.
    pub used: PluginUse,
}

impl Segmenting {
    /// What `labels` asks for; `None` where the capture has its own labels.
    pub fn load(
        labels: &LabelsFrom,
        prior: &PriorFrom,
        registry: &Registry,
        choices: &Choices,
    ) -> Result<Option<Self>, Failure> {
        let (Some(name), Some(photo)) = (&labels.segmenter, &prior.photo) else { return Ok(None) };
        let tool = choices.tool(&tools::load(registry, name)?)?;
        let segmenter = tool.plugin.segmenter(&tool.settings)?;
        Ok(Some(Self { segmenter, photo: photo.clone(), used: tool.used()? }))
    }

    /// The labels of the photo for the camera of `capture`. The segmenter is ended: one that crashes then has not kept
    /// its word either.
    pub fn segment(
        &mut self,
        capture: &Path,
        classes: &ClassTable,
        console: &mut Console<'_>,
    ) -> Result<LabelledPhoto, Failure> {
        let photo = CapturePhoto::read(&self.photo, capture)?;
        let stage = console.stage("segment");
        let labels = self.segmenter.segment(&PhotoServices::new(classes, &stage), &photo.pixels);
        console.finish(&stage);
        let labels = labels?;
        self.segmenter.finish()?;
        Ok(photo.labelled(labels))
    }
}
