//! The trials that are the same for every kind.

use super::super::error::PluginError;
use super::super::info::{Digest, Kind};
use super::super::isolation::Isolation;
use super::super::open::{Code, Plugin, open_library};
use super::super::settings::ValueType;
use super::super::{declaration, registry};
use super::answer::Answer;
use super::ask::{Asked, is_scorer};
use super::exhibit::Exhibit;
use super::finding::Finding;
use super::lent::{Host, Layout};
use super::manners::Manners;
use super::raw::{Raw, apart};
use super::report::Report;
use super::stage::{Place, Side, Stage};
use super::watched::Watched;
use resurvey_schema::GridPoint;
use std::path::Path;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// What a trial works with.
pub(super) struct Bench<'a> {
    pub path: &'a Path,
    pub bytes: &'a [u8],
    pub stage: &'a dyn Stage,
    pub report: &'a Report,
    /// How an executable is started.
    pub isolation: Arc<Isolation>,
}

/// A trial ends with what it found, early or late.
pub(super) type Tried = Result<Finding, Finding>;

/// Size of the photo where details do not count.
const SMALL: [u32; 2] = [161, 121];
/// Size of an ordinary photo.
const ORDINARY: [u32; 2] = [320, 240];
/// By then a plugin ends after a cancel (rule 7 of the header).
const CANCEL: Duration = Duration::from_millis(200);
/// The best of so many attempts counts: other programs run too.
const ATTEMPTS: usize = 3;

/// Positions further from the camera are said to lie inside buildings, metres: one that asks is done soon.
const COURTYARD_M: f64 = 8.0;

/// The side of a place on which a kind has something to say.
pub(super) fn side<'a>(kind: Kind, place: &Place<'a>) -> Side<'a> {
    if kind == Kind::Matcher { place.same } else { place.came }
}

/// The services of `side` with buildings all around `centre`.
fn courtyard<'a>(side: Side<'a>, centre: GridPoint) -> Watched<'a> {
    Watched::around(side.services, centre, COURTYARD_M)
}

impl Bench<'_> {
    pub(super) fn open(&self) -> Result<Plugin, Finding> {
        let refused = |fault| Finding::from(PluginError::from(registry::refusal(self.path, fault)));
        let declared = registry::read_declaration(self.path, self.bytes).map_err(refused)?;
        let sha256 = Digest::of(self.bytes);
        if declared.is_executable() {
            self.report.step("at its start");
            let place = (self.path, registry::fingerprint(self.path).map_err(refused)?);
            return Ok(Plugin::apart(place, declared, sha256, (Arc::clone(&self.isolation), None))?);
        }
        self.report.step("in the library's own start or in entry");
        let plugin = Plugin::open(self.path, declared, sha256).map_err(refused)?;
        self.report.step("after entry");
        Ok(plugin)
    }

    pub(super) fn asked(&self, plugin: &Plugin) -> Result<Asked<'_>, Finding> {
        Ok(Asked::new(plugin, [], self.report)?)
    }

    /// Does `act` where the camera has `[width, height]` pixels.
    pub(super) fn at(&self, [width, height]: [u32; 2], mut act: impl FnMut(&Place<'_>) -> Tried) -> Tried {
        let mut tried = None;
        self.stage
            .show(width, height, &mut |place| {
                let centre = place.pose.position;
                let (same, came) = (courtyard(place.same, centre), courtyard(place.came, centre));
                let (went, blank) = (courtyard(place.went, centre), courtyard(place.blank, centre));
                tried = Some(act(&Place {
                    same: Side { services: &same, ..place.same },
                    came: Side { services: &came, ..place.came },
                    went: Side { services: &went, ..place.went },
                    blank: Side { services: &blank, ..place.blank },
                    ..*place
                }));
            })
            .map_err(|text| Finding::failed(format!("the toy place cannot be shown: {text}"), "report this"))?;
        tried.unwrap_or_else(|| Err(Finding::failed("the toy place was not shown", "report this")))
    }
}

/// It opens, and its entry fills a table for its kind.
pub(super) fn loads(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    let info = plugin.info();
    let settings = plugin.schema().iter().count();
    Ok(Finding::passed(format!("{} {} ({}), {settings} settings", info.name, info.version, info.kind)))
}

/// Settings outside the schema are refused, those at its bounds are taken.
pub(super) fn settings(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    if plugin.settings([("no-such-setting", "1")]).is_ok() {
        return Err(Finding::failed("an unknown setting was accepted", "add \"additionalProperties\": false"));
    }
    drop(bench.asked(&plugin)?);
    let (mut taken, mut refused) = (0, 0);
    for (key, setting) in plugin.schema().iter() {
        let number = |value: f64| {
            if setting.value_type == ValueType::Integer { format!("{value:.0}") } else { value.to_string() }
        };
        let choices =
            setting.choices.iter().map(|choice| choice.as_str().map_or_else(|| choice.to_string(), str::to_owned));
        let bounds = [setting.minimum, setting.maximum].into_iter().flatten().map(number);
        for value in choices.chain(bounds).filter(|_| setting.value_type != ValueType::Boolean) {
            // A bound that is no value of its own type is none.
            if plugin.settings([(key, value.as_str())]).is_ok() {
                drop(Asked::new(&plugin, [(key, value.as_str())], bench.report)?);
                taken += 1;
            }
        }
        let below = setting.minimum.map(|least| number(least - 1.0));
        let above = setting.maximum.map(|most| number(most + 1.0));
        let no_choice = (!setting.choices.is_empty()).then(|| "no-such-choice".to_owned());
        let not_of_type = (setting.value_type != ValueType::String).then(|| "no-such-value".to_owned());
        for value in [below, above, no_choice, not_of_type].into_iter().flatten() {
            if let Ok(settings) = plugin.settings([(key, value.as_str())]) {
                let problem = format!("{key}={value} was accepted as {}", settings.as_json());
                return Err(Finding::failed(problem, "correct minimum, maximum or enum in the schema"));
            }
            refused += 1;
        }
    }
    Ok(Finding::passed(format!("{taken} values at the bounds taken, {refused} outside refused")))
}

/// It answers where photo and map are an ordinary street.
pub(super) fn answers(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    let kind = plugin.info().kind;
    bench.at(ORDINARY, |place| {
        let mut asked = bench.asked(&plugin)?;
        let mut words = Vec::new();
        let sides = if kind == Kind::Matcher { vec![place.same] } else { vec![place.same, place.came, place.went] };
        for side in sides {
            match asked.ask(&Exhibit::new(place, side)?)? {
                Answer::Refused(text) => return Err(unanswered(&plugin, &text)),
                answer => words.push(answer.words()),
            }
        }
        Ok(Finding::passed(words.join("; ")))
    })
}

fn unanswered(plugin: &Plugin, text: &str) -> Finding {
    let call = match plugin.info().kind {
        Kind::Matcher if is_scorer(plugin) => "score",
        Kind::Matcher => "search",
        Kind::Detector => "detect",
        Kind::Estimator => "estimate",
        Kind::Segmenter => "segment",
    };
    PluginError::Failed { plugin: plugin.info().name.clone(), call, text: text.to_owned() }.into()
}

/// Images of one pixel, one row and one column are answered or refused.
pub(super) fn small_images(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    for size in [[1, 1], [1, 7], [7, 1]] {
        bench.at(size, |place| {
            let answer = bench.asked(&plugin)?.ask(&Exhibit::new(place, side(plugin.info().kind, place))?)?;
            Ok(Finding::passed(answer.words()))
        })?;
    }
    Ok(Finding::passed("1×1, 1×7 and 7×1 pixels"))
}

/// Rows may be padded.
pub(super) fn rows(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    let raw = Raw::new(&plugin, bench.report)?;
    bench.at(SMALL, |place| {
        let exhibit = Exhibit::new(place, side(plugin.info().kind, place))?;
        let answer = |padding| raw.create()?.call(&exhibit, exhibit.services, Layout { padding, ..Layout::default() });
        let packed = answer(0)?;
        for padding in [1, 13] {
            if let Some(difference) = packed.difference(&answer(padding)?) {
                return Err(Finding::failed(
                    format!("{padding} pixels of padding behind each row changed the answer: {difference}"),
                    "step from row to row by row_bytes, not by the width (in Rust: ImageRef::row)",
                ));
            }
        }
        Ok(Finding::passed(packed.words()))
    })
}

/// There may be nothing to work on: no regions, a photo that is all void, no position outside of buildings.
pub(super) fn nothing(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    let kind = plugin.info().kind;
    bench.at(SMALL, |place| {
        let mut asked = bench.asked(&plugin)?;
        let mut exhibit = Exhibit::new(place, side(kind, place))?;
        if kind == Kind::Estimator {
            let regions = std::mem::take(&mut exhibit.regions);
            let answer = asked.ask(&exhibit)?;
            if answer != Answer::Proposals(Vec::new()) {
                return Err(Finding::failed(
                    format!("without a region there was an answer: {}", answer.words()),
                    "propose nothing that does not come from a region",
                ));
            }
            exhibit.regions = regions;
        }
        if kind == Kind::Matcher && !is_scorer(&plugin) {
            let nowhere = Watched::around(exhibit.services, place.pose.position, -1.0);
            asked.ask_with(&exhibit, &nowhere)?;
        }
        let blank = Exhibit { regions: exhibit.regions, ..Exhibit::new(place, place.blank)? };
        match asked.ask(&blank)? {
            Answer::Regions(regions) if !regions.is_empty() => Err(Finding::failed(
                format!("a photo that is all void (255) gave {} regions", regions.len()),
                "never compare pixels of class 255: they are unlabelled",
            )),
            answer => Ok(Finding::passed(format!("void photo: {}", answer.words()))),
        }
    })
}

/// What is lent is read, not written, and not used after the call.
pub(super) fn inputs(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    let raw = Raw::new(&plugin, bench.report)?;
    bench.at(SMALL, |place| {
        let exhibit = Exhibit::new(place, side(plugin.info().kind, place))?;
        let mut instance = raw.create()?;
        for _ in 0..2 {
            instance.call(&exhibit, exhibit.services, Layout::default())?;
        }
        drop(instance);
        Ok(Finding::passed(if cfg!(unix) {
            "read-only, and closed after each call"
        } else {
            "no page protection here"
        }))
    })
}

/// Nothing is written beside the places for answers and errors; a call may come without a place for its error.
pub(super) fn outputs(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    let raw = Raw::new(&plugin, bench.report)?;
    for size in [SMALL, [1, 1]] {
        bench.at(size, |place| {
            let mut instance = raw.create()?;
            let seen = Exhibit::new(place, side(plugin.info().kind, place))?;
            instance.call(&seen, seen.services, Layout::default())?;
            let blank = Exhibit::new(place, place.blank)?;
            for is_silent in [false, true] {
                instance.call(&blank, blank.services, Layout { is_silent, ..Layout::default() })?;
            }
            Ok(Finding::passed(""))
        })?;
    }
    Ok(Finding::passed("nothing beside score, localization, instance and error"))
}

/// The same input gives the same answer, from one instance and from two.
pub(super) fn repeats(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    bench.at(ORDINARY, |place| {
        let exhibit = Exhibit::new(place, side(plugin.info().kind, place))?;
        let mut asked = bench.asked(&plugin)?;
        let first = asked.ask(&exhibit)?;
        for (again, which) in
            [(asked.ask(&exhibit)?, "the same instance"), (bench.asked(&plugin)?.ask(&exhibit)?, "another instance")]
        {
            if let Some(difference) = first.difference(&again) {
                return Err(Finding::failed(
                    format!("{which} gave another answer to the same input: {difference}"),
                    "use no clock, no random seed, no address and no order of threads; clear what a call leaves behind, and copy \
                     what you keep: an array that was lent has other values after the call",
                ));
            }
        }
        Ok(Finding::passed("three times the same"))
    })
}

/// It returns soon after a cancel.
pub(super) fn cancel(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    bench.at(ORDINARY, |place| {
        let exhibit = Exhibit::new(place, side(plugin.info().kind, place))?;
        if is_scorer(&plugin) {
            return soon("one call of score, which cannot be cancelled,", || {
                let mut asked = bench.asked(&plugin)?;
                let start = Instant::now();
                asked.ask(&exhibit)?;
                Ok(start.elapsed())
            });
        }
        let watched = Watched::new(exhibit.services);
        let mut asked = bench.asked(&plugin)?;
        asked.ask_with(&exhibit, &watched)?;
        let mut found = Finding::passed("");
        for (uses, when) in
            [(0, "a call that is cancelled from the start"), (watched.used() / 2, "a call that is cancelled halfway")]
        {
            found = soon(when, || {
                let mut asked = bench.asked(&plugin)?;
                let services = Watched::cancelled_after(exhibit.services, uses);
                match asked.ask_with(&exhibit, &services) {
                    Ok(_) | Err(PluginError::Cancelled { .. }) => Ok(services.since_cancel().unwrap_or_default()),
                    Err(error) => Err(error.into()),
                }
            })?;
        }
        Ok(found)
    })
}

fn soon(what: &str, mut attempt: impl FnMut() -> Result<Duration, Finding>) -> Tried {
    let mut best = Duration::MAX;
    for _ in 0..ATTEMPTS {
        best = best.min(attempt()?);
        if best <= CANCEL {
            return Ok(Finding::passed(format!("returned after {} ms", best.as_millis())));
        }
    }
    Err(Finding::failed(
        format!("{what} took {} ms; expected at most {}", best.as_millis(), CANCEL.as_millis()),
        "look at cancelled() in every loop that may take long, and return RSV_CANCELLED (in Rust: an Err)",
    ))
}

/// Two instances in two threads agree with one alone.
pub(super) fn threads(bench: &Bench<'_>) -> Tried {
    let plugin = bench.open()?;
    bench.at(SMALL, |place| {
        let exhibit = Exhibit::new(place, side(plugin.info().kind, place))?;
        let alone = bench.asked(&plugin)?.ask(&exhibit)?;
        let several = || -> Result<Vec<Answer>, Finding> {
            let mut asked = bench.asked(&plugin)?;
            (0..2).map(|_| Ok(asked.ask(&exhibit)?)).collect()
        };
        let both = std::thread::scope(|scope| {
            let threads = [scope.spawn(several), scope.spawn(several)];
            threads.map(|thread| {
                thread.join().unwrap_or_else(|_| Err(Finding::failed("a thread panicked", "report this")))
            })
        });
        for answers in both {
            if let Some(difference) = answers?.iter().find_map(|answer| alone.difference(answer)) {
                return Err(Finding::failed(
                    format!("beside an instance in another thread the answer changed: {difference}"),
                    "keep what changes in the instance: no static buffers, no globals",
                ));
            }
        }
        Ok(Finding::passed("two instances agree"))
    })
}

/// A host whose structs end earlier crashes nothing.
pub(super) fn older_host(bench: &Bench<'_>) -> Tried {
    with_host(bench, Host::Older, |_, other| Ok(Finding::passed(other.words())))
}

/// A host whose structs go on changes nothing.
pub(super) fn newer_host(bench: &Bench<'_>) -> Tried {
    with_host(bench, Host::Newer, |today, other| match today.difference(other) {
        None => Ok(Finding::passed(other.words())),
        Some(difference) => Err(Finding::failed(
            format!("longer structs of a newer host changed the answer: {difference}"),
            "step through regions by region_step, and do not compare a struct's size with sizeof",
        )),
    })
}

fn with_host(bench: &Bench<'_>, host: Host, judge: impl Fn(&Answer, &Answer) -> Tried) -> Tried {
    let plugin = bench.open()?;
    let today = Raw::new(&plugin, bench.report)?;
    let refused = |fault| Finding::from(PluginError::from(registry::refusal(bench.path, fault)));
    let declared = declaration::read_library(bench.bytes).map_err(refused)?;
    let opened = open_library(bench.path, &declared).map_err(refused)?;
    let other = Raw::enter(&plugin, opened, host, bench.report)?;
    bench.at(SMALL, |place| {
        let exhibit = Exhibit::new(place, side(plugin.info().kind, place))?;
        let layout = Layout { host, ..Layout::default() };
        let of_other = other.create()?.call(&exhibit, exhibit.services, layout)?;
        let of_today = today.create()?.call(&exhibit, exhibit.services, Layout::default())?;
        judge(&of_today, &of_other)
    })
}

/// Floating-point mode, working directory, locale and signal handlers stay.
pub(super) fn manners(bench: &Bench<'_>) -> Tried {
    let before = Manners::now();
    let compare = |when: &str| before.change(&Manners::now(), when).map_or(Ok(()), Err);
    let plugin = bench.open()?;
    if matches!(plugin.code(), Code::Apart(_)) {
        return Err(apart());
    }
    compare("when the library was opened")?;
    bench.at(SMALL, |place| {
        let exhibit = Exhibit::new(place, side(plugin.info().kind, place))?;
        let mut asked = bench.asked(&plugin)?;
        compare("in create")?;
        asked.ask(&exhibit)?;
        compare("in a call")?;
        drop(asked);
        compare("in destroy")?;
        Ok(Finding::passed("floating-point mode, directory, locale and signals stay"))
    })
}
