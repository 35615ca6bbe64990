//! Arguments of `plugins`.

use clap::{Args, Subcommand, ValueEnum};
use std::fmt;
use std::path::PathBuf;

/// `plugins` subcommands.
#[derive(Debug, Subcommand)]
pub enum Plugins {
    /// List plugins by kind; runs no code of plugin files
    List {
        /// Also say which directories were searched and why a file was skipped
        #[arg(long, short)]
        verbose: bool,
    },
    /// Describe a plugin and its settings; loads an allowed plugin file
    Info {
        /// Name, as list prints it
        name: String,
    },
    /// Put a plugin file to every test of the plugin line; changes nothing
    ///
    /// Runs the code of the file, whether or not it is allowed, each test in a process of its own with a time and a memory
    /// limit. Exit code 12 when a test fails.
    Check(Check),
    /// Copy a plugin file to the user's data directory and allow it
    ///
    /// Checks it first. The file lies under its SHA-256 afterwards, and that stands in allowed-plugins; older builds of the
    /// same name stay for replay and run no more.
    Install(Install),
    /// Write a project for a plugin of your own, which builds and passes "plugins check"
    ///
    /// Writes a directory of its own and nothing else; one that is there already is left alone.
    New(New),
    /// Take an installed plugin away, from the user's data directory and from allowed-plugins
    Remove {
        /// Name of the plugin, or SHA-256 of one build
        #[arg(value_name = "NAME|SHA256")]
        which: String,
    },
}

/// Arguments of `plugins check`.
#[derive(Debug, Args)]
pub struct Check {
    /// Plugin file: a library, or an executable that is called resurvey-plugin-NAME
    pub file: PathBuf,
    #[command(flatten)]
    pub limits: Limits,
    /// Only this test, in this process
    #[arg(long, hide = true, requires = "report")]
    pub trial: Option<String>,
    /// Where that test writes what it does
    #[arg(long, hide = true, requires = "trial")]
    pub report: Option<PathBuf>,
}

/// What one test of a plugin may use.
#[derive(Clone, Copy, Debug, Args)]
pub struct Limits {
    /// Seconds for each test
    #[arg(long, value_name = "SECONDS", default_value_t = 30.0, value_parser = seconds)]
    pub time_limit: f64,
    /// Address space for each test, MiB
    #[arg(long, value_name = "MIB", default_value_t = 4096, value_parser = clap::value_parser!(u64).range(256..=1 << 20))]
    pub memory_limit: u64,
}

/// Arguments of `plugins install`.
#[derive(Debug, Args)]
pub struct Install {
    /// Plugin file: a library, or an executable that is called resurvey-plugin-NAME
    pub file: PathBuf,
    /// Do not run the tests of plugins check first
    #[arg(long)]
    pub no_check: bool,
    #[command(flatten)]
    pub limits: Limits,
}

/// Arguments of `plugins new`.
#[derive(Debug, Args)]
pub struct New {
    /// Name of the plugin: a-z and 0-9, words joined by dashes, such as facade-edges
    pub name: String,
    /// What it replaces: the search for the pose, the search for changes, the measuring, or the labelling of a photo
    #[arg(long, value_enum)]
    pub kind: NewKind,
    /// Of a matcher: whether the host searches or the plugin does
    #[arg(long, value_enum, default_value_t = NewForm::Score)]
    pub form: NewForm,
    /// Its language
    #[arg(long, value_enum)]
    pub lang: Language,
    /// Directory to write; default: NAME in the working directory
    #[arg(long, value_name = "DIR")]
    pub out: Option<PathBuf>,
    /// Where the Rust SDK is: a checkout of resurvey, or the URL of its repository; default: where this program was built
    #[arg(long, value_name = "DIR|URL")]
    pub sdk: Option<String>,
}

/// Kinds of plugin that can be begun.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum NewKind {
    /// Scores how well a view fits the photo
    Matcher,
    /// Finds the regions in which photo and view differ
    Detector,
    /// Measures what came, and says what went
    Estimator,
    /// Says which class each pixel of a photo is
    Segmenter,
}

/// Forms of a matcher that can be begun.
#[derive(Clone, Copy, Debug, PartialEq, Eq, ValueEnum)]
pub enum NewForm {
    /// Scores a view; the host makes candidates, renders and searches
    Score,
    /// Searches by itself, with what the host renders and compares for it
    Search,
}

/// Languages of `plugins new`.
#[derive(Clone, Copy, Debug, ValueEnum)]
pub enum Language {
    /// A crate with the SDK, without unsafe
    Rust,
    /// One file, the header, a Makefile
    C,
    /// The same as a class of C++17; a matcher that scores
    Cpp,
    /// A class on NumPy arrays; runs in a process of its own
    Python,
}

impl fmt::Display for NewKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Matcher => "matcher",
            Self::Detector => "detector",
            Self::Estimator => "estimator",
            Self::Segmenter => "segmenter",
        })
    }
}

impl fmt::Display for NewForm {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Score => "score",
            Self::Search => "search",
        })
    }
}

impl fmt::Display for Language {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(match self {
            Self::Rust => "rust",
            Self::C => "c",
            Self::Cpp => "cpp",
            Self::Python => "python",
        })
    }
}

fn seconds(text: &str) -> Result<f64, String> {
    let value: Option<f64> = text.parse().ok();
    value.filter(|value| (0.1..=3600.0).contains(value)).ok_or_else(|| "expected 0.1 to 3600".to_owned())
}
