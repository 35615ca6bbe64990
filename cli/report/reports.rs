//! The directory of reports: one page a capture, and an index of the run.

use super::index::{self, Entry};
use super::page;
use super::section::GENERATED;
use super::sheet::Sheet;
use crate::failure::Failure;
use crate::out_file::{make_directory, write_file};
use std::path::{Path, PathBuf};

/// The reports of one run.
pub struct Reports {
    directory: PathBuf,
    /// Names that are taken, in lower case: some file systems do not tell cases apart.
    taken: Vec<String>,
    entries: Vec<Entry>,
    /// What could not be written first.
    failed: Option<Failure>,
}

impl Reports {
    /// Reports in `directory`, which is made when it is missing: what cannot be written is said before a map changes.
    pub fn start(directory: &Path) -> Result<Self, Failure> {
        make_directory(directory)?;
        refuse_others(&directory.join("index.html"))?;
        let mut reports = Self {
            directory: directory.to_owned(),
            taken: vec!["index".to_owned()],
            entries: Vec::new(),
            failed: None,
        };
        reports.write_index()?;
        Ok(reports)
    }

    /// Writes the page of a capture, and the index anew. What cannot be written is kept for [`Self::finish`]: the capture
    /// is in the map whatever becomes of its page.
    pub fn add(&mut self, sheet: &Sheet<'_>) {
        let written = self.write(sheet);
        self.note(written);
    }

    /// Says in the index that the run met a capture that could not be worked on.
    pub fn add_failure(&mut self, path: &Path, failure: &Failure) {
        let name = self.free_name(path);
        self.entries.push(Entry::failed(name, path, failure));
        let written = self.write_index();
        self.note(written);
    }

    /// What could not be written first.
    pub fn finish(self) -> Result<(), Failure> {
        self.failed.map_or(Ok(()), Err)
    }

    fn note(&mut self, written: Result<(), Failure>) {
        self.failed = self.failed.take().or(written.err());
    }

    fn write(&mut self, sheet: &Sheet<'_>) -> Result<(), Failure> {
        let name = self.free_name(sheet.path);
        let file = format!("{name}.html");
        write_file(&self.directory.join(&file), page::page(sheet, &name)?.as_bytes())?;
        self.entries.push(Entry::of(sheet, name, file)?);
        self.write_index()
    }

    fn write_index(&mut self) -> Result<(), Failure> {
        write_file(&self.directory.join("index.html"), index::index(&self.entries).as_bytes())
    }

    /// A name no other capture of the run has, from the capture's directory.
    fn free_name(&mut self, capture: &Path) -> String {
        let wanted = name_of(capture);
        let is_free = |name: &String| !self.taken.contains(&name.to_lowercase());
        let numbered = (2_usize..).map(|number| format!("{wanted}-{number}"));
        let name = std::iter::once(wanted.clone()).chain(numbered).find(is_free).unwrap_or(wanted);
        self.taken.push(name.to_lowercase());
        name
    }
}

/// Refuses to write over a page that is not one of these.
fn refuse_others(index: &Path) -> Result<(), Failure> {
    match std::fs::read(index) {
        Ok(page) if !String::from_utf8_lossy(&page).contains(GENERATED) => Err(Failure::input(format!(
            "{}: expected a directory for reports, found a page of somebody else; name a directory of its own",
            index.display()
        ))),
        _ => Ok(()),
    }
}

/// The name of the capture's directory, and its own where that is not `capture.json`; letters and digits of ASCII, `-`,
/// `_` and `.` stay, all others become `-`.
fn name_of(capture: &Path) -> String {
    let whole = std::fs::canonicalize(capture).unwrap_or_else(|_| capture.to_owned());
    let directory = whole.parent().and_then(Path::file_name).unwrap_or_default().to_string_lossy().into_owned();
    let stem = whole.file_stem().unwrap_or_default().to_string_lossy().into_owned();
    let name = if stem == "capture" { directory } else { format!("{directory}-{stem}") };
    let plain: String = name
        .chars()
        .map(|sign| if sign.is_ascii_alphanumeric() || "-_.".contains(sign) { sign } else { '-' })
        .collect();
    let plain = plain.trim_matches(['.', '-']).to_owned();
    if plain.is_empty() { "capture".to_owned() } else { plain }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_page_is_called_after_the_directory_of_its_capture_and_no_two_alike() {
        let directory = tempfile::tempdir().unwrap();
        let mut reports = Reports::start(directory.path()).unwrap();
        let mut name = |path: &str| reports.free_name(Path::new(path));
        assert_eq!(name("/nowhere/0042/capture.json"), "0042");
        assert_eq!(name("/elsewhere/0042/capture.json"), "0042-2");
        assert_eq!(name("/nowhere/street/left.json"), "street-left");
        assert_eq!(name("/nowhere/<b>é & co/capture.json"), "b-----co");
        assert_eq!(name("/nowhere/Index/capture.json"), "Index-2");
        assert_eq!(name("capture.json"), "capture");
    }
}
