//! The numbers of a sweep, as text and as CSV.

use super::{Level, Noise};

/// Heads of the rows.
pub const HEADS: &str = "   level  median m  90 % m  (1 m, 1°)  (2 m, 2°)  reliable  changes  false  committed";

/// One level.
pub fn row(level: &Level) -> String {
    let [median_m, decile_m] = level.error_m;
    let [one, two] = level.recall.map(|share| format!("{:.0} %", 100.0 * share));
    let [found, expected] = level.changes;
    let [committed, wrong] = level.committed;
    let reliable = format!("{:.0} %", 100.0 * level.coverage);
    let changes = format!("{found}/{expected}");
    format!(
        "{:8} {median_m:9.2} {decile_m:7.2} {one:>10} {two:>10} {reliable:>9} {changes:>8} {wrong:6} {committed:10}",
        level.value
    )
}

/// First line of the CSV.
pub fn header() -> String {
    let columns = "noise,level,captures,median_m,ninth_decile_m,recall_1m_1deg,recall_2m_2deg,coverage,found,expected,committed,false_updates";
    format!("{columns}\n")
}

/// One line of the CSV.
pub fn csv_row(noise: Noise, level: &Level) -> String {
    let Level { value, captures, error_m, recall, coverage, changes, committed } = level;
    let numbers = [
        *value,
        *captures,
        error_m[0],
        error_m[1],
        recall[0],
        recall[1],
        *coverage,
        changes[0],
        changes[1],
        committed[0],
        committed[1],
    ];
    let cells: Vec<String> = numbers.iter().map(ToString::to_string).collect();
    format!("{},{}\n", noise.name(), cells.join(","))
}
