//! Plugins from files through `--plugin-dir` and `--allow-plugin`: what does not work is exit code 12, and the map stays.

use crate::bench::{Bench, resurvey, street, text};
use serde_json::json;
use sha2::Digest;
use std::io::Write as _;
use std::path::Path;
use std::process::Command;

const ROOT: &str = env!("CARGO_MANIFEST_DIR");

/// Compiles a fixture in C into the directory of `bench`, with its SHA-256; `None`, said aloud, without a compiler.
pub fn plugin(bench: &Bench, source: &str, name: &str, flags: &[&str]) -> Option<String> {
    let directory = bench.path("plugins");
    std::fs::create_dir_all(&directory).unwrap();
    let library = directory.join(format!("lib{name}.so"));
    let built = Command::new("cc")
        .args(["-std=c11", "-fPIC", "-shared", "-I"])
        .arg(format!("{ROOT}/schema/include"))
        .arg(format!("{ROOT}/plugins/fixtures/c/{source}"))
        .args(flags)
        .arg("-o")
        .arg(&library)
        .output();
    let Ok(built) = built else {
        let _ = writeln!(std::io::stderr(), "SKIPPED: no C compiler cc; plugin files were not tested");
        return None;
    };
    assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
    restrict(&directory, 0o755);
    restrict(&library, 0o644);
    Some(sha256(&std::fs::read(&library).unwrap()))
}

/// SHA-256 in hexadecimal digits.
pub fn sha256(bytes: &[u8]) -> String {
    sha2::Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

/// Sets the mode of a file.
pub fn restrict(path: &Path, mode: u32) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    }
    #[cfg(not(unix))]
    let _ = (path, mode);
}

/// Asserts that `update` with the matcher called `name` ends with code 12 and changes nothing.
fn refuses_update(bench: &Bench, name: &str, sha256: &str, words: &[&str]) {
    let (capture, directory) = (street().path("capture/capture.json"), bench.path("plugins"));
    let arguments = [text(&capture), "--matcher", name, "--plugin-dir", text(&directory), "--allow-plugin", sha256];
    bench.refuses("update", &arguments, 12, words);
    bench.refuses("localize", &arguments, 12, words);
}

#[test]
fn a_plugin_that_is_not_allowed_is_refused_by_its_digest() {
    let bench = Bench::with_street();
    let Some(sha256) = plugin(&bench, "matcher.c", "agreement", &[]) else { return };
    let other = "0".repeat(64);
    refuses_update(&bench, "agreement", &other, &["libagreement.so", &sha256, "not on the list"]);
    let (capture, directory) = (street().path("capture/capture.json"), bench.path("plugins"));
    let words = [text(&capture), "--matcher", "agreement", "--plugin-dir", text(&directory)];
    bench.refuses("update", &[&words[..], &["--allow-plugin", "123"]].concat(), 2, &["123"]);
}

#[test]
fn a_plugin_that_was_built_with_the_first_header_still_works() {
    let bench = Bench::with_street();
    // It comes before the header of today, whose guard then leaves that out.
    let first = format!("{ROOT}/plugins/fixtures/c/abi-1.0/resurvey_plugin.h");
    let Some(sha256) = plugin(&bench, "matcher.c", "first", &["-include", &first]) else { return };
    let (capture, directory) = (street().path("capture/capture.json"), bench.path("plugins"));
    let arguments = [text(&capture), "--matcher", "agreement", "--plugin-dir", text(&directory)];
    for how in [&["--allow-plugin", sha256.as_str()][..], &["--allow-plugin", &sha256, "--in-process"]] {
        let run = bench.run("localize", &[&arguments[..], how, &["--json"]].concat());
        // 22: its score is a share of pixels, which the gate may find low.
        assert!([0, 22].contains(&run.code), "{}", run.err);
        let (found, truth) = (run.json(), &street().case.truth.json["pose"]);
        let off = |key: &str| found["pose"][key].as_f64().unwrap() - truth[key].as_f64().unwrap();
        assert!(off("easting").hypot(off("northing")) < 2.0, "{found}");
    }
}

#[test]
fn a_plugin_of_another_abi_is_refused_with_what_to_do() {
    let bench = Bench::with_street();
    let Some(sha256) = plugin(&bench, "broken.c", "broken", &["-DMAJOR=2"]) else { return };
    refuses_update(&bench, "broken", &sha256, &["libbroken.so", "ABI 2.0", "upgrade resurvey"]);
}

#[test]
fn a_plugin_that_fails_or_lies_stops_the_update() {
    for (flag, words) in [
        ("-DENTRY_FAILS", &["needs a licence"][..]),
        ("-DCREATE_FAILS", &["plugin broken", "no model for this city"]),
        // It leaves what it has freed where the instance would be.
        ("-DCREATE_LEAVES", &["plugin broken gave no answer in create: no model for this city"]),
        ("-DSCORE=NAN", &["plugin broken", "NaN", "from 0 to 1"]),
        ("-DNO_REASON", &["plugin broken", "no reason given"]),
    ] {
        let bench = Bench::with_street();
        // The system opens a file of the same name once.
        let name = format!("cli{}", flag.replace(['-', '='], "").to_lowercase());
        let Some(sha256) = plugin(&bench, "broken.c", &name, &[flag]) else { return };
        refuses_update(&bench, "broken", &sha256, words);
    }
}

#[test]
fn a_plugin_that_panics_is_exit_12_and_the_program_lives_on() {
    for mode in ["panic-in-create", "panic-in-score", "not-a-number"] {
        let bench = Bench::with_street();
        let directory = bench.path("plugins");
        std::fs::create_dir_all(&directory).unwrap();
        let built = format!("{}resurvey_fixtures{}", std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
        let bytes = std::fs::read(std::env::current_exe().unwrap().with_file_name(&built)).unwrap();
        let library = directory.join(built);
        std::fs::write(&library, &bytes).unwrap();
        restrict(&directory, 0o755);
        restrict(&library, 0o644);
        let (capture, sha256) = (street().path("capture/capture.json"), sha256(&bytes));
        let setting = format!("fixture.mode={mode}");
        let arguments = [
            text(&capture),
            "--matcher",
            "fixture",
            "--set",
            &setting,
            "--set",
            "search.radius_m=2",
            "--plugin-dir",
            text(&directory),
            "--allow-plugin",
            &sha256,
        ];
        let word = if mode == "not-a-number" { "NaN" } else { "panicked in" };
        for command in ["localize", "update"] {
            bench.refuses(command, &arguments, 12, &["plugin fixture", word]);
        }
        assert_eq!(bench.head(), 1);
    }
}

#[test]
fn listing_says_where_it_looked_and_why_a_file_is_skipped() {
    let bench = Bench::with_street();
    let Some(sha256) = plugin(&bench, "matcher.c", "agreement", &[]) else { return };
    let directory = bench.path("plugins");
    std::fs::write(directory.join("libtext.so"), "text").unwrap();
    let words = ["plugins", "list", "--plugin-dir", text(&directory), "--allow-plugin", &sha256];
    let document = resurvey(&[&words[..], &["--json"]].concat()).ok().json();
    let plugins = document["plugins"].as_array().unwrap();
    let agreement = plugins.iter().find(|plugin| plugin["name"] == "agreement").unwrap();
    assert_eq!((&agreement["kind"], &agreement["builtin"]), (&json!("matcher"), &json!(false)));
    assert_eq!(agreement["sha256"], json!(sha256));
    assert!(agreement["path"].as_str().unwrap().ends_with("libagreement.so"));
    let skipped = document["skipped"].as_array().unwrap();
    assert!(skipped.iter().any(|file| file["path"].as_str().unwrap().ends_with("libtext.so")), "{skipped:?}");
    let verbose = resurvey(&[&words[..], &["--verbose"]].concat()).ok().out;
    assert!(verbose.contains(&format!("searched {}", directory.display())) && verbose.contains("libtext.so"));
}

#[test]
fn an_allowed_plugin_localizes_and_is_named_in_the_result() {
    let bench = Bench::with_street();
    let Some(sha256) = plugin(&bench, "matcher.c", "agreement", &[]) else { return };
    let (capture, directory) = (street().path("capture/capture.json"), bench.path("plugins"));
    let arguments = [
        text(&capture),
        "--matcher",
        "agreement",
        "--plugin-dir",
        text(&directory),
        "--allow-plugin",
        &sha256,
        "--set",
        "search.radius_m=3",
        "--set",
        "search.yaw_range_deg=2",
        "--json",
    ];
    let run = bench.run("localize", &arguments);
    assert!([0, 22].contains(&run.code), "{}", run.err);
    assert_eq!(run.json()["matcher"], json!({"name": "agreement", "version": "1.0.0", "sha256": sha256}));
}

#[cfg(unix)]
#[test]
fn what_a_plugin_said_before_it_failed_is_printed() {
    for command in ["localize", "update"] {
        let bench = Bench::with_street();
        let Some(sha256) = plugin(&bench, "faults.c", "faults", &["-DSEARCH"]) else { return };
        let (capture, directory) = (street().path("capture/capture.json"), bench.path("plugins"));
        let output = Command::new(env!("CARGO_BIN_EXE_resurvey"))
            .args([command, text(&bench.path("map.rsv")), text(&capture), "--matcher", "faults"])
            .args(["--set", "faults.how=exit", "--plugin-dir", text(&directory), "--allow-plugin", &sha256])
            .env("XDG_DATA_HOME", bench.path("data"))
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert_eq!(output.status.code(), Some(12), "{said}");
        let (told, failed) = (said.find("searching\n"), said.find("resurvey: "));
        assert!(told.is_some() && told < failed, "{said}");
    }
}
