//! The JSON document of `eval`: every number of every capture, so that others can plot; `docs/cli.md` documents the keys.

use super::attempt::{Attempt, Record, Update};
use super::contender::Contender;
use super::groups::Group;
use super::run::Results;
use crate::document::{change, plugin_use, rejection};
use crate::failure::Failure;
use resurvey_core::evaluate::{ChangeScore, Difference, PoseError, Summary, Trial};
use resurvey_schema::ClassTable;
use serde_json::{Value, json};

/// The whole document.
pub fn document(results: &Results<'_>, groups: &[Group]) -> Result<Value, Failure> {
    let contenders = &results.field.contenders;
    let matchers = contenders.iter().map(matcher).collect::<Result<Vec<_>, _>>()?;
    let others = results.field.others.iter().map(|tool| Ok(plugin_use(&tool.used()?)));
    let others = if results.with_updates { others.collect::<Result<Vec<_>, Failure>>()? } else { Vec::new() };
    let captures = results.records.iter().map(|record| capture(record, contenders));
    Ok(json!({
        "matchers": matchers,
        "plugins": others,
        "bootstrap": { "resamples": results.bootstrap.resamples, "seed": results.bootstrap.seed, "level": 0.95 },
        "cores": results.cores,
        "groups": groups.iter().map(|group| self::group(group, contenders)).collect::<Vec<_>>(),
        "captures": captures.collect::<Vec<_>>(),
    }))
}

fn matcher(contender: &Contender) -> Result<Value, Failure> {
    let plugin = contender.matcher.as_ref().map(|tool| Ok::<_, Failure>(plugin_use(&tool.used()?))).transpose()?;
    Ok(json!({ "name": contender.name, "specification": contender.specification, "plugin": plugin }))
}

fn group(group: &Group, contenders: &[Contender]) -> Value {
    let named = |name: &str, numbers: Value| {
        let mut all = json!({ "matcher": name });
        if let (Some(all), Value::Object(numbers)) = (all.as_object_mut(), numbers) {
            all.extend(numbers);
        }
        all
    };
    let names = || contenders.iter().map(|contender| contender.name.as_str());
    let summary = |(name, summary): (&str, &Summary)| named(name, json!(summary));
    let difference = |(name, difference): (&str, &Difference)| named(name, json!(difference));
    json!({
        "by": group.by,
        "name": group.name,
        "summaries": names().zip(&group.summaries).map(summary).collect::<Vec<_>>(),
        "above": contenders.last().map(|contender| &contender.name),
        "differences": names().zip(&group.differences).map(difference).collect::<Vec<_>>(),
    })
}

fn capture(record: &Record, contenders: &[Contender]) -> Value {
    let case = &record.case;
    let attempts = contenders.iter().zip(&record.attempts);
    json!({
        "capture": case.name,
        "path": case.capture().display().to_string(),
        "scene": case.truth.scene,
        "kind": case.truth.kind,
        "noise": case.truth.noise(),
        "truth": case.truth.pose,
        "prior": record.prior.as_ref().map(pose_error),
        "answers": attempts.map(|(contender, attempt)| answer(&contender.name, attempt)).collect::<Vec<_>>(),
    })
}

fn pose_error(error: &PoseError) -> Value {
    json!({
        "position_m": error.position_m(), "yaw_deg": error.yaw_deg(),
        "east_m": error.east_m, "north_m": error.north_m, "up_m": error.up_m,
    })
}

fn answer(name: &str, attempt: &Attempt) -> Value {
    let Trial { answer, seconds, changes } = &attempt.trial;
    let located = attempt.answer.as_ref().ok();
    let localization = located.map(|located| &located.localization);
    json!({
        "matcher": name,
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
    })
}

fn update(score: &ChangeScore, update: Option<&Update>) -> Value {
    // Every map of a run is made with the default classes.
    let classes = ClassTable::default();
    let made = update.map(|update| update.changes.as_slice()).unwrap_or_default();
    let refused = update.map(|update| update.rejections.as_slice()).unwrap_or_default();
    json!({
        "expected": score.expected,
        "false_updates": score.false_updates,
        "visible_share": score.visible_share,
        "second_run": score.second_run,
        "changes": made.iter().map(|made| change(made, None, &classes)).collect::<Vec<_>>(),
        "rejections": refused.iter().map(|refused| rejection(refused, &classes)).collect::<Vec<_>>(),
        "problem": update.and_then(|update| update.problem.as_ref()),
        "seconds": update.map(|update| update.seconds),
    })
}
