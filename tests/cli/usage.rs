//! Wrong command lines: exit code 2, or 11 for a name that nothing has.

use crate::bench::{Bench, resurvey, street, text};
use serde_json::json;

#[test]
fn a_command_line_that_is_none_is_exit_2_and_explains_itself() {
    for (words, expected) in [
        (&["updaet"][..], "unrecognized subcommand 'updaet'"),
        (&["query"], "<MAP>"),
        (&["query", "map.rsv", "--bbox", "1,2,3"], "expected 4 numbers with commas, found 3"),
        (&["query", "map.rsv", "--bbox", "1,2,3,NaN"], "expected finite numbers, found NaN"),
        (&["query", "map.rsv", "--near", "22.3,114.17"], "--radius"),
        (&["query", "map.rsv", "--near", "22.3,114.17", "--radius", "far"], "expected metres, found \"far\""),
        (&["query", "map.rsv", "--near", "22.3,114.17", "--radius", "5", "--bbox", "1,2,3,4"], "cannot be used with"),
        (&["query", "map.rsv", "--format", "xml"], "[possible values: table, json, geojson, csv]"),
        (&["import", "map.rsv", "a.3ds", "--up", "x"], "[possible values: y, z]"),
        (&["import", "map.rsv", "a.3ds", "--void-index", "256"], "256 is not in 0..=255"),
        (&["why", "map.rsv", "-1"], "unexpected argument"),
        (&["why", "map.rsv", "banner"], "expected a number, found \"banner\""),
        (&["proposals", "map.rsv", "show", "first"], "expected a number, found \"first\""),
        (&["localize", "map.rsv", "capture.json", "--truth", "truth.json"], "--heatmap"),
        (&["completions", "cmd.exe"], "invalid value"),
    ] {
        resurvey(words).refused(2, &[expected]);
    }
    let nothing = resurvey::<&str>(&[]);
    nothing.refused(2, &["Usage: resurvey"]);
    let help = resurvey(&["--help"]).ok();
    assert!(help.out.contains("Keeps a 3D city map current") && help.err.is_empty());
    assert!(resurvey(&["--version"]).ok().out.starts_with("resurvey "));
}

#[test]
fn a_region_with_its_ends_swapped_is_exit_2() {
    let bench = Bench::with_street();
    for command in ["query", "log"] {
        bench.refuses(command, &["--bbox", "10,0,5,1"], 2, &["10 is above 5", "E0 <= E1"]);
        bench.refuses(command, &["--bbox", "0,9,1,8"], 2, &["9 is above 8"]);
        bench.refuses(command, &["--bbox", "0,0,1,1", "--height", "7,6"], 2, &["--height: 7 is above 6"]);
    }
    let out = text(&bench.path("out.glb")).to_owned();
    bench.refuses("export", &[&out, "--bbox", "10,0,5,1"], 2, &["10 is above 5"]);
    assert!(!bench.path("out.glb").exists());
    bench.refuses("query", &["--bbox", "0,0,1e300,1"], 2, &["is not within"]);
    for (words, code) in [(&["--format", "csv"][..], 2), (&["--format", "table"], 2), (&["--format", "json"], 0)] {
        assert_eq!(bench.run("query", &[words, &["--json"]].concat()).code, code, "{words:?}");
    }
    bench.refuses("diff", &["0..1", "--format", "text", "--json"], 2, &["--json", "--format json or geojson"]);
    // GeoJSON is one JSON document too.
    for line in [&["query"][..], &["diff", "0..1"]] {
        let words = [&line[1..], &["--format", "geojson"]].concat();
        let [alone, beside] = [&words, &[&words[..], &["--json"]].concat()].map(|words| bench.run(line[0], words).ok());
        assert_eq!((&alone.json()["type"], alone.out == beside.out), (&json!("FeatureCollection"), true));
    }
}

#[test]
fn a_place_that_is_not_on_the_map_is_refused_with_its_numbers() {
    let bench = Bench::with_street();
    bench.refuses("query", &["--near", "91,114", "--radius", "10"], 2, &["91"]);
    bench.refuses("query", &["--near", "48.85,2.35", "--radius", "10"], 2, &["48.85"]);
    bench.refuses("query", &["--near", "22.3,114.17", "--radius", "-1"], 2, &["--radius -1"]);
    bench.refuses("query", &["--near", "22.3,114.17", "--radius", "NaN"], 2, &["--radius NaN"]);
    bench.refuses("query", &["--wgs84", "--bbox", "200,0,201,1"], 2, &["20"]);
    let swapped = ["--wgs84", "--bbox", "22.29,114.16,22.30,114.18"];
    bench.refuses("query", &swapped, 2, &["latitude 114.16", "longitude,latitude,longitude,latitude"]);
    bench.refuses("query", &["--bbox=-1e308,0,1,1"], 2, &["easting -1e308 m"]);
}

#[test]
fn names_that_nothing_has_are_exit_11_and_the_known_ones_are_listed() {
    let bench = Bench::with_street();
    bench.refuses("query", &["--at", "99"], 11, &["no version 99; the newest is 1"]);
    bench.refuses("query", &["--at", "spring"], 11, &["no tag \"spring\"", "resurvey tag MAP"]);
    bench.refuses("query", &["--at", "2026-03-01"], 11, &["no tag \"2026-03-01\"", "@2026-03-01"]);
    bench.refuses("query", &["--at", "@1999-12-31"], 11, &["no version at 1999-12-31"]);
    bench.refuses("query", &["--at", "@yesterday"], 2, &["@2026-03-01"]);
    bench.refuses("query", &["--at", "a b"], 2, &["expected a version number, a tag, head, or @DATE"]);
    bench.refuses("query", &["--class", "marble"], 11, &["no class \"marble\"", "stone, glass, metal, banner"]);
    bench.refuses("why", &["4000000"], 11, &["no feature 4000000", "resurvey query MAP"]);
    bench.refuses("log", &["4000000"], 11, &["no feature 4000000"]);
    bench.refuses("why", &["0"], 11, &["no feature 0"]);
    let capture = street().path("capture/capture.json");
    let capture = text(&capture);
    for command in ["localize", "update"] {
        bench.refuses(
            command,
            &[capture, "--matcher", "magic"],
            11,
            &["magic", "edges, palette, pixel, semantic, silhouette, skyline"],
        );
    }
    bench.refuses("update", &[capture, "--detector", "magic"], 11, &["class-difference"]);
    bench.refuses("update", &[capture, "--estimator", "magic"], 11, &["descriptors"]);
    resurvey(&["plugins", "info", "magic"]).refused(11, &["magic", "semantic"]);
}

#[test]
fn a_plugin_in_the_place_of_another_kind_is_refused() {
    let bench = Bench::with_street();
    let capture = street().path("capture/capture.json");
    bench.refuses("update", &[text(&capture), "--matcher", "descriptors"], 12, &["descriptors", "matcher"]);
    bench.refuses("update", &[text(&capture), "--detector", "semantic"], 12, &["semantic", "detector"]);
}

#[test]
fn a_setting_that_cannot_be_is_exit_2_with_what_can() {
    let bench = Bench::with_street();
    let capture = street().path("capture/capture.json");
    for (setting, words) in [
        ("semantic", &["--set semantic", "plugin.key=value"][..]),
        ("semantic.=1", &["plugin.key=value"]),
        ("semantic.colour=1", &["no setting is called \"colour\"", "known are"]),
        ("semantic.modes=many", &["modes", "many"]),
        ("skyline.sky_class=3", &["does not use \"skyline\"", "semantic"]),
        ("semantic.radius_m=-1", &["radius_m", "from 0 to 500"]),
        ("gate.luck=1", &["gate has no setting \"luck\"", "min_score"]),
        ("gate.min_score=high", &["expected a number"]),
        ("gate.min_score=NaN", &["expected a number"]),
        ("gate.min_score=-1", &["gate.min_score=-1", "0 to 1"]),
        ("gate.max_position_sigma_m=-0.5", &["gate.max_position_sigma_m=-0.5", "0 or more"]),
        ("search.radius_m=1e9", &["search.radius_m=1000000000", "0 to 500"]),
        ("search.yaw_range_deg=181", &["0 to 180"]),
        ("search.depth=1", &["search.depth=1", "radius_m"]),
    ] {
        for command in ["localize", "update"] {
            bench.refuses(command, &[text(&capture), "--set", setting], 2, words);
        }
    }
    bench.refuses("update", &[text(&capture), "--profile", "fast"], 2, &["profile", "fast"]);
}

#[test]
fn what_a_command_would_pass_over_in_silence_is_refused() {
    let bench = Bench::with_street();
    let (capture, pose) = (street().path("capture/capture.json"), street().path("pose.json"));
    bench.refuses("tag", &["spring", "1", "--delete"], 2, &["cannot be used with"]);
    bench.refuses(
        "update",
        &[text(&capture), "--pose", text(&pose), "--matcher", "skyline"],
        2,
        &["cannot be used with"],
    );
    for (words, said) in [
        (&["list", "1"][..], "a number belongs to show, accept and reject"),
        (&["show", "1", "--all"], "--all belongs to list"),
        (&["list", "--by", "ada"], "--by belongs to accept and reject"),
        (&["show", "1", "--note", "why"], "--note belongs to accept and reject"),
    ] {
        bench.refuses("proposals", words, 2, &[said]);
    }
}

#[test]
fn the_help_says_what_the_exit_codes_mean() {
    let help = resurvey(&["--help"]).ok().out;
    for code in ["0 ", "1 ", "2 ", "10", "11", "12", "13", "20", "21", "22"] {
        assert!(help.lines().any(|line| line.starts_with(&format!("  {code}  "))), "{code}: {help}");
    }
    assert!(resurvey(&["export", "--help"]).ok().out.contains(".gltf"));
}

#[test]
fn the_options_of_every_command_stand_below_its_own() {
    for command in ["query", "update", "fsck", "plugins"] {
        let help = resurvey(&[command, "--help"]).ok().out;
        let (own, everywhere) = help.split_once("Options of every command:").unwrap();
        for option in ["--json", "--plugin-dir", "--plugin-timeout", "--in-process"] {
            assert!(everywhere.contains(option) && !own.contains(&format!("{option} ")), "{command} {option}: {help}");
        }
        assert!(own.contains("Options:") || command == "plugins", "{help}");
    }
}
