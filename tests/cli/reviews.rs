//! `update --propose` and `--confirm`, and `proposals`.

use crate::bench::{Bench, edited, street, text};
use crate::synthetic::label_png;
use serde_json::{Value, json};

/// The street's capture as another phone would send it: another time, and the first `pixels` pixels void.
fn another(bench: &Bench, name: &str, (taken_at, pixels): (&str, usize)) -> String {
    let directory = bench.path(name);
    std::fs::create_dir_all(&directory).unwrap();
    let file = std::fs::File::open(street().path("capture/labels.png")).unwrap();
    let mut reader = png::Decoder::new(std::io::BufReader::new(file)).read_info().unwrap();
    let mut indices = vec![0; reader.output_buffer_size().unwrap()];
    let width = reader.next_frame(&mut indices).unwrap().width;
    indices[..pixels].fill(255);
    std::fs::write(directory.join("labels.png"), label_png::encode(&indices, width as usize).unwrap()).unwrap();
    let capture: Value =
        serde_json::from_slice(&std::fs::read(street().path("capture/capture.json")).unwrap()).unwrap();
    let path = directory.join("capture.json");
    std::fs::write(&path, edited(&capture, |capture| capture["taken_at"] = json!(taken_at))).unwrap();
    text(&path).to_owned()
}

/// `update CAPTURE --pose … WORDS --json`.
fn update(bench: &Bench, capture: &str, words: &[&str]) -> Value {
    let pose = street().path("pose.json");
    bench.json("update", &[&[capture, "--pose", text(&pose)], words].concat())
}

fn capture() -> String {
    text(&street().path("capture/capture.json")).to_owned()
}

#[test]
fn a_proposed_change_waits_until_it_is_accepted() {
    let bench = Bench::with_street();
    let document = update(&bench, &capture(), &["--propose", "--author", "phone 7"]);
    assert_eq!((&document["decision"], &document["version"]), (&json!("proposed"), &Value::Null));
    assert_eq!((&document["proposals"], &document["changes"][0]["fid"]), (&json!([1]), &Value::Null));
    assert_eq!((bench.head(), bench.json("query", &["--class", "banner"])["features"].clone()), (1, json!([])));
    // The same capture again is the same proposal.
    assert_eq!(update(&bench, &capture(), &["--propose"])["proposals"], json!([1]));
    let listed = bench.json("proposals", &["list"]);
    let entry = &listed["proposals"][0];
    let keys: Vec<&String> = entry.as_object().unwrap().keys().collect();
    let expected = [
        "id",
        "status",
        "proposed_at",
        "observed_at",
        "author",
        "message",
        "base_version",
        "capture_sha256",
        "changes",
        "version",
        "decision",
    ];
    assert_eq!(keys, expected);
    assert_eq!((&entry["status"], &entry["author"]), (&json!("open"), &json!("phone 7")));
    assert_eq!((&entry["changes"][0]["op"], &entry["changes"][0]["fid"]), (&json!("add"), &Value::Null));
    let table = bench.run("proposals", &[]).ok().out;
    assert!(table.contains("open") && table.contains("add banner at E 835"), "{table}");
    let shown = bench.json("proposals", &["show", "1"]);
    assert_eq!(shown["observation"]["capture_sha256"], entry["capture_sha256"]);
    assert_eq!(shown["observation"]["decision"], "proposed");
    let lines = bench.run("proposals", &["show", "1"]).ok().out;
    assert!(lines.contains("++ new banner") && lines.contains("capture   sha256"), "{lines}");

    let accepted = bench.json("proposals", &["accept", "1", "--by", "ada", "--note", "seen on site"]);
    assert_eq!(accepted, json!({"id": 1, "status": "accepted", "version": 2}));
    let fid = bench.json("query", &["--class", "banner"])["features"][0]["fid"].to_string();
    let step = bench.json("why", &[&fid])["steps"][0].clone();
    assert_eq!((&step["version"]["author"], &step["observation"]["decision"]), (&json!("phone 7"), &json!("proposed")));
    assert_eq!(bench.json("proposals", &[])["proposals"], json!([]));
    let all = bench.json("proposals", &["list", "--all"]);
    assert_eq!((&all["proposals"][0]["version"], &all["proposals"][0]["decision"]["by"]), (&json!(2), &json!("ada")));
    assert_eq!(bench.head(), 2);
}

#[test]
fn a_rejected_proposal_makes_no_version_and_is_decided_once() {
    let bench = Bench::with_street();
    update(&bench, &capture(), &["--propose"]);
    assert_eq!(bench.run("proposals", &["reject", "1", "--note", "a shadow"]).ok().out, "proposal 1 is rejected\n");
    for action in ["accept", "reject"] {
        bench.run("proposals", &[action, "1"]).refused(21, &["proposal 1 is rejected already", "MAP show 1"]);
        bench.run("proposals", &[action, "9"]).refused(11, &["no proposal 9", "list --all"]);
        bench.run("proposals", &[action]).refused(2, &["the number of a proposal"]);
    }
    bench.run("proposals", &["show", "9"]).refused(11, &["no proposal 9"]);
    bench.run("proposals", &["weigh", "1"]).refused(2, &["[possible values: list, show, accept, reject]"]);
    assert!(bench.run("proposals", &["show", "1"]).ok().out.contains("a shadow"));
    // Sent again it is not a new one, and nothing waits.
    let pose = street().path("pose.json");
    for words in [&["--propose"][..], &["--confirm", "2"]] {
        let again = bench.run("update", &[&[&capture(), "--pose", text(&pose), "--json"], words].concat());
        let document = again.json();
        assert_eq!((again.code, &document["decision"], &document["proposals"]), (20, &json!("nothing"), &json!([1])));
        assert_eq!(document["decided"], json!([{"id": 1, "status": "rejected"}]));
    }
    let told = bench.run("update", &[&capture(), "--pose", text(&pose), "--propose"]);
    assert!(told.out.contains("proposal  1, rejected before"), "{}", told.out);
    assert_eq!(bench.json("proposals", &[])["proposals"], json!([]));
    assert_eq!(bench.head(), 1);
}

#[test]
fn what_is_on_the_map_by_now_is_not_accepted_again() {
    let bench = Bench::with_street();
    update(&bench, &capture(), &["--propose"]);
    let other = another(&bench, "other", ("2026-06-01T11:00:00+08:00", 1));
    assert_eq!(update(&bench, &other, &["--propose"])["proposals"], json!([2]));
    bench.json("proposals", &["accept", "2"]);
    bench.run("proposals", &["accept", "1"]).refused(21, &["is where proposal 1 puts its own", "proposals show 1"]);
    let taken = bench.run("proposals", &["accept", "1", "--json"]);
    let banner = &bench.json("query", &["--class", "banner"])["features"][0];
    let mut found = banner.clone();
    found.as_object_mut().unwrap().retain(|key, _| !["fid", "from", "to"].contains(&key.as_str()));
    let there = json!([{"fid": banner["fid"], "changed_in": 2, "is_on_map": true, "is_target": false, "found": found}]);
    let expected = json!({"decision": "conflict", "base_version": 1, "head": 2, "version": null, "conflicts": there,
        "looked_at_by": [], "id": 1, "status": "open"});
    assert_eq!((taken.code, taken.json()), (21, expected));
    let decided = bench.run("proposals", &["reject", "2", "--json"]);
    let expected = json!({"decision": "conflict", "id": 2, "status": "accepted", "version": null});
    assert_eq!((decided.code, decided.json()), (21, expected));
    assert_eq!(bench.json("query", &["--class", "banner"])["features"].as_array().map(Vec::len), Some(1));
    assert_eq!((bench.head(), bench.json("proposals", &[])["proposals"][0]["id"].clone()), (2, json!(1)));
}

#[test]
fn a_change_becomes_a_version_when_enough_captures_agree() {
    let bench = Bench::with_street();
    let confirm = |capture: &str| update(&bench, capture, &["--confirm", "3"]);
    let first = confirm(&capture());
    assert_eq!((&first["decision"], &first["proposals"]), (&json!("proposed"), &json!([1])));
    // The same capture counts once, however often it is sent.
    assert_eq!(confirm(&capture())["decision"], "proposed");
    assert_eq!(confirm(&capture())["proposals"], json!([1]));
    // Nor does its photo under another time, or in another file.
    let copy = confirm(&another(&bench, "copy", ("2026-06-01T10:30:00+08:00", 0)));
    assert_eq!((&copy["decision"], &copy["proposals"]), (&json!("proposed"), &json!([2])));
    let second = confirm(&another(&bench, "second", ("2026-06-01T11:00:00+08:00", 1)));
    assert_eq!((&second["decision"], &second["proposals"]), (&json!("proposed"), &json!([3])));
    assert_eq!(bench.head(), 1);
    let third = confirm(&another(&bench, "third", ("2026-06-01T12:00:00+08:00", 2)));
    assert_eq!((&third["decision"], &third["version"]), (&json!("committed"), &json!(2)));
    let banner = bench.json("query", &["--class", "banner"])["features"][0].clone();
    assert_eq!(banner["fid"], third["changes"][0]["fid"]);
    assert_eq!(third["changes"], bench.json("diff", &["1..2"])["changes"]);
    // The same place three times: as it was, and √3 surer.
    let one = &first["changes"][0]["after"];
    let sigma = |state: &Value| state["sigma_m"].as_f64().unwrap();
    assert!((sigma(&banner) * 3.0_f64.sqrt() / sigma(one) - 1.0).abs() < 1e-6, "{banner} {one}");
    for axis in 0..3 {
        let (fused, own) = (banner["centre"][axis].as_f64().unwrap(), one["centre"][axis].as_f64().unwrap());
        assert!((fused - own).abs() < 1e-6);
    }
    let why = bench.json("why", &[&banner["fid"].to_string()]);
    let seen = &why["steps"][0]["observation"];
    let captures = seen["confirmed_by"].as_array().unwrap();
    let mut digests: Vec<&str> = captures.iter().map(|one| one["capture_sha256"].as_str().unwrap()).collect();
    digests.sort_unstable();
    digests.dedup();
    assert_eq!((digests.len(), captures.len()), (3, 3));
    assert!(bench.run("why", &[&banner["fid"].to_string()]).ok().out.contains("confirmed 3 of 3"));
    let all = bench.json("proposals", &["list", "--all"]);
    for proposal in all["proposals"].as_array().unwrap() {
        assert_eq!((&proposal["status"], &proposal["version"]), (&json!("accepted"), &json!(2)));
        assert!(proposal["decision"]["note"].as_str().unwrap().contains("confirmed by 3 captures"), "{proposal}");
    }
    assert_eq!(bench.head(), 2);
}

#[test]
fn ways_to_commit_that_exclude_each_other_are_refused() {
    let bench = Bench::with_street();
    let capture = capture();
    for words in [
        &["--propose", "--dry-run"][..],
        &["--propose", "--confirm", "2"],
        &["--confirm", "2", "--dry-run"],
        &["--confirm", "2", "--idempotency-key", "k"],
    ] {
        bench.refuses("update", &[&[capture.as_str()], words].concat(), 2, &["cannot be used with"]);
    }
    bench.refuses("update", &[&capture, "--confirm", "0"], 2, &["0 is not in 1.."]);
}
