//! The matcher of a run: a plugin, or several that the host combines (`fused`).

use crate::failure::{Failure, PLUGIN};
use crate::tools::{Choices, Tool, load};
use resurvey_core::localize::{FUSED, Fused, FusedError, Matching, Member, named_members};
use resurvey_core::plugin::{Assignment, Digest, PluginError, PluginInfo, Registry, Settings, SettingsSchema};
use resurvey_core::version::PluginUse;

/// JSON schema of the settings of `fused`.
const FUSED_SETTINGS: &str = include_str!("fused.schema.json");

/// A matcher with the settings of this run.
pub enum MatchingTool {
    /// A plugin.
    Plugin(Tool),
    /// Several plugins, each with its weight.
    Fused(FusedTool),
}

/// Several matchers as one.
pub struct FusedTool {
    settings: Settings,
    sigma_floor: f64,
    members: Vec<(Tool, f64)>,
}

/// The settings of the combination itself.
#[derive(serde::Deserialize)]
struct Values {
    members: String,
    sigma_floor: f64,
}

impl MatchingTool {
    /// The matcher called `name` with what `choices` say of it.
    pub fn load(registry: &Registry, choices: &Choices, name: &str) -> Result<Self, Failure> {
        if name != FUSED {
            return Ok(Self::Plugin(choices.tool(&load(registry, name)?)?));
        }
        let settings = complete(choices.given(FUSED))?;
        let Values { members, sigma_floor } = serde_json::from_str(settings.as_json())?;
        let member = |(name, weight): (String, f64)| -> Result<(Tool, f64), Failure> {
            Ok((choices.tool(&load(registry, &name)?)?, weight))
        };
        let members = named_members(&members)?.into_iter().map(member).collect::<Result<_, _>>()?;
        Ok(Self::Fused(FusedTool { settings, sigma_floor, members }))
    }

    /// A new instance.
    pub fn matching(&self) -> Result<Matching, Failure> {
        match self {
            Self::Plugin(tool) => Ok(tool.plugin.matcher(&tool.settings)?.into()),
            Self::Fused(fused) => Ok(Matching::Fused(fused.instance()?)),
        }
    }

    /// How the evidence records it: a combination, then each of its members.
    pub fn used(&self) -> Result<Vec<PluginUse>, Failure> {
        match self {
            Self::Plugin(tool) => Ok(vec![tool.used()?]),
            Self::Fused(fused) => fused.used(),
        }
    }

    /// Name and settings, of all members: what makes two matchers give the same answers.
    pub fn identity(&self) -> (&str, Digest) {
        match self {
            Self::Plugin(tool) => tool.identity(),
            Self::Fused(FusedTool { settings, members, .. }) => {
                let members = members.iter().map(|(tool, _)| tool.settings.as_json());
                let all: Vec<&str> = std::iter::once(settings.as_json()).chain(members).collect();
                (FUSED, Digest::of(all.join("\n").as_bytes()))
            }
        }
    }
}

impl FusedTool {
    fn instance(&self) -> Result<Fused, Failure> {
        let member = |(tool, weight): &(Tool, f64)| -> Result<Member, Failure> {
            let matcher = tool.plugin.matcher(&tool.settings)?;
            Ok(Member { matcher, weight: *weight, settings: tool.settings.sha256() })
        };
        let members = self.members.iter().map(member).collect::<Result<_, _>>()?;
        Ok(Fused::new(members, self.sigma_floor)?)
    }

    fn used(&self) -> Result<Vec<PluginUse>, Failure> {
        let instance = self.instance()?;
        let PluginInfo { name, kind, version, sha256, .. } = instance.info();
        let own = PluginUse {
            kind: kind.to_string(),
            name: name.clone(),
            version: version.clone(),
            sha256: Some(*sha256),
            settings: serde_json::from_str(self.settings.as_json())?,
            settings_sha256: Some(self.settings.sha256()),
            files: Vec::new(),
        };
        let members = self.members.iter().map(|(tool, _)| tool.used());
        std::iter::once(Ok(own)).chain(members).collect()
    }
}

/// The names of a run, and where [`FUSED`] is among them those of the matchers that `assignments` make it of.
pub fn with_members<'a>(
    names: &[&str],
    assignments: impl IntoIterator<Item = &'a Assignment>,
) -> Result<Vec<String>, Failure> {
    let mut all: Vec<String> = names.iter().map(|name| (*name).to_owned()).collect();
    if names.contains(&FUSED) {
        let own = assignments.into_iter().filter(|assignment| assignment.plugin == FUSED);
        let settings = complete(own.map(|own| (own.key.as_str(), own.value.as_str())))?;
        let Values { members, .. } = serde_json::from_str(settings.as_json())?;
        all.extend(named_members(&members)?.into_iter().map(|(name, _)| name));
    }
    Ok(all)
}

fn complete<'a>(given: impl IntoIterator<Item = (&'a str, &'a str)>) -> Result<Settings, Failure> {
    let settings = SettingsSchema::parse(FUSED_SETTINGS).and_then(|schema| schema.complete(given));
    settings.map_err(|source| PluginError::Settings { plugin: FUSED.to_owned(), source }.into())
}

impl From<FusedError> for Failure {
    fn from(error: FusedError) -> Self {
        match error {
            FusedError::SearchesAlone { .. } => Self::new(PLUGIN, error),
            _ => Self::usage(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_of_a_combination_uses_its_members_too() {
        let assignment = "fused.members=skyline+edges:2".parse().unwrap();
        assert_eq!(with_members(&["fused", "a"], [&assignment]).unwrap(), ["fused", "a", "skyline", "edges"]);
        assert_eq!(with_members(&["semantic"], [&assignment]).unwrap(), ["semantic"]);
        // The defaults are members.
        assert!(with_members(&["fused"], []).unwrap().len() > 2);
    }
}
