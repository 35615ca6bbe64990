//! `resurvey completions` and `resurvey man`.

use crate::args::{Cli, Completions, Man};
use crate::console::Console;
use crate::failure::Failure;
use crate::out_file::make_directory;
use clap::CommandFactory;
use serde_json::json;

/// Prints a completion script.
pub fn completions(options: &Completions, console: &mut Console<'_>) -> Result<u8, Failure> {
    // Through memory: the generator panics when its writer fails, and a closed pipe is no bug.
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut Cli::command(), "resurvey", &mut script);
    console.out().write_all(&script)?;
    Ok(0)
}

/// Writes a manual page per command.
pub fn man(options: &Man, console: &mut Console<'_>) -> Result<u8, Failure> {
    let failed = |error: std::io::Error| Failure::input(format!("{}: {error}", options.out.display()));
    make_directory(&options.out)?;
    clap_mangen::generate_to(Cli::command(), &options.out).map_err(failed)?;
    if console.is_json() {
        let entries = std::fs::read_dir(&options.out).and_then(Iterator::collect::<Result<Vec<_>, _>>);
        let names = entries.map_err(failed)?.into_iter().map(|entry| entry.file_name().to_string_lossy().into_owned());
        let mut files: Vec<String> =
            names.filter(|name| name.starts_with("resurvey") && name.ends_with(".1")).collect();
        files.sort_unstable();
        console.document(&json!({ "directory": options.out.display().to_string(), "files": files }))?;
    } else {
        console.line(format_args!("manual pages are in {}", options.out.display()))?;
    }
    Ok(0)
}
