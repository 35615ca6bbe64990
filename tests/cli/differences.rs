//! `diff`, `changes` and `export --diff`.

use crate::bench::{Bench, edited, resurvey, text};
use crate::change_sets::{CHAIR, banner, chair, furnished};
use serde_json::{Value, json};

/// The chair, this far east of its first place.
pub fn chair_at(east: f64) -> Value {
    serde_json::from_str(&edited(&chair(), |chair| chair["position"][0] = json!(CHAIR[0] + east))).unwrap()
}

/// The same chair as answers have it.
pub fn chair_state(east: f64) -> Value {
    let mut state = chair_at(east);
    state["size_m"] = json!([0.5, 0.5, 0.9]);
    state["kind"] = json!("dynamic");
    state
}

/// A chair (1) and a banner (2) as version 1; the chair moves 1 m east, the banner goes and a chair (3) 50 m east comes
/// as version 2.
pub fn changed() -> Bench {
    let bench = furnished();
    let version = bench.apply(&[
        json!({"op": "modify", "fid": 1, "before": chair(), "after": chair_at(1.0)}),
        json!({"op": "remove", "fid": 2, "before": banner()}),
        json!({"op": "add", "after": chair_at(50.0)}),
    ]);
    assert_eq!(version, 2);
    bench
}

/// `--bbox` around `east` of the chair's first place.
fn around(east: f64) -> String {
    let (e, n) = (CHAIR[0] + east, CHAIR[1]);
    format!("{},{},{},{}", e - 5.0, n - 5.0, e + 5.0, n + 5.0)
}

#[test]
fn a_difference_is_told_by_signs_with_old_and_new_values() {
    let bench = changed();
    let run = bench.run("diff", &["1..2"]).ok();
    let expected = "~~ 1 chair at E 835601.00 N 817800.00 H 4.50\n\
        - 1 position = [835600.0,817800.0,4.5]\n\
        + 1 position = [835601.0,817800.0,4.5]\n\
        -- 2 banner at E 835600.00 N 817801.00 H 5.00, 2.00 x 1.00 m\n\
        ++ 3 chair at E 835650.00 N 817800.00 H 4.50\n";
    assert_eq!(run.out, expected);
    assert_eq!(run.err, "3 features differ between version 1 and version 2\n");
    let back = bench.run("diff", &["2..1"]).ok().out;
    let expected = "~~ 1 chair at E 835600.00 N 817800.00 H 4.50\n\
        - 1 position = [835601.0,817800.0,4.5]\n\
        + 1 position = [835600.0,817800.0,4.5]\n\
        ++ 2 banner at E 835600.00 N 817801.00 H 5.00, 2.00 x 1.00 m\n\
        -- 3 chair at E 835650.00 N 817800.00 H 4.50\n";
    assert_eq!(back, expected);
    assert_eq!(bench.run("diff", &["2..2"]).ok().out, "");
}

#[test]
fn the_way_back_is_the_way_there_with_its_sides_swapped() {
    let bench = changed();
    let there = bench.json("diff", &["1..2"]);
    assert_eq!((&there["from"], &there["to"]), (&json!(1), &json!(2)));
    let back = bench.json("diff", &["2..1"]);
    let swapped: Vec<Value> = (there["changes"].as_array().unwrap().iter())
        .map(|change| {
            let op = match change["op"].as_str().unwrap() {
                "add" => "remove",
                "remove" => "add",
                other => other,
            };
            let (before, after) = (change["after"].clone(), change["before"].clone());
            json!({"op": op, "fid": change["fid"], "class": change["class"], "before": before, "after": after})
        })
        .collect();
    assert_eq!(back["changes"], json!(swapped));
    assert_eq!(swapped.len(), 3);
    assert_eq!(there["changes"][0]["before"]["position"], json!(CHAIR));
}

#[test]
fn what_came_and_went_in_between_is_no_difference() {
    let bench = changed();
    bench.apply(&[json!({"op": "remove", "fid": 3, "before": chair_at(50.0)})]);
    let fids = |range: &str| {
        let difference = bench.json("diff", &[range]);
        difference["changes"].as_array().unwrap().iter().map(|one| one["fid"].as_u64().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!((fids("1..3"), fids("2..3"), fids("1..2")), (vec![1, 2], vec![3], vec![1, 2, 3]));
}

#[test]
fn a_region_has_what_lay_in_it_before_or_after() {
    let bench = changed();
    let fids = |bbox: &str| {
        let difference = bench.json("diff", &["1..head", "--bbox", bbox]);
        difference["changes"].as_array().unwrap().iter().map(|one| one["fid"].as_u64().unwrap()).collect::<Vec<_>>()
    };
    assert_eq!((fids(&around(0.0)), fids(&around(50.0)), fids("0,0,1,1")), (vec![1, 2], vec![3], vec![]));
    assert_eq!(bench.run("diff", &["1..2", "--bbox", "0,0,1,1"]).ok().out, "");
    assert_eq!(bench.json("diff", &["1..2", "--bbox", &around(0.0), "--height", "90,99"])["changes"], json!([]));
}

#[test]
fn geojson_has_what_changed_twice_and_the_rest_once() {
    let bench = changed();
    let collection = bench.run("diff", &["1..2", "--format", "geojson"]).ok().json();
    collection.to_string().parse::<geojson::GeoJson>().unwrap();
    let features = collection["features"].as_array().unwrap();
    let told: Vec<(&str, &str)> =
        (features.iter()).map(|one| (one["id"].as_str().unwrap(), one["properties"]["op"].as_str().unwrap())).collect();
    assert_eq!(told, [("1:before", "modify"), ("1:after", "modify"), ("2:before", "remove"), ("3:after", "add")]);
    for feature in features {
        let position = match feature["geometry"]["type"].as_str().unwrap() {
            "Point" => &feature["geometry"]["coordinates"],
            _ => &feature["geometry"]["coordinates"][0][0],
        };
        let (x, y) = (position[0].as_f64().unwrap(), position[1].as_f64().unwrap());
        assert!((113.8..114.5).contains(&x) && (22.1..22.6).contains(&y), "{feature}");
    }
}

#[test]
fn a_range_that_is_none_or_names_nothing_is_refused() {
    let bench = changed();
    let before = bench.run("query", &["--json"]).out;
    for (range, code, word) in [
        ("2", 2, "expected REV..REV"),
        ("1..", 2, "expected REV..REV"),
        ("1..9", 11, "no version 9"),
        ("spring..head", 11, "no tag \"spring\""),
        ("@1999-12-31..head", 11, "no version at 1999-12-31"),
    ] {
        for command in ["diff", "changes"] {
            bench.run(command, &[range]).refused(code, &[word]);
        }
        let out = bench.path("out.glb");
        bench.run("export", &["--diff", range, text(&out)]).refused(code, &[word]);
        assert!(!out.exists());
    }
    bench.run("diff", &["1..2", "--bbox", "9,0,1,1"]).refused(2, &["9 is above 1"]);
    assert_eq!(bench.run("query", &["--json"]).out, before);
}

#[test]
fn changes_lead_another_copy_of_the_map_there_and_back() {
    let bench = changed();
    let whole = bench.path("map.rsv");
    // A copy of the map that stopped at version 1.
    let other = bench.path("other.rsv");
    let first = furnished();
    std::fs::copy(first.path("map.rsv"), &other).unwrap();
    let there = bench.file("there.jsonl", bench.run("changes", &["1..2"]).ok().out);
    let back = bench.file("back.jsonl", bench.run("changes", &["2..1"]).ok().out);
    let features = |map: &str| {
        let answer = resurvey(&["query", map, "--json"]).ok().json();
        let without = |feature: &Value| edited(feature, |one| one["from"] = Value::Null);
        answer["features"].as_array().unwrap().iter().map(without).collect::<Vec<_>>()
    };
    let (map, other) = (text(&whole), text(&other));
    let before = features(other);
    assert_ne!(before, features(map));
    resurvey(&["apply", other, &there]).ok();
    assert_eq!(features(other), features(map));
    resurvey(&["apply", other, &back]).ok();
    assert_eq!(features(other), before);
    // A second time the chair is not where the set expects it.
    resurvey(&["apply", other, &back]).refused(21, &["feature 1"]);
    resurvey(&["fsck", other]).ok();
    let header: Value = serde_json::from_str(std::fs::read_to_string(&there).unwrap().lines().next().unwrap()).unwrap();
    assert_eq!(
        (&header["base_version"], &header["author"], &header["message"]),
        (&json!(1), &json!("survey"), &json!("m"))
    );
}

#[test]
fn a_whole_map_with_its_models_is_made_again_from_its_changes_and_unmade() {
    let (bench, _) = Bench::with_banner();
    let there = bench.file("there.jsonl", bench.run("changes", &["0..head"]).ok().out);
    let back = bench.file("back.jsonl", bench.run("changes", &["head..0"]).ok().out);
    assert!(bench.is_unchanged());
    let other = Bench::with_empty_map();
    other.run("apply", &[&there]).ok();
    assert_eq!(other.state("head"), bench.state("head"));
    let files = [bench.path("out.glb"), other.path("out.glb")];
    bench.run("export", &[text(&files[0]), "--at", "1"]).ok();
    other.run("export", &[text(&files[1])]).ok();
    let head = other.head();
    other.run("apply", &[&back]).ok();
    assert_eq!((other.state("head"), other.head()), (vec![], head + 1));
}

#[test]
fn geometry_that_is_no_mesh_is_refused_with_the_set() {
    let bench = Bench::with_empty_map();
    // "Zm9v" is "foo".
    let digest = "2c26b46b68ffc68ff99b453c1d30413413422d706483bfa0f98a5e886266e7ae";
    let object = json!({"name": "a", "geometry": digest, "min_mm": [0, 0, 0], "max_mm": [1, 1, 1]});
    let add = json!({"op": "add", "after_object": object});
    let set = |lines: &[Value]| bench.file("set.jsonl", crate::change_sets::set(None, lines));
    bench.refuses(
        "apply",
        &[&set(&[json!({"geometry": digest, "base64": "Zm9v"}), add.clone()])],
        10,
        &["set.jsonl", "geometry 2c26"],
    );
    bench.refuses("apply", &[&set(&[add])], 10, &["object \"a\" needs geometry 2c26"]);
}

#[test]
fn a_difference_is_exported_in_three_materials() {
    let bench = changed();
    let out = bench.path("out.gltf");
    let document = bench.json("export", &["--diff", "1..2", text(&out)]);
    let counts =
        ["added", "removed", "changed", "objects", "descriptors", "from", "to"].map(|key| document[key].as_u64());
    assert_eq!(counts, [1, 1, 1, 0, 3, 1, 2].map(Some));
    let file: Value = serde_json::from_slice(&std::fs::read(&out).unwrap()).unwrap();
    let materials: Vec<_> =
        file["materials"].as_array().unwrap().iter().map(|one| one["name"].as_str().unwrap()).collect();
    assert_eq!(materials, ["changed", "removed", "added"]);
    let part = bench.json("export", &["--diff", "1..2", text(&out), "--bbox", &around(50.0)]);
    assert_eq!((&part["added"], &part["removed"], &part["changed"]), (&json!(1), &json!(0), &json!(0)));
    bench.run("export", &["--diff", "1..2", "--at", "1", text(&out)]).refused(2, &["cannot be used with"]);
    let (street, _) = Bench::with_banner();
    let whole = street.json("export", &["--diff", "0..head", text(&out)]);
    assert!(whole["added"].as_u64().unwrap() > 3 && whole["objects"].as_u64().unwrap() > 2, "{whole}");
}

/// The first line of `changes RANGE`.
fn header(bench: &Bench, range: &str) -> Value {
    serde_json::from_str(bench.run("changes", &[range]).ok().out.lines().next().unwrap()).unwrap()
}

/// Applies a chair that `author` saw at `time`.
fn seen(bench: &Bench, author: &str, time: Option<&str>, east: f64) {
    let mut header = json!({"format": "resurvey.changes/1", "base_version": null, "author": author, "message": "m"});
    if let Some(time) = time {
        header["observed_at"] = json!(time);
    }
    let line = json!({"op": "add", "after": chair_at(east)});
    bench.json("apply", &[&bench.file("seen.jsonl", format!("{header}\n{line}\n"))]);
}

#[test]
fn a_set_of_several_versions_has_their_authors_and_the_newest_time() {
    let bench = furnished();
    assert_eq!(
        (&header(&bench, "0..1")["author"], &header(&bench, "0..1")["message"]),
        (&json!("survey"), &json!("m"))
    );
    seen(&bench, "ada", Some("2026-03-05T00:00:00Z"), 10.0);
    seen(&bench, "bea", Some("2026-03-03T00:00:00Z"), 20.0);
    seen(&bench, "ada", Some("2026-03-01T00:00:00Z"), 30.0);
    let set = header(&bench, "1..4");
    assert_eq!((&set["author"], &set["observed_at"]), (&json!("ada, bea"), &json!("2026-03-05T00:00:00Z")));
    // What nobody dated was seen when it was committed.
    seen(&bench, "bea", None, 40.0);
    let committed = bench.json("log", &["-n", "1"])["versions"][0]["committed_at"].clone();
    assert_eq!(
        (&header(&bench, "1..5")["observed_at"], &header(&bench, "4..5")["observed_at"]),
        (&committed, &Value::Null)
    );
    // The way back is nobody's work yet.
    let back = header(&bench, "5..1");
    assert_eq!((&back["author"], &back["observed_at"], &back["base_version"]), (&Value::Null, &Value::Null, &json!(5)));
}

#[test]
fn the_base_of_another_map_is_no_base_here() {
    let bench = changed();
    let set = bench.file("there.jsonl", bench.run("changes", &["1..2"]).ok().out);
    let (ours, hash) = (header(&bench, "1..2"), bench.json("log", &[])["versions"][1]["hash"].clone());
    assert_eq!((&ours["base_version"], &ours["base_hash"]), (&json!(1), &hash));
    assert_eq!(ours["map_id"].as_str().map(str::len), Some(36));
    // The same features under another history: version 1 is another one here, and 2 looked at nothing of it.
    let other = Bench::with_empty_map();
    other.apply(&[json!({"op": "add", "after": chair()})]);
    other.apply(&[json!({"op": "add", "after": banner()})]);
    let run = other.run("apply", &[&set, "--json"]);
    assert_eq!((run.code, &run.json()["base_version"]), (0, &json!(2)), "{}", run.err);
    let map_id = ours["map_id"].as_str().unwrap();
    for word in ["note: version 1 of ", "there.jsonl", map_id, "not one of this map"] {
        assert!(run.err.contains(word), "expected {word:?} in {}", run.err);
    }
    assert_eq!(other.state("head"), bench.state("head"));
    // Every `before` is checked all the same.
    other.run("apply", &[&set]).refused(21, &["feature 1"]);
    // A map that never had so many versions.
    let fresh = furnished();
    let late = bench.file("late.jsonl", bench.run("changes", &["2..1"]).ok().out);
    fresh.run("apply", &[&late]).refused(21, &["note: version 2 of ", "feature 1"]);
    // Where the versions are the same, the base is as good as at home.
    let copy = bench.path("copy.rsv");
    std::fs::copy(bench.path("map.rsv"), &copy).unwrap();
    let home = resurvey(&["apply", text(&copy), &late, "--json"]).ok();
    assert_eq!((home.json()["base_version"].clone(), home.err.as_str()), (json!(2), ""));
}

#[test]
fn geometry_is_refused_where_its_classes_have_other_names() {
    let bench = Bench::with_street();
    let set = bench.run("changes", &["0..1"]).ok().out;
    let classes = header(&bench, "0..1")["classes"].clone();
    assert_eq!((&classes["stone"], &classes["chair"]), (&json!(0), &json!(5)));
    let table = |names: &[(u8, &str)]| -> Value {
        let class = |(index, name): &(u8, &str)| json!({"index": index, "name": name, "colour": [index, 0, 0], "kind": "material"});
        names.iter().map(class).collect()
    };
    let indices: Vec<(u8, &str)> =
        (0..9).map(|index| (index, ["a", "b", "c", "d", "e", "f", "g", "h", "i"][index as usize])).collect();
    for (name, names) in [("renamed.json", &indices[..]), ("few.json", &indices[8..])] {
        let (file, map) = (bench.file(name, table(names).to_string()), bench.path(&format!("{name}.rsv")));
        resurvey(&["init", text(&map), "--classes", &file]).ok();
        let set = bench.file("set.jsonl", &set);
        let word = if name == "few.json" { "not in this map" } else { "in this map" };
        let made = "where the set was made";
        resurvey(&["apply", text(&map), &set]).refused(10, &["set.jsonl: geometry ", "class ", made, word]);
    }
}

#[test]
fn texts_of_others_neither_break_lines_nor_steer_the_terminal() {
    let bench = furnished();
    let evil = "a\nb\u{1b}[2J";
    let mut header = json!({"format": "resurvey.changes/1", "base_version": null, "author": evil, "message": evil});
    header["observed_at"] = json!("2026-03-01T00:00:00Z");
    let line = json!({"op": "add", "after": chair_at(10.0)});
    bench.json("apply", &[&bench.file("set.jsonl", format!("{header}\n{line}\n"))]);
    for (command, words) in [("log", &[][..]), ("why", &["3"])] {
        let out = bench.run(command, words).ok().out;
        assert!(out.contains("a\\nb\\u{1b}[2J") && !out.contains('\u{1b}'), "{out:?}");
    }
    assert_eq!(bench.run("log", &[]).ok().out.lines().count(), 4);
    // Machines get what is there.
    assert_eq!(bench.json("log", &["-n", "1"])["versions"][0]["message"], evil);
    bench.run("query", &["--at", "a\u{1b}b"]).refused(2, &["\\u{1b}"]);
    let nowhere = bench.run("apply", &["/no\u{1b}where"]);
    assert!(nowhere.err.contains("/no\\u{1b}where") && !nowhere.err.contains('\u{1b}'), "{:?}", nowhere.err);
}
