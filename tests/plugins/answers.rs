//! Detectors and estimators: what they see, that their answers arrive whole, and that a wrong one is named.

use super::scene::{CAMERA, ESTIMATE, FEATURES, POSE, Rasters, Scene, chair};
use resurvey_core::plugin::{Plugin as Loaded, PluginError};
use resurvey_plugin::schema::abi::Declaration;
use resurvey_plugin::schema::{
    ChangeRegion, ClassId, Descriptor, GridPoint, MaterialDescriptor, PixelBox, Proposal, Rejection, Uncertainty,
};
use resurvey_plugin::{Comparison, Detector, Error, Estimator, Host, Plugin, export};

static DETECTOR: Declaration = export::detector::<Canned>();
static ESTIMATOR: Declaration = export::estimator::<Canned>();

/// Gives the answer that its setting names.
struct Canned {
    answer: String,
}

#[derive(serde::Deserialize)]
struct Settings {
    answer: String,
}

impl Plugin for Canned {
    const NAME: &'static str = "canned";
    const VERSION: &'static str = "1";
    const SUMMARY: &'static str = "Gives the answer that is asked for";
    const SETTINGS: &'static str = r#"{"properties": {"answer": {"type": "string", "default": "right"}}}"#;
    type Settings = Settings;

    fn create(Settings { answer }: Settings) -> Result<Self, Error> {
        Ok(Self { answer })
    }
}

fn check(comparison: &Comparison<'_>) {
    let rasters = Rasters::new();
    let view = &comparison.view;
    assert_eq!((comparison.camera, comparison.estimate, view.origin), (CAMERA, ESTIMATE, POSE.position));
    assert_eq!(view.feature_table, FEATURES);
    for v in 0..3 {
        assert_eq!(comparison.photo.row(v), rasters.photo.row(v));
        assert_eq!(view.labels.row(v), rasters.labels.row(v));
        assert_eq!(view.range_m.row(v), rasters.range_m.row(v));
        assert_eq!(view.points.row(v), rasters.points.row(v));
        assert_eq!(view.features.row(v), rasters.features.row(v));
    }
}

impl Detector for Canned {
    fn detect(&mut self, _host: &dyn Host, comparison: &Comparison<'_>) -> Result<Vec<ChangeRegion>, Error> {
        check(comparison);
        Ok(vec![region(), broken_region(&self.answer)])
    }
}

impl Estimator for Canned {
    fn estimate(
        &mut self,
        _host: &dyn Host,
        comparison: &Comparison<'_>,
        regions: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, Error> {
        check(comparison);
        assert_eq!(regions, [region(), region()]);
        let mut proposals = proposals();
        break_proposals(&self.answer, &mut proposals);
        Ok(proposals)
    }
}

fn region() -> ChangeRegion {
    let bounds = PixelBox { left: 1, top: 0, right: 4, bottom: 2 };
    ChangeRegion { class_before: ClassId(0), class_after: ClassId(3), bounds, mask: vec![1, 1, 0, 0, 1, 1], pixels: 4 }
}

fn broken_region(answer: &str) -> ChangeRegion {
    let mut region = region();
    match answer {
        "void" => region.class_after = ClassId::VOID,
        "unknown class" => region.class_before = ClassId(9),
        "outside" => region.bounds.right = 5,
        "inside out" => (region.bounds.left, region.bounds.right) = (4, 1),
        "short mask" => drop(region.mask.pop()),
        "grey mask" => region.mask[0] = 2,
        "miscounted" => region.pixels = 5,
        "empty" => (region.mask, region.pixels) = (vec![0; 6], 0),
        _ => {}
    }
    region
}

fn banner() -> MaterialDescriptor {
    let corner = |easting_m, height_m| GridPoint::new(easting_m, 819_100.0, height_m);
    MaterialDescriptor {
        class: ClassId(3),
        corners: [corner(1.0, 4.0), corner(3.0, 4.0), corner(3.0, 7.0), corner(1.0, 7.0)],
        normal: [0.0, -1.0, 0.0],
        sigma: Some(Uncertainty { position_m: 0.25, size_m: Some(0.125), area_m2: Some(0.5) }),
    }
}

fn proposals() -> Vec<Proposal> {
    let rejection = Rejection {
        class_before: ClassId(1),
        class_after: ClassId(2),
        pixels: 4,
        requirement: "within-range".into(),
        measured: 61.5,
        limit: 50.0,
        unit: "m".into(),
    };
    vec![
        Proposal::Place { region: 0, descriptor: Descriptor::Material(banner()) },
        Proposal::Place { region: 1, descriptor: chair() },
        Proposal::Remove { region: 1, class: ClassId(5), near: GridPoint::new(1.0, 2.0, 3.0), sigma_m: 0.5 },
        Proposal::Reject { region: 0, rejection },
    ]
}

fn break_proposals(answer: &str, proposals: &mut [Proposal]) {
    let (mut material, mut dynamic) = (banner(), chair());
    if let Descriptor::Dynamic(dynamic) = &mut dynamic {
        match answer {
            "chair of stone" => dynamic.class = ClassId(0),
            "chair of no size" => dynamic.size_m[2] = 0.0,
            "chair in the sky" => dynamic.position.height_m = f64::INFINITY,
            _ => {}
        }
    }
    match answer {
        "banner of chair" => material.class = ClassId(5),
        "corner nowhere" => material.corners[2].easting_m = f64::NAN,
        "long normal" => material.normal = [0.0, -1.1, 0.0],
        "no normal" => material.normal = [f64::NAN; 3],
        "negative sigma" => material.sigma = Some(Uncertainty { position_m: -1.0, size_m: None, area_m2: None }),
        _ => {}
    }
    proposals[0] = Proposal::Place { region: 0, descriptor: Descriptor::Material(material) };
    let region = if answer == "third region" { 2 } else { 1 };
    proposals[1] = Proposal::Place { region, descriptor: dynamic };
    match (answer, &mut proposals[2..]) {
        ("remove the unknown", [Proposal::Remove { class, .. }, ..]) => *class = ClassId(77),
        ("remove nowhere", [Proposal::Remove { near, .. }, ..]) => near.northing_m = f64::NAN,
        ("no requirement", [_, Proposal::Reject { rejection, .. }]) => rejection.requirement.clear(),
        ("measured nothing", [_, Proposal::Reject { rejection, .. }]) => rejection.measured = f64::NAN,
        _ => {}
    }
}

fn detect(answer: &str) -> Result<Vec<ChangeRegion>, PluginError> {
    let (plugin, scene) = (Loaded::builtin(&DETECTOR).unwrap(), Scene::new());
    let settings = plugin.settings([("answer", answer)]).unwrap();
    plugin.detector(&settings).unwrap().detect(&scene, &scene.rasters.comparison())
}

fn estimate(answer: &str) -> Result<Vec<Proposal>, PluginError> {
    let (plugin, scene) = (Loaded::builtin(&ESTIMATOR).unwrap(), Scene::new());
    let settings = plugin.settings([("answer", answer)]).unwrap();
    plugin.estimator(&settings).unwrap().estimate(&scene, &scene.rasters.comparison(), &[region(), region()])
}

#[test]
fn regions_arrive_as_the_detector_made_them() {
    assert_eq!(detect("right"), Ok(vec![region(), region()]));
}

#[test]
fn proposals_arrive_as_the_estimator_made_them() {
    assert_eq!(estimate("right"), Ok(proposals()));
}

#[test]
fn a_region_that_breaks_a_rule_names_plugin_field_and_value() {
    for (answer, message) in [
        ("void", "region[1].class_after = 255 in detect; expected a class of the map"),
        ("unknown class", "region[1].class_before = 9 in detect; expected a class of the map"),
        ("outside", "region[1].bounds = 1…5 × 0…2 in detect; expected a box inside 4×3 pixels"),
        ("inside out", "region[1].bounds = 4…1 × 0…2 in detect; expected a box inside 4×3 pixels"),
        ("short mask", "region[1].mask = 5 bytes in detect; expected 6 bytes"),
        ("grey mask", "region[1].mask = 2 in detect; expected 0 or 1"),
        ("miscounted", "region[1].pixels = 5 in detect; expected the number of ones in the mask, 4, above 0"),
        ("empty", "region[1].pixels = 0 in detect; expected the number of ones in the mask, 0, above 0"),
    ] {
        assert_eq!(detect(answer).unwrap_err().to_string(), format!("plugin canned answered {message}"));
    }
}

#[test]
fn a_proposal_that_breaks_a_rule_names_plugin_field_and_value() {
    for (answer, message) in [
        ("third region", "proposal[1].region = 2 in estimate; expected an index below 2"),
        ("banner of chair", "proposal[0].descriptor.class = chair in estimate; expected a class of kind material"),
        ("chair of stone", "proposal[1].descriptor.class = stone in estimate; expected a class of kind dynamic"),
        ("chair of no size", "proposal[1].descriptor.size_m = 0 in estimate; expected a finite number above 0"),
        ("chair in the sky", "proposal[1].descriptor.position = inf in estimate; expected a finite number"),
        ("corner nowhere", "proposal[0].descriptor.corners[2] = NaN in estimate; expected a finite number"),
        ("long normal", "proposal[0].descriptor.normal = [0.0, -1.1, 0.0] in estimate; expected a unit vector"),
        ("no normal", "proposal[0].descriptor.normal = [NaN, NaN, NaN] in estimate; expected a unit vector"),
        ("negative sigma", "proposal[0].descriptor.sigma = -1 in estimate; expected a finite number of at least 0"),
        ("remove the unknown", "proposal[2].class = 77 in estimate; expected a class of the map"),
        ("remove nowhere", "proposal[2].near = NaN in estimate; expected a finite number"),
        ("no requirement", "proposal[3].requirement = \"\" in estimate; expected a short name"),
        ("measured nothing", "proposal[3].measured = NaN in estimate; expected a finite number"),
    ] {
        assert_eq!(estimate(answer).unwrap_err().to_string(), format!("plugin canned answered {message}"));
    }
}

#[test]
fn rasters_of_different_sizes_never_reach_the_plugin() {
    let (plugin, scene) = (Loaded::builtin(&DETECTOR).unwrap(), Scene::new());
    let mut detector = plugin.detector(&plugin.settings([]).unwrap()).unwrap();
    let mut input = scene.rasters.comparison();
    let wide = resurvey_plugin::schema::Intrinsics { width: 8, ..CAMERA };
    input.camera = &wide;
    let message = detector.detect(&scene, &input).unwrap_err().to_string();
    assert_eq!(message, "plugin canned was not called: photo is 4×3, its camera 8×3");
}
