//! The paper's Table II, a row for each capture (Lee & Hsu, §4).

use super::cells::{dash, metres, table};
use super::contender::Contender;
use super::run::Results;
use comfy_table::Table;
use resurvey_core::evaluate::{ChangeScore, ExpectedChange, PoseError, mean};
use resurvey_schema::changes::Op;

/// The phone, every matcher, and the map update of the last one with every detector and estimator. Headings are found
/// minus true.
pub fn captures(results: &Results<'_>) -> Table {
    let field = results.field;
    // The prior has its own column already.
    let shown: Vec<usize> = (0..field.contenders.len())
        .filter(|index| field.is_first_of_matcher(*index))
        .filter(|index| field.matchers[field.contenders[*index].matcher].tool.is_some())
        .collect();
    let names = shown.iter().map(|index| field.matchers[field.contenders[*index].matcher].name.clone());
    let mut header: Vec<String> =
        ["capture", "noise", "phone"].map(ToOwned::to_owned).into_iter().chain(names).collect();
    let updated = if results.with_updates { of_last_matcher(&field.contenders) } else { Vec::new() };
    for index in &updated {
        let name = if updated.len() > 1 { format!(" ({})", field.contenders[*index].name) } else { String::new() };
        header.extend([format!("map update m{name}"), "area %".to_owned()]);
    }
    let mut table = table(&header.iter().map(String::as_str).collect::<Vec<_>>());
    for record in results.records {
        let error_of = |index: &usize| record.attempts.get(*index)?.trial.answer.map(|answer| answer.error);
        let mut row = vec![record.case.name.clone(), record.case.truth.noise().name().to_owned()];
        row.push(record.prior.as_ref().map_or_else(dash, pose));
        row.extend(shown.iter().map(|index| error_of(index).as_ref().map_or_else(dash, pose)));
        for index in &updated {
            let score = record.attempts.get(*index).and_then(|attempt| attempt.trial.changes.as_ref());
            row.extend(score.map_or_else(|| [dash(), dash()], update));
        }
        table.add_row(row);
    }
    table.add_row(means(results, &shown, &updated));
    table
}

/// Contenders with the matcher of the last one.
fn of_last_matcher(contenders: &[Contender]) -> Vec<usize> {
    let matcher = contenders.last().map(|contender| contender.matcher);
    (0..contenders.len()).filter(|index| Some(contenders[*index].matcher) == matcher).collect()
}

fn means(results: &Results<'_>, shown: &[usize], updated: &[usize]) -> Vec<String> {
    let mut means = vec!["mean".to_owned(), String::new()];
    means.push(mean_pose(results.records.iter().filter_map(|record| record.prior)));
    means.extend(shown.iter().map(|index| {
        let answers = results.records.iter().filter_map(|record| record.attempts.get(*index)?.trial.answer);
        mean_pose(answers.map(|answer| answer.error))
    }));
    for index in updated {
        let scores = || results.records.iter().filter_map(|record| record.attempts.get(*index)?.trial.changes.as_ref());
        let found = || scores().flat_map(|score| &score.expected).filter_map(|change| change.found);
        let off_m: Vec<f64> = found().filter_map(|found| found.position_off_m).collect();
        let area_pct: Vec<f64> = found().filter_map(|found| found.area_error_pct).map(f64::abs).collect();
        means.push(mean(&off_m).map_or_else(dash, metres));
        means.push(mean(&area_pct).map_or_else(dash, |error| format!("{error:.0}")));
    }
    means
}

fn pose(error: &PoseError) -> String {
    // Zero is added so that a rounded −0 has no sign.
    let yaw_deg = (10.0 * error.yaw_deg()).round() / 10.0 + 0.0;
    format!("{:.2} / {yaw_deg:.1}", error.position_m())
}

/// Mean of the distances and of the absolute headings, over those that there are.
fn mean_pose(errors: impl Iterator<Item = PoseError>) -> String {
    let (positions, headings): (Vec<f64>, Vec<f64>) =
        errors.map(|error| (error.position_m(), error.yaw_deg().abs())).unzip();
    match (mean(&positions), mean(&headings)) {
        (Some(position_m), Some(yaw_deg)) => format!("{position_m:.2} / {yaw_deg:.1}"),
        _ => dash(),
    }
}

/// How far off each change was placed and its area, in the words of the paper.
fn update(score: &ChangeScore) -> [String; 2] {
    let placed = |change: &ExpectedChange| match (change.found, change.op) {
        (None, _) => "missed".to_owned(),
        (Some(_), Op::Remove) => "removed".to_owned(),
        (Some(found), _) => found.position_off_m.map_or_else(dash, metres),
    };
    let mut places: Vec<String> = score.expected.iter().map(placed).collect();
    if !score.false_updates.is_empty() {
        places.push(format!("{} false", score.false_updates.len()));
    }
    let areas = score.expected.iter().filter_map(|change| change.found?.area_error_pct);
    let areas: Vec<String> = areas.map(|error| format!("{error:+.0}")).collect();
    [places, areas].map(|cells| if cells.is_empty() { dash() } else { cells.join(", ") })
}
