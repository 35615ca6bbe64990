//! Library files through the public door: what is refused, at which gate, with which words, and what loads.
#![allow(clippy::unwrap_used, clippy::panic)] // also in the helpers of a test

use resurvey_core::image::Raster;
use resurvey_core::plugin::{Digest, PluginError, Registry, Stage, ViewImages};
use resurvey_schema::GridPoint;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::Command;

const ROOT: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/..");

/// A directory with C fixtures in it.
struct Fixtures(tempfile::TempDir);

/// `None`, said aloud, where there is no C compiler.
fn fixtures() -> Option<Fixtures> {
    if Command::new("cc").arg("--version").output().is_err() {
        // Past the capture of the test harness: a skipped test should be seen.
        let _ = writeln!(std::io::stderr(), "SKIPPED: no C compiler cc; plugin files were not tested");
        return None;
    }
    Some(Fixtures(tempfile::tempdir().unwrap()))
}

impl Fixtures {
    /// Compiles `source` with `flags` as `lib<name>.so`.
    fn build(&self, source: &str, name: &str, flags: &[&str]) -> PathBuf {
        let library = self.0.path().join(format!("lib{name}.so"));
        let built = Command::new("cc")
            .args(["-std=c11", "-Wall", "-Wextra", "-Werror", "-fPIC", "-shared", "-I"])
            .arg(format!("{ROOT}/schema/include"))
            .arg(format!("{ROOT}/plugins/fixtures/c/{source}"))
            .args(flags)
            .arg("-o")
            .arg(&library)
            .output()
            .unwrap();
        assert!(built.status.success(), "{}", String::from_utf8_lossy(&built.stderr));
        set_mode(&library, 0o644);
        library
    }

    fn broken(&self, name: &str, flags: &[&str]) -> PathBuf {
        self.build("broken.c", name, flags)
    }
}

fn set_mode(path: &Path, mode: u32) {
    #[cfg(unix)]
    {
        use std::os::unix::fs::PermissionsExt;
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    }
    #[cfg(not(unix))]
    let _ = (path, mode);
}

fn digest(path: &Path) -> Digest {
    Digest::of(&std::fs::read(path).unwrap())
}

fn allowing(path: &Path) -> Registry {
    Registry::new([digest(path)])
}

fn refusal(path: &Path) -> (Stage, String) {
    match allowing(path).load_file(path) {
        Err(PluginError::Refused(refusal)) => (refusal.stage, refusal.to_string()),
        other => panic!("expected a refusal, found {other:?}"),
    }
}

/// Scores two 3 × 2 images of the classes given.
fn score(path: &Path, photo: [u8; 6], view: [u8; 6]) -> Result<f64, PluginError> {
    let plugin = allowing(path).load_file(path)?;
    let mut matcher = plugin.matcher(&plugin.settings([])?)?;
    let labels = |values: [u8; 6]| Raster::from_values(3, 2, values.to_vec()).unwrap();
    let view = ViewImages {
        origin: GridPoint::new(836_694.05, 819_069.8, 0.0),
        labels: &labels(view),
        range_m: &Raster::filled(3, 2, 10.0),
        points: &Raster::filled(3, 2, [0.0; 3]),
        features: &Raster::filled(3, 2, 0),
        feature_table: &[],
    };
    matcher.score(&labels(photo), &view)
}

#[test]
fn a_matcher_in_c_loads_and_scores() {
    let Some(fixtures) = fixtures() else { return };
    let path = fixtures.build("matcher.c", "agreement", &[]);
    let info = allowing(&path).load_file(&path).unwrap().info().clone();
    assert_eq!((info.name.as_str(), info.version.as_str(), info.builtin), ("agreement", "1.0.0", false));
    assert_eq!(info.sha256, digest(&path));
    // Five pixels are compared, four agree.
    assert!((score(&path, [0, 1, 2, 3, 4, 255], [0, 1, 2, 3, 5, 6]).unwrap() - 0.8).abs() < 1e-12);
    let message = score(&path, [255; 6], [0; 6]).unwrap_err().to_string();
    assert_eq!(message, "plugin agreement gave no answer in score: every pixel of the photo is void");
}

#[test]
fn a_setting_that_is_misspelt_is_refused_before_c_code_sees_it() {
    let Some(fixtures) = fixtures() else { return };
    let path = fixtures.build("matcher.c", "agreement", &[]);
    let plugin = allowing(&path).load_file(&path).unwrap();
    let message = plugin.settings([("void_is_rong", "true")]).unwrap_err().to_string();
    assert_eq!(message, r#"plugin agreement: no setting is called "void_is_rong"; known are: void_is_wrong"#);
    assert_eq!(plugin.settings([("void_is_wrong", "true")]).unwrap().as_json(), r#"{"void_is_wrong":true}"#);
}

#[test]
fn a_plugin_of_another_abi_is_refused_with_what_to_do() {
    let Some(fixtures) = fixtures() else { return };
    let expected = "refused libother.so at abi: plugin speaks ABI 2.0, this host speaks 1.0 to 1.1 · \
                    upgrade resurvey, or install a build for ABI 1";
    assert_eq!(refusal(&fixtures.broken("other", &["-DMAJOR=2"])), (Stage::Abi, expected.to_owned()));
    let renamed = fixtures.broken("other", &["-DSYMBOL=resurvey_plugin_v3__broken"]);
    assert_eq!(refusal(&renamed), (Stage::Abi, expected.replace("ABI 2.0", "ABI 3")));
}

#[test]
fn every_other_way_to_be_broken_has_its_gate_and_its_words() {
    let Some(fixtures) = fixtures() else { return };
    let cases: &[(&[&str], Stage, &str)] = &[
        (&["-DMIN_HOST=9"], Stage::Abi, "plugin needs a host of ABI 1.9, this host speaks 1.0 to 1.1"),
        (&["-DKIND=9"], Stage::Abi, "plugin is of kind 9, this host knows 1 (matcher)"),
        (&["-DMAGIC={0}"], Stage::Header, "expected the letters RESURVEY, found \\x00"),
        (&["-DSIZE=64"], Stage::Header, "expected a declaration of at least 272 bytes, found 64"),
        (&["-DNAME=\"Not A Name\""], Stage::Header, "expected a name of a–z, 0–9 and dashes, found \"Not A Name\""),
        (&["-DSYMBOL=resurvey_plug"], Stage::Header, "exports no symbol that begins with resurvey_plugin_v1__"),
        (&["-DSECOND=resurvey_plugin_v1__second"], Stage::Header, "exports more than one declaration"),
        (&["-DUNDEFINED_SYMBOL"], Stage::Symbol, "resurvey_nobody_has_this"),
        (&["-DENTRY_FAILS"], Stage::Entry, "its entry returned status 1: needs a licence"),
        (&["-DNO_SCORE"], Stage::Entry, "a matcher needs the function score or search, its table has none"),
        (&["-DKIND=2"], Stage::Entry, "a detector needs the function detect, its table has none"),
        (&["-DKIND=4"], Stage::Entry, "a segmenter needs the function segment, its table has none"),
        (&["-DSCHEMA=\"[]\""], Stage::Settings, "settings schema: expected an object, found []"),
    ];
    for (index, (flags, stage, words)) in cases.iter().enumerate() {
        // The system opens a file of the same name once: each case needs its own.
        let path = fixtures.broken(&format!("broken{index}"), flags);
        let (found, message) = refusal(&path);
        assert_eq!(found, *stage, "{flags:?}: {message}");
        assert!(message.contains(words), "{flags:?}: {message}");
    }
}

#[test]
fn an_answer_outside_0_to_1_names_plugin_field_and_value() {
    let Some(fixtures) = fixtures() else { return };
    for (index, (value, shown)) in
        [("NAN", "NaN"), ("1.5", "1.5"), ("-1", "-1"), ("INFINITY", "inf")].iter().enumerate()
    {
        let path = fixtures.broken(&format!("answer{index}"), &[&format!("-DSCORE={value}")]);
        let message = score(&path, [0; 6], [0; 6]).unwrap_err().to_string();
        let expected = format!("plugin broken answered score = {shown} in score; expected a number from 0 to 1");
        assert_eq!(message, expected);
    }
}

#[test]
fn statuses_become_errors_with_the_plugins_own_words() {
    let Some(fixtures) = fixtures() else { return };
    let failure = |name: &str, flag: &str| score(&fixtures.broken(name, &[flag]), [0; 6], [0; 6]).unwrap_err();
    assert_eq!(failure("cancelled", "-DCANCELLED").to_string(), "plugin broken was cancelled in score");
    let message = failure("create", "-DCREATE_FAILS").to_string();
    assert_eq!(message, "plugin broken gave no answer in create: no model for this city");
    let message = failure("reason", "-DNO_REASON").to_string();
    assert_eq!(message, "plugin broken gave no answer in score: no reason given");
    let PluginError::Failed { text, .. } = failure("long", "-DLONG_ERROR") else { panic!("expected a failure") };
    assert_eq!(text, "x".repeat(2048));
}

#[test]
fn files_that_are_no_libraries_are_refused() {
    let directory = tempfile::tempdir().unwrap();
    for (name, bytes) in [("empty", &b""[..]), ("text", b"not a library at all, but long enough to be read as one")] {
        let path = directory.path().join(name);
        std::fs::write(&path, bytes).unwrap();
        let (stage, message) = refusal(&path);
        assert_eq!(stage, Stage::Header, "{message}");
        assert!(message.contains("not a library of this system"), "{message}");
    }
    let missing = Registry::new([]).load_file(&directory.path().join("none.so")).unwrap_err().to_string();
    assert!(missing.starts_with("refused none.so at file: "), "{missing}");
    let itself = Registry::new([]).load_file(directory.path()).unwrap_err().to_string();
    assert!(itself.contains("at file: not a file"), "{itself}");
}

#[test]
fn a_file_cut_off_anywhere_is_refused_and_never_opened() {
    let Some(fixtures) = fixtures() else { return };
    // Opening it would run the constructor, which aborts: this test passing shows that nothing was opened.
    let path = fixtures.broken("cut", &["-DCONSTRUCTOR"]);
    let whole = std::fs::read(&path).unwrap();
    for length in (0..whole.len()).step_by(whole.len() / 97).chain([1, 16, 63, 64, whole.len() - 1]) {
        let cut = path.with_file_name(format!("cut{length}.so"));
        std::fs::write(&cut, &whole[..length]).unwrap();
        let (stage, message) = refusal(&cut);
        assert_eq!(stage, Stage::Header, "{length} bytes: {message}");
    }
}

#[test]
fn a_damaged_header_table_never_crashes_the_reader() {
    let Some(fixtures) = fixtures() else { return };
    let whole = std::fs::read(fixtures.broken("damaged", &["-DMAJOR=2"])).unwrap();
    let path = fixtures.0.path().join("damage.so");
    // The first 4 KiB hold the ELF header, the segments and the dynamic symbols; the last, the sections.
    let places = (0..4096.min(whole.len())).chain(whole.len().saturating_sub(2048)..whole.len()).step_by(7);
    for place in places {
        let mut bytes = whole.clone();
        bytes[place] ^= 0xff;
        std::fs::write(&path, bytes).unwrap();
        assert!(refusal(&path).0 <= Stage::Abi);
    }
}

#[test]
fn listing_runs_no_code_and_says_why_each_file_is_skipped() {
    let Some(fixtures) = fixtures() else { return };
    let directory = fixtures.0.path();
    let good = fixtures.build("matcher.c", "agreement", &[]);
    let aborts = fixtures.broken("aborts", &["-DCONSTRUCTOR", "-DNAME=\"aborts\""]);
    std::fs::write(directory.join("libtext.so"), "text").unwrap();
    std::fs::write(directory.join("readme.txt"), "text").unwrap();

    let mut registry = Registry::new([digest(&good), digest(&aborts)]);
    registry.add_directory(directory);
    let names: Vec<_> = registry.list().into_iter().map(|info| info.name).collect();
    assert_eq!(names, ["aborts", "agreement"]);
    assert_eq!(registry.list()[1].settings_schema, None);
    let skipped: Vec<_> = registry.skipped().iter().map(|skipped| skipped.refusal.name.as_str()).collect();
    assert_eq!(skipped, ["libtext.so"]);
    assert_eq!(registry.directories(), [directory]);
    assert_eq!(registry.load("agreement").unwrap().info().kind.to_string(), "matcher");

    let message = registry.load("agreemint").unwrap_err().to_string();
    assert_eq!(message, r#"no plugin is called "agreemint"; known are: aborts, agreement"#);
}

#[test]
fn a_file_that_is_not_on_the_list_is_refused_by_name_with_its_digest() {
    let Some(fixtures) = fixtures() else { return };
    let path = fixtures.build("matcher.c", "agreement", &[]);
    let mut registry = Registry::new([Digest::of(b"another file")]);
    registry.add_directory(fixtures.0.path());
    assert!(registry.list().is_empty());
    let message = registry.load("agreement").unwrap_err().to_string();
    let expected = format!(
        "refused libagreement.so at allow-list: SHA-256 {digest} is not on the list of allowed plugins · if you trust it, \
         run \"resurvey plugins install {}\", or add --allow-plugin {digest}",
        path.canonicalize().unwrap().display(),
        digest = digest(&path)
    );
    assert_eq!(message, expected);
}

#[test]
fn a_file_can_be_inspected_before_it_is_allowed() {
    let Some(fixtures) = fixtures() else { return };
    // The constructor would abort: inspecting runs no code.
    let path = fixtures.broken("inspected", &["-DCONSTRUCTOR"]);
    let info = Registry::inspect(&path).unwrap();
    assert_eq!((info.name.as_str(), info.sha256, info.settings_schema), ("broken", digest(&path), None));
}

#[cfg(unix)]
#[test]
fn a_file_or_directory_that_everybody_may_write_is_refused() {
    let Some(fixtures) = fixtures() else { return };
    let path = fixtures.build("matcher.c", "agreement", &[]);
    set_mode(&path, 0o666);
    let (stage, message) = refusal(&path);
    assert_eq!(stage, Stage::Permissions);
    assert!(message.contains("every user of this machine may write the file · run \"chmod o-w "), "{message}");
    set_mode(&path, 0o644);
    set_mode(fixtures.0.path(), 0o777);
    assert!(refusal(&path).1.contains("may write its directory"));
}

#[test]
fn the_first_plugin_of_a_name_counts() {
    let Some(fixtures) = fixtures() else { return };
    let first = fixtures.build("matcher.c", "a", &[]);
    let second = fixtures.build("matcher.c", "b", &["-O2"]);
    let mut registry = Registry::new([digest(&first), digest(&second)]);
    registry.add_directory(fixtures.0.path());
    assert_eq!(registry.list().len(), 1);
    assert_eq!(registry.list()[0].path, Some(first.canonicalize().unwrap()));
    let why = registry.skipped()[0].refusal.to_string();
    assert!(why.contains("a plugin called agreement is already there, at "), "{why}");
}

#[test]
fn a_directory_that_is_not_there_is_skipped_with_its_reason() {
    let mut registry = Registry::new([]);
    registry.add_directory(Path::new("/nonexistent/plugins"));
    assert_eq!(registry.skipped()[0].refusal.stage, Stage::File);
}
