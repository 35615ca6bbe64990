//! The page that links the captures of a run.

use super::base64::png_address;
use super::numbers::text;
use super::page::outcome;
use super::section::{badge, document, rows};
use super::sheet::Sheet;
use super::words::counted;
use crate::failure::Failure;
use maud::{Markup, html};
use resurvey_core::image::{LabelImage, write_label_png};
use std::path::Path;

/// Columns of a thumbnail.
const THUMBNAIL_PX: u32 = 160;

/// One line of the index.
pub struct Entry {
    name: String,
    /// Where the page is; `None` for a capture that could not be worked on.
    file: Option<String>,
    thumbnail: Option<Vec<u8>>,
    decision: String,
    words: String,
    changes: Vec<String>,
}

impl Entry {
    /// Of a capture with a page.
    pub fn of(sheet: &Sheet<'_>, name: String, file: String) -> Result<Self, Failure> {
        let labels = &sheet.capture.labels;
        let stride = labels.width().div_ceil(THUMBNAIL_PX).max(1);
        let (width, height) = (labels.width().div_ceil(stride), labels.height().div_ceil(stride));
        let mut small = LabelImage::filled(width, height, 0);
        for v in 0..height {
            for u in 0..width {
                small.set(u, v, labels.at(u * stride, v * stride));
            }
        }
        let changes = sheet.document["changes"].as_array().into_iter().flatten();
        let words = |change: &serde_json::Value| {
            let fid = change["fid"].as_u64().map_or_else(String::new, |fid| format!(" {fid}"));
            format!("{} {}{fid}", text(&change["op"]), text(&change["class"]))
        };
        Ok(Self {
            name,
            file: Some(file),
            thumbnail: Some(write_label_png(&small, sheet.world.classes())?),
            decision: text(&sheet.document["decision"]).to_owned(),
            words: outcome(sheet),
            changes: changes.map(words).collect(),
        })
    }

    /// Of a capture that could not be worked on.
    pub fn failed(name: String, path: &Path, failure: &Failure) -> Self {
        let words = format!("{}: {failure}", path.display());
        Self { name, file: None, thumbnail: None, decision: "failed".to_owned(), words, changes: Vec::new() }
    }
}

/// The index of `entries`.
pub fn index(entries: &[Entry]) -> String {
    let lines: Vec<Vec<Markup>> = entries
        .iter()
        .map(|entry| {
            vec![
                html! { @if let Some(png) = &entry.thumbnail { img class="thumbnail" src=(png_address(png)) alt=""; } },
                html! { @match &entry.file { Some(file) => a href=(file) { (entry.name) }, None => (entry.name) } },
                badge(&entry.decision),
                html! { (entry.words) @for change in &entry.changes { br; b { (change) } } },
            ]
        })
        .collect();
    let body = html! {
        header {
            h1 { "Update report" }
            p class="outcome" { (counted(entries.len(), "capture", "captures")) }
        }
        @if !lines.is_empty() { section { (rows(&["", "Capture", "Decision", "What came of it"], &lines)) } }
    };
    document("Update report – resurvey", &body).into_string()
}
