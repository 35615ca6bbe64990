//! Contenders: matchers, detectors and estimators with their settings, as the options name them, in every combination.

use crate::args::{Eval, PluginSearch, Settings};
use crate::failure::Failure;
use crate::matching::{MatchingTool, with_members};
use crate::tools::{Choices, Tool, load, registry};
use resurvey_core::localize::FUSED;
use resurvey_core::plugin::{Assignment, Digest, Registry};

/// The phone's pose as the answer.
const PRIOR: &str = "prior";

/// What is compared when nothing is asked for: name in tables, and as `--matcher` has it.
const DEFAULT: [(&str, &str); 11] = [
    (PRIOR, PRIOR),
    ("skyline", "skyline"),
    ("silhouette", "silhouette"),
    ("edges", "edges"),
    ("pixel", "pixel"),
    (FUSED, FUSED),
    ("Dice", "semantic:profile=paper,dice=1,jaccard=0,boundary_f1=0"),
    ("Jaccard", "semantic:profile=paper,dice=0,jaccard=1,boundary_f1=0"),
    ("boundary F1", "semantic:profile=paper,dice=0,jaccard=0,boundary_f1=1"),
    ("mean of three", "semantic:profile=paper"),
    ("semantic", "semantic"),
];

/// A plugin with its settings; that of a matcher is `None` for the prior.
pub struct Entry<T> {
    /// Its name in tables and documents.
    pub name: String,
    /// As the option has it.
    pub specification: String,
    /// The plugin.
    pub tool: T,
}

/// A matcher, a detector and an estimator, by their places in the field; without updates only the matcher counts.
pub struct Contender {
    /// Its name in tables and documents: the matcher's, and those of detector and estimator where there are several.
    pub name: String,
    /// Which matcher.
    pub matcher: usize,
    /// Which detector.
    pub detector: usize,
    /// Which estimator.
    pub estimator: usize,
}

/// The plugins of a run, and the limits of its gate.
pub struct Field {
    /// Every combination, in the order of the tables: all of the first matcher first.
    pub contenders: Vec<Contender>,
    /// Matchers.
    pub matchers: Vec<Entry<Option<MatchingTool>>>,
    /// Detectors.
    pub detectors: Vec<Entry<Tool>>,
    /// Estimators.
    pub estimators: Vec<Entry<Tool>>,
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
        let others = options.detector.iter().chain(&options.estimator).map(|text| plugin_name(text));
        let mut names: Vec<String> = matchers.chain(others).map(ToOwned::to_owned).collect();
        for (_, text) in &specifications {
            names.extend(members(&options.settings, text)?);
        }
        let settings = Settings { set: options.settings.set.clone(), profile: options.settings.profile.clone() };
        let reading = Reading { registry: &registry, settings: &settings, names: &names };
        let matchers = specifications.iter().map(|(name, text)| reading.matcher(name, text));
        let matchers: Vec<_> = matchers.collect::<Result<_, _>>()?;
        let entries = |option: &str, texts: &[String]| -> Result<Vec<Entry<Tool>>, Failure> {
            texts.iter().map(|text| reading.entry(option, text)).collect()
        };
        let detectors = entries("--detector", &options.detector)?;
        let estimators = entries("--estimator", &options.estimator)?;
        // A plugin in the place of another kind is refused before the first capture.
        for Entry { tool, .. } in &detectors {
            tool.plugin.detector(&tool.settings)?;
        }
        for Entry { tool, .. } in &estimators {
            tool.plugin.estimator(&tool.settings)?;
        }
        let contenders = combinations(&matchers, &detectors, &estimators);
        Ok(Self { contenders, matchers, detectors, estimators, settings, names })
    }

    /// The contenders with this matcher.
    pub fn with_matcher(&self, matcher: usize) -> impl Iterator<Item = &Contender> {
        self.contenders.iter().filter(move |contender| contender.matcher == matcher)
    }

    /// Detector and estimator of `contender`.
    pub fn comparers(&self, contender: &Contender) -> [&Tool; 2] {
        [&self.detectors[contender.detector].tool, &self.estimators[contender.estimator].tool]
    }

    /// Whether `index` is the first contender with its matcher: the others have the same poses.
    pub fn is_first_of_matcher(&self, index: usize) -> bool {
        let matcher = |index: usize| self.contenders.get(index).map(|contender| contender.matcher);
        index.checked_sub(1).is_none_or(|before| matcher(before) != matcher(index))
    }

    /// Pairs of contenders that are the same plugins with the same complete settings, and so give the same answers.
    pub fn twins(&self) -> Vec<[&str; 2]> {
        let pairs = self
            .contenders
            .iter()
            .enumerate()
            .flat_map(|(index, contender)| self.contenders[..index].iter().map(move |before| (before, contender)));
        let same = pairs.filter(|(before, contender)| self.identity(before) == self.identity(contender));
        same.map(|(before, contender)| [before.name.as_str(), contender.name.as_str()]).collect()
    }

    fn identity(&self, contender: &Contender) -> [Option<(&str, Digest)>; 3] {
        let matcher = self.matchers[contender.matcher].tool.as_ref().map(MatchingTool::identity);
        let [detector, estimator] = self.comparers(contender).map(|tool| Some(tool.identity()));
        [matcher, detector, estimator]
    }

    /// Limits of gate and search, and the settings of detector and estimator.
    pub fn choices(&self) -> Result<Choices, Failure> {
        choices(&self.settings, &self.names, &[])
    }
}

/// Every matcher with every detector with every estimator. A name says of the latter two only what differs.
fn combinations<M, T>(matchers: &[Entry<M>], detectors: &[Entry<T>], estimators: &[Entry<T>]) -> Vec<Contender> {
    let mut contenders = Vec::new();
    for (matcher, with) in matchers.iter().enumerate() {
        for (detector, and) in detectors.iter().enumerate() {
            for (estimator, last) in estimators.iter().enumerate() {
                let mut name = with.name.clone();
                for (entry, count) in [(and, detectors.len()), (last, estimators.len())] {
                    if count > 1 {
                        name = format!("{name} + {}", entry.name);
                    }
                }
                contenders.push(Contender { name, matcher, detector, estimator });
            }
        }
    }
    contenders
}

struct Reading<'a> {
    registry: &'a Registry,
    settings: &'a Settings,
    names: &'a [String],
}

impl Reading<'_> {
    fn matcher(&self, name: &str, text: &str) -> Result<Entry<Option<MatchingTool>>, Failure> {
        const OPTION: &str = "--matcher";
        if plugin_name(text) == PRIOR {
            if !own_settings(OPTION, text)?.is_empty() {
                return Err(Failure::usage(format!("--matcher {text}: the prior has no settings")));
            }
            return Ok(Entry { name: name.to_owned(), specification: text.to_owned(), tool: None });
        }
        let choices = choices(self.settings, self.names, &own_settings(OPTION, text)?)?;
        let tool = MatchingTool::load(self.registry, &choices, plugin_name(text))?;
        tool.matching()?;
        Ok(Entry { name: name.to_owned(), specification: text.to_owned(), tool: Some(tool) })
    }

    /// The plugin that `text` names, with the settings of the run, overruled by its own.
    fn entry(&self, option: &str, text: &str) -> Result<Entry<Tool>, Failure> {
        let own = own_settings(option, text)?;
        let plugin = load(self.registry, plugin_name(text))?;
        let tool = choices(self.settings, self.names, &own)?.tool(&plugin)?;
        Ok(Entry { name: text.to_owned(), specification: text.to_owned(), tool })
    }
}

fn choices(settings: &Settings, names: &[String], own: &[String]) -> Result<Choices, Failure> {
    let set = settings.set.iter().chain(own).cloned().collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    Choices::read(&Settings { set, profile: settings.profile.clone() }, &names)
}

/// The matchers that one is made of, where `specification` names several.
fn members(settings: &Settings, specification: &str) -> Result<Vec<String>, Failure> {
    if plugin_name(specification) != FUSED {
        return Ok(Vec::new());
    }
    let own = own_settings("--matcher", specification)?;
    let parsed = |text: &String| text.parse::<Assignment>().map_err(Failure::usage);
    let assignments = settings.set.iter().chain(&own).map(parsed).collect::<Result<Vec<_>, _>>()?;
    with_members(&[FUSED], &assignments)
}

fn plugin_name(specification: &str) -> &str {
    specification.split_once(':').map_or(specification, |(name, _)| name)
}

/// The settings behind the colon as `--set` has them.
fn own_settings(option: &str, specification: &str) -> Result<Vec<String>, Failure> {
    let Some((name, settings)) = specification.split_once(':') else { return Ok(Vec::new()) };
    let own = settings.split(',').map(|setting| match setting.split_once('=') {
        Some((key, _)) if !key.is_empty() => Ok(format!("{name}.{setting}")),
        _ => Err(Failure::usage(format!(
            "{option} {specification}: expected NAME:KEY=VALUE,… such as semantic:profile=paper,dice=1; found {setting:?}"
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
        assert_eq!(own_settings("--matcher", text).unwrap(), ["semantic.profile=paper", "semantic.dice=1"]);
        assert!(own_settings("--matcher", "skyline").unwrap().is_empty());
        for wrong in ["semantic:", "semantic:dice", "semantic:=1", "semantic:dice=1,"] {
            assert!(own_settings("--matcher", wrong).unwrap_err().to_string().contains("NAME:KEY=VALUE"), "{wrong}");
        }
    }

    #[test]
    fn every_matcher_meets_every_detector_and_names_say_what_differs() {
        let entries = |names: &[&str]| -> Vec<Entry<()>> {
            let entry = |name: &&str| Entry { name: (*name).to_owned(), specification: (*name).to_owned(), tool: () };
            names.iter().map(entry).collect()
        };
        let names = |matchers: &[&str], detectors: &[&str], estimators: &[&str]| -> Vec<String> {
            let all = combinations(&entries(matchers), &entries(detectors), &entries(estimators));
            all.into_iter().map(|contender| contender.name).collect()
        };
        assert_eq!(names(&["prior", "semantic"], &["class-difference"], &["descriptors"]), ["prior", "semantic"]);
        assert_eq!(
            names(&["prior", "semantic"], &["plain", "aligned"], &["descriptors"]),
            ["prior + plain", "prior + aligned", "semantic + plain", "semantic + aligned"]
        );
        assert_eq!(names(&["semantic"], &["plain"], &["a", "b"]), ["semantic + a", "semantic + b"]);
    }
}
