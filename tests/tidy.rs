//! What must always hold in this repository (docs/architecture.md). Every rule is first shown to fail on a small bad
//! sample, so that a rule that finds nothing means that there is nothing.

#[path = "tidy/documents.rs"]
mod documents;
#[path = "tidy/packages.rs"]
mod packages;
#[path = "tidy/rules.rs"]
mod rules;
#[path = "tidy/source.rs"]
mod source;

use rules::Broken;
use serde_json::json;
use source::Source;

#[track_caller]
fn nothing(broken: &Broken) {
    assert!(broken.is_empty(), "{} findings:\n{}", broken.len(), broken.join("\n"));
}

/// Shows that `rule` finds exactly one thing in each bad sample and nothing in the good ones.
#[track_caller]
fn proves(rule: fn(&[Source]) -> Broken, bad: &[(&str, &str)], good: &[(&str, &str)]) {
    for (path, text) in bad {
        let found = rule(&[Source::sample(path, text)]);
        assert_eq!(found.len(), 1, "bad sample {path}: {text:?}: {found:?}");
    }
    for (path, text) in good {
        let found = rule(&[Source::sample(path, text)]);
        assert!(found.is_empty(), "good sample {path}: {text:?}: {found:?}");
    }
}

#[test]
fn sql_stands_only_in_the_store() {
    proves(
        rules::sql_outside_the_store,
        &[
            ("core/src/update/run.rs", "let q = \"SELECT 1\";"),
            ("cli/main.rs", "use rusqlite::Connection;"),
            ("plugins/x/src/lib.rs", "x(\"PRAGMA user_version\")"),
        ],
        &[
            ("core/src/store/query.rs", "let q = \"SELECT 1\";"),
            ("core/src/update/run.rs", "// SELECT the best\nlet selected = 1;"),
            ("core/src/update/run.rs", "#[cfg(test)]\nmod tests { use rusqlite::Connection; }"),
        ],
    );
    nothing(&rules::sql_outside_the_store(&source::all()));
}

#[test]
fn tables_are_made_only_in_schema_sql() {
    proves(
        rules::ddl_outside_the_schema,
        &[("core/src/store/open.rs", "run(\"CREATE TABLE x (a)\")")],
        &[("core/src/store/open.rs", "run(\"CREATE TEMP TABLE x (a)\"); // CREATE TABLE")],
    );
    nothing(&rules::ddl_outside_the_schema(&source::all()));
}

#[test]
fn released_sql_never_changes() {
    let file = Source::sample("schema/sql/0001_map.sql", "abc");
    // SHA-256 of "abc": FIPS 180-2, appendix B.1.
    let pin = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad  0001_map.sql\n";
    assert!(documents::unpinned_sql(std::slice::from_ref(&file), pin).is_empty());
    assert_eq!(documents::unpinned_sql(std::slice::from_ref(&file), "").len(), 1);
    assert_eq!(documents::unpinned_sql(&[Source::sample("schema/sql/0001_map.sql", "abd")], pin).len(), 1);
    assert_eq!(documents::unpinned_sql(&[], pin).len(), 1);

    let all = source::all();
    let files: Vec<Source> = all.iter().filter(|file| file.is_in(&["schema/sql/"])).cloned().collect();
    nothing(&documents::unpinned_sql(&files, include_str!("tidy/sql.sha256")));
}

#[test]
fn unsafe_stands_only_at_the_plugin_line_and_gives_its_reason() {
    proves(
        rules::unsafe_without_leave,
        &[
            ("core/src/mesh/read.rs", "fn a() { unsafe { b() } }"),
            ("core/src/plugin/open.rs", "fn a() {\n    unsafe { b() }\n}"),
            ("examples/x.rs", "unsafe impl Send for X {}"),
            ("schema/src/abi.rs", "unsafe extern \"C\" fn open() {}"),
        ],
        &[
            ("core/src/plugin/open.rs", "// SAFETY: b is pure.\nunsafe { b() }"),
            ("schema/src/abi.rs", "pub open: Option<unsafe extern \"C\" fn(u32) -> i32>,"),
            ("core/src/mesh/read.rs", "#![forbid(unsafe_code)] // unsafe\nlet a = \"unsafe\";"),
        ],
    );
    proves(
        rules::crates_that_do_not_forbid_unsafe,
        &[("plugins/x/src/lib.rs", "//! A plugin.")],
        &[("plugins/x/src/lib.rs", "#![forbid(unsafe_code)]"), ("plugins/sdk/src/lib.rs", "")],
    );
    nothing(&rules::unsafe_without_leave(&source::all()));
    nothing(&rules::crates_that_do_not_forbid_unsafe(&source::all()));
}

#[test]
fn core_prints_nothing_and_reads_no_clock_environment_or_network() {
    proves(
        rules::side_effects_in_core,
        &[
            ("core/src/update/run.rs", "println!(\"x\");"),
            ("core/src/update/run.rs", "let now = SystemTime::now();"),
            ("core/src/update/run.rs", "let a = std::env::var(\"A\");"),
            ("core/src/update/run.rs", "let started = Instant::now();"),
            ("core/src/update/run.rs", "use std::net::TcpStream;"),
        ],
        &[
            ("core/src/plugin/child.rs", "let until = Instant::now() + limit;"),
            ("core/src/update/run.rs", "//! never println!\nlet a = env!(\"CARGO_PKG_VERSION\");"),
            ("core/src/update/run.rs", "#[cfg(test)]\nmod tests { fn a() { std::env::var(\"A\"); } }"),
            ("cli/main.rs", "println!(\"x\");"),
        ],
    );
    nothing(&rules::side_effects_in_core(&source::all()));
}

#[test]
fn packages_depend_only_as_drawn() {
    let dependency = |name: &str| json!({"name": name, "kind": null});
    let package = |name: &str, on: &[&str]| json!({"name": name, "source": null, "dependencies": on.iter().map(|on| dependency(on)).collect::<Vec<_>>()});
    let sample = |on: &[&str]| json!({"packages": [package("a", on), package("b", &[]), package("c", &[])]});
    let drawn: [(&str, &[&str]); 3] = [("a", &["b"]), ("b", &[]), ("c", &[])];
    assert!(packages::wrong_arrows(&sample(&["b", "serde"]), &drawn).is_empty());
    assert_eq!(packages::wrong_arrows(&sample(&["b", "c"]), &drawn).len(), 1);
    assert_eq!(packages::wrong_arrows(&sample(&[]), &drawn).len(), 1);
    assert_eq!(packages::wrong_arrows(&sample(&["b"]), &drawn[..2]).len(), 1);
    let schema = json!({"packages": [package("resurvey-schema", &["serde", "png"])]});
    assert_eq!(packages::wrong_arrows(&schema, &[("resurvey-schema", &[])]).len(), 1);

    nothing(&packages::wrong_arrows(&packages::metadata(), &packages::ARROWS));
}

#[test]
fn nothing_in_core_points_up() {
    proves(
        rules::upward_arrows_in_core,
        &[
            ("core/src/store/query.rs", "use crate::render::view;"),
            ("core/src/crs/grid.rs", "use crate::mesh::Mesh;"),
            ("core/src/plugin/host.rs", "fn a(s: &crate::store::Snapshot) {}"),
        ],
        &[
            ("core/src/update/run.rs", "use crate::store::Store;"),
            ("core/src/store/query.rs", "use crate::version::Delta;"),
        ],
    );
    nothing(&rules::upward_arrows_in_core(&source::all()));
}

#[test]
fn grid_coordinates_become_f32_in_one_file_and_axes_are_swapped_in_one() {
    proves(
        rules::grid_narrowed_elsewhere,
        &[("core/src/render/scene.rs", "let e = point.easting_m as f32;")],
        &[
            ("core/src/crs/local.rs", "let e = point.easting_m as f32;"),
            ("core/src/render/scene.rs", "let e = x as f32;"),
        ],
    );
    let swaps = |first: &str, second: &str| {
        rules::axes_swapped_in_several_files(&[
            Source::sample("core/src/export/a.rs", first),
            Source::sample("core/src/mesh/b.rs", second),
        ])
    };
    assert_eq!(swaps("[x, z, -y]", "[x, -z, y]").len(), 2);
    assert!(swaps("[x, z, -y]", "[x, y, z]").is_empty());
    nothing(&rules::grid_narrowed_elsewhere(&source::all()));
    nothing(&rules::axes_swapped_in_several_files(&source::all()));
}

#[test]
fn no_file_is_over_600_lines() {
    let [long, short] = [601, 600].map(|lines| "//\n".repeat(lines));
    proves(rules::files_too_long, &[("core/src/a.rs", &long)], &[("core/src/a.rs", &short), ("docs/a.md", &long)]);
    nothing(&rules::files_too_long(&source::all()));
}

#[test]
fn every_package_asks_for_a_sentence_on_every_public_item() {
    proves(
        rules::packages_without_lints,
        &[("core/Cargo.toml", "[package]"), ("Cargo.toml", "[lints]\nworkspace = true")],
        &[("core/Cargo.toml", "[lints]\nworkspace = true")],
    );
    let manifests: Vec<Source> =
        source::all().into_iter().filter(|file| file.path.rsplit('/').next() == Some("Cargo.toml")).collect();
    assert!(manifests.len() >= packages::ARROWS.len());
    nothing(&rules::packages_without_lints(&manifests));
}

#[test]
fn no_link_in_readme_and_docs_is_dead() {
    let pages = |text: &str| [Source::sample("docs/a.md", text), Source::sample("README.md", "# Two words\n")];
    let exists = |path: &str| ["docs/a.md", "README.md"].contains(&path);
    assert_eq!(documents::dead_links(&pages("[x](b.md)"), exists).len(), 1);
    assert_eq!(documents::dead_links(&pages("[x](../README.md#no-such)"), exists).len(), 1);
    let good = "[x](../README.md#two-words) [y](https://example.org/b.md) `[z](b.md)`\n```\n[z](b.md)\n```\n";
    assert_eq!(documents::dead_links(&pages(good), exists), Broken::new());

    nothing(&documents::dead_links(&source::all(), |path| source::root().join(path).exists()));
}

#[test]
fn the_paper_map_names_functions_and_tests_that_exist() {
    let code =
        Source::sample("core/src/a.rs", "pub fn area() {}\n#[test]\nfn a_square_has_its_area() {}\nfn helper() {}\n");
    let map = |function: &str, test: &str| {
        let row = |item: String| format!("| {item} | what | `{function}` | `{test}` |\n");
        documents::paper_items().into_iter().map(row).collect::<String>()
    };
    let gaps = |map: &str| documents::paper_map_gaps(map, std::slice::from_ref(&code)).len();
    let all = documents::paper_items().len();
    assert_eq!(gaps(&map("core/src/a.rs::area", "core/src/a.rs::a_square_has_its_area")), 0);
    assert_eq!(gaps(&map("core/src/a.rs::are", "core/src/a.rs::a_square_has_its_area")), all);
    assert_eq!(gaps(&map("core/src/b.rs::area", "core/src/a.rs::a_square_has_its_area")), all);
    assert_eq!(gaps(&map("core/src/a.rs::area", "core/src/a.rs::helper")), all);
    assert_eq!(gaps(""), all);

    let map = std::fs::read_to_string(source::root().join("docs/paper-map.md")).expect("docs/paper-map.md");
    nothing(&documents::paper_map_gaps(&map, &source::all()));
}

#[test]
fn tests_are_named_after_what_they_promise() {
    // Put together so that this file passes.
    let bad = ["fn te", "st_area() {}"].concat();
    proves(rules::tests_named_after_functions, &[("core/src/a.rs", &bad)], &[("core/src/a.rs", "fn a_test_area() {}")]);
    nothing(&rules::tests_named_after_functions(&source::all()));
}

#[test]
fn no_file_names_a_path_of_one_machine() {
    let bad = ["see /ho", "me/me/x"].concat();
    let [inside, other] = [["a/wo", "rk/x"], ["out.tm", "p/x"]].map(|parts| parts.concat());
    proves(rules::machine_paths, &[("docs/a.md", &bad)], &[("docs/a.md", &inside), ("docs/a.md", &other)]);
    nothing(&rules::machine_paths(&source::all()));
}

#[test]
fn every_dependency_is_under_a_permissive_licence() {
    for good in [
        "MIT",
        "MIT OR Apache-2.0",
        "MIT/Apache-2.0",
        "(MIT OR GPL-3.0-only) AND Unicode-3.0",
        "Apache-2.0 WITH LLVM-exception",
    ] {
        assert!(packages::is_permissive(good), "{good}");
    }
    for bad in ["", "GPL-3.0-only", "MIT AND LGPL-2.1", "(MIT AND MPL-2.0) OR AGPL-3.0"] {
        assert!(!packages::is_permissive(bad), "{bad}");
    }
    let sample = json!({"packages": [{"name": "a", "license": "GPL-3.0-only"}, {"name": "b", "license": null}, {"name": "c", "license": "MIT"}]});
    assert_eq!(packages::licences_that_bind(&sample).len(), 2);

    nothing(&packages::licences_that_bind(&packages::metadata()));
}
