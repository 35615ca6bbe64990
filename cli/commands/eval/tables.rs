//! The tables of `eval` about poses, a row for each matcher.

use super::cells::{dash, metres, number, per_cent, points, table};
use super::contender::Field;
use comfy_table::Table;
use resurvey_core::evaluate::{Difference, Summary};

/// Recall, errors and time.
pub fn accuracy(summaries: &[Summary], field: &Field) -> Table {
    let mut table = table(&[
        "matcher",
        "within 1 m 1° %",
        "within 2 m 2° %",
        "within 5 m 5° %",
        "median m",
        "90 % below m",
        "median °",
        "mean m",
        "mean °",
        "answered",
        "s",
    ]);
    for (summary, name) in of_matchers(summaries, field) {
        table.add_row([
            name.to_owned(),
            per_cent(&summary.recall_1m_1deg),
            per_cent(&summary.recall_2m_2deg),
            per_cent(&summary.recall_5m_5deg),
            number(&summary.median_m),
            metres(summary.ninth_decile_m.value),
            number(&summary.median_deg),
            summary.mean_m.as_ref().map_or_else(dash, number),
            summary.mean_deg.as_ref().map_or_else(dash, number),
            format!("{} of {}", summary.answered, summary.captures),
            format!("{:.1}", summary.median_seconds),
        ]);
    }
    table
}

/// Coverage, wrong answers that pass, and whether covariances are honest.
pub fn reliability(summaries: &[Summary], field: &Field) -> Table {
    let mut table = table(&[
        "matcher",
        "coverage %",
        "reliable of those within 2 m",
        "reliable but over 5 m off",
        "NEES mean",
        "median",
        "within 95 % ellipsoid %",
    ]);
    for (summary, name) in of_matchers(summaries, field) {
        let nees = summary.nees;
        table.add_row([
            name.to_owned(),
            per_cent(&summary.coverage),
            format!("{} of {}", summary.within_2m_reliable, summary.within_2m),
            summary.wrong_but_reliable.to_string(),
            nees.map_or_else(dash, |nees| format!("{:.2}", nees.mean)),
            nees.map_or_else(dash, |nees| format!("{:.2}", nees.median)),
            nees.map_or_else(dash, |nees| format!("{:.0}", 100.0 * nees.within_95)),
        ]);
    }
    table
}

/// Each matcher against the last.
pub fn differences(differences: &[Difference], field: &Field) -> Table {
    let mut table =
        table(&["matcher", "within 1 m 1° % points", "within 2 m 2°", "within 5 m 5°", "nearer to the truth %"]);
    for (difference, name) in of_matchers(differences, field) {
        table.add_row([
            name.to_owned(),
            points(&difference.recall_1m_1deg),
            points(&difference.recall_2m_2deg),
            points(&difference.recall_5m_5deg),
            per_cent(&difference.nearer),
        ]);
    }
    table
}

/// One of `numbers` a matcher, with its name: contenders with the same matcher have the same poses.
fn of_matchers<'a, T>(numbers: &'a [T], field: &'a Field) -> impl Iterator<Item = (&'a T, &'a str)> {
    let firsts =
        numbers.iter().zip(&field.contenders).enumerate().filter(|(index, _)| field.is_first_of_matcher(*index));
    firsts.map(|(_, (number, contender))| (number, field.matchers[contender.matcher].name.as_str()))
}
