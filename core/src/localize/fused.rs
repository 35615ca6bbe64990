//! Several matchers in `score` form as one: the host renders each candidate once, asks all of them and weighs what they
//! say.

use super::panel::Panel;
use crate::plugin::{Digest, Kind, Matcher, MatcherForm, PluginError, PluginInfo};

/// Its name on the command line.
pub const FUSED: &str = "fused";

/// Of this way of combining, as the evidence records it.
/// The weights that a member may have: beyond them sums are no numbers any more.
const WEIGHTS: std::ops::RangeInclusive<f64> = 1e-6..=1e6;
const VERSION: &str = env!("CARGO_PKG_VERSION");

/// What finds poses: a matcher, or several that the host combines.
#[derive(Debug)]
pub enum Matching {
    /// One matcher.
    Plugin(Matcher),
    /// Several.
    Fused(Fused),
}

/// A matcher that takes part.
#[derive(Debug)]
pub struct Member {
    /// The matcher, in `score` form.
    pub matcher: Matcher,
    /// What its standardised score counts for, above 0.
    pub weight: f64,
    /// Digest of its settings.
    pub settings: Digest,
}

/// Matchers whose scores are combined.
#[derive(Debug)]
pub struct Fused {
    info: PluginInfo,
    members: Vec<Member>,
    sigma_floor: f64,
}

/// Why matchers cannot be combined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum FusedError {
    /// Not a list of matchers.
    #[error(
        "fused.members={text}: expected names with weights from 1e-6 to 1e6, such as pixel:1+edges:2; found {found:?}"
    )]
    Members {
        /// The whole list.
        text: String,
        /// The part that is wrong.
        found: String,
    },
    /// A matcher twice, or one that is a combination itself.
    #[error("fused.members={text}: expected each matcher once and not {FUSED} itself; found {name:?}")]
    Repeated {
        /// The whole list.
        text: String,
        /// The matcher.
        name: String,
    },
    /// A matcher that scores no single views.
    #[error(
        "matcher {name} cannot take part in {FUSED}: expected one that scores a view, found one that searches by itself"
    )]
    SearchesAlone {
        /// The matcher.
        name: String,
    },
}

/// Names and weights in `text`, such as `pixel:1+edges:2`; a name without a weight has 1.
pub fn named_members(text: &str) -> Result<Vec<(String, f64)>, FusedError> {
    let mut members: Vec<(String, f64)> = Vec::new();
    for part in text.split('+') {
        let (name, weight) = part.split_once(':').unwrap_or((part, "1"));
        let (name, weight) = (name.trim(), weight.trim().parse::<f64>());
        let weight = weight.ok().filter(|weight| WEIGHTS.contains(weight) && !name.is_empty());
        let Some(weight) = weight else {
            return Err(FusedError::Members { text: text.to_owned(), found: part.to_owned() });
        };
        if name == FUSED || members.iter().any(|(known, _)| known == name) {
            return Err(FusedError::Repeated { text: text.to_owned(), name: name.to_owned() });
        }
        members.push((name.to_owned(), weight));
    }
    Ok(members)
}

impl Fused {
    /// `members` as one; one whose scores over all candidates of a photo have a standard deviation far below
    /// `sigma_floor` counts for little.
    pub fn new(members: Vec<Member>, sigma_floor: f64) -> Result<Self, FusedError> {
        if let Some(other) = members.iter().find(|member| member.matcher.form() == MatcherForm::Search) {
            return Err(FusedError::SearchesAlone { name: other.matcher.info().name.clone() });
        }
        if members.is_empty() {
            return Err(FusedError::Members { text: String::new(), found: String::new() });
        }
        let info = PluginInfo {
            name: FUSED.to_owned(),
            kind: Kind::Matcher,
            version: VERSION.to_owned(),
            summary: "Weighted mean of several matchers' scores, standardised over the candidates of a photo"
                .to_owned(),
            sha256: identity(&members, sigma_floor),
            path: None,
            builtin: true,
            is_apart: false,
            // Who its members are by default is for the program to say.
            settings_schema: None,
        };
        Ok(Self { info, members, sigma_floor })
    }

    /// What the evidence says of the combination: the digest covers version, file and settings of every member.
    pub fn info(&self) -> &PluginInfo {
        &self.info
    }

    pub(super) fn panel(&mut self) -> Panel<'_> {
        let members = self.members.iter_mut().map(|member| (&mut member.matcher, member.weight));
        Panel::of_many(members, self.sigma_floor)
    }
}

fn identity(members: &[Member], sigma_floor: f64) -> Digest {
    let mut text = format!("{FUSED} {VERSION} {sigma_floor}\n");
    for Member { matcher, weight, settings } in members {
        let PluginInfo { name, version, sha256, .. } = matcher.info();
        text += &format!("{name} {version} {sha256} {settings} {weight}\n");
    }
    Digest::of(text.as_bytes())
}

impl Matching {
    /// Which matcher it is.
    pub fn info(&self) -> &PluginInfo {
        match self {
            Self::Plugin(matcher) => matcher.info(),
            Self::Fused(fused) => fused.info(),
        }
    }

    /// Ends the instances, as [`Matcher::finish`] does.
    pub fn finish(&mut self) -> Result<(), PluginError> {
        match self {
            Self::Plugin(matcher) => matcher.finish(),
            Self::Fused(fused) => fused.members.iter_mut().try_for_each(|member| member.matcher.finish()),
        }
    }
}

impl From<Matcher> for Matching {
    fn from(matcher: Matcher) -> Self {
        Self::Plugin(matcher)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn members_are_names_with_weights() {
        let found = named_members("pixel:1 + edges:2.5+skyline").unwrap();
        let expected = [("pixel", 1.0), ("edges", 2.5), ("skyline", 1.0)].map(|(name, w)| (name.to_owned(), w));
        assert_eq!(found, expected);
    }

    #[test]
    fn what_is_no_list_of_members_is_refused_with_what_is() {
        for (text, found) in [
            ("", "\"\""),
            ("pixel+", "\"\""),
            ("pixel:0", "\"pixel:0\""),
            ("pixel:-1", "\"pixel:-1\""),
            ("pixel:NaN", "\"pixel:NaN\""),
            ("pixel:inf", "\"pixel:inf\""),
            (":2", "\":2\""),
            ("pixel:1,edges:2", "\"pixel:1,edges:2\""),
        ] {
            let message = named_members(text).unwrap_err().to_string();
            assert!(message.contains("pixel:1+edges:2") && message.ends_with(&format!("found {found}")), "{message}");
        }
        for text in ["pixel+pixel:2", "pixel+fused"] {
            assert!(matches!(named_members(text), Err(FusedError::Repeated { .. })), "{text}");
        }
    }
}
