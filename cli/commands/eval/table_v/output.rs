//! The experiments as text, document and figure.

use super::experiment::Experiment;
use crate::console::Console;
use crate::failure::Failure;
use resurvey_core::evaluate::{Chart, Mark, Series};
use serde_json::{Value, json};
use std::path::PathBuf;

/// Prints a row for each error of the pose.
pub fn print(experiments: &[Experiment], console: &mut Console<'_>) -> Result<(), Failure> {
    for (index, experiment) in experiments.iter().enumerate() {
        if index > 0 {
            console.line("")?;
        }
        let Experiment { title, quantity, oracle, range_m, .. } = experiment;
        console.line(format_args!("{title}, {range_m} m from the camera; {quantity}; oracle {oracle}"))?;
        console.line("  pose error   measured     oracle       apart")?;
        for point in &experiment.points {
            let (error_m, expected) = (point.pose_error_m, point.oracle);
            match &point.measured {
                Ok(measured) => console.line(format_args!(
                    "  {error_m:8.2} m {measured:10.3} {expected:10.3} {:+11.3}",
                    measured - expected
                ))?,
                Err(reason) => console.line(format_args!("  {error_m:8.2} m          – {expected:10.3}  {reason}"))?,
            }
        }
    }
    Ok(())
}

/// The document of `--json`.
pub fn document(experiments: &[Experiment], plugins: &[Value], files: &[PathBuf]) -> Value {
    let experiment = |experiment: &Experiment| {
        let points = experiment.points.iter().map(|point| {
            json!({
                "pose_error_m": point.pose_error_m,
                "measured": point.measured.as_ref().ok(),
                "oracle": point.oracle,
                "problem": point.measured.as_ref().err(),
            })
        });
        json!({
            "name": experiment.name,
            "range_m": experiment.range_m,
            "unit": experiment.unit,
            "points": points.collect::<Vec<_>>(),
        })
    };
    json!({
        "experiments": experiments.iter().map(experiment).collect::<Vec<_>>(),
        "plugins": plugins,
        "files": files.iter().map(|file| file.display().to_string()).collect::<Vec<_>>(),
    })
}

/// Measured values beside their oracle.
pub fn chart(experiment: &Experiment) -> Chart {
    let points = &experiment.points;
    let measured = points.iter().map(|point| [point.pose_error_m, *point.measured.as_ref().unwrap_or(&f64::NAN)]);
    let oracle = points.iter().map(|point| [point.pose_error_m, point.oracle]);
    Chart {
        title: format!("{}, {} m from the camera", experiment.title, experiment.range_m),
        x_label: "error e of the pose, backing off, m".to_owned(),
        y_label: experiment.quantity.to_owned(),
        series: vec![
            Series { name: experiment.oracle.to_owned(), points: oracle.collect(), mark: Mark::Oracle },
            Series { name: "measured".to_owned(), points: measured.collect(), mark: Mark::Measured },
        ],
        y_span: [0.0, 1.0],
    }
}
