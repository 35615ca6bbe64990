//! A line for each capture and contender, for spreadsheets and plots.

use super::attempt::{Attempt, Record};
use super::contender::Contender;
use super::run::Results;
use crate::commands::quoted;
use resurvey_core::evaluate::{ChangeScore, ExpectedChange, FoundChange};
use std::fmt::Write;

/// Names of the columns.
const HEADER: &str = "capture,scene,noise,kind,matcher,position_m,yaw_deg,up_m,reliable,score,nees,seconds,\
                      changes_found,changes_expected,false_updates,problem,contender,detector,estimator,visible_share,\
                      position_off_m,area_error_pct,replaced,missed,second_run,second_photo_changes,\
                      second_photo_duplicates,second_photo_false,second_photo_new,update_problem";

/// All lines, the names first. A capture without an answer has empty cells and the reason; of several changes a cell has
/// all values with semicolons between.
pub fn csv(results: &Results<'_>) -> String {
    let mut lines = format!("{HEADER}\n");
    for record in results.records {
        for (contender, attempt) in results.field.contenders.iter().zip(&record.attempts) {
            let cells = [pose(results, record, contender, attempt), update(results, contender, attempt)].concat();
            // Writing to a string does not fail.
            let _ = writeln!(lines, "{}", cells.join(","));
        }
    }
    lines
}

fn pose(results: &Results<'_>, record: &Record, contender: &Contender, attempt: &Attempt) -> Vec<String> {
    let (truth, trial) = (&record.case.truth, &attempt.trial);
    let error = trial.answer.map(|answer| answer.error);
    let located = attempt.answer.as_ref().ok();
    let changes = trial.changes.as_ref();
    let found = |score: &ChangeScore| score.expected.iter().filter(|change| change.found.is_some()).count();
    vec![
        quoted(&record.case.name),
        quoted(&truth.scene),
        truth.noise().name().to_owned(),
        quoted(&truth.kind),
        quoted(&results.field.matchers[contender.matcher].name),
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
    ]
}

fn update(results: &Results<'_>, contender: &Contender, attempt: &Attempt) -> Vec<String> {
    let field = results.field;
    let changes = attempt.trial.changes.as_ref();
    let all = |of: &dyn Fn(&ExpectedChange) -> Option<String>| {
        changes.map_or_else(String::new, |score| score.expected.iter().filter_map(of).collect::<Vec<_>>().join(";"))
    };
    let found = |of: fn(&FoundChange) -> Option<f64>| {
        all(&|change| change.found.as_ref().and_then(of).map(|value| format!("{value:.4}")))
    };
    let second = changes.and_then(|score| score.second_photo.as_ref());
    let problems = attempt.update.as_ref().map(|update| update.problems.join("; "));
    vec![
        quoted(&contender.name),
        quoted(if results.with_updates { &field.detectors[contender.detector].name } else { "" }),
        quoted(if results.with_updates { &field.estimators[contender.estimator].name } else { "" }),
        cell(changes.map(|score| format!("{:.3}", score.visible_share))),
        found(|found| found.position_off_m),
        found(|found| found.area_error_pct),
        all(&|change| change.found?.replacement.map(|how| how.name().to_owned())),
        quoted(&all(&|change| change.why_missed.clone())),
        cell(changes.and_then(|score| score.second_run)),
        cell(second.map(|photo| photo.changes)),
        cell(second.map(|photo| photo.duplicates)),
        cell(second.map(|photo| photo.false_updates)),
        cell(second.map(|photo| photo.newly_found)),
        quoted(problems.as_deref().unwrap_or_default()),
    ]
}

fn cell<T: std::fmt::Display>(value: Option<T>) -> String {
    value.map_or_else(String::new, |value| value.to_string())
}
