//! The tables of `eval`, a row for each matcher or each capture.

use super::contender::Contender;
use super::run::Results;
use comfy_table::{CellAlignment, Table, presets};
use resurvey_core::evaluate::{
    ChangeScore, ChangeSummary, ChangeTally, Difference, Estimate, ExpectedChange, PoseError, Summary, mean,
};
use resurvey_schema::changes::Op;

/// Recall, errors and time.
pub fn accuracy(summaries: &[Summary], contenders: &[Contender]) -> Table {
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
    for (summary, contender) in summaries.iter().zip(contenders) {
        table.add_row([
            contender.name.clone(),
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
pub fn reliability(summaries: &[Summary], contenders: &[Contender]) -> Table {
    let mut table = table(&[
        "matcher",
        "coverage %",
        "reliable of those within 2 m",
        "reliable but over 5 m off",
        "NEES mean",
        "median",
        "within 95 % ellipsoid %",
    ]);
    for (summary, contender) in summaries.iter().zip(contenders) {
        let nees = summary.nees;
        table.add_row([
            contender.name.clone(),
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

/// What updates came to.
pub fn changes(summaries: &[Summary], contenders: &[Contender]) -> Table {
    let mut table = table(&[
        "matcher",
        "material found",
        "dynamic found",
        "found %",
        "false of made",
        "false per 100 without change",
        "off m",
        "area %",
        "changed twice",
    ]);
    for (summary, contender) in summaries.iter().zip(contenders) {
        let Some(changes) = &summary.changes else { continue };
        let ChangeSummary { committed, false_updates, captures_without_change, .. } = changes;
        let tally = |ChangeTally { found, expected }: ChangeTally| format!("{found} of {expected}");
        let false_rate = changes.false_per_100_without_change.as_ref().map_or_else(dash, number);
        table.add_row([
            contender.name.clone(),
            tally(changes.material),
            tally(changes.dynamic),
            changes.found.as_ref().map_or_else(dash, per_cent),
            format!("{false_updates} of {committed}"),
            format!("{false_rate} of {captures_without_change}"),
            changes.position_off_median_m.map_or_else(dash, metres),
            changes.area_error_median_pct.map_or_else(dash, |error| format!("{error:.1}")),
            changes.not_idempotent.to_string(),
        ]);
    }
    table
}

/// Each contender against the last.
pub fn differences(differences: &[Difference], contenders: &[Contender]) -> Table {
    let mut table =
        table(&["matcher", "within 1 m 1° % points", "within 2 m 2°", "within 5 m 5°", "nearer to the truth %"]);
    for (difference, contender) in differences.iter().zip(contenders) {
        table.add_row([
            contender.name.clone(),
            points(&difference.recall_1m_1deg),
            points(&difference.recall_2m_2deg),
            points(&difference.recall_5m_5deg),
            per_cent(&difference.nearer),
        ]);
    }
    table
}

/// The paper's Table II: the phone, every matcher, and the map update of the last one. Headings are found minus true.
pub fn captures(results: &Results<'_>) -> Table {
    let contenders = &results.field.contenders;
    // The prior has its own column already.
    let shown: Vec<usize> = (0..contenders.len()).filter(|index| contenders[*index].matcher.is_some()).collect();
    let names = shown.iter().map(|index| contenders[*index].name.as_str());
    let mut header: Vec<&str> = ["capture", "noise", "phone"].into_iter().chain(names).collect();
    if results.with_updates {
        header.extend(["map update m", "area %"]);
    }
    let mut table = table(&header);
    for record in results.records {
        let error_of = |index: &usize| record.attempts.get(*index)?.trial.answer.map(|answer| answer.error);
        let mut row = vec![record.case.name.clone(), record.case.truth.noise().name().to_owned()];
        row.push(record.prior.as_ref().map_or_else(dash, pose));
        row.extend(shown.iter().map(|index| error_of(index).as_ref().map_or_else(dash, pose)));
        if results.with_updates {
            let score = record.attempts.last().and_then(|attempt| attempt.trial.changes.as_ref());
            row.extend(score.map_or_else(|| [dash(), dash()], update));
        }
        table.add_row(row);
    }
    let mut means = vec!["mean".to_owned(), String::new()];
    means.push(mean_pose(results.records.iter().filter_map(|record| record.prior)));
    means.extend(shown.iter().map(|index| {
        let answers = results.records.iter().filter_map(|record| record.attempts.get(*index)?.trial.answer);
        mean_pose(answers.map(|answer| answer.error))
    }));
    table.add_row(means);
    table
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

fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

fn dash() -> String {
    "-".to_owned()
}

fn metres(value: f64) -> String {
    if value.is_finite() { format!("{value:.2}") } else { "inf".to_owned() }
}

fn number(estimate: &Estimate) -> String {
    let [value, low, high] = [estimate.value, estimate.low, estimate.high].map(metres);
    format!("{value} [{low}, {high}]")
}

fn per_cent(share: &Estimate) -> String {
    let [value, low, high] = [share.value, share.low, share.high].map(|share| 100.0 * share);
    format!("{value:.0} [{low:.0}, {high:.0}]")
}

fn points(difference: &Estimate) -> String {
    let [value, low, high] = [difference.value, difference.low, difference.high].map(|share| 100.0 * share);
    format!("{value:+.0} [{low:+.0}, {high:+.0}]")
}
