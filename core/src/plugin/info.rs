//! What is known of a plugin before it runs.

use resurvey_schema::abi;
use sha2::{Digest as _, Sha256};
use std::path::PathBuf;

/// A plugin as `plugins list` shows it and the evidence records it.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PluginInfo {
    /// Name on the command line.
    pub name: String,
    /// What it does.
    pub kind: Kind,
    /// Its own version.
    pub version: String,
    /// One sentence.
    pub summary: String,
    /// Of the library file. A built-in plugin has no file: the digest of its name, version, summary and settings schema,
    /// so that the same program gives the same evidence on every machine.
    pub sha256: Digest,
    /// The library file; `None` when built in.
    pub path: Option<PathBuf>,
    /// Whether it is part of this program.
    pub builtin: bool,
    /// JSON schema of its settings; `None` for a file that is not loaded yet, because asking would run its code.
    pub settings_schema: Option<String>,
}

/// What a plugin does.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
#[non_exhaustive]
pub enum Kind {
    /// Finds the pose of a photo.
    Matcher,
    /// Finds the regions in which photo and map differ.
    Detector,
    /// Makes descriptors of these regions.
    Estimator,
}

impl Kind {
    /// The kind with this number in the header.
    pub(super) fn from_number(number: u16) -> Option<Self> {
        match number {
            abi::KIND_MATCHER => Some(Self::Matcher),
            abi::KIND_DETECTOR => Some(Self::Detector),
            abi::KIND_ESTIMATOR => Some(Self::Estimator),
            _ => None,
        }
    }
}

impl std::fmt::Display for Kind {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        formatter.write_str(match self {
            Self::Matcher => "matcher",
            Self::Detector => "detector",
            Self::Estimator => "estimator",
        })
    }
}

/// A SHA-256, written as 64 hexadecimal digits.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Digest([u8; 32]);

impl Digest {
    /// The SHA-256 of `bytes`.
    pub fn of(bytes: &[u8]) -> Self {
        Self(Sha256::digest(bytes).into())
    }

    /// Its 32 bytes.
    pub fn bytes(&self) -> [u8; 32] {
        self.0
    }
}

impl std::fmt::Display for Digest {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.iter().try_for_each(|byte| write!(formatter, "{byte:02x}"))
    }
}

impl std::fmt::Debug for Digest {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(formatter, "Digest({self})")
    }
}

impl std::str::FromStr for Digest {
    type Err = InvalidDigest;

    fn from_str(text: &str) -> Result<Self, InvalidDigest> {
        let invalid = || InvalidDigest(text.to_owned());
        if text.len() != 64 || !text.bytes().all(|byte| byte.is_ascii_hexdigit()) {
            return Err(invalid());
        }
        let mut bytes = [0; 32];
        for (index, byte) in bytes.iter_mut().enumerate() {
            *byte = u8::from_str_radix(&text[2 * index..2 * index + 2], 16).map_err(|_| invalid())?;
        }
        Ok(Self(bytes))
    }
}

/// A text that is not a SHA-256.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("expected a SHA-256 of 64 hexadecimal digits, found {0:?}")]
pub struct InvalidDigest(pub String);

#[cfg(test)]
mod tests {
    use super::*;

    // FIPS 180-2, appendix B.1.
    const ABC: &str = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";

    #[test]
    fn a_digest_is_written_and_read_as_hexadecimal() {
        assert_eq!(Digest::of(b"abc").to_string(), ABC);
        assert_eq!(ABC.parse(), Ok(Digest::of(b"abc")));
    }

    #[test]
    fn a_text_that_is_not_a_digest_is_refused() {
        for text in ["", "ba78", &ABC.replace('b', "g"), &ABC.replace("b", "+"), &"é".repeat(32)] {
            assert_eq!(text.parse::<Digest>(), Err(InvalidDigest(text.to_owned())));
        }
    }
}
