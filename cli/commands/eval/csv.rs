//! A line for each capture and matcher, for spreadsheets and plots.

use super::run::Results;
use crate::commands::quoted;
use std::fmt::Write;

/// Names of the columns.
const HEADER: &str = "capture,scene,noise,kind,matcher,position_m,yaw_deg,up_m,reliable,score,nees,seconds,\
                      changes_found,changes_expected,false_updates,problem";

/// All lines, the names first. A capture without an answer has empty cells and the reason.
pub fn csv(results: &Results<'_>) -> String {
    let mut lines = format!("{HEADER}\n");
    for record in results.records {
        let truth = &record.case.truth;
        for (contender, attempt) in results.field.contenders.iter().zip(&record.attempts) {
            let trial = &attempt.trial;
            let error = trial.answer.map(|answer| answer.error);
            let located = attempt.answer.as_ref().ok();
            let changes = trial.changes.as_ref();
            let found = |score: &resurvey_core::evaluate::ChangeScore| {
                score.expected.iter().filter(|change| change.found.is_some()).count()
            };
            let cells = [
                quoted(&record.case.name),
                quoted(&truth.scene),
                truth.noise().name().to_owned(),
                quoted(&truth.kind),
                quoted(&contender.name),
                cell(error.map(|error| error.position_m())),
                cell(error.map(|error| error.yaw_deg())),
                cell(error.map(|error| error.up_m)),
                cell(trial.answer.map(|answer| answer.is_reliable)),
                cell(located.map(|located| located.localization.score)),
                cell(trial.answer.and_then(|answer| answer.nees)),
                format!("{:.3}", trial.seconds),
                cell(changes.map(found)),
                cell(changes.map(|score| score.expected.len())),
                cell(changes.map(|score| score.false_updates.len())),
                quoted(attempt.answer.as_ref().err().map_or("", String::as_str)),
            ];
            // Writing to a string does not fail.
            let _ = writeln!(lines, "{}", cells.join(","));
        }
    }
    lines
}

fn cell<T: std::fmt::Display>(value: Option<T>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}
