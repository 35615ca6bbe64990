//! What a command was asked for, as a digest: an idempotency key goes with one request. Who asks and with which message is
//! no part of it.

use crate::args::Region;
use crate::failure::Failure;
use resurvey_core::version::Digest;
use std::fmt::Display;
use std::path::Path;

/// A request, part by part.
pub struct Request(String);

impl Request {
    /// One of this command.
    pub fn of(command: &str) -> Self {
        Self(format!("{command}\n"))
    }

    /// Adds what is asked for, where it is.
    pub fn with(mut self, name: &str, value: Option<impl Display>) -> Self {
        if let Some(value) = value.map(|value| value.to_string()) {
            self.0 += &format!("{name} {} {value}\n", value.len());
        }
        self
    }

    /// Adds numbers.
    pub fn with_numbers(self, name: &str, numbers: Option<&[f64]>) -> Self {
        let text = |numbers: &[f64]| numbers.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        self.with(name, numbers.map(text))
    }

    /// Adds the contents of a file.
    pub fn with_file(self, name: &str, path: Option<&Path>) -> Result<Self, Failure> {
        let read = |path: &Path| {
            let bytes = std::fs::read(path);
            bytes.map_err(|error| Failure::input(format!("{}: {error}", path.display())))
        };
        Ok(self.with(name, path.map(read).transpose()?.map(|bytes| Digest::of(&bytes))))
    }

    /// Adds a region.
    pub fn with_region(self, region: &Region) -> Self {
        let (bbox, height) = (region.bbox.as_ref(), region.height.as_ref());
        self.with_numbers("bbox", bbox.map(<[f64; 4]>::as_slice))
            .with_numbers("height", height.map(<[f64; 2]>::as_slice))
    }

    /// Its digest.
    pub fn digest(&self) -> Digest {
        Digest::of(self.0.as_bytes())
    }
}
