//! What `eval` prints for people: tables, then the captures that need a look.

use super::groups::Group;
use super::run::Results;
use super::table_ii::captures;
use super::tables::{accuracy, differences, reliability};
use super::update_tables;
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
    if is_by_capture {
        titled("every capture (Table II of Lee & Hsu): position m / heading °", &captures(results), console)?;
    }
    let worth_it: Vec<&Group> = groups.iter().filter(|group| is_worth_a_table(group, groups)).collect();
    for group in &worth_it {
        let count = group.summaries.first().map_or(0, |summary| summary.captures);
        let is_of_all = group.by == "all";
        let what = if is_of_all { "all captures".to_owned() } else { format!("{} {}", group.by, group.name) };
        // What changed is nothing to a pose.
        if group.by != "kind" {
            titled(&format!("{what}: {count}"), &accuracy(&group.summaries, results.field), console)?;
        }
        if is_of_all {
            titled("reliability", &reliability(&group.summaries, results.field), console)?;
            against_the_last(group, results, console)?;
        }
    }
    if results.with_updates {
        updates(&worth_it, results, console)?;
    }
    notes(results, console)?;
    for index in 0..results.field.contenders.len() {
        of_interest(index, results, console)?;
    }
    Ok(())
}

fn updates(groups: &[&Group], results: &Results<'_>, console: &mut Console<'_>) -> Result<(), Failure> {
    let contenders = &results.field.contenders;
    for group in groups.iter().filter(|group| group.by == "all") {
        let summaries = &group.summaries;
        titled("changes found, of those that can be seen", &update_tables::found(summaries, contenders), console)?;
        for (summary, contender) in summaries.iter().zip(contenders) {
            if let Some(why) = summary.changes.as_ref().and_then(update_tables::why_missed) {
                console.line(format_args!("why missed: {}: {why}", contender.name))?;
                console.line("")?;
            }
        }
        titled("false, and changed again", &update_tables::false_updates(summaries, contenders), console)?;
        titled("as placed", &update_tables::placed(summaries, contenders), console)?;
        if let Some(last) = contenders.last().filter(|_| !group.differences.is_empty()) {
            let table = update_tables::differences(&group.differences, contenders);
            titled(&format!("changes: each against {} on the same captures", last.name), &table, console)?;
        }
    }
    for by in ["noise", "scene", "kind"] {
        let of_it: Vec<&Group> = groups.iter().copied().filter(|group| group.by == by).collect();
        if !of_it.is_empty() {
            titled(&format!("changes by {by}"), &update_tables::by_group(&of_it, contenders), console)?;
        }
    }
    Ok(())
}

fn against_the_last(group: &Group, results: &Results<'_>, console: &mut Console<'_>) -> Result<(), Failure> {
    let field = results.field;
    let last = field.contenders.last().filter(|_| field.matchers.len() > 1 && !group.differences.is_empty());
    let Some(last) = last else { return Ok(()) };
    let title = format!("each against {} on the same captures", field.matchers[last.matcher].name);
    titled(&title, &differences(&group.differences, field), console)
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
    let jobs = match results.jobs {
        1 => String::new(),
        jobs => format!(", {jobs} captures at a time: longer than one alone"),
    };
    console.line(format_args!(
        "[low, high]: 95 % bootstrap over captures, {resamples} resamples, seed {seed}. A capture without an answer counts \
         as infinitely wrong; means are over captures with an answer. Seconds: median of the localization, {cores} \
         cores{jobs}."
    ))?;
    if results.with_updates {
        console.line(
            "Changes: found of those in captures that show at least 80 % of what changed. \"n of m: share [low, high]\" has \
             Wilson's 95 % interval. Expected of honest 1 sigma: 95 % within 2 sigma.",
        )?;
    }
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

/// Captures without an answer, with an update that failed or is false, or with a wrong pose that is called reliable.
fn of_interest(index: usize, results: &Results<'_>, console: &mut Console<'_>) -> Result<(), Failure> {
    let field = results.field;
    let Some(contender) = field.contenders.get(index) else { return Ok(()) };
    let (matcher, name) = (&field.matchers[contender.matcher].name, &contender.name);
    for record in results.records {
        let Some(attempt) = record.attempts.get(index) else { continue };
        let capture = &record.case.name;
        // Contenders with the same matcher have the same poses.
        if field.is_first_of_matcher(index) {
            if let Err(reason) = &attempt.answer {
                console.line(format_args!("no answer: {matcher}, {capture}: {reason}"))?;
            }
            if attempt.trial.is_wrong_but_reliable() {
                let (position_m, yaw_deg) = (attempt.trial.position_m(), attempt.trial.yaw_deg());
                console
                    .line(format_args!("wrong but reliable: {matcher}, {capture}: {position_m:.2} m, {yaw_deg:.1}°"))?;
            }
        }
        for problem in attempt.update.iter().flat_map(|update| &update.problems) {
            console.line(format_args!("no update: {name}, {capture}: {problem}"))?;
        }
        let Some(changes) = &attempt.trial.changes else { continue };
        for wrong in &changes.false_updates {
            let (class, [e, n, h]) = (&wrong.class, <[f64; 3]>::from(wrong.position));
            let op = format!("{:?}", wrong.op).to_lowercase();
            console
                .line(format_args!("false update: {name}, {capture}: {op} {class} at E {e:.2} N {n:.2} H {h:.2}"))?;
        }
        if let Some(count) = changes.second_run.filter(|count| *count > 0) {
            console.line(format_args!("changed twice: {name}, {capture}: {count} by the same photo"))?;
        }
        if let Some(photo) = changes.second_photo.filter(|photo| photo.duplicates + photo.false_updates > 0) {
            let (again, wrong) = (photo.duplicates, photo.false_updates);
            console.line(format_args!("second photo: {name}, {capture}: {again} changed again, {wrong} false"))?;
        }
    }
    Ok(())
}
