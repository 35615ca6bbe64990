//! The five calls of the C line, on structs that point to what the host lends. Every answer is checked here.
#![allow(unsafe_code)]

use super::check::{self, Rules};
use super::error::PluginError;
use super::instance::Instance;
use super::lend;
use super::results::{self, Collected, Collector};
use super::service_table::ServiceTable;
use super::services::Services;
use crate::image::LabelImage;
use resurvey_schema::abi::{self, Growing, STATUS_UNSUPPORTED, Status};
use resurvey_schema::{ChangeRegion, ClassId, Localization, Proposal};

/// Similarity of photo and view, 0–1.
///
/// # Safety
/// What `photo` and `view` point to is readable until the function returns; so in all functions below.
pub(super) unsafe fn score(instance: &mut Instance, photo: &abi::Image, view: &abi::View) -> Result<f64, PluginError> {
    let mut score = f64::NAN;
    instance.call(
        "score",
        || false,
        |table, pointer, error| match table.score {
            // SAFETY: a function of the plugin's own table; the caller promises the inputs, score and error live until it
            // returns, and `call` holds the instance alone.
            Some(function) => unsafe { function(pointer, photo, view, &raw mut score, error) },
            None => STATUS_UNSUPPORTED,
        },
    )?;
    check::ratio("score", score).map_err(|violation| instance.invalid("score", violation))?;
    Ok(score)
}

/// The pose of `photo`.
///
/// # Safety
/// As [`score`].
pub(super) unsafe fn search(
    instance: &mut Instance,
    services: &dyn Services,
    photo: &abi::Photo,
) -> Result<Localization, PluginError> {
    let rules =
        Rules { classes: services.classes(), width: photo.labels.width, height: photo.labels.height, regions: 0 };
    let mut found = abi::Localization::new();
    let collected = collect(instance, "search", services, rules, |table, pointer, context, error| {
        match table.search {
            // SAFETY: as in `score`.
            Some(function) => unsafe {
                function(pointer, context.services, photo, context.results, &raw mut found, error)
            },
            None => STATUS_UNSUPPORTED,
        }
    })?;
    let found = results::localization(&found, collected.heat);
    check::localization(&found).map_err(|violation| instance.invalid("search", violation))?;
    Ok(found)
}

/// Regions in which photo and view differ.
///
/// # Safety
/// As [`score`].
pub(super) unsafe fn detect(
    instance: &mut Instance,
    services: &dyn Services,
    comparison: &abi::Comparison,
) -> Result<Vec<ChangeRegion>, PluginError> {
    let rules = rules(services, comparison, 0);
    let collected = collect(instance, "detect", services, rules, |table, pointer, context, error| {
        match table.detect {
            // SAFETY: as in `score`.
            Some(function) => unsafe { function(pointer, context.services, comparison, context.results, error) },
            None => STATUS_UNSUPPORTED,
        }
    })?;
    Ok(collected.regions)
}

/// What each region means for the map.
///
/// # Safety
/// As [`score`].
pub(super) unsafe fn estimate(
    instance: &mut Instance,
    services: &dyn Services,
    comparison: &abi::Comparison,
    regions: &[abi::Region],
) -> Result<Vec<Proposal>, PluginError> {
    let rules = rules(services, comparison, regions.len());
    let collected = collect(instance, "estimate", services, rules, |table, pointer, context, error| {
        match table.estimate {
            // SAFETY: as in `score`.
            Some(function) => unsafe {
                function(
                    pointer,
                    context.services,
                    comparison,
                    regions.as_ptr(),
                    regions.len(),
                    size_of::<abi::Region>(),
                    context.results,
                    error,
                )
            },
            None => STATUS_UNSUPPORTED,
        }
    })?;
    Ok(collected.proposals)
}

/// The class of each pixel of `picture`.
///
/// # Safety
/// As [`score`].
pub(super) unsafe fn segment(
    instance: &mut Instance,
    services: &dyn Services,
    picture: &abi::Picture,
) -> Result<LabelImage, PluginError> {
    let abi::Image { width, height, .. } = picture.pixels;
    let mut labels = LabelImage::filled(width, height, ClassId::VOID.0);
    let rules = Rules { classes: services.classes(), width, height, regions: 0 };
    let place = lend::labels(&mut labels);
    collect(instance, "segment", services, rules, |table, pointer, context, error| match table.segment {
        // SAFETY: as in `score`; the place lives until the function returns, and nobody else uses it meanwhile.
        Some(function) => unsafe { function(pointer, context.services, picture, &raw const place, error) },
        None => STATUS_UNSUPPORTED,
    })?;
    check::labels(&labels, services.classes()).map_err(|violation| instance.invalid("segment", violation))?;
    Ok(labels)
}

fn rules<'a>(services: &'a dyn Services, comparison: &abi::Comparison, regions: usize) -> Rules<'a> {
    let (width, height) = (comparison.photo.width, comparison.photo.height);
    Rules { classes: services.classes(), width, height, regions }
}

/// What the host lends to a call beside its input.
struct Context {
    services: *const abi::Services,
    results: *const abi::Results,
}

/// Runs a call that delivers results; a violation comes before whatever the plugin itself says.
fn collect(
    instance: &mut Instance,
    call: &'static str,
    services: &dyn Services,
    rules: Rules<'_>,
    body: impl FnOnce(&abi::Table, *mut abi::Instance, &Context, *mut abi::ErrorText) -> Status,
) -> Result<Collected, PluginError> {
    let (collector, table) = (Collector::new(rules), ServiceTable::new(services));
    let (results, service_table) = (collector.results(), table.table());
    let context = Context { services: &raw const service_table, results: &raw const results };
    let outcome =
        instance.call(call, || services.cancelled(), |table, pointer, error| body(table, pointer, &context, error));
    let mut collected = collector.finish();
    if let Some(violation) = collected.violation.take() {
        return Err(instance.invalid(call, violation));
    }
    outcome.map(|()| collected)
}
