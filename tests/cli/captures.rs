//! Captures that are no captures, priors that are nowhere, and labels that show nothing.

use crate::bench::{Bench, Run, edited, noise, street, text};
use crate::synthetic::label_png;
use serde_json::{Value, json};

/// The columns and rows of the street's label image.
fn size() -> (usize, usize) {
    (street().case.width, street().case.labels.len() / street().case.width)
}

fn document() -> Value {
    serde_json::to_value(&street().case.capture).unwrap()
}

/// A capture with these labels and this document in the bench's directory.
fn capture(bench: &Bench, document: &str, labels: &[u8]) -> String {
    bench.file("labels.png", labels);
    bench.file("capture.json", document)
}

fn good_labels() -> Vec<u8> {
    std::fs::read(street().path("capture/labels.png")).unwrap()
}

/// Asserts that both commands refuse the capture with code 10.
fn refuse_both(bench: &Bench, document: &str, labels: &[u8], words: &[&str]) {
    let path = capture(bench, document, labels);
    for command in ["localize", "update"] {
        bench.refuses(command, &[&path], 10, words);
    }
}

#[test]
fn a_capture_that_is_not_there_or_no_json_is_named() {
    let bench = Bench::with_street();
    bench.refuses("update", &["/nowhere/capture.json"], 10, &["/nowhere/capture.json"]);
    let labels = good_labels();
    let whole = document().to_string();
    for contents in ["", "[]", "{}", "null", "a capture", &whole[..whole.len() / 2]] {
        refuse_both(&bench, contents, &labels, &["capture.json: "]);
    }
    let random = bench.file("capture.json", noise(4000));
    bench.refuses("update", &[&random], 10, &["capture.json: "]);
}

/// What is wrong with a capture.
type Edit = fn(&mut Value);

#[test]
fn unknown_keys_and_impossible_values_are_refused_by_name() {
    let bench = Bench::with_street();
    let labels = good_labels();
    let cases: &[(Edit, &[&str])] = &[
        (|d| d["format"] = json!("resurvey.capture/2"), &["resurvey.capture/2", "expected \"resurvey.capture/1\""]),
        (|d| d["weather"] = json!("fine"), &["unknown field `weather`"]),
        (|d| d["camera"]["iso"] = json!(100), &["unknown field `iso`"]),
        (|d| d["prior"]["lattitude"] = json!(22.0), &["unknown field `lattitude`"]),
        (|d| d["prior"]["latitude"] = json!(91.0), &["prior.latitude is 91", "-90 to 90"]),
        (|d| d["prior"]["longitude"] = json!(-181.0), &["prior.longitude is -181"]),
        (|d| d["prior"]["latitude"] = json!(null), &["either latitude and longitude or easting and northing"]),
        (|d| d["prior"]["height_datum"] = json!(null), &["prior.height_datum is missing", "never guessed"]),
        (|d| d["prior"]["height_datum"] = json!("sea"), &["prior.height_datum is \"sea\""]),
        (|d| d["prior"]["height"] = json!(1e6), &["prior.height is 1000000"]),
        (|d| d["prior"]["pitch_deg"] = json!(120), &["prior.pitch_deg is 120"]),
        (|d| d["prior"]["north"] = json!("up"), &["prior.north is \"up\""]),
        (|d| d["prior"]["north"] = json!("magnetic"), &["prior.declination_deg is missing"]),
        (|d| d["prior"]["position_sigma_m"] = json!(-1), &["prior.position_sigma_m is -1"]),
        (|d| d["taken_at"] = json!("yesterday"), &["taken_at is \"yesterday\"", "2026-06-01T10:33:00+08:00"]),
        (|d| d["camera"]["fx"] = json!(0), &["camera.fx", "found 0"]),
        (|d| d["camera"]["fx"] = json!(null), &["either fx, fy, cx, cy or diagonal_fov_deg"]),
        (|d| d["camera"]["width"] = json!(0), &["found 0 x"]),
        (|d| d["camera"]["width"] = json!(4_000_000_000_u32), &["found 4000000000 x"]),
        (|d| d["camera"]["model"] = json!("pinehole"), &["expected pinhole, brown or fisheye", "pinehole"]),
        (|d| d["labels"] = json!("missing.png"), &["missing.png"]),
        (|d| d["labels"] = json!(""), &["capture.json"]),
    ];
    for (edit, words) in cases {
        let words = if words[0] == "capture.json" { &[][..] } else { words };
        refuse_both(&bench, &edited(&document(), edit), &labels, words);
    }
    let nan = document().to_string().replacen("\"yaw_deg\":", "\"yaw_deg\":NaN,\"x\":", 1);
    refuse_both(&bench, &nan, &labels, &["capture.json: ", "line 1"]);
    let huge = document().to_string().replacen("\"yaw_deg\":", "\"yaw_deg\":1e999,\"x\":", 1);
    refuse_both(&bench, &huge, &labels, &["capture.json: ", "line 1"]);
}

#[test]
fn a_label_image_that_is_none_is_refused_by_name() {
    let bench = Bench::with_street();
    let whole = good_labels();
    for labels in [&b""[..], &whole[..8], &whole[..whole.len() / 2], &noise(4000), b"GIF89a", b"\xff\xd8\xff\xe0"] {
        refuse_both(&bench, &document().to_string(), labels, &["labels.png"]);
    }
}

#[test]
fn a_label_image_of_another_size_than_the_camera_names_both() {
    let bench = Bench::with_street();
    let (width, height) = size();
    let small = label_png::encode(&vec![0; 32 * 24], 32).unwrap();
    let camera = format!("{width}×{height}");
    refuse_both(&bench, &document().to_string(), &small, &["labels.png", "32×24", "capture.json", &camera]);
}

#[test]
fn a_colour_that_is_no_class_is_refused_with_its_pixel() {
    let bench = Bench::with_street();
    let (width, height) = size();
    let mut colours = [0_u8, 0, 255].repeat(width * height);
    colours[3 * (5 * width + 9)..][..3].copy_from_slice(&[1, 2, 3]);
    let mut labels = Vec::new();
    let mut encoder = png::Encoder::new(&mut labels, width as u32, height as u32);
    encoder.set_color(png::ColorType::Rgb);
    encoder.set_depth(png::BitDepth::Eight);
    encoder.write_header().unwrap().write_image_data(&colours).unwrap();
    refuse_both(&bench, &document().to_string(), &labels, &["labels.png", "9", "5", "1,2,3"]);
    // An index beyond the class table.
    let mut indices = vec![0; width * height];
    indices[0] = 8;
    let mut bytes = label_png::encode(&indices, width).unwrap();
    let good = capture(&bench, &document().to_string(), &bytes);
    assert_ne!(bench.run("render", &[&good, "--out", text(&bench.path("view"))]).code, 10);
    bytes.clear();
    let mut encoder = png::Encoder::new(&mut bytes, width as u32, height as u32);
    encoder.set_color(png::ColorType::Grayscale);
    encoder.set_depth(png::BitDepth::Eight);
    indices[0] = 77;
    encoder.write_header().unwrap().write_image_data(&indices).unwrap();
    refuse_both(&bench, &document().to_string(), &bytes, &["labels.png", "77"]);
}

fn moved(latitude: f64, longitude: f64) -> String {
    edited(&document(), |d| {
        d["prior"]["latitude"] = json!(latitude);
        d["prior"]["longitude"] = json!(longitude);
    })
}

#[test]
fn a_prior_away_from_the_map_says_where_it_is() {
    let bench = Bench::with_street();
    let labels = good_labels();
    let latitude = street().case.capture.prior.latitude.unwrap();
    let longitude = street().case.capture.prior.longitude.unwrap();
    // 0.045° of latitude are 5 km.
    refuse_both(&bench, &moved(latitude + 0.045, longitude), &labels, &["nothing within 450 m of the prior", "origin"]);
    refuse_both(&bench, &moved(48.8584, 2.2945), &labels, &["capture.json: prior: "]);
    // Latitude and longitude swapped.
    refuse_both(&bench, &moved(longitude - 90.0, latitude), &labels, &["capture.json: prior: "]);
    let empty = Bench::with_empty_map();
    refuse_both(&empty, &document().to_string(), &labels, &["nothing within 450 m"]);
}

/// Updates with this capture: nothing may come of it but exit code 20 or 22.
fn comes_to_nothing(bench: &Bench, document: &str, labels: &[u8], pose: Option<&str>) -> Run {
    let path = capture(bench, document, labels);
    let given = pose.map_or_else(|| vec!["--set", "semantic.radius_m=10"], |pose| vec!["--pose", pose]);
    let run = bench.run("update", &[&[path.as_str(), "--json"], given.as_slice()].concat());
    assert!([20, 22].contains(&run.code), "exit {}: {}{}", run.code, run.out, run.err);
    assert_eq!((&run.json()["changes"], &run.json()["version"]), (&json!([]), &Value::Null));
    assert_eq!(bench.head(), 1);
    run
}

#[test]
fn labels_that_show_nothing_change_nothing() {
    let bench = Bench::with_street();
    let (width, height) = size();
    let pose = street().path("pose.json");
    let document = document().to_string();
    // Sky, others, stone and void.
    for class in [6, 8, 0, 255] {
        let labels = label_png::encode(&vec![class; width * height], width).unwrap();
        comes_to_nothing(&bench, &document, &labels, None);
        comes_to_nothing(&bench, &document, &labels, Some(text(&pose)));
    }
    // A photo filled with one banner or one pedestrian shows neither whole.
    for class in [3, 4] {
        let labels = label_png::encode(&vec![class; width * height], width).unwrap();
        comes_to_nothing(&bench, &document, &labels, Some(text(&pose)));
    }
}

#[test]
fn labels_without_meaning_change_nothing() {
    let bench = Bench::with_street();
    let (width, height) = size();
    let classes: Vec<u8> = noise(width * height).iter().map(|byte| byte % 9).collect();
    let labels = label_png::encode(&classes, width).unwrap();
    comes_to_nothing(&bench, &document().to_string(), &labels, None);
    comes_to_nothing(&bench, &document().to_string(), &labels, Some(text(&street().path("pose.json"))));
}

/// A point at eye height in the building that is nearest to the camera, so that the search from there still reaches it.
fn inside_a_building() -> [f64; 3] {
    let camera = street().case.truth.position;
    let tall = street().scene.world.blocks.iter().filter(|block| block.top - block.bottom > 10.0);
    let middles = tall.map(|block| {
        let corners = block.corners();
        let middle = [0, 1].map(|axis| corners.iter().map(|corner| corner[axis]).sum::<f64>() / 4.0);
        street().scene.grid([middle[0], middle[1], block.bottom + 1.6])
    });
    let distance_m = |point: &[f64; 3]| (point[0] - camera[0]).hypot(point[1] - camera[1]);
    let nearest = middles.min_by(|a, b| distance_m(a).total_cmp(&distance_m(b))).unwrap();
    assert!(distance_m(&nearest) < 30.0);
    nearest
}

/// The true position, moved up by so many metres.
fn raised(by_m: f64) -> [f64; 3] {
    let [easting, northing, height] = street().case.truth.position;
    [easting, northing, height + by_m]
}

/// A capture whose prior is at this grid position.
fn with_prior([easting, northing, height]: [f64; 3]) -> String {
    edited(&document(), |d| {
        let prior = d["prior"].as_object_mut().unwrap();
        prior.shift_remove("latitude");
        prior.shift_remove("longitude");
        prior.insert("easting".to_owned(), json!(easting));
        prior.insert("northing".to_owned(), json!(northing));
        prior.insert("height".to_owned(), json!(height));
    })
}

#[test]
fn a_pose_inside_a_building_underground_or_in_the_air_changes_nothing() {
    let bench = Bench::with_street();
    let labels = good_labels();
    let pose_at = |[easting, northing, height]: [f64; 3]| {
        let yaw_deg = street().case.truth.attitude_deg[0];
        let pose = json!({"easting": easting, "northing": northing, "height": height, "yaw_deg": yaw_deg,
            "pitch_deg": 0.0, "roll_deg": 0.0});
        bench.file("pose.json", pose.to_string())
    };
    let document = document().to_string();
    let inside = comes_to_nothing(&bench, &document, &labels, Some(&pose_at(inside_a_building())));
    assert_eq!(inside.code, 22);
    assert!(inside.out.contains("inside a building of the map"), "{}", inside.out);
    for by_m in [-30.0, 500.0] {
        comes_to_nothing(&bench, &document, &labels, Some(&pose_at(raised(by_m))));
    }
}

#[test]
fn a_prior_inside_a_building_or_underground_never_moves_the_banner() {
    let truth = street().case.truth.changes[0].position.unwrap();
    for position in [inside_a_building(), raised(-30.0)] {
        let bench = Bench::with_street();
        let path = capture(&bench, &with_prior(position), &good_labels());
        let run = bench.run("update", &[&path, "--json"]);
        assert!([0, 20, 22].contains(&run.code), "exit {}: {}", run.code, run.err);
        for change in run.json()["changes"].as_array().unwrap() {
            assert_eq!((&change["op"], &change["class"]), (&json!("add"), &json!("banner")));
            let off = [0, 1].map(|axis| change["after"]["centre"][axis].as_f64().unwrap() - truth[axis]);
            assert!(off[0].hypot(off[1]) < 0.6, "{change}");
        }
        assert_eq!(bench.head(), if run.code == 0 { 2 } else { 1 });
    }
}

#[test]
fn a_pose_file_that_is_none_is_refused_by_name() {
    let bench = Bench::with_street();
    let path = street().path("capture/capture.json");
    for (contents, word) in [
        ("", "EOF"),
        ("{}", "\"easting\""),
        (r#"{"pose":{"easting":835600}}"#, "\"northing\""),
        (r#"{"easting":1e999,"northing":0,"height":0,"yaw_deg":0,"pitch_deg":0,"roll_deg":0}"#, "line 1"),
        (r#"{"easting":1e300,"northing":0,"height":0,"yaw_deg":0,"pitch_deg":0,"roll_deg":0}"#, "is not within"),
        (r#"{"easting":835600,"northing":0,"height":0,"yaw_deg":0,"pitch_deg":0,"roll_deg":0}"#, "nothing within"),
    ] {
        let pose = bench.file("pose.json", contents);
        bench.refuses("update", &[text(&path), "--pose", &pose], 10, &[word]);
        bench.refuses("render", &["--pose", &pose, "--out", text(&bench.path("view"))], 10, &[word]);
    }
    assert!(!bench.path("view").exists());
    bench.refuses("update", &[text(&path), "--pose", "/nowhere.json"], 10, &["/nowhere.json"]);
}
