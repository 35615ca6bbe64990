//! The rules that text alone can show, one function each. A rule returns what breaks it: file, line, and what to do.

use crate::source::{Source, code, lines_with_word, without_comments, without_tests};

/// What breaks a rule.
pub type Broken = Vec<String>;

/// Where product code lives.
const PRODUCT: [&str; 4] = ["core/src/", "cli/", "schema/src/", "plugins/"];

fn product_code(sources: &[Source]) -> impl Iterator<Item = &Source> {
    sources.iter().filter(|source| source.is_rust() && source.is_in(&PRODUCT) && !source.is_test())
}

/// SQL stands in `core/src/store` alone.
pub fn sql_outside_the_store(sources: &[Source]) -> Broken {
    const STATEMENTS: [&str; 11] = [
        "SELECT ",
        "INSERT INTO",
        "INSERT OR",
        "DELETE FROM",
        "UPDATE ",
        "CREATE TABLE",
        "CREATE INDEX",
        "ALTER TABLE",
        "DROP TABLE",
        "PRAGMA ",
        "BEGIN IMMEDIATE",
    ];
    let mut broken = Vec::new();
    for source in product_code(sources).filter(|source| !source.is_in(&["core/src/store/"])) {
        let text = without_comments(&without_tests(&source.text));
        for word in STATEMENTS.into_iter().chain(["rusqlite"]) {
            for line in lines_with_word(&text, word) {
                broken.push(format!("{}:{line}: {word:?} belongs to core/src/store", source.path));
            }
        }
    }
    broken
}

/// The store runs DDL from `schema/sql` and has none of its own; temporary tables are its own business.
pub fn ddl_outside_the_schema(sources: &[Source]) -> Broken {
    const STATEMENTS: [&str; 7] = [
        "CREATE TABLE",
        "CREATE INDEX",
        "CREATE UNIQUE",
        "CREATE VIRTUAL",
        "CREATE TRIGGER",
        "ALTER TABLE",
        "DROP TABLE",
    ];
    let mut broken = Vec::new();
    for source in product_code(sources) {
        let text = without_comments(&without_tests(&source.text));
        for word in STATEMENTS {
            for line in lines_with_word(&text, word) {
                broken.push(format!("{}:{line}: {word:?} belongs to schema/sql", source.path));
            }
        }
    }
    broken
}

/// `unsafe` stands in `core/src/plugin` and `plugins/sdk` alone, each block with its reason just above. The *type* of an
/// unsafe function (`unsafe extern "C" fn(…)`) does nothing and may be named anywhere.
pub fn unsafe_without_leave(sources: &[Source]) -> Broken {
    let mut broken = Vec::new();
    for source in sources.iter().filter(|source| source.is_rust()) {
        let is_allowed = source.is_in(&["core/src/plugin/", "plugins/sdk/"]);
        let text = if is_allowed { code(&without_tests(&source.text)) } else { code(&source.text) };
        for line in lines_with_word(&text, "unsafe") {
            if !is_allowed && text.lines().nth(line - 1).is_some_and(names_only_a_type) {
                continue;
            }
            if !is_allowed {
                broken.push(format!("{}:{line}: unsafe outside core/src/plugin and plugins/sdk", source.path));
            } else if text.lines().nth(line - 1).is_some_and(|code| code.contains("unsafe {"))
                && !has_reason(&source.text, line)
            {
                broken.push(format!("{}:{line}: unsafe block without a // SAFETY: line", source.path));
            }
        }
    }
    broken
}

/// Whether every `unsafe` of a line of code begins the type of a function.
fn names_only_a_type(line: &str) -> bool {
    line.split("unsafe").skip(1).all(|after| {
        let after: String = after.chars().filter(|letter| !letter.is_whitespace()).collect();
        after.starts_with("fn(") || after.starts_with("externfn(")
    })
}

/// Whether line `line` (from 1), or the comment that ends at most two lines above it, says `SAFETY:`.
fn has_reason(text: &str, line: usize) -> bool {
    let lines: Vec<&str> = text.lines().take(line).collect();
    let mut above = lines.iter().rev();
    let own = above.next().is_some_and(|line| line.contains("SAFETY:"));
    let mut code_lines = 0;
    own || above
        .take_while(|line| {
            code_lines += u32::from(!line.trim_start().starts_with("//"));
            code_lines <= 2
        })
        .any(|line| line.contains("SAFETY:"))
}

/// Crates that need no unsafe code forbid it.
pub fn crates_that_do_not_forbid_unsafe(sources: &[Source]) -> Broken {
    let is_root = |source: &&Source| {
        let path = source.path.as_str();
        let is_plugin =
            path.starts_with("plugins/") && path.ends_with("/src/lib.rs") && !path.starts_with("plugins/sdk/");
        is_plugin || ["schema/src/lib.rs", "cli/main.rs", "cli/lib.rs"].contains(&path)
    };
    let open = sources.iter().filter(is_root).filter(|source| !source.text.contains("#![forbid(unsafe_code)]"));
    open.map(|source| format!("{}: lacks #![forbid(unsafe_code)]", source.path)).collect()
}

/// A token that `core` may use in one place, and why.
struct Exception {
    place: &'static str,
    token: &'static str,
}

/// A plugin's process is given up after a time limit, and what it answers does not depend on the clock; its descriptors 1
/// and 2 are the wire and its last words, which nobody prints.
const EXCEPTIONS: [Exception; 3] = [
    Exception { place: "core/src/plugin/", token: "Instant" },
    Exception { place: "core/src/plugin/process/", token: "stdout" },
    Exception { place: "core/src/plugin/process/", token: "stderr" },
];

/// `core` prints nothing and reads no clock, environment or network.
pub fn side_effects_in_core(sources: &[Source]) -> Broken {
    const TOKENS: [&str; 18] = [
        "println!",
        "print!",
        "eprintln!",
        "eprint!",
        "dbg!",
        "stdout",
        "stderr",
        "env::var",
        "env::var_os",
        "env::vars",
        "env::args",
        "env::current_dir",
        "SystemTime",
        "Instant",
        "Timestamp::now",
        "Zoned::now",
        "std::net",
        "process::exit",
    ];
    let mut broken = Vec::new();
    for source in product_code(sources).filter(|source| source.is_in(&["core/src/"])) {
        let text = code(&without_tests(&source.text));
        for token in TOKENS {
            if EXCEPTIONS.iter().any(|exception| source.path.starts_with(exception.place) && exception.token == token) {
                continue;
            }
            for line in lines_with_word(&text, token) {
                broken.push(format!("{}:{line}: {token} in core; let the caller hand it in", source.path));
            }
        }
    }
    broken
}

/// Inside `core` nothing points up.
pub fn upward_arrows_in_core(sources: &[Source]) -> Broken {
    const TOP: [&str; 4] = ["plugin", "localize", "update", "export"];
    let forbidden = |module: &str| -> Vec<&str> {
        match module {
            "crs" => [&TOP[..], &["store", "version", "render", "mesh", "camera", "image", "metrics"]].concat(),
            "image" | "camera" => [&TOP[..], &["store", "version", "render", "mesh"]].concat(),
            "mesh" | "version" | "metrics" => [&TOP[..], &["store", "render"]].concat(),
            "render" => [&TOP[..], &["store"]].concat(),
            "store" => [&TOP[..], &["render", "camera"]].concat(),
            "plugin" => vec!["store", "localize", "update", "export"],
            "localize" => vec!["store", "update", "export"],
            "export" => vec!["plugin", "localize", "update"],
            _ => Vec::new(),
        }
    };
    let mut broken = Vec::new();
    for source in product_code(sources) {
        let Some(inside) = source.path.strip_prefix("core/src/") else { continue };
        let module = inside.split('/').next().unwrap_or_default().trim_end_matches(".rs");
        let text = code(&without_tests(&source.text));
        for above in forbidden(module) {
            for line in lines_with_word(&text, &format!("crate::{above}")) {
                broken.push(format!("{}:{line}: {module} must not know {above}", source.path));
            }
        }
    }
    broken
}

/// Grid coordinates become `f32` in `core/src/crs/local.rs` alone.
pub fn grid_narrowed_elsewhere(sources: &[Source]) -> Broken {
    let mut broken = Vec::new();
    for source in product_code(sources).filter(|source| source.path != "core/src/crs/local.rs") {
        let text = code(&without_tests(&source.text));
        for (index, line) in text.lines().enumerate() {
            let names_grid = ["easting", "northing"].into_iter().any(|word| line.contains(word));
            if names_grid && line.contains("as f32") {
                broken.push(format!("{}:{}: grid coordinate as f32; use crs::local", source.path, index + 1));
            }
        }
    }
    broken
}

/// Axes are swapped for glTF in one file: every file of `core` that writes the swap, when there is more than one.
pub fn axes_swapped_in_several_files(sources: &[Source]) -> Broken {
    // `x, z, −y` and its inverse as arrays, and as the rows of a column-major matrix.
    const SWAPS: [&str; 6] =
        [",-z,y]", ",z,-y]", ",up,-north]", ",height_m,-north", ",h,-n]", "0.0,0.0,-1.0,0.0,0.0,1.0,0.0,0.0"];
    let swaps = |source: &&Source| {
        let text: String =
            code(&without_tests(&source.text)).chars().filter(|letter| !letter.is_whitespace()).collect();
        SWAPS.into_iter().any(|swap| text.contains(swap))
    };
    let files: Vec<&Source> =
        product_code(sources).filter(|source| source.is_in(&["core/src/"])).filter(swaps).collect();
    if files.len() <= 1 {
        return Vec::new();
    }
    files.into_iter().map(|source| format!("{}: swaps axes for glTF; one file may", source.path)).collect()
}

/// No Rust file is over 600 lines.
pub fn files_too_long(sources: &[Source]) -> Broken {
    let lines = |source: &Source| source.text.lines().count();
    let long = sources.iter().filter(|source| source.is_rust() && lines(source) > 600);
    long.map(|source| format!("{}: {} lines; the limit is 600", source.path, lines(source))).collect()
}

/// Every package takes the workspace's lints, and those ask for a sentence on every public item.
pub fn packages_without_lints(manifests: &[Source]) -> Broken {
    let mut broken = Vec::new();
    for manifest in manifests {
        let asks = manifest
            .text
            .split("[lints]")
            .nth(1)
            .is_some_and(|after| after.trim_start().starts_with("workspace = true"));
        if !asks {
            broken.push(format!("{}: lacks [lints] workspace = true", manifest.path));
        }
        if manifest.path == "Cargo.toml" && !manifest.text.contains("missing_docs = ") {
            broken.push("Cargo.toml: [workspace.lints.rust] lacks missing_docs".to_owned());
        }
    }
    broken
}

/// Tests say what they promise: no `test_` in front of a name.
pub fn tests_named_after_functions(sources: &[Source]) -> Broken {
    let mut broken = Vec::new();
    for source in sources.iter().filter(|source| source.is_rust()) {
        let text = code(&source.text);
        for (index, line) in text.lines().enumerate().filter(|(_, line)| line.contains("fn test_")) {
            broken.push(format!("{}:{}: {} is not a promise", source.path, index + 1, line.trim()));
        }
    }
    broken
}

/// No path of one developer's machine. The words are put together here so that this file passes.
pub fn machine_paths(sources: &[Source]) -> Broken {
    let words =
        [["/wo", "rk/"], ["/ho", "me/"], ["/ro", "ot/"], ["/Us", "ers/"], ["/tm", "p/"]].map(|parts| parts.concat());
    let mut broken = Vec::new();
    for source in sources {
        for (index, line) in source.text.lines().enumerate() {
            for word in words.iter().filter(|word| is_path_start(line, word)) {
                broken.push(format!("{}:{}: {word} is a path of one machine", source.path, index + 1));
            }
        }
    }
    broken
}

/// Whether `word` begins a path in `line`: what stands before it is not itself part of a path.
fn is_path_start(line: &str, word: &str) -> bool {
    line.match_indices(word).any(|(at, _)| {
        let before = line[..at].chars().next_back();
        !before.is_some_and(|letter| letter.is_alphanumeric() || "._-".contains(letter))
    })
}
