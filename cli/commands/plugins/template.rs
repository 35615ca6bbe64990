//! The files of `plugins/templates`, and what stands in them for a project.

use crate::args::{Language, NewForm, NewKind};

/// Paths relative to the project, and texts before the project's words are put in.
type Sources = Vec<(String, &'static str)>;

/// What is to be written.
pub struct Project<'a> {
    /// Name of the plugin.
    pub name: &'a str,
    /// Its kind.
    pub kind: NewKind,
    /// Its form; a matcher alone has two.
    pub form: NewForm,
    /// Its language.
    pub language: Language,
    /// In Rust: the dependency on the SDK, as `Cargo.toml` says it.
    pub sdk: Option<String>,
}

macro_rules! template {
    ($path:literal) => {
        include_str!(concat!("../../../plugins/templates/", $path))
    };
}

macro_rules! package {
    ($($file:literal),*) => {
        [$((concat!("resurvey_plugin/", $file), include_str!(concat!("../../../plugins/python/resurvey_plugin/", $file)))),*]
    };
}

/// The Python package goes with the project: it is on no registry, and speaks the wire of this very host.
const PACKAGE: [(&str, &str); 10] = package![
    "__init__.py",
    "__main__.py",
    "build.py",
    "host.py",
    "link.py",
    "plugin.py",
    "records.py",
    "serve.py",
    "toy.py",
    "words.py"
];

/// The contract, and the toy host of the project's test.
const HEADERS: [(&str, &str); 2] = [
    ("resurvey_plugin.h", include_str!("../../../schema/include/resurvey_plugin.h")),
    ("resurvey_toy.h", include_str!("../../../plugins/toy/resurvey_toy.h")),
];

/// Path and text of every file, paths relative to the project.
pub fn files(project: &Project<'_>) -> Vec<(String, String)> {
    let (sources, verbatim): (Sources, &[(&str, &str)]) = match project.language {
        Language::Rust => (rust(project), &[]),
        Language::C => (c(project), &HEADERS),
        Language::Cpp => (cpp(), &HEADERS),
        Language::Python => (python(project), &PACKAGE),
    };
    let written = sources.into_iter().map(|(path, text)| (path, filled_in(project, text)));
    written.chain(verbatim.iter().map(|(path, text)| ((*path).to_owned(), (*text).to_owned()))).collect()
}

/// The file to open first.
pub fn main_file(project: &Project<'_>) -> String {
    match project.language {
        Language::Rust => "src/lib.rs".to_owned(),
        Language::C => "plugin.c".to_owned(),
        Language::Cpp => "plugin.cpp".to_owned(),
        Language::Python => format!("{}.py", work(project)),
    }
}

/// What the plugin does, which names its template: a matcher searches, or has the name of its kind.
fn work(project: &Project<'_>) -> String {
    match (project.kind, project.form) {
        (NewKind::Matcher, NewForm::Search) => "search".to_owned(),
        (kind, _) => kind.to_string(),
    }
}

/// What to type next, in the directory of the project, and at last where the user was before.
pub fn steps(project: &Project<'_>) -> Vec<String> {
    let (test, build, built) = match project.language {
        Language::Rust => {
            ("cargo test", "cargo build --release".to_owned(), format!("target/release/{}", library(project)))
        }
        Language::C | Language::Cpp => ("make test", "make".to_owned(), library(project)),
        Language::Python => (
            "python3 -m unittest",
            format!("python3 -m resurvey_plugin build {}", main_file(project)),
            format!("resurvey-plugin-{}", project.name),
        ),
    };
    let (check, install) = (format!("resurvey plugins check {built}"), format!("resurvey plugins install {built}"));
    // Back to where the map is.
    vec![test.to_owned(), build, check, install, "cd -".to_owned(), usage(project)]
}

fn rust(project: &Project<'_>) -> Sources {
    let source = match (project.kind, project.form) {
        (NewKind::Matcher, NewForm::Score) => template!("rust/matcher.rs"),
        (NewKind::Matcher, NewForm::Search) => template!("rust/search.rs"),
        (NewKind::Detector, _) => template!("rust/detector.rs"),
        (NewKind::Estimator, _) => template!("rust/estimator.rs"),
        (NewKind::Segmenter, _) => template!("rust/segmenter.rs"),
    };
    vec![
        ("Cargo.toml".to_owned(), template!("rust/Cargo.toml.in")),
        ("src/lib.rs".to_owned(), source),
        ("README.md".to_owned(), template!("rust/README.md")),
        (".gitignore".to_owned(), "/target\n"),
    ]
}

fn c(project: &Project<'_>) -> Sources {
    let (source, test) = match (project.kind, project.form) {
        (NewKind::Matcher, NewForm::Score) => (template!("c/matcher.c"), template!("c/test_matcher.c")),
        (NewKind::Matcher, NewForm::Search) => (template!("c/search.c"), template!("c/test_search.c")),
        (NewKind::Detector, _) => (template!("c/detector.c"), template!("c/test_detector.c")),
        (NewKind::Estimator, _) => (template!("c/estimator.c"), template!("c/test_estimator.c")),
        (NewKind::Segmenter, _) => (template!("c/segmenter.c"), template!("c/test_segmenter.c")),
    };
    vec![
        ("plugin.c".to_owned(), source),
        ("test.c".to_owned(), test),
        ("Makefile".to_owned(), template!("c/Makefile")),
        ("README.md".to_owned(), template!("c/README.md")),
        (".gitignore".to_owned(), "*.so\ntoy-test\n"),
    ]
}

fn cpp() -> Sources {
    vec![
        ("plugin.cpp".to_owned(), template!("cpp/matcher.cpp")),
        ("test.c".to_owned(), template!("c/test_matcher.c")),
        ("Makefile".to_owned(), template!("cpp/Makefile")),
        ("README.md".to_owned(), template!("cpp/README.md")),
        (".gitignore".to_owned(), "*.so\n*.o\ntoy-test\n"),
    ]
}

fn python(project: &Project<'_>) -> Sources {
    let (source, test) = match (project.kind, project.form) {
        (NewKind::Matcher, NewForm::Score) => (template!("python/matcher.py"), template!("python/test_matcher.py")),
        (NewKind::Matcher, NewForm::Search) => (template!("python/search.py"), template!("python/test_search.py")),
        (NewKind::Detector, _) => (template!("python/detector.py"), template!("python/test_detector.py")),
        (NewKind::Estimator, _) => (template!("python/estimator.py"), template!("python/test_estimator.py")),
        (NewKind::Segmenter, _) => (template!("python/segmenter.py"), template!("python/test_segmenter.py")),
    };
    vec![
        (main_file(project), source),
        (format!("test_{}", main_file(project)), test),
        ("README.md".to_owned(), template!("python/README.md")),
        (".gitignore".to_owned(), "__pycache__/\nresurvey-plugin-*\n"),
    ]
}

/// Puts the project's words in place of the template's.
fn filled_in(project: &Project<'_>, text: &str) -> String {
    let placeholder = format!("My{}", capital(&project.kind.to_string()));
    text.replace("my-plugin", project.name)
        .replace("my_plugin", &project.name.replace('-', "_"))
        .replace(&placeholder, &type_name(project))
        .replace("@KIND@", &project.kind.to_string())
        .replace("@FILE@", &main_file(project))
        .replace("@USE@", &usage(project))
        .replace("@SDK@", &format!("resurvey-plugin = {}", project.sdk.as_deref().unwrap_or_default()))
}

/// `facade-edges` of a matcher becomes `FacadeEdgesMatcher`: never a name that the SDK has.
fn type_name(project: &Project<'_>) -> String {
    let kind = capital(&project.kind.to_string());
    let name: String = project.name.split('-').map(capital).collect();
    match name.strip_suffix(&kind) {
        Some("") => format!("My{kind}"),
        Some(_) => name,
        None => format!("{name}{kind}"),
    }
}

fn capital(word: &str) -> String {
    let mut letters = word.chars();
    letters.next().map(|first| first.to_ascii_uppercase().to_string() + letters.as_str()).unwrap_or_default()
}

fn library(project: &Project<'_>) -> String {
    let (prefix, suffix) = (std::env::consts::DLL_PREFIX, std::env::consts::DLL_SUFFIX);
    format!("{prefix}{}{suffix}", project.name.replace('-', "_"))
}

fn usage(project: &Project<'_>) -> String {
    let (command, more) = match project.kind {
        NewKind::Matcher => ("localize", ""),
        NewKind::Detector | NewKind::Estimator => ("update", ""),
        NewKind::Segmenter => ("localize", " --photo photo.jpg"),
    };
    format!("resurvey {command} city.rsv capture.json{more} --{} {}", project.kind, project.name)
}
