//! View, detect, estimate: from a pose to proposals.

use crate::capture::Capture;
use crate::localize::SceneServices;
use crate::plugin::{ComparisonInput, Detector, Estimator, PluginError, ViewImages};
use crate::render::{Scene, View};
use crate::version::BoxMm;
use resurvey_schema::service::PoseEstimate;
use resurvey_schema::{ChangeRegion, GridPoint, Localization, Proposal};

/// The map is not measured beyond this distance, metres (requirement 2 of Lee & Hsu's Algorithm 1), so a change of the
/// map further away than this does not touch what the capture says.
const MEASURED_REACH_M: f64 = 50.0;

/// The pose with its uncertainty as detectors and estimators see it: plan and heading from the matcher, the rest from
/// the prior, which the matcher can only have improved.
pub fn pose_estimate(localization: &Localization, capture: &Capture) -> PoseEstimate {
    PoseEstimate {
        pose: localization.pose,
        covariance: localization.covariance,
        height_sigma_m: capture.prior.height_sigma_m.min(REFINED_HEIGHT_SIGMA_M),
        tilt_sigma_rad: capture.prior.tilt_sigma_rad.min(REFINED_TILT_SIGMA_RAD),
        alignment: localization.alignment,
    }
}

/// 1σ of a height that was refined on the image, metres.
const REFINED_HEIGHT_SIGMA_M: f64 = 0.1;
/// 1σ of pitch and roll that were refined on the image, radians: 0.3°.
const REFINED_TILT_SIGMA_RAD: f64 = 0.3 * std::f64::consts::PI / 180.0;

/// Photo and view side by side; what `detect` and `estimate` work on.
pub struct Comparison<'a> {
    /// The capture.
    pub capture: &'a Capture,
    /// The map from the pose.
    pub view: &'a View,
    /// The scene that was viewed.
    pub scene: &'a Scene,
    /// The pose.
    pub estimate: PoseEstimate,
}

impl Comparison<'_> {
    /// Regions in which photo and view differ, as `detector` finds them.
    pub fn detect(
        &self,
        detector: &mut Detector,
        services: &SceneServices<'_>,
    ) -> Result<Vec<ChangeRegion>, PluginError> {
        let camera = self.capture.camera.intrinsics();
        let input = ComparisonInput {
            photo: &self.capture.labels,
            view: self.view_images(),
            camera: &camera,
            estimate: &self.estimate,
        };
        detector.detect(services, &input)
    }

    /// What each of `regions` means for the map, as `estimator` measures it.
    pub fn estimate(
        &self,
        estimator: &mut Estimator,
        services: &SceneServices<'_>,
        regions: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, PluginError> {
        let camera = self.capture.camera.intrinsics();
        let input = ComparisonInput {
            photo: &self.capture.labels,
            view: self.view_images(),
            camera: &camera,
            estimate: &self.estimate,
        };
        estimator.estimate(services, &input, regions)
    }

    /// Box around what was seen of the map within 50 m: while the capture was worked on nothing may change in it.
    pub fn viewed_region(&self) -> Option<BoxMm> {
        let near = self.view.range_m.values().iter().zip(self.view.points.values());
        let points = near.filter(|(range_m, _)| f64::from(**range_m) <= MEASURED_REACH_M).map(|(_, point)| *point);
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for point in points {
            for axis in 0..3 {
                low[axis] = low[axis].min(point[axis]);
                high[axis] = high[axis].max(point[axis]);
            }
        }
        let corner = |offset: [f32; 3]| -> GridPoint { self.scene.point(offset.map(f64::from)) };
        BoxMm::new(corner(low), corner(high)).ok()
    }

    fn view_images(&self) -> ViewImages<'_> {
        ViewImages {
            origin: self.view.origin,
            labels: &self.view.labels,
            range_m: &self.view.range_m,
            points: &self.view.points,
            features: &self.view.features,
            feature_table: self.scene.feature_table(),
        }
    }
}
