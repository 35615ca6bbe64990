//! `query` in all its forms.

use crate::bench::{Bench, resurvey, street, text};
use serde_json::{Value, json};

fn fids(answer: &Value) -> Vec<u64> {
    answer["features"].as_array().unwrap().iter().map(|feature| feature["fid"].as_u64().unwrap()).collect()
}

/// Fid and centre of the banner.
fn banner(document: &Value) -> (u64, [f64; 3]) {
    let change = &document["changes"][0];
    (change["fid"].as_u64().unwrap(), [0, 1, 2].map(|axis| change["after"]["centre"][axis].as_f64().unwrap()))
}

fn comma(numbers: &[f64]) -> String {
    numbers.iter().map(f64::to_string).collect::<Vec<_>>().join(",")
}

#[test]
fn features_are_printed_with_the_documented_keys() {
    let (bench, document) = Bench::with_banner();
    let answer = bench.json("query", &[]);
    let from_format = bench.run("query", &["--format", "json"]).ok().json();
    assert_eq!(answer, from_format);
    assert_eq!(answer["version"], 2);
    let (fid, _) = banner(&document);
    for feature in answer["features"].as_array().unwrap() {
        let keys: Vec<&str> = feature.as_object().unwrap().keys().map(String::as_str).collect();
        assert_eq!(keys[..4], ["fid", "from", "to", "kind"]);
        if feature["fid"] == fid {
            assert_eq!(
                (&feature["from"], &feature["to"], &feature["kind"]),
                (&json!(2), &json!(null), &json!("material"))
            );
            for key in ["class", "corners", "centre", "width_m", "height_m", "area_m2", "normal", "sigma_m"] {
                assert!(keys.contains(&key), "{key} is not among {keys:?}");
            }
        } else {
            assert_eq!(keys[4..], ["class", "name", "geometry", "min", "max"]);
        }
    }
}

#[test]
fn a_box_and_heights_narrow_the_answer() {
    let (bench, document) = Bench::with_banner();
    let (fid, [e, n, h]) = banner(&document);
    let near = comma(&[e - 1.0, n - 1.0, e + 1.0, n + 1.0]);
    let found = |words: &[&str]| fids(&bench.json("query", words)).contains(&fid);
    assert!(found(&["--bbox", &near]));
    assert!(found(&["--bbox", &near, "--height", &comma(&[h - 0.1, h + 0.1])]));
    assert!(!found(&["--bbox", &near, "--height", &comma(&[h + 100.0, h + 200.0])]));
    assert!(!found(&["--bbox", &comma(&[e + 50.0, n + 50.0, e + 60.0, n + 60.0])]));
    assert_eq!(fids(&bench.json("query", &["--bbox", "-5,-5,5,5"])), [0_u64; 0]);
    assert_eq!(fids(&bench.json("query", &["--class", "banner"])), [fid]);
    assert_eq!(fids(&bench.json("query", &["--class", "chair", "--class", "BANNER"])), [fid]);
    assert_eq!(fids(&bench.json("query", &["--class", "chair"])), [0_u64; 0]);
}

#[test]
fn degrees_find_what_metres_find() {
    let (bench, document) = Bench::with_banner();
    let (fid, _) = banner(&document);
    let here = bench.json("query", &["--class", "banner", "--wgs84"])["features"][0].clone();
    let (latitude, longitude) = (here["latitude"].as_f64().unwrap(), here["longitude"].as_f64().unwrap());
    // The street lies in Tsim Sha Tsui.
    assert!((22.2..22.4).contains(&latitude) && (114.1..114.3).contains(&longitude), "{latitude} {longitude}");
    // 1e-5° are about 1.1 m.
    let [west, south, east, north] = [longitude - 1e-5, latitude - 1e-5, longitude + 1e-5, latitude + 1e-5];
    let bbox = comma(&[west, south, east, north]);
    assert_eq!(fids(&bench.json("query", &["--wgs84", "--bbox", &bbox, "--class", "banner"])), [fid]);
    let place = comma(&[latitude, longitude]);
    assert_eq!(fids(&bench.json("query", &["--near", &place, "--radius", "0.5", "--class", "banner"])), [fid]);
    let away = comma(&[latitude + 0.001, longitude]);
    let found = |radius: &str| fids(&bench.json("query", &["--near", &away, "--radius", radius, "--class", "banner"]));
    // 0.001° of latitude are 110.7 m here (WGS84 meridian).
    assert_eq!((found("100"), found("120")), (vec![], vec![fid]));
}

#[test]
fn a_polygon_finds_what_lies_in_it_and_not_in_its_hole() {
    let (bench, document) = Bench::with_banner();
    let (fid, [e, n, _]) = banner(&document);
    let ring = |reach: f64| {
        json!([
            [e - reach, n - reach],
            [e + reach, n - reach],
            [e + reach, n + reach],
            [e - reach, n + reach],
            [e - reach, n - reach]
        ])
    };
    let polygon = |rings: Value| json!({"type": "Polygon", "coordinates": rings});
    let found = |document: Value, words: &[&str]| {
        let file = bench.file("region.geojson", document.to_string());
        fids(&bench.json("query", &[&["--polygon", &file, "--class", "banner"], words].concat()))
    };
    assert_eq!(found(polygon(json!([ring(20.0)])), &[]), [fid]);
    assert_eq!(found(polygon(json!([ring(20.0), ring(15.0)])), &[]), [0_u64; 0]);
    let feature = json!({"type": "Feature", "properties": {}, "geometry": polygon(json!([ring(20.0)]))});
    assert_eq!(found(feature.clone(), &[]), [fid]);
    assert_eq!(found(json!({"type": "FeatureCollection", "features": [feature]}), &[]), [fid]);
    let here = bench.json("query", &["--class", "banner", "--wgs84"])["features"][0].clone();
    let (y, x) = (here["latitude"].as_f64().unwrap(), here["longitude"].as_f64().unwrap());
    let degrees = json!([[[x - 1e-4, y - 1e-4], [x + 1e-4, y - 1e-4], [x, y + 1e-4], [x - 1e-4, y - 1e-4]]]);
    assert_eq!(found(polygon(degrees), &["--wgs84"]), [fid]);
}

#[test]
fn a_polygon_file_that_is_none_is_exit_10() {
    let bench = Bench::with_street();
    for contents in [
        "",
        "not json",
        "{}",
        r#"{"type":"Point","coordinates":[835600,817800]}"#,
        r#"{"type":"Polygon","coordinates":[]}"#,
        r#"{"type":"Polygon","coordinates":[[]]}"#,
        r#"{"type":"Polygon","coordinates":[[[0,0],[1,1]]]}"#,
        r#"{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0,1]]]}"#,
        r#"{"type":"Polygon","coordinates":[[[0,0],[1,0],[1,1],[0]]]}"#,
        r#"{"type":"Polygon","coordinates":[[[0,0],[1e300,0],[1,1],[0,0]]]}"#,
        r#"{"type":"Polygon","coordinates":[[[0,0],[1e999,0],[1,1],[0,0]]]}"#,
        r#"{"type":"Feature","properties":null,"geometry":null}"#,
        r#"{"type":"FeatureCollection","features":[]}"#,
    ] {
        let file = bench.file("region.geojson", contents);
        bench.refuses("query", &["--polygon", &file], 10, &["region.geojson"]);
    }
    for (contents, found) in [
        (r#"{"type":"Point","coordinates":[835600,817800]}"#, "found a Point"),
        (r#"{"type":"Polygon","coordinates":[]}"#, "found a Polygon without rings"),
        (r#"{"type":"FeatureCollection","features":[]}"#, "found a collection of 0 features"),
        (r#"{"type":"Feature","properties":null,"geometry":null}"#, "found a feature without a geometry"),
    ] {
        let file = bench.file("region.geojson", contents);
        bench.refuses("query", &["--polygon", &file], 10, &["expected one GeoJSON polygon", found]);
    }
    let swapped =
        bench.file("region.geojson", r#"{"type":"Polygon","coordinates":[[[22,114],[23,114],[23,115],[22,114]]]}"#);
    bench.refuses("query", &["--polygon", &swapped, "--wgs84"], 10, &["region.geojson"]);
    bench.refuses("query", &["--polygon", "/nowhere.geojson"], 10, &["/nowhere.geojson"]);
}

#[test]
fn csv_has_a_head_and_as_many_cells_in_every_line() {
    let (bench, document) = Bench::with_banner();
    let out = bench.run("query", &["--format", "csv"]).ok().out;
    let mut lines = out.lines();
    let columns: Vec<&str> = lines.next().unwrap().split(',').collect();
    let mut once = columns.clone();
    once.sort_unstable();
    once.dedup();
    assert_eq!(once.len(), columns.len(), "two columns have one name: {columns:?}");
    let expected = "fid,kind,class,name,easting,northing,height,width_m,height_m,area_m2,sigma_m,from,to";
    assert_eq!(columns.join(","), expected);
    let count = bench.json("query", &[])["features"].as_array().unwrap().len();
    let rows: Vec<Vec<&str>> = lines.map(|line| line.split(',').collect()).collect();
    assert_eq!(rows.len(), count);
    assert!(rows.iter().all(|row| row.len() == columns.len()), "{out}");
    let (fid, [e, ..]) = banner(&document);
    let row = rows.iter().find(|row| row[0] == fid.to_string()).unwrap();
    assert_eq!((row[1], row[2]), ("material", "banner"));
    assert!((row[4].parse::<f64>().unwrap() - e).abs() < 0.01);
    let degrees = bench.run("query", &["--format", "csv", "--wgs84"]).ok().out;
    assert!(degrees.starts_with("fid,kind,class,name,longitude,latitude,ellipsoidal_height,width_m,"), "{degrees}");
}

#[test]
fn a_table_has_a_line_for_every_feature() {
    let (bench, document) = Bench::with_banner();
    let run = bench.run("query", &[]).ok();
    let count = bench.json("query", &[])["features"].as_array().unwrap().len();
    assert_eq!(run.out.lines().count(), count + 1);
    assert_eq!(run.err, format!("{count} features\n"));
    let (fid, _) = banner(&document);
    assert!(run.out.lines().any(|line| line.trim_start().starts_with(&fid.to_string()) && line.contains("banner")));
}

/// Signed area of a ring in plan: positive when it runs counter-clockwise.
fn signed_area(ring: &[[f64; 2]]) -> f64 {
    ring.windows(2).map(|side| side[0][0] * side[1][1] - side[1][0] * side[0][1]).sum::<f64>() / 2.0
}

#[test]
fn geojson_is_of_closed_rings_that_run_counter_clockwise_in_degrees() {
    let (bench, document) = Bench::with_banner();
    let (fid, _) = banner(&document);
    let collection = bench.run("query", &["--format", "geojson"]).ok().json();
    assert_eq!(collection["type"], "FeatureCollection");
    collection.to_string().parse::<geojson::GeoJson>().unwrap();
    let features = collection["features"].as_array().unwrap();
    assert_eq!(features.len(), fids(&bench.json("query", &[])).len());
    for feature in features {
        assert_eq!(feature["type"], "Feature");
        assert_eq!(feature["id"], feature["properties"]["fid"]);
        assert_eq!(feature["geometry"]["type"], "Polygon");
        // RFC 7946, 3.1.6: four positions or more, the first is the last, the right-hand rule.
        let ring = feature["geometry"]["coordinates"][0].as_array().unwrap();
        assert!(ring.len() >= 4 && ring.first() == ring.last(), "{ring:?}");
        let plan: Vec<[f64; 2]> = ring.iter().map(|at| [0, 1].map(|axis| at[axis].as_f64().unwrap())).collect();
        assert!(plan.iter().all(|[x, y]| (113.8..114.5).contains(x) && (22.1..22.6).contains(y)), "{plan:?}");
        if feature["id"] != fid {
            assert!(signed_area(&plan) > 0.0, "{plan:?}");
        }
    }
}

#[test]
fn an_empty_map_gives_empty_answers() {
    let bench = Bench::with_empty_map();
    assert_eq!(bench.json("query", &[]), json!({"version": 0, "features": []}));
    let collection = bench.run("query", &["--format", "geojson"]).ok().json();
    assert_eq!(collection, json!({"type": "FeatureCollection", "features": []}));
    assert_eq!(bench.run("query", &["--format", "csv"]).ok().out.lines().count(), 1);
    assert_eq!(bench.run("query", &[]).ok().err, "0 features\n");
}

#[test]
fn init_and_import_say_what_they_made() {
    let bench = Bench::with_empty_map();
    let map = bench.path("new.rsv");
    let made = resurvey(&["init", text(&map), "--json"]).ok().json();
    let keys: Vec<&String> = made.as_object().unwrap().keys().collect();
    assert_eq!(keys, ["map", "map_id", "version", "crs", "vertical_datum"]);
    assert_eq!(
        (&made["version"], &made["crs"], &made["vertical_datum"]),
        (&json!(0), &json!("EPSG:2326"), &json!("hkpd"))
    );
    for suffix in ["3ds", "glb"] {
        let model = street().model(suffix);
        let imported =
            bench.json("import", &[text(&model), "--origin", &street().origin(), "--message", "survey 2026"]);
        let file = &imported["files"][0];
        let keys: Vec<&String> = file.as_object().unwrap().keys().collect();
        let expected = [
            "file",
            "format",
            "origin",
            "objects",
            "triangles",
            "textures",
            "degenerate_faces",
            "empty_objects",
            "skipped_primitives",
            "warnings",
        ];
        assert_eq!(keys, expected);
        assert!(file["objects"].as_u64().unwrap() > 1 && file["triangles"].as_u64().unwrap() > 100);
    }
    let log = bench.json("log", &["-n", "1"]);
    assert_eq!((&log["versions"][0]["message"], &log["versions"][0]["version"]), (&json!("survey 2026"), &json!(2)));
    assert_eq!(bench.head(), 2);
}

#[test]
fn a_state_has_its_kind_in_every_answer_and_may_be_sent_back() {
    let (bench, document) = Bench::with_banner();
    let fid = document["changes"][0]["fid"].to_string();
    let diff = bench.json("diff", &["1..2"])["changes"][0]["after"].clone();
    let why = bench.json("why", &[&fid])["steps"][0]["after"].clone();
    assert_eq!((&diff["kind"], &why, &document["changes"][0]["after"]), (&json!("material"), &diff, &diff));
    let object = bench.json("diff", &["0..1"])["changes"][0]["after"].clone();
    assert_eq!(object["kind"], "object");
    let before = crate::change_sets::set(
        Some(2),
        &[json!({"op": "remove", "fid": document["changes"][0]["fid"], "before": diff})],
    );
    bench.run("apply", &[&bench.file("set.jsonl", before)]).ok();
    assert_eq!(bench.head(), 3);
}

#[test]
fn a_region_is_the_same_for_every_command() {
    let (bench, document) = Bench::with_banner();
    let (fid, [e, n, h]) = banner(&document);
    let here = bench.json("query", &["--class", "banner", "--wgs84"])["features"][0].clone();
    let (latitude, longitude) = (here["latitude"].as_f64().unwrap(), here["longitude"].as_f64().unwrap());
    let degrees = comma(&[longitude - 1e-5, latitude - 1e-5, longitude + 1e-5, latitude + 1e-5]);
    let nowhere = comma(&[longitude + 1e-2, latitude, longitude + 2e-2, latitude + 1e-5]);
    let versions = |words: &[&str]| bench.json("log", words)["versions"].as_array().unwrap().len();
    assert_eq!((versions(&["--bbox", &degrees, "--wgs84"]) > 0, versions(&["--bbox", &nowhere, "--wgs84"])), (true, 0));
    let changes =
        |words: &[&str]| bench.json("diff", &[&["1..2"], words].concat())["changes"].as_array().unwrap().len();
    assert_eq!((changes(&["--bbox", &degrees, "--wgs84"]), changes(&["--bbox", &nowhere, "--wgs84"])), (1, 0));
    // Heights alone are a region everywhere in plan.
    let (around, above) = (comma(&[h - 0.1, h + 0.1]), comma(&[h + 500.0, h + 600.0]));
    assert!(fids(&bench.json("query", &["--height", &around])).contains(&fid));
    assert!(fids(&bench.json("query", &["--height", &above])).is_empty());
    assert_eq!(
        (changes(&["--height", &around]), changes(&["--height", &above]), versions(&["--height", &above])),
        (1, 0, 0)
    );
    // A feature and a region: the versions that changed it there.
    let (number, near) = (fid.to_string(), comma(&[e - 1.0, n - 1.0, e + 1.0, n + 1.0]));
    assert_eq!((versions(&[&number, "--bbox", &near]), versions(&[&number, "--bbox", "0,0,1,1"])), (1, 0));
    let out = bench.path("out.glb");
    let exported = bench.json("export", &[text(&out), "--bbox", &degrees, "--wgs84"]);
    assert_eq!(exported["descriptors"], 1);
    assert_eq!(bench.run("revert", &["2", "--bbox", &nowhere, "--wgs84"]).code, 20);
    assert_eq!(bench.json("revert", &["2", "--bbox", &degrees, "--wgs84"])["removed"], 1);
}

#[test]
fn degrees_are_added_to_metres_and_replace_none() {
    let (bench, document) = Bench::with_banner();
    let (fid, _) = banner(&document);
    let [plain, degrees] = [&[][..], &["--wgs84"]].map(|words: &[&str]| bench.json("query", words));
    let collection = bench.run("query", &["--format", "geojson"]).ok().json();
    for (index, feature) in degrees["features"].as_array().unwrap().iter().enumerate() {
        let mut without = feature.clone();
        for key in ["latitude", "longitude", "ellipsoidal_height", "wgs84"] {
            assert!(!without[key].is_null(), "{key} is missing in {feature}");
            without.as_object_mut().unwrap().remove(key);
        }
        assert_eq!(without, plain["features"][index]);
        assert_eq!(feature["wgs84"], collection["features"][index]["geometry"]);
    }
    let csv = bench.run("query", &["--format", "csv", "--wgs84", "--class", "banner"]).ok().out;
    let height: f64 = csv.lines().nth(1).unwrap().split(',').nth(6).unwrap().parse().unwrap();
    let own = degrees["features"].as_array().unwrap().iter().find(|one| one["fid"] == fid).unwrap();
    assert!((own["ellipsoidal_height"].as_f64().unwrap() - height).abs() < 1e-9);
}

#[test]
fn what_lies_outside_the_system_has_no_place_in_degrees_and_is_listed() {
    let bench = crate::change_sets::furnished();
    bench.apply(&[json!({"op": "add", "after": {"class": "chair", "position": [10.0, 20.0, 0.0]}})]);
    let warned = |run: crate::bench::Run| {
        assert!(run.err.contains("warning: 1 features have no position in degrees"), "{}", run.err);
        run
    };
    let collection = warned(bench.run("query", &["--format", "geojson"]).ok()).json();
    let geometries: Vec<bool> =
        collection["features"].as_array().unwrap().iter().map(|one| one["geometry"].is_null()).collect();
    assert_eq!(geometries, [false, false, true]);
    collection.to_string().parse::<geojson::GeoJson>().unwrap();
    let answer = warned(bench.run("query", &["--wgs84", "--json"]).ok()).json();
    assert_eq!((&answer["features"][2]["latitude"], &answer["features"][2]["wgs84"]), (&Value::Null, &Value::Null));
    let csv = warned(bench.run("query", &["--wgs84", "--format", "csv"]).ok()).out;
    assert!(csv.lines().nth(3).unwrap().starts_with("3,dynamic,chair,,,,,"), "{csv}");
    assert_eq!(warned(bench.run("query", &["--wgs84"]).ok()).out.lines().count(), 4);
    let diff = warned(bench.run("diff", &["1..2", "--format", "geojson"]).ok()).json();
    assert_eq!(diff["features"][0]["geometry"], Value::Null);
}

#[test]
fn a_place_within_a_large_banner_finds_it_as_its_box_does() {
    let bench = Bench::with_empty_map();
    let [e, n, h] = crate::change_sets::CHAIR;
    // 40 m along a wall: centre and corners are far from where is asked.
    let banner = json!({"class": "banner",
        "corners": [[e, n, h], [e, n + 40.0, h], [e, n + 40.0, h + 5.0], [e, n, h + 5.0]]});
    bench.apply(&[json!({"op": "add", "after": banner})]);
    let ring = |east: f64| {
        let corner = |x: f64, y: f64| [e + east + x, n + 10.0 + y];
        json!({"type": "Polygon", "coordinates": [[corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0), corner(-1.0, -1.0)]]})
    };
    let found = |east: f64| {
        let file = bench.file("region.geojson", ring(east).to_string());
        fids(&bench.json("query", &["--polygon", &file]))
    };
    assert_eq!((found(0.0), found(3.0)), (vec![1], vec![]));
    // A circle 2.5 m off the wall, at a quarter of its length; 1 m is 9.7e-6° of longitude there.
    let quarter = json!({"class": "chair", "position": [e + 2.5, n + 10.0, h]});
    bench.apply(&[json!({"op": "add", "after": quarter})]);
    let place = bench.json("query", &["--class", "chair", "--wgs84"])["features"][0].clone();
    let place = comma(&[place["latitude"].as_f64().unwrap(), place["longitude"].as_f64().unwrap()]);
    let near = |radius: &str| fids(&bench.json("query", &["--near", &place, "--radius", radius, "--class", "banner"]));
    assert_eq!((near("2.4"), near("2.6")), (vec![], vec![1]));
}
