//! The numbers of a page: pose, gates, changes, rejections, plugins, times.

use super::section::table;
use super::sheet::Sheet;
use super::words::{coordinate, number, requirement, signed, with_unit};
use maud::{Markup, html};
use resurvey_schema::Pose;
use serde_json::Value;

/// Pose and prior side by side, with what lies between them.
pub fn pose_table(sheet: &Sheet<'_>) -> Markup {
    let localization = &sheet.located.localization;
    let (found, prior) = (values(&localization.pose), values(&sheet.capture.prior.pose));
    let sigma = |axis: usize| localization.covariance[axis][axis].max(0.0).sqrt();
    let (prior_sigma, is_given) = (&sheet.capture.prior, localization.candidates == 0);
    let own = [Some(sigma(0)), Some(sigma(1)), None, Some(sigma(2).to_degrees()), None, None];
    let told = [
        prior_sigma.position_sigma_m,
        prior_sigma.position_sigma_m,
        prior_sigma.height_sigma_m,
        prior_sigma.yaw_sigma_rad.to_degrees(),
        prior_sigma.tilt_sigma_rad.to_degrees(),
        prior_sigma.tilt_sigma_rad.to_degrees(),
    ];
    let names = ["Easting, m", "Northing, m", "Height, m", "Heading, °", "Pitch, °", "Roll, °"];
    let rows: Vec<Vec<Markup>> = (0..6)
        .map(|row| {
            let off = if row == 3 {
                (found[row] - prior[row] + 180.0).rem_euclid(360.0) - 180.0
            } else {
                found[row] - prior[row]
            };
            vec![
                html! { (names[row]) },
                html! { b { (coordinate(found[row])) } },
                html! { @match own[row].filter(|_| !is_given) { Some(sigma) => (format!("{sigma:.2}")), None => "–" } },
                html! { (coordinate(prior[row])) },
                html! { (number(told[row])) },
                html! { (signed(off, 2)) },
            ]
        })
        .collect();
    table(&["", if is_given { "Pose (given)" } else { "Pose" }, "1σ", "Prior", "1σ", "Pose − prior"], &rows)
}

fn values(pose: &Pose) -> [f64; 6] {
    let [e, n, h]: [f64; 3] = pose.position.into();
    let yaw = pose.yaw_rad.to_degrees().rem_euclid(360.0);
    [e, n, h, yaw, pose.pitch_rad.to_degrees(), pose.roll_rad.to_degrees()]
}

/// What the reliability gate measured.
pub fn gates(sheet: &Sheet<'_>) -> Markup {
    let rows: Vec<Vec<Markup>> = sheet
        .located
        .gates
        .iter()
        .map(|gate| {
            let rule = if gate.name == "score" { "at least" } else { "at most" };
            vec![
                html! { (gate.name) },
                html! { b { (with_unit(gate.measured, &gate.unit)) } },
                html! { (rule) " " (with_unit(gate.limit, &gate.unit)) },
                html! { @if gate.passed { span class="yes" { "passed" } } @else { span class="no" { "failed" } } },
            ]
        })
        .collect();
    table(&["Gate", "Measured", "Limit", ""], &rows)
}

/// One change with every number of its descriptor, before and after, beside `detail`.
pub fn change(change: &Value, number_of: usize, detail: &Markup) -> Markup {
    let (op, class) = (text(&change["op"]), text(&change["class"]));
    let kind = match op {
        "add" => "added",
        "remove" => "removed",
        _ => "modified",
    };
    let states: Vec<(&str, &Value)> = [("Before", &change["before"]), ("After", &change["after"])]
        .into_iter()
        .filter(|(_, state)| !state.is_null())
        .collect();
    let heads: Vec<&str> = std::iter::once("").chain(states.iter().map(|(name, _)| *name)).collect();
    let rows = |read: &dyn Fn(&Value) -> Vec<(String, String)>| -> Vec<Vec<Markup>> {
        let columns: Vec<Vec<(String, String)>> = states.iter().map(|(_, state)| read(state)).collect();
        let mut names: Vec<&String> = Vec::new();
        columns.iter().flatten().for_each(|(name, _)| {
            if !names.contains(&name) {
                names.push(name);
            }
        });
        let cell = |column: &Vec<(String, String)>, name: &String| {
            column.iter().find(|(other, _)| other == name).map_or_else(|| "–".to_owned(), |(_, value)| value.clone())
        };
        names
            .iter()
            .map(|name| {
                std::iter::once(html! { (name) })
                    .chain(columns.iter().map(|column| html! { (cell(column, name)) }))
                    .collect()
            })
            .collect()
    };
    html! {
        article class={ "change " (kind) } {
            h3 { span class={ "op " (kind) } { (kind) } " " (class) @if let Some(fid) = change["fid"].as_u64() { " " (fid) } @else if op == "add" { " (change " (number_of) ")" } }
            div class="beside" { (detail) (table(&heads, &rows(&descriptor))) }
        }
    }
}

/// Name and value of everything that a descriptor says.
fn descriptor(state: &Value) -> Vec<(String, String)> {
    let mut rows = Vec::new();
    let mut add = |name: &str, value: Option<String>| rows.extend(value.map(|value| (name.to_owned(), value)));
    let metres = |key: &str| state[key].as_f64().map(|value| format!("{value:.2} m"));
    add("Ground contact", point(&state["position"]));
    add("Centre", point(&state["centre"]));
    add("Width", metres("width_m"));
    add("Height", metres("height_m"));
    add("Area", state["area_m2"].as_f64().map(|value| format!("{value:.2} m²")));
    for (index, place) in ["bottom left", "bottom right", "top right", "top left"].iter().enumerate() {
        add(&format!("Corner {}, {place}", index + 1), point(&state["corners"][index]));
    }
    add("Faces", facing(&state["normal"]));
    add("Size", list(&state["size_m"]));
    add("Heading", state["yaw_deg"].as_f64().map(|value| format!("{value:.1}°")));
    add("1σ of the place", metres("sigma_m"));
    add("1σ of width and height", metres("sigma_size_m"));
    add("1σ of the area", state["sigma_area_m2"].as_f64().map(|value| format!("{value:.2} m²")));
    rows
}

/// E, N, H of a point.
fn point(value: &Value) -> Option<String> {
    let [e, n, h] = [0, 1, 2].map(|axis| value[axis].as_f64());
    Some(format!("E {}  N {}  H {}", coordinate(e?), coordinate(n?), coordinate(h?)))
}

/// Azimuth of a normal.
fn facing(value: &Value) -> Option<String> {
    let (east, north) = (value[0].as_f64()?, value[1].as_f64()?);
    Some(format!("azimuth {:.1}°", east.atan2(north).to_degrees().rem_euclid(360.0)))
}

fn list(value: &Value) -> Option<String> {
    let numbers: Vec<String> =
        value.as_array()?.iter().filter_map(Value::as_f64).map(|size| format!("{size:.2}")).collect();
    Some(format!("{} m", numbers.join(" × ")))
}

/// A rejection in words: requirement, measured, limit.
pub fn rejection(rejection: &resurvey_schema::Rejection) -> Markup {
    let (measured, limit) =
        (with_unit(rejection.measured, &rejection.unit), with_unit(rejection.limit, &rejection.unit));
    html! {
        b { (rejection.requirement) }
        @if let Some(words) = requirement(&rejection.requirement) { ": " (words) }
        span class="measured" { "measured " b { (measured) } ", limit " (limit) }
    }
}

/// Plugins with versions, digests and settings.
pub fn plugins(document: &Value) -> Markup {
    html! {
        @for plugin in document["plugins"].as_array().into_iter().flatten() {
            details {
                summary { (text(&plugin["kind"])) " " b { (text(&plugin["name"])) } " " (text(&plugin["version"])) }
                p { "SHA-256 " code class="digest" { (plugin["sha256"].as_str().unwrap_or("unknown")) } }
                pre { (pretty(&plugin["settings"])) }
            }
        }
    }
}

/// Milliseconds of each stage, and of all.
pub fn timings(document: &Value) -> Markup {
    let stages: Vec<(&String, f64)> = document["timings_ms"]
        .as_object()
        .into_iter()
        .flatten()
        .filter_map(|(name, time)| Some((name, time.as_f64()?)))
        .collect();
    let longest = stages.iter().map(|(_, time)| *time).fold(1e-9, f64::max);
    let all: f64 = stages.iter().map(|(_, time)| time).sum();
    html! {
        dl class="times" {
            @for (name, time) in &stages {
                div { dt { (name) } dd { span class="time" style=(format!("--share:{:.3}", time / longest)) {} (format!("{time:.0} ms")) } }
            }
            div { dt { "all" } dd { b { (format!("{all:.0} ms")) } } }
        }
    }
}

/// JSON as people read it.
pub fn pretty(value: &Value) -> String {
    serde_json::to_string_pretty(value).unwrap_or_default()
}

/// Text of a JSON string, empty for anything else.
pub fn text(value: &Value) -> &str {
    value.as_str().unwrap_or_default()
}
