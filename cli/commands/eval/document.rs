//! The JSON document of `eval`: every number of every capture, so that others can plot; `docs/cli.md` documents the keys.

use super::attempt::{Attempt, Record};
use super::contender::{Contender, Entry};
use super::groups::Group;
use super::judge::Update;
use super::run::Results;
use crate::document::{change, plugin_use, rejection};
use crate::failure::Failure;
use crate::matching::MatchingTool;
use crate::tools::Tool;
use resurvey_core::evaluate::{ChangeScore, Difference, PoseError, Summary, Trial};
use resurvey_core::update::Change;
use resurvey_schema::ClassTable;
use serde_json::{Map, Value, json};

/// The whole document.
pub fn document(results: &Results<'_>, groups: &[Group]) -> Result<Value, Failure> {
    let field = results.field;
    let matchers = field.matchers.iter().map(matcher).collect::<Result<Vec<_>, _>>()?;
    let others = field.detectors.iter().chain(&field.estimators);
    let others = others.map(|entry| Ok(plugin_use(&entry.tool.used()?)));
    let others = if results.with_updates { others.collect::<Result<Vec<_>, Failure>>()? } else { Vec::new() };
    let captures = results.records.iter().map(|record| capture(record, results));
    let contenders = field.contenders.iter().map(|contender| Value::Object(names(contender, results)));
    Ok(json!({
        "matchers": matchers,
        "plugins": others,
        "contenders": contenders.collect::<Vec<_>>(),
        "bootstrap": { "resamples": results.bootstrap.resamples, "seed": results.bootstrap.seed, "level": 0.95 },
        "cores": results.cores,
        "jobs": results.jobs,
        "groups": groups.iter().map(|group| self::group(group, results)).collect::<Vec<_>>(),
        "captures": captures.collect::<Vec<_>>(),
    }))
}

fn matcher(entry: &Entry<Option<MatchingTool>>) -> Result<Value, Failure> {
    let used = entry.tool.as_ref().map_or(Ok(Vec::new()), MatchingTool::used)?;
    let mut used = used.iter().map(plugin_use);
    let mut document = json!({ "name": entry.name, "specification": entry.specification, "plugin": used.next() });
    let members: Vec<Value> = used.collect();
    if !members.is_empty() {
        document["members"] = json!(members);
    }
    Ok(document)
}

/// What a contender is called and made of; detector and estimator are null where nothing is updated.
fn names(contender: &Contender, results: &Results<'_>) -> Map<String, Value> {
    let field = results.field;
    let other = |entry: &Entry<Tool>| if results.with_updates { json!(entry.name) } else { Value::Null };
    Map::from_iter([
        ("matcher".to_owned(), json!(field.matchers[contender.matcher].name)),
        ("contender".to_owned(), json!(contender.name)),
        ("detector".to_owned(), other(&field.detectors[contender.detector])),
        ("estimator".to_owned(), other(&field.estimators[contender.estimator])),
    ])
}

fn group(group: &Group, results: &Results<'_>) -> Value {
    let contenders = &results.field.contenders;
    let named = |contender: &Contender, numbers: Value| {
        let mut all = names(contender, results);
        if let Value::Object(numbers) = numbers {
            all.extend(numbers);
        }
        Value::Object(all)
    };
    let summary = |(contender, summary): (&Contender, &Summary)| named(contender, json!(summary));
    let difference = |(contender, difference): (&Contender, &Difference)| named(contender, json!(difference));
    json!({
        "by": group.by,
        "name": group.name,
        "summaries": contenders.iter().zip(&group.summaries).map(summary).collect::<Vec<_>>(),
        "above": contenders.last().map(|contender| &contender.name),
        "differences": contenders.iter().zip(&group.differences).map(difference).collect::<Vec<_>>(),
    })
}

fn capture(record: &Record, results: &Results<'_>) -> Value {
    let case = &record.case;
    let attempts = results.field.contenders.iter().zip(&record.attempts);
    let answer = |(contender, attempt)| {
        let mut all = names(contender, results);
        all.extend(answer(attempt));
        all
    };
    json!({
        "capture": case.name,
        "path": case.capture().display().to_string(),
        "scene": case.truth.scene,
        "kind": case.truth.kind,
        "noise": case.truth.noise(),
        "truth": case.truth.pose,
        "prior": record.prior.as_ref().map(pose_error),
        "answers": attempts.map(answer).collect::<Vec<_>>(),
    })
}

fn pose_error(error: &PoseError) -> Value {
    json!({
        "position_m": error.position_m(), "yaw_deg": error.yaw_deg(),
        "east_m": error.east_m, "north_m": error.north_m, "up_m": error.up_m,
    })
}

fn answer(attempt: &Attempt) -> Map<String, Value> {
    let Trial { answer, seconds, changes } = &attempt.trial;
    let located = attempt.answer.as_ref().ok();
    let localization = located.map(|located| &located.localization);
    let document = json!({
        "problem": attempt.answer.as_ref().err(),
        "error": answer.as_ref().map(|answer| pose_error(&answer.error)),
        "pose": localization.map(|localization| localization.pose),
        "score": localization.map(|localization| localization.score),
        "covariance": localization.map(|localization| localization.covariance),
        "nees": answer.and_then(|answer| answer.nees),
        "reliable": answer.map(|answer| answer.is_reliable),
        "reasons": located.map(|located| &located.reasons),
        "runner_up": localization.and_then(|localization| localization.runner_up).map(|other| json!({
            "distance_m": other.distance_m,
            "score_ratio": other.score_ratio,
        })),
        "candidates": localization.map(|localization| localization.candidates),
        "seconds": seconds,
        "update": changes.as_ref().map(|changes| update(changes, attempt.update.as_ref())),
    });
    if let Value::Object(fields) = document { fields } else { Map::new() }
}

fn update(score: &ChangeScore, update: Option<&Update>) -> Value {
    // Every map of a run is made with the default classes.
    let classes = ClassTable::default();
    let none = Update::default();
    let done = update.unwrap_or(&none);
    let changes = |made: &[Change]| made.iter().map(|made| change(made, None, &classes)).collect::<Vec<_>>();
    let refused = done.resolution.rejections.iter();
    json!({
        "expected": score.expected,
        "false_updates": score.false_updates,
        "visible_share": score.visible_share,
        "second_run": score.second_run,
        "second_photo": score.second_photo,
        "changes": changes(&done.resolution.changes),
        "second_photo_changes": changes(&done.second_photo),
        "rejections": refused.map(|refused| rejection(refused, &classes)).collect::<Vec<_>>(),
        "problem": (!done.problems.is_empty()).then(|| done.problems.join("; ")),
        "seconds": update.map(|update| update.seconds),
    })
}
