//! One experiment: the same photo again and again, each time with a pose that is further off.

use super::photo::{Classes, ORIGIN, Thing, objects, photo};
use crate::commands::render::paper_camera;
use crate::commands::update::exactly;
use crate::failure::Failure;
use resurvey_core::capture::Capture;
use resurvey_core::crs::Crs;
use resurvey_core::localize::{SceneServices, Silent, World};
use resurvey_core::mesh::Object;
use resurvey_core::plugin::{Detector, Estimator};
use resurvey_core::render::view;
use resurvey_core::update::{Comparison, pose_estimate};
use resurvey_core::version::Digest;
use resurvey_schema::service::Prior;
use resurvey_schema::{ClassTable, Descriptor, GridPoint, MaterialDescriptor, Pose, Proposal};

/// Greatest error of the pose, and its step, metres.
const MOST_M: f64 = 5.0;
const STEPS: u32 = 20;
/// Height of the camera above the ground, metres (Lee & Hsu, §4).
const EYE_M: f64 = 1.6;
/// Attitude, degrees: turned a little, so that no edge runs along a row of pixels.
const ATTITUDE_DEG: [f64; 3] = [2.0, 3.0, 1.0];
/// Distance of the banner's wall, and of the pedestrian, metres.
const WALL_M: f64 = 20.0;
const PEDESTRIAN_M: f64 = 6.0;
/// The banner: west, east, lowest and highest edge, metres.
const BANNER_M: [f64; 4] = [-3.0, 3.0, 4.0, 8.0];

/// What is changed, what is measured, and what geometry says of it.
pub struct Experiment {
    /// Stable name.
    pub name: &'static str,
    /// In words.
    pub title: &'static str,
    /// What is measured, with its unit.
    pub quantity: &'static str,
    /// Unit of the values.
    pub unit: &'static str,
    /// What geometry says, in words.
    pub oracle: &'static str,
    /// Distance of the thing from the true camera, metres.
    pub range_m: f64,
    /// One a pose error.
    pub points: Vec<Point>,
}

/// What one error of the pose came to.
pub struct Point {
    /// The error, metres.
    pub pose_error_m: f64,
    /// What was measured, or why nothing was.
    pub measured: Result<f64, String>,
    /// What geometry says.
    pub oracle: f64,
}

impl Experiment {
    /// A pedestrian on level ground: its descriptor is off by the error of the pose.
    pub fn pedestrian(detector: &mut Detector, estimator: &mut Estimator) -> Result<Self, Failure> {
        let table = ClassTable::default();
        let size_m = table.by_name("pedestrian").and_then(|class| class.size_m).unwrap_or([0.5, 0.5, 1.7]);
        let thing = Thing::Pedestrian { north_m: PEDESTRIAN_M, size_m };
        let truth = GridPoint { northing_m: ORIGIN.northing_m + PEDESTRIAN_M, ..ORIGIN };
        let measure = |descriptor: &Descriptor| match descriptor {
            Descriptor::Dynamic(object) => Ok(object.position.plan_distance_m(&truth)),
            Descriptor::Material(_) => Err("a rectangle was placed".to_owned()),
        };
        let points = points(&thing, (detector, estimator), measure, |error_m| error_m)?;
        Ok(Self {
            name: "pedestrian",
            title: "A pedestrian on level ground",
            quantity: "descriptor off by, m",
            unit: "m",
            oracle: "shift = e",
            range_m: PEDESTRIAN_M,
            points,
        })
    }

    /// A banner on a wall: backing off by e makes its area (1 + e/z)² as large.
    pub fn banner(detector: &mut Detector, estimator: &mut Estimator) -> Result<Self, Failure> {
        let [west, east, low, high] = BANNER_M;
        let true_m2 = (east - west) * (high - low);
        let thing = Thing::Banner { sides_m: BANNER_M, wall_m: WALL_M };
        let measure = |descriptor: &Descriptor| match descriptor {
            Descriptor::Material(rectangle) => Ok(100.0 * (area_m2(rectangle) / true_m2 - 1.0)),
            Descriptor::Dynamic(_) => Err("an object was placed".to_owned()),
        };
        let oracle = |error_m: f64| 100.0 * ((1.0 + error_m / WALL_M).powi(2) - 1.0);
        let points = points(&thing, (detector, estimator), measure, oracle)?;
        Ok(Self {
            name: "banner",
            title: "A banner of 6 × 4 m on a wall",
            quantity: "area too large by, %",
            unit: "%",
            oracle: "(1 + e/z)² − 1",
            range_m: WALL_M,
            points,
        })
    }
}

/// Area of a rectangle from its four corners, m²: two triangles.
fn area_m2(rectangle: &MaterialDescriptor) -> f64 {
    let [a, b, c, d] = rectangle.corners.map(|corner| {
        nalgebra::Vector3::new(
            corner.easting_m - ORIGIN.easting_m,
            corner.northing_m - ORIGIN.northing_m,
            corner.height_m,
        )
    });
    let ac = c - a;
    ((b - a).cross(&ac).norm() + ac.cross(&(d - a)).norm()) / 2.0
}

/// What `measure` says at every error of the one descriptor that is placed, beside what `oracle` says.
fn points(
    thing: &Thing,
    (detector, estimator): (&mut Detector, &mut Estimator),
    measure: impl Fn(&Descriptor) -> Result<f64, String>,
    oracle: impl Fn(f64) -> f64,
) -> Result<Vec<Point>, Failure> {
    let place = Place::new(thing)?;
    (0..=STEPS)
        .map(|step| {
            let pose_error_m = MOST_M * f64::from(step) / f64::from(STEPS);
            let proposals = place.proposals(pose_error_m, detector, estimator)?;
            let measured = only_placed(&proposals).and_then(&measure);
            Ok(Point { pose_error_m, measured, oracle: oracle(pose_error_m) })
        })
        .collect()
}

/// The one descriptor that is to be placed, or what there is instead.
fn only_placed(proposals: &[Proposal]) -> Result<&Descriptor, String> {
    let placed: Vec<&Descriptor> = proposals
        .iter()
        .filter_map(|proposal| match proposal {
            Proposal::Place { descriptor, .. } => Some(descriptor),
            _ => None,
        })
        .collect();
    match placed.as_slice() {
        [only] => Ok(only),
        [] => Err(proposals
            .iter()
            .find_map(|proposal| match proposal {
                Proposal::Reject { rejection, .. } => Some(rejection.requirement.clone()),
                _ => None,
            })
            .unwrap_or_else(|| "no change was found".to_owned())),
        several => Err(format!("{} descriptors were placed", several.len())),
    }
}

/// One place with its photo.
struct Place {
    world: World,
    capture: Capture,
    pose: Pose,
}

impl Place {
    fn new(thing: &Thing) -> Result<Self, Failure> {
        let table = ClassTable::default();
        let classes = Classes::of(&table);
        let camera = paper_camera()?;
        let [yaw_rad, pitch_rad, roll_rad] = ATTITUDE_DEG.map(f64::to_radians);
        let position = GridPoint { height_m: ORIGIN.height_m + EYE_M, ..ORIGIN };
        let pose = Pose { position, yaw_rad, pitch_rad, roll_rad };
        let objects = objects(thing, &classes);
        let lent: Vec<(u64, &Object)> = (1..).zip(&objects).collect();
        let labels = photo(thing, &classes, &camera, &pose);
        let prior = Prior { pose, position_sigma_m: 0.0, height_sigma_m: 0.0, yaw_sigma_rad: 0.0, tilt_sigma_rad: 0.0 };
        let digest = Digest::of(labels.values());
        let capture = Capture { labels, label_bytes: Vec::new(), camera, prior, taken_at: None, digest };
        Ok(Self { world: World::new(ORIGIN, &lent, Vec::new(), table), capture, pose })
    }

    /// What is proposed when the camera is taken to be `error_m` further south than it was.
    fn proposals(
        &self,
        error_m: f64,
        detector: &mut Detector,
        estimator: &mut Estimator,
    ) -> Result<Vec<Proposal>, Failure> {
        let mut pose = self.pose;
        pose.position.northing_m -= error_m;
        let scene = self.world.scene(true);
        let view = view(scene, &self.capture.camera, &pose);
        let estimate = pose_estimate(&exactly(pose), &self.capture);
        let comparison = Comparison { capture: &self.capture, view: &view, scene, estimate };
        let services = SceneServices::new(&self.world, &self.capture, Crs::Hk1980, &Silent);
        let regions = comparison.detect(detector, &services)?;
        Ok(comparison.estimate(estimator, &services, &regions)?)
    }
}
