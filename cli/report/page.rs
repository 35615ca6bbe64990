//! The page of one capture.

use super::fate::{Fate, fates};
use super::numbers::{self, text};
use super::overlay::Overlay;
use super::pictures::{DROPPED, KEPT, LEFT_ALONE, Pictures, colour_of};
use super::plan;
use super::section::{badge, document, figure, pairs, rows, section};
use super::sheet::{Seen, Sheet};
use super::words::{coordinate, counted, with_unit};
use crate::failure::Failure;
use maud::{Markup, html};
use resurvey_core::localize::{HeatMap, heat_map};
use resurvey_core::render::view;
use resurvey_schema::{ChangeRegion, ClassTable};

/// The page of `sheet`, called `name`.
pub fn page(sheet: &Sheet<'_>, name: &str) -> Result<String, Failure> {
    let fates = sheet.seen.map_or_else(Vec::new, |seen| fates(&seen.regions, &seen.proposals, sheet.resolution));
    let body = html! {
        nav { a href="index.html" { "← all captures" } }
        (head(sheet, name))
        (pictures(sheet, &fates)?)
        (section("Regions", &regions(sheet, &fates)))
        @if !sheet.resolution.changes.is_empty() { (section("Changes of the map", &changes(sheet)?)) }
        (section("Where", &html! {
            div class="two" {
                figure { (plan::plan(sheet)) figcaption { (plan::key(sheet)) } }
                (heat(sheet, name)?)
            }
        }))
        (section("Pose", &html! { (numbers::pose_table(sheet)) (numbers::gates(sheet)) }))
        (section("How it was made", &made(sheet)))
    };
    Ok(document(&format!("{name} – resurvey"), &body).into_string())
}

/// What came out, in one look.
pub fn outcome(sheet: &Sheet<'_>) -> String {
    let changes = &sheet.resolution.changes;
    let rejected = counted(sheet.resolution.rejections.len(), "region dropped", "regions dropped");
    let changed = counted(changes.len(), "change", "changes");
    match text(&sheet.document["decision"]) {
        "unreliable" => "The pose is not reliable, so nothing was compared and the map stays as it is.".to_owned(),
        "nothing" if !changes.is_empty() => {
            format!("{changed} proposed before and decided: nothing waits, {rejected}.")
        }
        "nothing" if sheet.resolution.rejections.is_empty() => "No change was found: nothing to update.".to_owned(),
        "nothing" => format!("Nothing to update: {rejected}."),
        "dry-run" => format!("A dry run: {changed} would be made, {rejected}; the map stays as it is."),
        "proposed" => format!("{changed} proposed for review, {rejected}."),
        _ => match sheet.document["version"].as_u64() {
            Some(version) => {
                let committed = sheet.document["changes"].as_array().map_or(0, Vec::len);
                let changed = counted(committed, "change", "changes");
                format!("{changed} committed as version {version}, {rejected}.")
            }
            None => format!("{changed}, {rejected}."),
        },
    }
}

fn head(sheet: &Sheet<'_>, name: &str) -> Markup {
    let localization = &sheet.located.localization;
    let prior = &sheet.capture.prior;
    let is_given = localization.candidates == 0;
    let [e, n, h]: [f64; 3] = localization.pose.position.into();
    let moved_m = localization.pose.position.plan_distance_m(&prior.pose.position);
    let version = &sheet.document["base_version"];
    html! {
        header {
            h1 { (name) " " (badge(text(&sheet.document["decision"]))) }
            p class="outcome" { (outcome(sheet)) }
            @for reason in &sheet.located.reasons { p class="doubt" { (reason) } }
            (pairs(&[
                ("Map", html! { (sheet.map.file_name().unwrap_or_default().to_string_lossy()) ", version " (version) }),
                ("Taken", html! { @match sheet.capture.taken_at { Some(time) => (time), None => "time unknown" } }),
                (if is_given { "Camera (given)" } else { "Camera" }, html! { "E " (coordinate(e)) "  N " (coordinate(n)) "  H " (coordinate(h)) }),
                ("Heading", html! { (format!("{:.1}°", localization.pose.yaw_rad.to_degrees().rem_euclid(360.0))) }),
                ("From the prior", html! { (format!("{moved_m:.2} m")) }),
                ("Score", html! { @if is_given { "–" } @else { (format!("{:.3}", localization.score)) } }),
            ]))
        }
    }
}

fn pictures(sheet: &Sheet<'_>, fates: &[Vec<Fate>]) -> Result<Markup, Failure> {
    let (capture, pose, classes) = (sheet.capture, sheet.located.localization.pose, sheet.world.classes());
    // Where nothing was compared the view is drawn for the page alone.
    let drawn = sheet.seen.is_none().then(|| view(sheet.world.scene(true), &capture.camera, &pose));
    let labels = sheet.seen.map(|seen| &seen.view.labels).or(drawn.as_ref().map(|view| &view.labels));
    let pictures = Pictures::new(&capture.labels, labels.unwrap_or(&capture.labels), classes);
    let overlay = Overlay::new(&capture.camera, pose);
    let nothing = html! {};
    let differing = format!("{:.1} %", 100.0 * pictures.differing_share());
    let contents = html! {
        div class="figures" {
            (figure(&pictures.photo()?, "Labels of the photo", &nothing, &html! { b { "Photo" } " as it was labelled" }))
            (figure(&pictures.view()?, "Classes of the map from the pose", &nothing, &html! { b { "Map" } " from the pose, before the update" }))
            (figure(&pictures.difference()?, "Where photo and map differ", &nothing, &html! { b { "Difference" } ", in the colours of the photo: " (differing) " of the pixels" }))
            @if let Some(seen) = sheet.seen {
                (figure(&pictures.regions(seen, fates)?, "Regions of change", &overlay.regions(&seen.regions), &region_caption(&seen.regions)))
                @if !sheet.resolution.changes.is_empty() {
                    (figure(&pictures.pale_photo()?, "Measured points", &overlay.points(&sheet.resolution.changes), &html! {
                        b { "Points" } ": corners as they are stored, or the ground contact"
                    }))
                }
            }
        }
        (legend(&pictures, classes))
    };
    Ok(section("What was seen", &contents))
}

fn region_caption(regions: &[ChangeRegion]) -> Markup {
    html! {
        b { "Regions" }
        @if regions.is_empty() { ": none was found" } @else {
            ": " (swatch(KEPT)) "kept " (swatch(DROPPED)) "dropped " (swatch(LEFT_ALONE)) "left alone"
        }
    }
}

fn swatch([red, green, blue]: [u8; 3]) -> Markup {
    html! { span class="swatch" style={ "background:rgb(" (red) " " (green) " " (blue) ")" } {} }
}

fn legend(pictures: &Pictures<'_>, classes: &ClassTable) -> Markup {
    html! {
        ul class="legend" {
            @for (class, share) in pictures.shares() {
                @let colour = classes.get(class).map_or([128; 3], |class| class.colour);
                li { (swatch(colour)) (classes.name(class)) " " span class="share" { (format!("{:.1} %", 100.0 * share)) } }
            }
        }
    }
}

fn regions(sheet: &Sheet<'_>, fates: &[Vec<Fate>]) -> Markup {
    let Some(seen) = sheet.seen else {
        return html! { p { "Not looked for: only a reliable pose may change the map." } };
    };
    if seen.regions.is_empty() {
        let left = "The detector found none. Grey in the picture is what it left alone: explained by the error of the pose, of a class that is never a change, or too small.";
        return html! { p { (left) } };
    }
    let classes = sheet.world.classes();
    let image_px = f64::from(sheet.capture.labels.width()) * f64::from(sheet.capture.labels.height());
    let row = |index: usize, region: &ChangeRegion| {
        let own = fates.get(index).map_or(&[][..], Vec::as_slice);
        let share = 100.0 * f64::from(region.pixels) / image_px;
        let bounds = region.bounds;
        vec![
            html! { span class="number" style={ "--tone:rgb(" (colour_of(own)[0]) " " (colour_of(own)[1]) " " (colour_of(own)[2]) ")" } { (index + 1) } },
            html! { (classes.name(region.class_before)) " → " b { (classes.name(region.class_after)) } },
            html! { (region.pixels) " px" br; span class="share" { (with_unit(share, "%")) } },
            html! { (bounds.left) "–" (bounds.right) ", " (bounds.top) "–" (bounds.bottom) },
            html! { (became(sheet, seen, own)) },
        ]
    };
    let lines: Vec<Vec<Markup>> = seen.regions.iter().enumerate().map(|(index, region)| row(index, region)).collect();
    rows(&["", "Map → photo", "Size", "Columns, rows", "What became of it"], &lines)
}

fn became(sheet: &Sheet<'_>, seen: &Seen, fates: &[Fate]) -> Markup {
    let of_none = if seen.proposals.is_empty() {
        "nothing was proposed for it"
    } else {
        "taken together with another region, or nothing was proposed for it"
    };
    html! {
        @if fates.is_empty() { (of_none) }
        @for fate in fates {
            div class="fate" {
                @match fate {
                    Fate::Changed(index) => {
                        @let change = &sheet.changes[*index];
                        span class="yes" { "kept" } ": " (text(&change["op"])) " " (text(&change["class"]))
                        @if let Some(fid) = change["fid"].as_u64() { " " (fid) }
                    },
                    Fate::Dropped(index) => {
                        @if let Some(rejection) = sheet.resolution.rejections.get(*index) {
                            span class="no" { "dropped" } " by " (numbers::rejection(rejection))
                        }
                    },
                }
            }
        }
    }
}

fn changes(sheet: &Sheet<'_>) -> Result<Markup, Failure> {
    let overlay = Overlay::new(&sheet.capture.camera, sheet.located.localization.pose);
    let labels = &sheet.capture.labels;
    let pictures = Pictures::new(labels, labels, sheet.world.classes());
    let mut cards = Vec::new();
    for (index, change) in sheet.resolution.changes.iter().enumerate() {
        let detail = match overlay.part(change) {
            Some(bounds) => overlay.detail(&pictures.part(bounds)?, bounds, change),
            None => html! {},
        };
        cards.push(numbers::change(&sheet.changes[index], index + 1, &detail));
    }
    Ok(html! { div class="changes" { @for card in &cards { (card) } } })
}

fn heat(sheet: &Sheet<'_>, name: &str) -> Result<Markup, Failure> {
    let localization = &sheet.located.localization;
    if localization.heat.is_empty() {
        let words = if localization.candidates == 0 {
            "The pose was given: nothing was searched."
        } else {
            "The matcher says no scores of places."
        };
        return Ok(html! { p { (words) } });
    }
    let picture = heat_map(&HeatMap {
        heat: &localization.heat,
        prior: sheet.capture.prior.pose,
        estimate: localization.pose,
        truth: None,
        covariance: localization.covariance,
        score: localization.score,
        title: name,
    })?;
    let caption = html! {
        b { "Search" } ": best score at each of " (localization.heat.len()) " places, "
        (localization.candidates) " poses in all, " (localization.skipped) " inside buildings left out"
    };
    Ok(figure(&picture, "Score of each candidate position", &html! {}, &caption))
}

fn made(sheet: &Sheet<'_>) -> Markup {
    html! {
        div class="two" {
            div { h3 { "Plugins" } (numbers::plugins(sheet.document)) }
            div { h3 { "Time" } (numbers::timings(sheet.document)) }
        }
        p { "Capture " code { (sheet.path.display()) } ", SHA-256 " code class="digest" { (sheet.capture.digest) } }
        details { summary { "All of it as JSON" } pre { (numbers::pretty(sheet.document)) } }
    }
}
