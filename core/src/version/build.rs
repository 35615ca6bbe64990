//! Naming what a plugin build did.

use super::{Observation, PluginUse};
use std::fmt;
use std::str::FromStr;

/// Fewest digits of a SHA-256 that name a build.
const LEAST_DIGITS: usize = 8;

/// One build of a plugin, or all builds of a name or version.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum PluginBuild {
    /// Its SHA-256, or how that begins; lower case.
    Hash(String),
    /// Its name, and where it matters its version.
    Named {
        /// The name.
        name: String,
        /// The version; all when missing.
        version: Option<String>,
    },
}

impl PluginBuild {
    /// Whether `used` is such a build.
    pub fn is(&self, used: &PluginUse) -> bool {
        match self {
            // A name may look like digits.
            Self::Hash(digits) => {
                used.name == *digits || used.sha256.is_some_and(|digest| digest.to_string().starts_with(digits))
            }
            Self::Named { name, version } => {
                used.name == *name && version.as_ref().is_none_or(|version| used.version == *version)
            }
        }
    }

    /// Whether it took part in `observation`.
    pub fn took_part(&self, observation: &Observation) -> bool {
        observation.plugins.iter().any(|used| self.is(used))
    }
}

impl FromStr for PluginBuild {
    type Err = String;

    /// Reads 8 to 64 hexadecimal digits of a SHA-256, `NAME`, or `NAME@VERSION`.
    fn from_str(text: &str) -> Result<Self, Self::Err> {
        let is_hash = (LEAST_DIGITS..=64).contains(&text.len()) && text.bytes().all(|byte| byte.is_ascii_hexdigit());
        if is_hash {
            return Ok(Self::Hash(text.to_ascii_lowercase()));
        }
        let (name, version) = text.split_once('@').map_or((text, None), |(name, version)| (name, Some(version)));
        if name.is_empty() || version.is_some_and(str::is_empty) {
            return Err(format!(
                "expected {LEAST_DIGITS} or more digits of a SHA-256, NAME or NAME@VERSION, found {text:?}"
            ));
        }
        Ok(Self::Named { name: name.to_owned(), version: version.map(str::to_owned) })
    }
}

impl fmt::Display for PluginBuild {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Hash(digits) => formatter.write_str(digits),
            Self::Named { name, version: None } => formatter.write_str(name),
            Self::Named { name, version: Some(version) } => write!(formatter, "{name}@{version}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::version::Digest;

    #[test]
    fn a_build_is_named_by_digits_by_name_or_by_name_and_version() {
        let used = PluginUse {
            kind: "matcher".to_owned(),
            name: "semantic".to_owned(),
            version: "0.1.0".to_owned(),
            sha256: Some(Digest([0xAB; 32])),
            settings: serde_json::Value::Null,
            settings_sha256: None,
            files: Vec::new(),
        };
        let is = |text: &str| text.parse::<PluginBuild>().unwrap().is(&used);
        assert!(is("abababab") && is("ABABABABAB") && is(&"ab".repeat(32)) && is("semantic") && is("semantic@0.1.0"));
        assert!(!is("babababa") && !is("semantic@0.1.1") && !is("skyline"));
        let named = PluginUse { name: "deadbeef01".to_owned(), ..used.clone() };
        assert!("deadbeef01".parse::<PluginBuild>().unwrap().is(&named) && !is("deadbeef01"));
        // Seven digits are a name.
        assert_eq!("abababa".parse::<PluginBuild>().unwrap().to_string(), "abababa");
        assert!(!is("abababa"));
        for wrong in ["", "@1", "semantic@"] {
            assert!(wrong.parse::<PluginBuild>().unwrap_err().contains("NAME@VERSION"));
        }
    }
}
