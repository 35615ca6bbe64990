//! Labels that a segmenter makes from a photo, through the built program.

use crate::bench::{Bench, edited, street, text};
use crate::plugin_files::plugin;
use resurvey_core::image::{LabelReading, RgbImage, colours_of_labels, read_label_file, write_rgb_png};
use resurvey_schema::ClassTable;
use serde_json::{Value, json};

/// The street's label image in the colours of the classes.
fn picture() -> RgbImage {
    let classes = ClassTable::default();
    let labels = read_label_file(&street().path("capture/labels.png"), &classes, &LabelReading::default()).unwrap();
    colours_of_labels(&labels, &classes)
}

/// A photo, and a capture that names no label image.
struct Shot {
    bench: Bench,
    photo: String,
    capture: String,
}

impl Shot {
    fn new(picture: &RgbImage) -> Self {
        let bench = Bench::with_street();
        let photo = bench.file("photo.png", write_rgb_png(picture).unwrap());
        let whole = serde_json::to_value(&street().case.capture).unwrap();
        let without = edited(&whole, |document| drop(document.as_object_mut().unwrap().remove("labels")));
        let capture = bench.file("capture.json", without);
        Self { bench, photo, capture }
    }

    fn words<'a>(&'a self, more: &[&'a str]) -> Vec<&'a str> {
        [&[self.capture.as_str(), "--photo", &self.photo, "--segmenter", "palette"], more].concat()
    }
}

/// What a document says of changes, without the number that the feature got.
fn changes(document: &Value) -> Vec<[Value; 3]> {
    let changes = document["changes"].as_array().unwrap().iter();
    changes.map(|change| ["op", "class", "after"].map(|key| change[key].clone())).collect()
}

#[test]
fn a_banner_in_a_coloured_photo_is_found_as_with_labels() {
    let (plain, shot) = (Bench::with_street(), Shot::new(&picture()));
    let capture = street().path("capture/capture.json");
    let expected = plain.json("update", &[text(&capture)]);
    let document = shot.bench.json("update", &shot.words(&["--keep-labels"]));
    assert_eq!((&document["decision"], document["version"].as_u64()), (&json!("committed"), Some(2)));
    assert_eq!(changes(&document), changes(&expected));
    assert!(changes(&document).iter().any(|[op, class, _]| op == "add" && class == "banner"), "{document:#}");
    assert_eq!(document["localization"]["pose"], expected["localization"]["pose"]);

    let used: Vec<_> = document["plugins"].as_array().unwrap().iter().map(|used| &used["kind"]).collect();
    assert_eq!(used, ["segmenter", "matcher", "detector", "estimator"]);
    assert_eq!(document["plugins"][0]["settings"], json!({ "majority_radius_px": 0, "max_delta_e": 15.0 }));
    let replayed = shot.bench.json("replay", &["2"]);
    assert_eq!(replayed["same"], true, "the labels that were made were kept: {replayed:#}");
    shot.bench.run("replay", &["2", "--capture", &shot.capture]).refused(10, &["segmenter palette", "--keep-labels"]);
}

#[test]
fn a_pose_that_is_given_leaves_the_segmenter_in_the_evidence() {
    let (shot, pose) = (Shot::new(&picture()), street().path("pose.json"));
    shot.bench.json("update", &shot.words(&["--pose", text(&pose)]));
    let log = shot.bench.json("log", &["--by-plugin", "palette"]);
    assert_eq!(log["versions"][0]["version"], 2, "{log:#}");
}

#[test]
fn a_larger_photo_is_averaged_down_and_localized() {
    let small = picture();
    let double = |index: u32| (index % (2 * small.width()) / 2, index / (2 * small.width()) / 2);
    let pixels = (0..4 * small.width() * small.height()).map(|index| small.at(double(index).0, double(index).1));
    let large = RgbImage::from_values(2 * small.width(), 2 * small.height(), pixels.collect()).unwrap();
    let (one, two) = (Shot::new(&small), Shot::new(&large));
    let narrow = ["--set", "search.radius_m=0", "--set", "palette.max_delta_e=10"];
    let [one, two] =
        [&one, &two].map(|shot| shot.bench.run("localize", &shot.words(&[&narrow[..], &["--json"]].concat())));
    assert_eq!(one.json()["pose"], two.json()["pose"]);
    assert!(one.err.contains("photo.png: no position") && one.err.contains("that of capture.json"), "{}", one.err);
}

#[test]
fn a_photo_of_another_shape_or_a_capture_without_labels_is_refused() {
    let whole = picture();
    let (width, height) = (whole.width(), whole.height() / 2);
    let half = whole.values()[..(width * height) as usize].to_vec();
    let shot = Shot::new(&RgbImage::from_values(width, height, half).unwrap());
    let sizes = [format!("the photo is {width}×{height} px"), format!("{width}×{} px", whole.height())];
    for command in ["update", "localize"] {
        shot.bench.refuses(command, &shot.words(&[]), 10, &["photo.png", &sizes[0], &sizes[1], "aspect ratio"]);
        let missing = ["capture.json", "expected labels", "a segmenter"];
        shot.bench.refuses(command, &[&shot.capture], 10, &missing);
        shot.bench.refuses(command, &[&shot.capture, "--segmenter", "palette"], 2, &["--photo"]);
        let other = [&shot.capture, "--photo", &shot.photo, "--segmenter", "semantic"];
        shot.bench.refuses(command, &other, 12, &["plugin semantic is a matcher, not a segmenter"]);
    }
}

#[test]
fn a_label_that_is_no_class_of_the_map_drops_the_run() {
    // Mid-grey is the colour of no class, and the segmenter calls it 200.
    let grey = RgbImage::filled(picture().width(), picture().height(), [128; 3]);
    let shot = Shot::new(&grey);
    let Some(sha256) = plugin(&shot.bench, "faulty_segmenter.c", "labels", &["-DFAULT_LABEL"]) else { return };
    let plugins = shot.bench.path("plugins");
    for here in [&[][..], &["--in-process"]] {
        let words = [&shot.capture, "--photo", &shot.photo, "--segmenter", "faulty-segmenter"];
        let from = ["--plugin-dir", text(&plugins), "--allow-plugin", &sha256];
        let words = [&words[..], &from, here].concat();
        shot.bench.refuses(
            "update",
            &words,
            12,
            &["faulty-segmenter", "segment", "labels[0][0] = 200", "a class of the map"],
        );
    }
}

#[test]
#[cfg(target_os = "linux")]
fn a_segmenter_in_another_process_makes_the_same_labels() {
    let shot = Shot::new(&picture());
    let Some(sha256) = plugin(&shot.bench, "faulty_segmenter.c", "labels", &["-DRIGHT"]) else { return };
    let (pose, plugins) = (street().path("pose.json"), shot.bench.path("plugins"));
    let given = ["--pose", text(&pose), "--dry-run"];
    let words = [&shot.capture, "--photo", &shot.photo, "--segmenter", "faulty-segmenter"];
    let from = ["--plugin-dir", text(&plugins), "--allow-plugin", &sha256];
    let apart = shot.bench.json("update", &[&words[..], &from, &given].concat());
    let linked = shot.bench.json("update", &shot.words(&given));
    assert_eq!(apart["changes"], linked["changes"]);
    assert!(!apart["changes"].as_array().unwrap().is_empty());
}
