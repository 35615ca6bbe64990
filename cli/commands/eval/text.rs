//! What `eval` prints for people: tables, then the captures that need a look.

use super::attempt::Record;
use super::groups::Group;
use super::run::Results;
use super::tables::{accuracy, captures, changes, differences, reliability};
use crate::console::Console;
use crate::failure::Failure;
use comfy_table::Table;
use resurvey_core::evaluate::wilson_95;

/// Prints `results`; with `is_by_capture` a row for each capture too.
pub fn print(
    results: &Results<'_>,
    groups: &[Group],
    is_by_capture: bool,
    console: &mut Console<'_>,
) -> Result<(), Failure> {
    let contenders = &results.field.contenders;
    if is_by_capture {
        titled("every capture (Table II of Lee & Hsu): position m / heading °", &captures(results), console)?;
    }
    for group in groups.iter().filter(|group| is_worth_a_table(group, groups)) {
        let count = group.summaries.first().map_or(0, |summary| summary.captures);
        let what = if group.by == "all" { "all captures".to_owned() } else { format!("{} {}", group.by, group.name) };
        titled(&format!("{what}: {count}"), &accuracy(&group.summaries, contenders), console)?;
        if group.by == "all" {
            titled("reliability", &reliability(&group.summaries, contenders), console)?;
        }
        if results.with_updates {
            titled(&format!("{what}: changes"), &changes(&group.summaries, contenders), console)?;
        }
        if group.by == "all"
            && let Some(reference) = contenders.last()
            && !group.differences.is_empty()
        {
            let title = format!("each against {} on the same captures", reference.name);
            titled(&title, &differences(&group.differences, contenders), console)?;
        }
    }
    notes(results, console)?;
    for (index, contender) in contenders.iter().enumerate() {
        of_interest(&contender.name, index, results.records, console)?;
    }
    Ok(())
}

/// One noise level or one scene alone is all captures again.
fn is_worth_a_table(group: &Group, groups: &[Group]) -> bool {
    group.by == "all" || groups.iter().filter(|other| other.by == group.by).count() > 1
}

fn titled(title: &str, table: &Table, console: &mut Console<'_>) -> Result<(), Failure> {
    console.line(title)?;
    console.line(table.trim_fmt())?;
    console.line("")
}

fn notes(results: &Results<'_>, console: &mut Console<'_>) -> Result<(), Failure> {
    let (resamples, seed, cores) = (results.bootstrap.resamples, results.bootstrap.seed, results.cores);
    console.line(format_args!(
        "[low, high]: 95 % bootstrap over captures, {resamples} resamples, seed {seed}. A capture without an answer counts \
         as infinitely wrong; means are over captures with an answer. Seconds: median of the localization, {cores} cores."
    ))?;
    let count = results.records.len();
    if let Some(all) = wilson_95(count, count) {
        let least = 100.0 * all.low;
        console.line(format_args!(
            "An interval without width says only that all captures agree: 100 % of {count} is consistent with {least:.0} \
             % (Wilson)."
        ))?;
    }
    console.line("Expected of an honest covariance: NEES mean 3, median 2.37, 95 % within the ellipsoid.")
}

/// Captures without an answer, with an update that failed, or with a wrong pose that is called reliable.
fn of_interest(name: &str, index: usize, records: &[Record], console: &mut Console<'_>) -> Result<(), Failure> {
    for record in records {
        let Some(attempt) = record.attempts.get(index) else { continue };
        let capture = &record.case.name;
        if let Err(reason) = &attempt.answer {
            console.line(format_args!("no answer: {name}, {capture}: {reason}"))?;
        }
        if attempt.trial.is_wrong_but_reliable() {
            let (position_m, yaw_deg) = (attempt.trial.position_m(), attempt.trial.yaw_deg());
            console.line(format_args!("wrong but reliable: {name}, {capture}: {position_m:.2} m, {yaw_deg:.1}°"))?;
        }
        if let Some(problem) = attempt.update.as_ref().and_then(|update| update.problem.as_ref()) {
            console.line(format_args!("no update: {name}, {capture}: {problem}"))?;
        }
        for wrong in attempt.trial.changes.iter().flat_map(|changes| &changes.false_updates) {
            let (class, [e, n, h]) = (&wrong.class, <[f64; 3]>::from(wrong.position));
            let op = format!("{:?}", wrong.op).to_lowercase();
            console
                .line(format_args!("false update: {name}, {capture}: {op} {class} at E {e:.2} N {n:.2} H {h:.2}"))?;
        }
    }
    Ok(())
}
