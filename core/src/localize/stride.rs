//! Views at a coarser step of the pixels, rendered on all cores and scored one after the other.

use super::compare::every;
use super::panel::Panel;
use super::services::SceneServices;
use crate::camera::Camera;
use crate::image::LabelImage;
use crate::plugin::{PluginError, Services, ViewImages};
use crate::render::{View, view};
use rayon::prelude::*;
use resurvey_schema::Pose;

/// Views that are held at a time: 37 MB at 192 × 144 pixels.
const TOGETHER: usize = 64;

/// The photo at one stride.
pub(super) struct Strided<'a, 's> {
    services: &'a SceneServices<'s>,
    photo: LabelImage,
    camera: Camera,
}

impl<'a, 's> Strided<'a, 's> {
    /// The photo with at most about `samples` pixels along its longer side.
    pub fn new(services: &'a SceneServices<'s>, samples: u32) -> Self {
        let labels = &services.capture().labels;
        let stride = (labels.width().max(labels.height()) / samples).max(1);
        Self { services, photo: every(labels, stride), camera: services.capture().camera.subsampled(stride) }
    }

    /// The scores of all matchers for each of `poses`, pose by pose.
    pub fn scores(&self, panel: &mut Panel<'_>, poses: &[Pose]) -> Result<Vec<f64>, PluginError> {
        let scene = self.services.world().scene(true);
        let mut scores = Vec::with_capacity(poses.len() * panel.len());
        for poses in poses.chunks(TOGETHER) {
            if self.services.cancelled() {
                return Err(PluginError::Cancelled { plugin: panel.name(), call: "score" });
            }
            let views: Vec<View> = poses.par_iter().map(|pose| view(scene, &self.camera, pose)).collect();
            let lend = &mut |index: usize, take: &mut dyn FnMut(&ViewImages<'_>)| {
                let view = &views[index];
                take(&ViewImages {
                    origin: view.origin,
                    labels: &view.labels,
                    range_m: &view.range_m,
                    points: &view.points,
                    features: &view.features,
                    feature_table: scene.feature_table(),
                });
            };
            let cancelled = || self.services.cancelled();
            scores.extend(panel.scores(&self.photo, views.len(), lend, &cancelled)?);
        }
        Ok(scores)
    }
}
