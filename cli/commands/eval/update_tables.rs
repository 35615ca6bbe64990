//! The tables of `eval` about updates, a row for each contender.

use super::cells::{dash, number, per_cent, points, share, signed, spread, table, tally};
use super::contender::Contender;
use super::groups::Group;
use comfy_table::Table;
use resurvey_core::evaluate::{ChangeSummary, Difference, SecondPhotos, Summary};

fn of_each<'a>(
    summaries: &'a [Summary],
    contenders: &'a [Contender],
) -> impl Iterator<Item = (&'a ChangeSummary, &'a str)> {
    let named = summaries.iter().zip(contenders);
    named.filter_map(|(summary, contender)| Some((summary.changes.as_ref()?, contender.name.as_str())))
}

/// What was found of what can be seen, and in which way.
pub fn found(summaries: &[Summary], contenders: &[Contender]) -> Table {
    let mut table = table(&[
        "contender",
        "material found",
        "dynamic found",
        "found %",
        "material came",
        "material went",
        "dynamic came",
        "dynamic went",
        "replaced in place",
        "left beside",
    ]);
    for (changes, name) in of_each(summaries, contenders) {
        table.add_row([
            name.to_owned(),
            tally(changes.material),
            tally(changes.dynamic),
            changes.found.as_ref().map_or_else(dash, per_cent),
            tally(changes.material_added),
            tally(changes.material_removed),
            tally(changes.dynamic_added),
            tally(changes.dynamic_removed),
            tally(changes.replaced_in_place),
            changes.replaced_beside.to_string(),
        ]);
    }
    table
}

/// What never happened, and what changed again.
pub fn false_updates(summaries: &[Summary], contenders: &[Contender]) -> Table {
    let mut table = table(&[
        "contender",
        "false of made %",
        "captures with one %",
        "of those without change %",
        "false per 100 of them",
        "changed twice",
        "second photos",
        "changed again",
        "newly found",
        "false",
    ]);
    for (changes, name) in of_each(summaries, contenders) {
        let photos = |of: fn(&SecondPhotos) -> String| changes.second_photos.as_ref().map_or_else(dash, of);
        table.add_row([
            name.to_owned(),
            share(changes.false_of_committed.as_ref()),
            share(changes.false_captures.as_ref()),
            share(changes.false_captures_without_change.as_ref()),
            changes.false_per_100_without_change.as_ref().map_or_else(dash, number),
            changes.not_idempotent.to_string(),
            photos(|photos| format!("{} of {} reliable", photos.reliable, photos.photos)),
            photos(|photos| format!("{} in {}", photos.duplicates, photos.changed_again)),
            photos(|photos| photos.newly_found.to_string()),
            photos(|photos| photos.false_updates.to_string()),
        ]);
    }
    table
}

/// How far off what was placed is, and whether it says so.
pub fn placed(summaries: &[Summary], contenders: &[Contender]) -> Table {
    let mut table = table(&[
        "contender",
        "placed",
        "off m: median / worst",
        "with the pose within 1 m",
        "area %: median / worst",
        "position within 2 sigma %",
        "area within 2 sigma %",
    ]);
    for (changes, name) in of_each(summaries, contenders) {
        table.add_row([
            name.to_owned(),
            changes.position_off_m.map_or(0, |off| off.count).to_string(),
            spread(changes.position_off_m.as_ref(), 2),
            spread(changes.position_off_good_pose_m.as_ref(), 2),
            spread(changes.area_error_pct.as_ref(), 1),
            share(changes.position_within_2_sigma.as_ref()),
            share(changes.area_within_2_sigma.as_ref()),
        ]);
    }
    table
}

/// The chief numbers of each of `groups`, a row for each contender in each.
pub fn by_group(groups: &[&Group], contenders: &[Contender]) -> Table {
    let by = groups.first().map_or("", |group| group.by);
    let mut table = table(&[
        by,
        "contender",
        "captures",
        "material found",
        "dynamic found",
        "false of made",
        "captures without change: false in %",
        "off m: median / worst",
        "area %: median / worst",
        "replaced in place",
        "changed twice",
        "second photos changed again",
        "missed",
    ]);
    for group in groups {
        let count = group.summaries.first().map_or(0, |summary| summary.captures);
        for (changes, name) in of_each(&group.summaries, contenders) {
            let again = changes.second_photos.map(|photos| format!("{} of {}", photos.changed_again, photos.photos));
            table.add_row([
                if group.name.is_empty() { dash() } else { group.name.clone() },
                name.to_owned(),
                count.to_string(),
                tally(changes.material),
                tally(changes.dynamic),
                format!("{} of {}", changes.false_updates, changes.committed),
                share(changes.false_captures_without_change.as_ref()),
                spread(changes.position_off_m.as_ref(), 2),
                spread(changes.area_error_pct.as_ref(), 1),
                tally(changes.replaced_in_place),
                changes.not_idempotent.to_string(),
                again.unwrap_or_else(dash),
                why_missed(changes).unwrap_or_else(dash),
            ]);
        }
    }
    table
}

/// Each contender against the last.
pub fn differences(differences: &[Difference], contenders: &[Contender]) -> Table {
    let mut table = table(&["contender", "found % points", "false a capture", "off m, where both placed it"]);
    for (difference, contender) in differences.iter().zip(contenders) {
        let Some(changes) = &difference.changes else { continue };
        table.add_row([
            contender.name.clone(),
            changes.found.as_ref().map_or_else(dash, points),
            signed(&changes.false_per_capture),
            changes.position_off_m.as_ref().map_or_else(dash, signed),
        ]);
    }
    table
}

/// Why changes that can be seen were missed, the most frequent reason first; `None` where none was.
pub fn why_missed(changes: &ChangeSummary) -> Option<String> {
    let mut reasons: Vec<(&String, &usize)> = changes.missed.iter().collect();
    reasons.sort_by(|a, b| b.1.cmp(a.1).then(a.0.cmp(b.0)));
    let words: Vec<String> = reasons.iter().map(|(why, count)| format!("{why} {count}")).collect();
    (!words.is_empty()).then(|| words.join(", "))
}
