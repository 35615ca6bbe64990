//! `update --report`: pages that say what the document says, are whole in themselves, and trust no text.

use crate::bench::{Bench, Run, edited, street, text};
use serde_json::{Value, json};
use std::path::{Path, PathBuf};

/// A copy of the street's capture in a directory called `name`.
fn capture(bench: &Bench, name: &str) -> PathBuf {
    let folder = bench.path(name);
    std::fs::create_dir_all(&folder).unwrap();
    for file in ["capture.json", "labels.png"] {
        std::fs::copy(street().path("capture").join(file), folder.join(file)).unwrap();
    }
    folder.join("capture.json")
}

/// Updates with `capture` at `pose` and reports into `reports`.
fn update(bench: &Bench, capture: &Path, pose: &Path, more: &[&str]) -> Run {
    let reports = bench.path("reports");
    let words = [&[text(capture), "--pose", text(pose), "--report", text(&reports), "--json"], more].concat();
    bench.run("update", &words)
}

fn read(bench: &Bench, file: &str) -> String {
    std::fs::read_to_string(bench.path("reports").join(file)).unwrap()
}

/// Asserts that a page needs no other file and no network: every address is a page beside it or an image in itself.
fn stands_alone(page: &str) {
    for attribute in ["src=\"", "href=\"", "url(", "@import", "action=\""] {
        for after in page.split(attribute).skip(1) {
            let is_own = after.starts_with("data:image/png;base64,") || after.starts_with("#plan-clip");
            let address = &after[..after.find('"').unwrap()];
            let is_page = address.ends_with(".html") && !address.contains('/') && !address.contains(':');
            assert!(is_own || is_page, "{attribute}{address}");
        }
    }
    assert!(!page.contains("<script") && page.contains("prefers-color-scheme: dark"));
}

/// `coordinate` as pages write it.
fn grouped(coordinate: f64) -> String {
    let text = format!("{coordinate:.2}");
    format!("{}\u{202f}{}", &text[..3], &text[3..])
}

#[test]
fn a_page_shows_what_was_committed_and_the_index_links_it() {
    let bench = Bench::with_street();
    let document = update(&bench, &capture(&bench, "0042"), &street().path("pose.json"), &[]).ok().json();
    let (page, index) = (read(&bench, "0042.html"), read(&bench, "index.html"));
    [&page, &index].into_iter().for_each(|page| stands_alone(page));
    assert!(index.contains("<a href=\"0042.html\">0042</a>"), "{index}");
    let banner = &document["changes"][0];
    let number = |value: &Value| value.as_f64().unwrap();
    let mut expected = vec![
        "1 change committed as version 2".to_owned(),
        format!("banner {}", banner["fid"]),
        format!("{:.2} m²", number(&banner["after"]["area_m2"])),
        format!("{:.2} m", number(&banner["after"]["width_m"])),
        grouped(number(&document["localization"]["pose"]["easting"])),
    ];
    for corner in banner["after"]["corners"].as_array().unwrap() {
        expected.push(format!("E {}  N {}", grouped(number(&corner[0])), grouped(number(&corner[1]))));
    }
    for plugin in document["plugins"].as_array().unwrap() {
        expected.push(plugin["sha256"].as_str().unwrap().to_owned());
    }
    expected
        .extend(["photo", "Difference", "Plan view, north up", " m</text>", "The pose was given"].map(str::to_owned));
    for words in expected {
        assert!(page.contains(&words), "expected {words:?}");
    }
    assert_eq!(page.matches("class=\"fate\"").count(), 1, "one region was kept");
}

#[test]
fn what_came_to_nothing_is_reported_too() {
    let (bench, _) = Bench::with_banner();
    let again = update(&bench, &capture(&bench, "again"), &street().path("pose.json"), &[]);
    assert_eq!(again.code, 20);
    assert!(read(&bench, "again.html").contains("badge nothing"));
    let inside = {
        let [e, n, h] = street().scene.origin;
        let block = &street().scene.world.blocks[0];
        let pose = json!({"pose": {"easting": e + block.centre[0], "northing": n + block.centre[1], "height": h + 1.6,
            "yaw_deg": 0.0, "pitch_deg": 0.0, "roll_deg": 0.0}});
        PathBuf::from(bench.file("inside.json", pose.to_string()))
    };
    let unreliable = update(&bench, &capture(&bench, "lost"), &inside, &[]);
    assert_eq!(unreliable.code, 22);
    let page = read(&bench, "lost.html");
    assert!(page.contains("badge unreliable") && page.contains("inside-building"));
    assert!(page.contains("lies inside a building"), "the reason");
    stands_alone(&page);
}

#[test]
fn a_dry_run_reports_and_changes_not_one_byte_of_the_map() {
    let bench = Bench::with_street();
    update(&bench, &capture(&bench, "dry"), &street().path("pose.json"), &["--dry-run"]).ok();
    assert!(read(&bench, "dry.html").contains("A dry run: 1 change would be made"));
    assert!(bench.is_unchanged());
}

#[test]
fn names_from_outside_are_text_and_never_markup() {
    let bench = Bench::with_street();
    let name = "<img src=x onerror=alert(1)>&'\"";
    let capture = capture(&bench, name);
    update(&bench, &capture, &street().path("pose.json"), &["--author", "<b>me</b>"]).ok();
    let file = "img-src-x-onerror-alert-1.html";
    let (page, index) = (read(&bench, file), read(&bench, "index.html"));
    for page in [&page, &index] {
        assert!(!page.contains("<img src=x") && !page.contains("<b>me"), "{page}");
        stands_alone(page);
    }
    assert!(page.contains("&lt;img src=x onerror=alert(1)&gt;&amp;"), "the path is there, as text");
}

#[test]
fn a_capture_that_ends_the_run_is_in_the_index() {
    let bench = Bench::with_street();
    let good = capture(&bench, "good");
    let bad = capture(&bench, "bad");
    let whole: Value = serde_json::from_slice(&std::fs::read(&bad).unwrap()).unwrap();
    std::fs::write(&bad, edited(&whole, |document| document["weather"] = json!("<fine>"))).unwrap();
    let reports = bench.path("reports");
    let words = [text(&good), text(&bad), "--set", "semantic.radius_m=2", "--report", text(&reports)];
    assert_eq!(bench.run("update", &words).code, 10);
    let index = read(&bench, "index.html");
    assert!(index.contains("good.html") && !index.contains("bad.html"));
    assert!(index.contains("unknown field `weather`"), "{index}");
}

#[test]
fn reports_that_cannot_be_written_are_refused_before_the_map_changes() {
    let bench = Bench::with_street();
    let file = bench.file("reports", "a file");
    let (capture, pose) = (capture(&bench, "0042"), street().path("pose.json"));
    bench.refuses("update", &[text(&capture), "--pose", text(&pose), "--report", &file], 10, &["reports"]);
}

#[test]
fn a_page_that_cannot_be_written_hides_no_version() {
    let bench = Bench::with_street();
    let capture = capture(&bench, "0042");
    std::fs::create_dir_all(bench.path("reports/0042.html")).unwrap();
    let run = update(&bench, &capture, &street().path("pose.json"), &[]);
    assert_eq!(run.code, 10, "{}", run.err);
    assert!(run.err.contains("0042.html: ") && !run.err.contains("standard output"), "{}", run.err);
    assert_eq!((&run.json()["decision"], &run.json()["version"]), (&json!("committed"), &json!(2)));
    assert_eq!(bench.head(), 2);
    // What was not done for another reason keeps its code.
    let again = update(&bench, &capture, &street().path("pose.json"), &[]);
    assert_eq!((again.code, &again.json()["decision"]), (20, &json!("nothing")));
    assert!(again.err.contains("0042.html: "), "{}", again.err);
}

#[test]
fn a_page_of_somebody_else_is_not_written_over() {
    let bench = Bench::with_street();
    std::fs::create_dir_all(bench.path("reports")).unwrap();
    std::fs::write(bench.path("reports/index.html"), "<title>my site</title>").unwrap();
    let run = update(&bench, &capture(&bench, "0042"), &street().path("pose.json"), &[]);
    run.refused(10, &["index.html: ", "a page of somebody else"]);
    assert_eq!(read(&bench, "index.html"), "<title>my site</title>");
    assert!(bench.is_unchanged());
}
