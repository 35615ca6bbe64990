//! An instance of a plugin in another process: the calls of the line, over the wire.

use super::desk::Desk;
use super::lending::Lending;
use super::link::{Handled, Link, Turn};
use super::program::Program;
use super::translate;
use crate::image::{LabelImage, RgbImage};
use crate::plugin::check::{self, Rules, Violation};
use crate::plugin::error::PluginError;
use crate::plugin::input::{ComparisonInput, PhotoInput};
use crate::plugin::open::Plugin;
use crate::plugin::results::Collected;
use crate::plugin::services::Services;
use crate::plugin::settings::Settings;
use resurvey_schema::wire::{
    DetectCall, EstimateCall, SearchCall, SegmentCall, ToPlugin, WireLocalization, WireRegion,
};
use resurvey_schema::{ChangeRegion, Class, ClassId, Localization, Proposal};
use std::io;
use std::sync::Arc;

/// An instance, or the promise of one: after [`finish`](Self::finish) the next call makes it anew.
#[derive(Debug)]
pub(in super::super) struct Apart {
    plugin: Plugin,
    program: Arc<Program>,
    settings: String,
    /// The process with the instance in it.
    link: Option<Link>,
    /// Why it is not called again.
    broken: Option<PluginError>,
}

impl Apart {
    pub(in super::super) fn create(
        plugin: Plugin,
        program: Arc<Program>,
        settings: &Settings,
    ) -> Result<Self, PluginError> {
        let settings = settings.as_json().to_owned();
        let mut instance = Self { plugin, program, settings, link: None, broken: None };
        instance.ready()?;
        Ok(instance)
    }

    pub(in super::super) fn plugin(&self) -> &Plugin {
        &self.plugin
    }

    /// Ends the instance and says how that went.
    pub(in super::super) fn finish(&mut self) -> Result<(), PluginError> {
        self.destroy(Turn::steady("destroy"))
    }

    fn destroy(&mut self, turn: Turn<'_>) -> Result<(), PluginError> {
        let Some(mut link) = self.link.take() else { return Ok(()) };
        let ended =
            link.send(&ToPlugin::Destroy {}, &turn).and_then(|()| link.conclude(turn, |_, _| Handled::OutOfTurn));
        let ended = self.judge(&link, ended).map(|_| ());
        if !link.is_dead() && matches!(ended, Ok(()) | Err(PluginError::Cancelled { .. })) {
            link.lending.memory.set_cancelled(false);
            self.program.put_back(link);
        }
        ended
    }

    /// The process, with an instance made.
    fn ready(&mut self) -> Result<(), PluginError> {
        if let Some(error) = &self.broken {
            return Err(error.clone());
        }
        if self.link.is_some() {
            return Ok(());
        }
        let mut link = self.program.take()?;
        let turn = Turn::steady("create");
        let message = ToPlugin::Create { settings: self.settings.clone() };
        let made = link.send(&message, &turn).and_then(|()| link.conclude(turn, |_, _| Handled::OutOfTurn));
        self.judge(&link, made)?;
        self.link = Some(link);
        Ok(())
    }

    /// Runs `body` with the process; one that dies of it is not used again.
    pub(super) fn with_link<T>(
        &mut self,
        body: impl FnOnce(&mut Link) -> Result<T, PluginError>,
    ) -> Result<T, PluginError> {
        self.ready()?;
        let mut link = self.link.take().expect("invariant: `ready` makes the link or fails");
        let outcome = body(&mut link);
        let outcome = self.judge(&link, outcome);
        if !link.is_dead() {
            self.link = Some(link);
        }
        outcome
    }

    /// Remembers and counts what killed the process.
    fn judge<T>(&mut self, link: &Link, outcome: Result<T, PluginError>) -> Result<T, PluginError> {
        if let Err(error) = &outcome
            && link.is_dead()
        {
            self.program.count(error);
            self.broken = Some(match error {
                PluginError::Panicked { plugin, .. } => PluginError::Poisoned { plugin: plugin.clone() },
                other => other.clone(),
            });
        }
        outcome
    }

    pub(in super::super) fn search(
        &mut self,
        services: &dyn Services,
        photo: &PhotoInput<'_>,
    ) -> Result<Localization, PluginError> {
        let rules =
            Rules { classes: services.classes(), width: photo.camera.width, height: photo.camera.height, regions: 0 };
        let lend = |lending: &mut Lending| {
            let call = SearchCall {
                photo: lending.raster(photo.labels)?,
                scratch: lending.scratch(photo.labels.values().len())?,
                classes: classes(services),
                camera: translate::camera(photo.camera),
                prior: translate::wire_prior(photo.prior),
                memory: lending.memory.bytes(),
            };
            Ok(ToPlugin::Search(Box::new(call)))
        };
        let (collected, found) = self.call("search", services, rules, lend)?;
        let invalid = |Violation { field, value, expected }| PluginError::InvalidOutput {
            plugin: self.name(),
            call: "search",
            field,
            value,
            expected,
        };
        let nothing = || Violation {
            field: "localization".to_owned(),
            value: "nothing".to_owned(),
            expected: "a localization in done".to_owned(),
        };
        let found = translate::localization(&*found.ok_or_else(nothing).map_err(invalid)?, collected.heat);
        check::localization(&found).map_err(invalid)?;
        Ok(found)
    }

    pub(in super::super) fn detect(
        &mut self,
        services: &dyn Services,
        input: &ComparisonInput<'_>,
    ) -> Result<Vec<ChangeRegion>, PluginError> {
        let lend = |lending: &mut Lending| Ok(ToPlugin::Detect(Box::new(comparison(lending, services, input)?)));
        let (collected, _) = self.call("detect", services, rules(services, input, 0), lend)?;
        Ok(collected.regions)
    }

    pub(in super::super) fn estimate(
        &mut self,
        services: &dyn Services,
        input: &ComparisonInput<'_>,
        regions: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, PluginError> {
        let lend = |lending: &mut Lending| {
            let regions = regions.iter().map(|one| region(lending, one)).collect::<io::Result<_>>()?;
            let comparison = comparison(lending, services, input)?;
            Ok(ToPlugin::Estimate(Box::new(EstimateCall { comparison, regions })))
        };
        let (collected, _) = self.call("estimate", services, rules(services, input, regions.len()), lend)?;
        Ok(collected.proposals)
    }

    pub(in super::super) fn segment(
        &mut self,
        services: &dyn Services,
        photo: &RgbImage,
    ) -> Result<LabelImage, PluginError> {
        let (width, height) = (photo.width(), photo.height());
        let rules = Rules { classes: services.classes(), width, height, regions: 0 };
        let mut labels = LabelImage::filled(width, height, ClassId::VOID.0);
        let mut place = 0;
        let lend = |lending: &mut Lending| {
            let (rows, columns) = (height as usize, width as usize);
            let answer = lending.raster(&labels)?;
            place = answer.offset;
            Ok(ToPlugin::Segment(Box::new(SegmentCall {
                photo: lending.lend(&[rows, columns, 3], photo.values())?,
                labels: answer,
                scratch: lending.scratch(photo.values().len())?,
                classes: classes(services),
                memory: lending.memory.bytes(),
            })))
        };
        self.call("segment", services, rules, lend)?;
        self.with_link(|link| Ok(link.lending.memory.read_into(place, labels.values_mut())))?;
        check::labels(&labels, services.classes()).map_err(|Violation { field, value, expected }| {
            PluginError::InvalidOutput { plugin: self.name(), call: "segment", field, value, expected }
        })?;
        Ok(labels)
    }

    /// One call with services and results; a violation comes before whatever the plugin itself says.
    fn call(
        &mut self,
        call: &'static str,
        services: &dyn Services,
        rules: Rules<'_>,
        lend: impl FnOnce(&mut Lending) -> io::Result<ToPlugin>,
    ) -> Result<(Collected, Option<Box<WireLocalization>>), PluginError> {
        let plugin = self.name();
        self.with_link(|link| {
            link.lending.start();
            let message = lend(&mut link.lending).map_err(|error| no_memory(&plugin, &error))?;
            let mut desk = Desk::new(services, rules, &link.lending);
            let cancelled = || services.cancelled();
            let turn = Turn::new(call, &cancelled);
            let outcome = link
                .send(&message, &turn)
                .and_then(|()| link.conclude(turn, |lending, message| desk.handle(lending, message)));
            let mut collected = desk.finish();
            // Where the process died, that is the news.
            if let Some(Violation { field, value, expected }) = collected.violation.take().filter(|_| !link.is_dead()) {
                return Err(PluginError::InvalidOutput { plugin: plugin.clone(), call, field, value, expected });
            }
            outcome.map(|found| (collected, found))
        })
    }

    pub(super) fn name(&self) -> String {
        self.plugin.info().name.clone()
    }
}

impl Drop for Apart {
    fn drop(&mut self) {
        // Nobody can be told here, nor waits for long; a crash is counted all the same. Who wants to know calls `finish`.
        let _ = self.destroy(Turn::new("destroy", &|| true));
    }
}

/// There is no memory to lend.
pub(super) fn no_memory(plugin: &str, error: &io::Error) -> PluginError {
    let text = format!("there is no memory to share with it: {error}");
    PluginError::InvalidInput { plugin: plugin.to_owned(), text }
}

fn classes(services: &dyn Services) -> Vec<Class> {
    services.classes().iter().cloned().collect()
}

fn rules<'a>(services: &'a dyn Services, input: &ComparisonInput<'_>, regions: usize) -> Rules<'a> {
    Rules { classes: services.classes(), width: input.photo.width(), height: input.photo.height(), regions }
}

fn comparison(lending: &mut Lending, services: &dyn Services, input: &ComparisonInput<'_>) -> io::Result<DetectCall> {
    let size = (input.photo.width(), input.photo.height());
    let photo = lending.raster(input.photo)?;
    let views = lending.reserve_views(1, size, input.view.feature_table)?;
    lending.put_view(&views, 0, &input.view);
    Ok(DetectCall {
        photo,
        views,
        scratch: lending.scratch(input.photo.values().len())?,
        classes: classes(services),
        camera: translate::camera(input.camera),
        estimate: translate::wire_estimate(input.estimate),
        memory: lending.memory.bytes(),
    })
}

fn region(lending: &mut Lending, region: &ChangeRegion) -> io::Result<WireRegion> {
    let bounds = region.bounds;
    let shape = [bounds.height() as usize, bounds.width() as usize];
    Ok(WireRegion {
        class_before: region.class_before.0,
        class_after: region.class_after.0,
        bounds: [bounds.left, bounds.top, bounds.right, bounds.bottom],
        pixels: region.pixels,
        mask: lending.lend(&shape, &region.mask)?,
    })
}
