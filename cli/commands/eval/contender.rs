//! Contenders: matchers with their settings, as `--matcher` names them.

use crate::args::{Eval, PluginSearch, Settings};
use crate::failure::Failure;
use crate::tools::{Choices, Tool, load, registry};
use resurvey_core::plugin::{Digest, Registry};

/// The phone's pose as the answer.
const PRIOR: &str = "prior";

/// What is compared when nothing is asked for: name in tables, and as `--matcher` has it.
const DEFAULT: [(&str, &str); 7] = [
    (PRIOR, PRIOR),
    ("skyline", "skyline"),
    ("Dice", "semantic:profile=paper,dice=1,jaccard=0,boundary_f1=0"),
    ("Jaccard", "semantic:profile=paper,dice=0,jaccard=1,boundary_f1=0"),
    ("boundary F1", "semantic:profile=paper,dice=0,jaccard=0,boundary_f1=1"),
    ("mean of three", "semantic:profile=paper"),
    ("semantic", "semantic"),
];

/// A matcher with its settings.
pub struct Contender {
    /// Its name in tables and documents.
    pub name: String,
    /// As `--matcher` has it.
    pub specification: String,
    /// The plugin; `None` for the prior.
    pub matcher: Option<Tool>,
}

impl Contender {
    fn identity(&self) -> Option<(&str, Digest)> {
        self.matcher.as_ref().map(|tool| (tool.plugin.info().name.as_str(), tool.settings.sha256()))
    }
}

/// The plugins of a run, and the limits of its gate.
pub struct Field {
    /// Matchers, in the order of the tables.
    pub contenders: Vec<Contender>,
    /// Detector and estimator.
    pub others: [Tool; 2],
    /// The `--set` and `--profile` of all of them.
    pub settings: Settings,
    names: Vec<String>,
}

impl Field {
    /// Loads what `options` name and checks every setting.
    pub fn load(options: &Eval, plugins: &PluginSearch) -> Result<Self, Failure> {
        let registry = registry(plugins)?;
        let given = options.matcher.iter().map(|text| (text.as_str(), text.as_str()));
        let specifications: Vec<(&str, &str)> =
            if options.matcher.is_empty() { DEFAULT.to_vec() } else { given.collect() };
        let matchers = specifications.iter().map(|(_, text)| plugin_name(text)).filter(|name| *name != PRIOR);
        let others = [options.detector.as_str(), options.estimator.as_str()];
        let names: Vec<String> = matchers.chain(others).map(ToOwned::to_owned).collect();
        let settings = Settings { set: options.settings.set.clone(), profile: options.settings.profile.clone() };
        let field = Reading { registry: &registry, settings: &settings, names: &names };
        let contenders =
            specifications.iter().map(|(name, text)| field.contender(name, text)).collect::<Result<_, _>>()?;
        let [detector, estimator] = others.map(|name| field.tool(name, &[]));
        let others = [detector?, estimator?];
        // A plugin in the place of another kind is refused before the first capture.
        others[0].plugin.detector(&others[0].settings)?;
        others[1].plugin.estimator(&others[1].settings)?;
        Ok(Self { contenders, others, settings, names })
    }

    /// Pairs of contenders that are the same plugin with the same complete settings, and so give the same answers.
    pub fn twins(&self) -> Vec<[&str; 2]> {
        let pairs = self
            .contenders
            .iter()
            .enumerate()
            .flat_map(|(index, contender)| self.contenders[..index].iter().map(move |before| (before, contender)));
        let same = pairs.filter(|(before, contender)| before.identity() == contender.identity());
        same.map(|(before, contender)| [before.name.as_str(), contender.name.as_str()]).collect()
    }

    /// Limits of gate and search, and the settings of detector and estimator.
    pub fn choices(&self) -> Result<Choices, Failure> {
        choices(&self.settings, &self.names, &[])
    }
}

struct Reading<'a> {
    registry: &'a Registry,
    settings: &'a Settings,
    names: &'a [String],
}

impl Reading<'_> {
    fn contender(&self, name: &str, text: &str) -> Result<Contender, Failure> {
        let own = own_settings(text)?;
        let matcher = if plugin_name(text) == PRIOR {
            if !own.is_empty() {
                return Err(Failure::usage(format!("--matcher {text}: the prior has no settings")));
            }
            None
        } else {
            let tool = self.tool(plugin_name(text), &own)?;
            tool.plugin.matcher(&tool.settings)?;
            Some(tool)
        };
        Ok(Contender { name: name.to_owned(), specification: text.to_owned(), matcher })
    }

    /// The plugin called `name` with the settings of the run, overruled by `own`.
    fn tool(&self, name: &str, own: &[String]) -> Result<Tool, Failure> {
        let plugin = load(self.registry, name)?;
        choices(self.settings, self.names, own)?.tool(&plugin)
    }
}

fn choices(settings: &Settings, names: &[String], own: &[String]) -> Result<Choices, Failure> {
    let set = settings.set.iter().chain(own).cloned().collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Choices::read(&Settings { set, profile: settings.profile.clone() }, &names)
}

fn plugin_name(specification: &str) -> &str {
    specification.split_once(':').map_or(specification, |(name, _)| name)
}

/// The settings behind the colon as `--set` has them.
fn own_settings(specification: &str) -> Result<Vec<String>, Failure> {
    let Some((name, settings)) = specification.split_once(':') else { return Ok(Vec::new()) };
    let own = settings.split(',').map(|setting| match setting.split_once('=') {
        Some((key, _)) if !key.is_empty() => Ok(format!("{name}.{setting}")),
        _ => Err(Failure::usage(format!(
            "--matcher {specification}: expected NAME:KEY=VALUE,… such as semantic:profile=paper,dice=1; found {setting:?}"
        ))),
    });
    own.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_specification_is_a_name_and_settings() {
        let text = "semantic:profile=paper,dice=1";
        assert_eq!(plugin_name(text), "semantic");
        assert_eq!(own_settings(text).unwrap(), ["semantic.profile=paper", "semantic.dice=1"]);
        assert!(own_settings("skyline").unwrap().is_empty());
        for wrong in ["semantic:", "semantic:dice", "semantic:=1", "semantic:dice=1,"] {
            assert!(own_settings(wrong).unwrap_err().to_string().contains("NAME:KEY=VALUE"), "{wrong}");
        }
    }
}
