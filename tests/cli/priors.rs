//! Priors from an NMEA log and from a photo's EXIF, and what is refused.

use crate::bench::{Bench, edited, street, text};
use serde_json::{Value, json};

/// The time of the capture, and the same as a log writes it.
const TAKEN_AT: &str = "2026-06-01T10:28:00+08:00";

/// The street's capture whose prior says only pitch and roll; `edit` may add to it.
fn capture(bench: &Bench, edit: impl FnOnce(&mut Value)) -> String {
    bench.file("labels.png", std::fs::read(street().path("capture/labels.png")).unwrap());
    let whole = serde_json::to_value(&street().case.capture).unwrap();
    let document = edited(&whole, |d| {
        d["taken_at"] = json!(TAKEN_AT);
        d["prior"] = json!({ "pitch_deg": whole["prior"]["pitch_deg"], "roll_deg": whole["prior"]["roll_deg"] });
        edit(d);
    });
    bench.file("capture.json", document)
}

/// Latitude and longitude of the street's own prior.
fn position() -> [f64; 2] {
    let prior = &street().case.capture.prior;
    [prior.latitude.unwrap(), prior.longitude.unwrap()]
}

fn yaw_deg() -> f64 {
    street().case.capture.prior.yaw_deg.unwrap()
}

/// A GPS tag: number, type (1 byte, 2 text, 5 fraction), count and bytes.
type GpsTag = (u16, u16, u32, Vec<u8>);

fn ascii(tag: u16, text: &str) -> GpsTag {
    let bytes = [text.as_bytes(), &[0]].concat();
    (tag, 2, u32::try_from(bytes.len()).unwrap(), bytes)
}

fn fractions(tag: u16, numbers: &[f64]) -> GpsTag {
    let bytes = numbers
        .iter()
        .flat_map(|number| [((number * 1e6).round() as u32).to_be_bytes(), 1_000_000_u32.to_be_bytes()].concat());
    (tag, 5, u32::try_from(numbers.len()).unwrap(), bytes.collect())
}

/// A JPEG file with these tags in its GPS directory, as TIFF 6.0 and EXIF 2.3 lay them out, and no picture.
fn photo(tags: &[GpsTag]) -> Vec<u8> {
    let short = u16::to_be_bytes;
    let long = |value: usize| u32::try_from(value).unwrap().to_be_bytes();
    // Header, one directory with one entry, which points to the GPS directory at 26.
    let mut tiff =
        [b"MM\0*", &long(8)[..], &short(1), &short(0x8825), &short(4), &long(1), &long(26), &long(0)].concat();
    assert_eq!(tiff.len(), 26);
    let mut beyond = Vec::new();
    let data_at = 26 + 2 + 12 * tags.len() + 4;
    tiff.extend(short(u16::try_from(tags.len()).unwrap()));
    for (tag, kind, count, bytes) in tags {
        tiff.extend([&short(*tag)[..], &short(*kind), &count.to_be_bytes()].concat());
        let mut value = bytes.clone();
        value.resize(value.len().max(4), 0);
        if value.len() > 4 {
            tiff.extend(long(data_at + beyond.len()));
            beyond.extend(value);
        } else {
            tiff.extend(value);
        }
    }
    tiff.extend(long(0));
    tiff.extend(beyond);
    let length = short(u16::try_from(tiff.len() + 8).unwrap());
    [&[0xff, 0xd8, 0xff, 0xe1], &length[..], b"Exif\0\0", &tiff, &[0xff, 0xd9]].concat()
}

/// The tags of a position.
fn located() -> Vec<GpsTag> {
    let [latitude, longitude] = position();
    let angle = |value: f64| {
        let minutes = value.fract() * 60.0;
        [value.trunc(), minutes.trunc(), minutes.fract() * 60.0]
    };
    vec![ascii(1, "N"), fractions(2, &angle(latitude)), ascii(3, "E"), fractions(4, &angle(longitude))]
}

/// The sentence with its checksum.
fn signed(body: &str) -> String {
    format!("${body}*{:02X}\r\n", body.bytes().fold(0, |sum, byte| sum ^ byte))
}

/// A log with a fix each second from 02:27:59 to 02:28:01 UTC at the street's prior, 60 m above its geoid.
fn log(heading: &str) -> String {
    let angle = |value: f64, width: usize| {
        let minutes = value.fract() * 60.0;
        format!("{:0width$}{minutes:010.7}", value.trunc())
    };
    let [latitude, longitude] = position();
    let (latitude, longitude) = (angle(latitude, 2), angle(longitude, 3));
    let epoch = |time: &str| {
        signed(&format!("GNRMC,{time},A,{latitude},N,{longitude},E,1.9,12.0,010626,,,A"))
            + &signed(&format!("GNGGA,{time},{latitude},N,{longitude},E,1,09,1.4,60.0,M,-2.6,M,,"))
            + heading
    };
    ["022759.00", "022800.00", "022801.00"].map(epoch).concat()
}

/// The `prior` of an update at the true pose, which needs no search, with these arguments.
fn prior(bench: &Bench, capture: &str, arguments: &[&str]) -> Value {
    let pose = street().path("pose.json");
    let words = [&[capture, "--pose", text(&pose), "--dry-run"], arguments].concat();
    bench.json("update", &words)["localization"]["prior"].clone()
}

fn near(value: &Value, expected: f64, within: f64) {
    let value = value.as_f64().unwrap();
    assert!((value - expected).abs() < within, "expected {expected}, found {value}");
}

#[test]
fn a_photo_localizes_without_any_prior_in_the_capture() {
    let bench = Bench::with_street();
    let capture = capture(&bench, |_| {});
    let direction = [ascii(0x10, "T"), fractions(0x11, &[yaw_deg()]), fractions(6, &[63.0]), fractions(0x1f, &[9.0])];
    let photo = bench.file("photo.jpg", photo(&[located(), direction.to_vec()].concat()));
    let run = bench.run("localize", &[&capture, "--photo", &photo, "--json"]).ok();
    let (document, truth) = (run.json(), &street().case.truth);
    let prior = &document["prior"];
    assert_eq!((&prior["source"], &prior["heading_from"]), (&json!("photo"), &json!("photo")));
    assert_eq!((&prior["height_from"], &prior["file"]), (&json!("ground"), &json!(photo)));
    near(&prior["position_sigma_m"], 9.0, 1e-9);
    near(&prior["pose"]["height"], truth.position[2], 0.6);
    // A true heading and grid north differ by the convergence: less than 0.1° here.
    near(&prior["pose"]["yaw_deg"], yaw_deg(), 0.1);
    assert!(run.err.contains("63.0 m") || run.err.contains("not used: taken 1.6 m above the ground"), "{}", run.err);
    near(&document["pose"]["easting"], truth.position[0], 1.0);
    near(&document["pose"]["northing"], truth.position[1], 1.0);
}

#[test]
fn a_log_localizes_at_the_time_of_the_capture() {
    let bench = Bench::with_street();
    let capture = capture(&bench, |_| {});
    let heading = signed(&format!("GNHDT,{:.3},T", yaw_deg()));
    let damaged = log(&heading) + "$GNGGA,022802.00,22*00\r\n$GNGGA,0228";
    let log = bench.file("walk.nmea", &damaged);
    let run = bench.run("localize", &[&capture, "--nmea", &log, "--json"]).ok();
    let (document, truth) = (run.json(), &street().case.truth);
    let prior = &document["prior"];
    assert_eq!(
        (&prior["source"], &prior["heading_from"], &prior["height_from"]),
        (&json!("nmea"), &json!("nmea"), &json!("ground"))
    );
    let expected = json!({ "used": 9, "skipped": 2, "bad_checksum": 1, "malformed": 1, "empty": 0 });
    assert_eq!(prior["sentences"], expected);
    assert!(run.err.contains("9 sentences read, 2 lines skipped (1 with a bad checksum, 1 malformed"), "{}", run.err);
    near(&prior["position_sigma_m"], 7.0, 1e-9);
    near(&document["pose"]["easting"], truth.position[0], 1.0);
    near(&document["pose"]["northing"], truth.position[1], 1.0);
}

#[test]
fn what_a_source_leaves_out_is_taken_from_the_capture() {
    let bench = Bench::with_street();
    let photo = bench.file("photo.jpg", photo(&located()));
    let own = |d: &mut Value| {
        let prior = serde_json::to_value(&street().case.capture.prior).unwrap();
        d["prior"] = prior;
        d["prior"]["latitude"] = json!(22.0);
        d["prior"]["yaw_sigma_deg"] = json!(12.0);
    };
    let found = prior(&bench, &capture(&bench, own), &["--photo", &photo]);
    assert_eq!(
        (&found["source"], &found["height_from"], &found["heading_from"]),
        (&json!("photo"), &json!("capture"), &json!("capture"))
    );
    near(&found["pose"]["yaw_deg"], yaw_deg(), 1e-9);
    near(&found["yaw_sigma_deg"], 12.0, 1e-9);
    near(&found["pose"]["height"], street().case.capture.prior.height.unwrap(), 1e-6);
    // Without a heading anywhere it may be any.
    let found = prior(&bench, &capture(&bench, |_| {}), &["--photo", &photo]);
    assert_eq!((&found["heading_from"], &found["height_from"]), (&Value::Null, &json!("ground")));
    near(&found["yaw_sigma_deg"], 180.0, 1e-9);
}

#[test]
fn a_magnetic_photo_needs_its_date_or_a_declination() {
    let bench = Bench::with_street();
    let tags = [located(), vec![ascii(0x10, "M"), fractions(0x11, &[100.0])]].concat();
    let photo = bench.file("photo.jpg", photo(&tags));
    let found = prior(&bench, &capture(&bench, |_| {}), &["--photo", &photo]);
    // The World Magnetic Model has 3.2° west in Hong Kong in 2026, the convergence is below 0.1°.
    near(&found["pose"]["yaw_deg"], 96.8, 0.4);
    let undated = |d: &mut Value| d["taken_at"] = Value::Null;
    let words = &["prior.declination_deg is missing (no date)"];
    bench.refuses("localize", &[&capture(&bench, undated), "--photo", &photo], 10, words);
    let stated = |d: &mut Value| {
        d["taken_at"] = Value::Null;
        d["prior"]["declination_deg"] = json!(-10.0);
    };
    near(&prior(&bench, &capture(&bench, stated), &["--photo", &photo])["pose"]["yaw_deg"], 90.0, 0.1);
}

#[test]
fn a_capture_without_a_prior_names_the_ways_to_give_one() {
    let bench = Bench::with_street();
    let capture = capture(&bench, |_| {});
    for command in ["localize", "update"] {
        bench.refuses(command, &[&capture], 10, &["prior is without a position", "--nmea", "--photo"]);
    }
}

#[test]
fn a_source_that_says_nothing_is_refused_with_what_it_lacks() {
    let bench = Bench::with_street();
    let (capture, dark) = (capture(&bench, |_| {}), bench.file("dark.jpg", photo(&[ascii(1, "N")])));
    let walk = bench.file("walk.nmea", log(""));
    let empty = bench.file("empty.nmea", "$GNGGA,0228\r\n");
    let other = bench.file("other.json", "{}");
    let cases: &[(&[&str], &[&str])] = &[
        (&["--photo", &dark], &["dark.jpg", "found no GPSLatitude"]),
        (&["--photo", &other], &["other.json", "expected a JPEG"]),
        (&["--photo", "/nowhere.jpg"], &["/nowhere.jpg"]),
        (&["--nmea", &empty], &["empty.nmea", "expected GGA or RMC sentences with a fix", "1 malformed"]),
        (
            &["--nmea", &walk, "--at-time", "2026-06-01T10:29:00+08:00"],
            &["walk.nmea", "nearest is at 2026-06-01T02:28:01Z, 59.0 s away"],
        ),
    ];
    for (arguments, words) in cases {
        for command in ["localize", "update"] {
            bench.refuses(command, &[&[capture.as_str()], *arguments].concat(), 10, words);
        }
    }
    let untimed = self::capture(&bench, |d| d["taken_at"] = Value::Null);
    bench.refuses("localize", &[&untimed, "--nmea", &walk], 10, &["taken_at is missing", "--at-time"]);
    let found = prior(&bench, &untimed, &["--nmea", &walk, "--at-time", TAKEN_AT]);
    assert_eq!(found["source"], json!("nmea"));
    // A date is the end of that day, with @ or without: nothing in this log is near it.
    for date in ["2026-06-01", "@2026-06-01"] {
        bench.refuses(
            "localize",
            &[&untimed, "--nmea", &walk, "--at-time", date],
            10,
            &["walk.nmea", "2026-06-01T23:59:59"],
        );
    }
}

#[test]
fn what_belongs_to_one_photo_is_refused_with_several() {
    let bench = Bench::with_street();
    let (capture, walk) = (capture(&bench, |_| {}), bench.file("walk.nmea", log("")));
    let pose = street().path("pose.json");
    for (arguments, word) in [
        (&["--pose", text(&pose)][..], "--pose belongs to one photo"),
        (&["--photo", "photo.jpg"], "--photo belongs to one photo"),
        (&["--nmea", &walk, "--at-time", TAKEN_AT], "--at-time belongs to one photo"),
    ] {
        let words = [&[capture.as_str(), capture.as_str()], arguments].concat();
        bench.refuses("update", &words, 2, &[word, "expected one capture, found 2"]);
    }
    bench.refuses("localize", &[&capture, "--at-time", TAKEN_AT], 2, &["--nmea"]);
    bench.refuses("localize", &[&capture, "--nmea", &walk, "--photo", "a.jpg"], 2, &["cannot be used with"]);
    bench.refuses(
        "localize",
        &[&capture, "--nmea", &walk, "--at-time", "10:28"],
        2,
        &["a time with its zone", "10:28"],
    );
    let out = bench.path("view");
    let words = ["--pose", text(&pose), "--nmea", &walk, "--out", text(&out)];
    bench.refuses("render", &words, 2, &["expected a capture.json beside --nmea or --photo"]);
}

#[test]
fn a_view_is_drawn_from_the_prior_of_a_log() {
    let bench = Bench::with_street();
    let (capture, walk) = (capture(&bench, |_| {}), bench.file("walk.nmea", log("")));
    let out = bench.path("view");
    let drawn = bench.json("render", &[&capture, "--nmea", &walk, "--out", text(&out)]);
    near(&drawn["pose"]["height"], street().case.truth.position[2], 0.6);
    assert!(out.join("class.png").exists());
}

#[test]
fn a_place_without_ground_asks_for_a_height() {
    let bench = Bench::with_street();
    // 100 m east of everything: near enough to be on the map, too far to stand on it.
    let [easting, northing, _] = street().case.truth.position;
    let region =
        [easting - 2000.0, northing - 2000.0, easting + 2000.0, northing + 2000.0].map(|edge| edge.to_string());
    let objects = bench.json("query", &["--bbox", &region.join(",")]);
    let ends = objects["features"].as_array().unwrap().iter().filter_map(|object| object["max"][0].as_f64());
    let east_end = ends.fold(f64::NEG_INFINITY, f64::max);
    let far = capture(&bench, |d| {
        d["prior"]["easting"] = json!(east_end + 100.0);
        d["prior"]["northing"] = json!(northing);
        d["prior"]["yaw_deg"] = json!(0);
    });
    bench.refuses("localize", &[&far], 10, &["expected prior.height, or ground of the map"]);
}
