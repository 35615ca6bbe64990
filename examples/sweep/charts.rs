//! The curves of a sweep.

use super::{Level, Noise};
use resurvey_core::evaluate::{Chart, Mark, Series};

/// The charts of a sweep with their names: the error of the pose, and shares of captures and changes.
pub fn charts(noise: Noise, levels: &[Level]) -> [(String, Chart); 2] {
    let series = |name: &str, pick: &dyn Fn(&Level) -> f64| Series {
        name: name.to_owned(),
        points: levels.iter().map(|level| [level.value, pick(level)]).collect(),
        mark: Mark::Measured,
    };
    let captures = levels.first().map_or(0.0, |level| level.captures);
    let chart = |title: &str, y_label: &str, series: Vec<Series>, most: f64| Chart {
        title: format!("{title}, {captures} captures a point"),
        x_label: noise.label().to_owned(),
        y_label: y_label.to_owned(),
        series,
        y_span: [0.0, most],
    };
    let errors =
        vec![series("median", &|level| level.error_m[0]), series("nine of ten below", &|level| level.error_m[1])];
    let shares = vec![
        series("within 1 m, 1°", &|level| 100.0 * level.recall[0]),
        series("within 2 m, 2°", &|level| 100.0 * level.recall[1]),
        series("called reliable", &|level| 100.0 * level.coverage),
        series("changes found", &Level::found_percent),
        series("false updates", &Level::false_per_100),
    ];
    [
        (format!("{}-pose", noise.name()), chart("Error of the pose", "error in plan, m", errors, 0.5)),
        (format!("{}-changes", noise.name()), chart("Poses and changes", "of a hundred", shares, 100.0)),
    ]
}
