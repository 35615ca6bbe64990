//! What stands in a cell of a table.

use comfy_table::{CellAlignment, Table, presets};
use resurvey_core::evaluate::{ChangeTally, Estimate, Share, Spread};

/// A table with a row of names, all columns but the first to the right.
pub fn table(header: &[&str]) -> Table {
    let mut table = Table::new();
    table.load_preset(presets::NOTHING).set_header(header);
    for column in table.column_iter_mut().skip(1) {
        column.set_cell_alignment(CellAlignment::Right);
    }
    table
}

/// Nothing to say.
pub fn dash() -> String {
    "-".to_owned()
}

/// To the centimetre.
pub fn metres(value: f64) -> String {
    if value.is_finite() { format!("{value:.2}") } else { "inf".to_owned() }
}

/// With its interval.
pub fn number(estimate: &Estimate) -> String {
    let [value, low, high] = [estimate.value, estimate.low, estimate.high].map(metres);
    format!("{value} [{low}, {high}]")
}

/// A difference of numbers with its interval.
pub fn signed(estimate: &Estimate) -> String {
    let [value, low, high] = [estimate.value, estimate.low, estimate.high];
    format!("{value:+.2} [{low:+.2}, {high:+.2}]")
}

/// A share in per cent with its interval.
pub fn per_cent(share: &Estimate) -> String {
    let [value, low, high] = [share.value, share.low, share.high].map(|share| 100.0 * share);
    format!("{value:.0} [{low:.0}, {high:.0}]")
}

/// A difference of shares in per cent with its interval.
pub fn points(difference: &Estimate) -> String {
    let [value, low, high] = [difference.value, difference.low, difference.high].map(|share| 100.0 * share);
    format!("{value:+.0} [{low:+.0}, {high:+.0}]")
}

/// Found of expected; a dash where nothing was.
pub fn tally(ChangeTally { found, expected }: ChangeTally) -> String {
    if expected == 0 { dash() } else { format!("{found} of {expected}") }
}

/// Counts, and the share in per cent with Wilson's interval.
pub fn share(share: Option<&Share>) -> String {
    share.map_or_else(dash, |share| {
        let [value, low, high] = [share.value, share.low, share.high].map(|share| 100.0 * share);
        format!("{} of {}: {value:.1} [{low:.1}, {high:.1}]", share.count, share.of)
    })
}

/// Median and worst.
pub fn spread(spread: Option<&Spread>, decimals: usize) -> String {
    spread.map_or_else(dash, |Spread { median, worst, .. }| format!("{median:.decimals$} / {worst:.decimals$}"))
}
