//! Calls a plugin through its table with inputs and places of a trial's own making, where [`super::ask`] would be too kind.
#![allow(unsafe_code)]

use super::super::check::{self, Rules};
use super::super::info::Kind;
use super::super::lend::read_growing;
use super::super::open::{Code, Plugin};
use super::super::photo_services::PhotoServices;
use super::super::results::{self, Collected, Collector};
use super::super::service_table::ServiceTable;
use super::super::services::Services;
use super::answer::Answer;
use super::exhibit::Exhibit;
use super::finding::Finding;
use super::guard::Block;
use super::lent::{Host, Inputs, Layout, Lent, struct_bytes};
use super::placeless::Behind;
use super::report::Report;
use crate::image::LabelImage;
use resurvey_schema::ClassId;
use resurvey_schema::abi::{
    self, ABI_MAJOR, ABI_MINOR, Declaration, Growing, STATUS_CANCELLED, STATUS_OK, STATUS_PANICKED, Status, Table, Text,
};
use std::mem::offset_of;
use std::ptr::null_mut;

/// Bytes for the text of an error; short, so that one who does not look is found.
const ERROR_BYTES: usize = 16;

/// A plugin whose table was filled for a trial.
pub(super) struct Raw<'a> {
    plugin: &'a Plugin,
    table: Table,
    report: &'a Report,
}

/// Where a plugin writes.
struct Place(Block);

impl Place {
    fn new(name: &'static str, bytes: &[u8]) -> Result<Self, Finding> {
        // Texts may stand anywhere, structs and numbers may not.
        let alignment = if bytes.len().is_multiple_of(8) { 8 } else { 1 };
        let block = Block::new(name, bytes, alignment);
        block.map(Self).ok_or_else(|| Finding::failed("the system has no memory for the trial", "try again"))
    }

    /// What stands there now, unless something was written around it.
    fn read(&self, name: &str) -> Result<Vec<u8>, Finding> {
        let outside = || {
            Finding::failed(
                format!("something was written beside {name}"),
                "write no further than the size, capacity or count that comes with each place",
            )
        };
        Ok(self.0.bytes().ok_or_else(outside)?.to_vec())
    }
}

/// A place for the labels of a segmenter, with rows padded.
struct LabelPlace {
    place: Place,
    size: (u32, u32),
    row_bytes: usize,
}

impl LabelPlace {
    fn new(size: (u32, u32), padding: usize) -> Result<Self, Finding> {
        let row_bytes = size.0 as usize + padding;
        let place = Place::new("labels", &vec![ClassId::VOID.0; row_bytes * size.1 as usize])?;
        Ok(Self { place, size, row_bytes })
    }

    fn record(&self) -> abi::Labels {
        abi::Labels { data: self.place.0.data(), width: self.size.0, height: self.size.1, row_bytes: self.row_bytes }
    }

    /// The labels, unless something was written between the rows or around them.
    fn read(&self) -> Result<LabelImage, Finding> {
        let (bytes, (width, height)) = (self.place.read("the labels")?, self.size);
        let rows = bytes.chunks_exact(self.row_bytes).map(|row| row.split_at(width as usize));
        if rows.clone().any(|(_, behind)| behind.iter().any(|byte| *byte != ClassId::VOID.0)) {
            return Err(Finding::failed(
                "something was written behind the end of a row of labels",
                "write `width` labels a row, and step from row to row by row_bytes",
            ));
        }
        let values = rows.flat_map(|(labels, _)| labels.iter().copied()).collect();
        LabelImage::from_values(width, height, values).ok_or_else(|| Finding::failed("labels were lost", "report this"))
    }
}

/// A place for the text of an error.
struct ErrorPlace {
    record: Place,
    text: Place,
}

impl ErrorPlace {
    fn new() -> Result<Self, Finding> {
        let text = Place::new("error.data", &[0; ERROR_BYTES])?;
        let record = abi::ErrorText { capacity: ERROR_BYTES as u32, data: text.0.data(), ..abi::ErrorText::new() };
        let bytes = struct_bytes(&record, Host::Today, 0);
        Ok(Self { record: Place::new("error", &bytes)?, text })
    }

    fn pointer(&self) -> *mut abi::ErrorText {
        self.record.0.data().cast()
    }

    /// The text, which must be whole characters within the capacity.
    fn text(&self) -> Result<String, Finding> {
        let bytes = self.text.read("the text of the error")?;
        self.record.read("the error")?;
        // SAFETY: the place holds a whole struct with its size first.
        let record = unsafe { read_growing(self.pointer().cast_const()) }.unwrap_or_default();
        let length = record.length as usize;
        let wrong = |what: String| Finding::failed(what, "use rsv_fail() of the header, which cuts the text to fit");
        if length > ERROR_BYTES {
            return Err(wrong(format!("error.length is {length} where the capacity is {ERROR_BYTES}")));
        }
        let text = std::str::from_utf8(&bytes[..length]);
        text.map(str::to_owned)
            .map_err(|_| wrong("the text of an error is not UTF-8, or cut inside a character".into()))
    }
}

impl<'a> Raw<'a> {
    /// The table as the host filled it in when it opened the plugin.
    pub(super) fn new(plugin: &'a Plugin, report: &'a Report) -> Result<Self, Finding> {
        match plugin.code() {
            Code::Here(table) => Ok(Self { plugin, table: *table, report }),
            Code::Apart(_) => Err(apart()),
        }
    }

    /// The table that `declaration` fills for an older or newer host.
    pub(super) fn enter(
        plugin: &'a Plugin,
        declaration: &'static Declaration,
        host: Host,
        report: &'a Report,
    ) -> Result<Self, Finding> {
        let info = abi::HostInfo {
            abi_major: ABI_MAJOR,
            abi_minor: ABI_MINOR,
            version: Text::of(env!("CARGO_PKG_VERSION")),
            ..abi::HostInfo::new()
        };
        let info = Place::new("host info", &struct_bytes(&info, host, offset_of!(abi::HostInfo, version)))?;
        let older = match plugin.info().kind {
            Kind::Matcher => offset_of!(Table, detect),
            Kind::Detector => offset_of!(Table, estimate),
            Kind::Estimator => offset_of!(Table, segment),
            Kind::Segmenter => size_of::<Table>(),
        };
        let sent = struct_bytes(&Table::new(), host, older);
        let (place, error) = (Place::new("table", &sent)?, ErrorPlace::new()?);
        info.0.seal();
        report.step("in entry");
        // SAFETY: the declaration promises an entry of this type; all three pointers live until it returns.
        let status =
            unsafe { (declaration.entry)(info.0.data().cast_const().cast(), place.0.data().cast(), error.pointer()) };
        let filled = place.read("the table")?;
        if status != STATUS_OK {
            let text = error.text()?;
            return Err(Finding::failed(
                format!("its entry returned status {status} for such a host: {text}"),
                "look at abi_major alone; every minor of it will do",
            ));
        }
        let known = sent.len().min(size_of::<Table>());
        if filled[..4] != sent[..4] || filled[known..] != sent[known..] {
            return Err(Finding::failed(
                "entry overwrote `size`, or what lies behind the table of this version",
                "set the functions one by one, and leave `size` alone",
            ));
        }
        // SAFETY: the place holds a table with its size first.
        let table = unsafe { read_growing(place.0.data().cast_const().cast::<Table>()) }.unwrap_or_default();
        Ok(Self { plugin, table, report })
    }

    /// An instance with the default settings.
    pub(super) fn create(&self) -> Result<RawInstance<'_>, Finding> {
        let settings = self.plugin.settings([])?;
        let text = Place::new("settings", settings.as_json().as_bytes())?;
        let (place, error) = (Place::new("instance", &[0; size_of::<usize>()])?, ErrorPlace::new()?);
        text.0.seal();
        let Some(create) = self.table.create else { return Err(no_function("create")) };
        self.report.step("in create");
        let lent = Text { data: text.0.data().cast_const(), length: settings.as_json().len() };
        // SAFETY: the function came from the plugin's own entry; text, place and buffer live until it returns.
        let status = unsafe { create(lent, place.0.data().cast(), error.pointer()) };
        text.0.close();
        let text = error.text()?;
        if status != STATUS_OK {
            return Err(Finding::failed(format!("create returned status {status}: {text}"), "take the defaults"));
        }
        let bytes = place.read("the instance")?;
        let mut address = [0; size_of::<usize>()];
        address.copy_from_slice(&bytes);
        Ok(RawInstance { raw: self, pointer: std::ptr::with_exposed_provenance_mut(usize::from_ne_bytes(address)) })
    }
}

/// What an executable does to the memory of its own process is nobody's business.
pub(super) fn apart() -> Finding {
    Finding::NotApplicable("an executable has no part in this process".to_owned())
}

fn no_function(name: &str) -> Finding {
    Finding::failed(format!("the table has no function {name}"), "set it in entry, whatever the size of the table")
}

/// An instance that a trial calls by itself.
pub(super) struct RawInstance<'a> {
    raw: &'a Raw<'a>,
    pointer: *mut abi::Instance,
}

impl RawInstance<'_> {
    /// One call. What is lent is read-only meanwhile, and gone afterwards.
    pub(super) fn call(
        &mut self,
        exhibit: &Exhibit<'_>,
        services: &dyn Services,
        layout: Layout,
    ) -> Result<Answer, Finding> {
        let (camera, classes) = (&exhibit.camera, services.classes());
        let rules = Rules { classes, width: camera.width, height: camera.height, regions: exhibit.regions.len() };
        let listener = Behind(services);
        let placeless = PhotoServices::new(classes, &listener);
        let services = if self.kind() == Kind::Segmenter { &placeless } else { services };
        let (collector, service_table) = (Collector::new(rules), ServiceTable::new(services));
        let mut lent = Lent::new(layout);
        let inputs = lent.inputs(exhibit)?;
        let services = lent.growing("services", service_table.table(), offset_of!(abi::Services, parallel_for))?;
        let results = lent.growing("results", collector.results(), size_of::<abi::Results>())?;
        let score = Place::new("score", &f64::NAN.to_ne_bytes())?;
        let sent = struct_bytes(&abi::Localization::new(), layout.host, offset_of!(abi::Localization, has_alignment));
        let found = Place::new("found", &sent)?;
        let labels = LabelPlace::new((camera.width, camera.height), layout.padding)?;
        let labels_record = lent.labels(labels.record())?;
        let error = ErrorPlace::new()?;
        lent.seal();
        let to = if layout.is_silent { null_mut() } else { error.pointer() };
        let places = Places {
            services,
            results,
            score: score.0.data(),
            found: found.0.data(),
            labels: labels_record,
            error: to,
        };
        let status = self.dispatch(&inputs, &places)?;
        lent.close();
        let text = error.text()?;
        let (score, filled) = (score.read("the score")?, found.read("the localization")?);
        let labels = labels.read()?;
        let known = sent.len().min(size_of::<abi::Localization>());
        if filled[..4] != sent[..4] || filled[known..] != sent[known..] {
            return Err(Finding::failed(
                "search overwrote `size`, or what lies behind the localization of this version",
                "write field by field, none beyond `size`, and leave `size` alone",
            ));
        }
        let mut collected = collector.finish();
        let outcome = match (status, collected.violation.take()) {
            (_, Some(violation)) => return Err(violated(&violation)),
            (STATUS_OK, None) if self.kind() == Kind::Segmenter => {
                check::labels(&labels, classes).map(|()| Answer::Labels(labels))
            }
            (STATUS_OK, None) => self.answer(&score, &found, collected),
            (STATUS_PANICKED, None) => {
                return Err(Finding::failed(format!("panicked: {text}…"), "return an error with the reason instead"));
            }
            (STATUS_CANCELLED, None) => return Err(Finding::failed("ended as if it were cancelled", "nobody asked")),
            (_, None) => Ok(Answer::Refused(text)),
        };
        outcome.map_err(|violation| violated(&violation))
    }

    fn dispatch(&self, inputs: &Inputs, places: &Places) -> Result<Status, Finding> {
        let table = &self.raw.table;
        let Inputs { photo_image, photo, picture, view, comparison, regions, region_count, region_step } = *inputs;
        let Places { services, results, score, found, labels, error } = *places;
        let step = |name: &str| self.raw.report.step(name);
        // SAFETY: functions of the plugin's own table; everything lent lives until they return, and this instance is
        // called by nobody else.
        let status = unsafe {
            match (self.kind(), table.score, table.search) {
                (Kind::Matcher, _, Some(search)) => {
                    step("in search");
                    search(self.pointer, services, photo, results, found.cast(), error)
                }
                (Kind::Matcher, Some(function), None) => {
                    step("in score");
                    function(self.pointer, photo_image, view, score.cast(), error)
                }
                (Kind::Matcher, None, None) => return Err(no_function("score or search")),
                (Kind::Detector, ..) => {
                    let detect = table.detect.ok_or_else(|| no_function("detect"))?;
                    step("in detect");
                    detect(self.pointer, services, comparison, results, error)
                }
                (Kind::Estimator, ..) => {
                    let estimate = table.estimate.ok_or_else(|| no_function("estimate"))?;
                    step("in estimate");
                    estimate(self.pointer, services, comparison, regions, region_count, region_step, results, error)
                }
                (Kind::Segmenter, ..) => {
                    let segment = table.segment.ok_or_else(|| no_function("segment"))?;
                    step("in segment");
                    segment(self.pointer, services, picture, labels, error)
                }
            }
        };
        step("after the call");
        Ok(status)
    }

    fn kind(&self) -> Kind {
        self.raw.plugin.info().kind
    }

    /// The answer of whoever does not write labels.
    fn answer(&self, score: &[u8], found: &Place, collected: Collected) -> Result<Answer, check::Violation> {
        match self.kind() {
            Kind::Matcher if self.raw.table.search.is_some() => {
                // SAFETY: the place holds a whole struct with its size first.
                let record = unsafe { read_growing(found.0.data().cast_const().cast()) }.unwrap_or_default();
                let found = results::localization(&record, collected.heat);
                check::localization(&found)?;
                Ok(Answer::Pose(Box::new(found)))
            }
            Kind::Matcher => {
                let mut bytes = [0; size_of::<f64>()];
                bytes.copy_from_slice(score);
                let score = f64::from_ne_bytes(bytes);
                check::ratio("score", score)?;
                Ok(Answer::Score(score))
            }
            Kind::Detector => Ok(Answer::Regions(collected.regions)),
            Kind::Estimator | Kind::Segmenter => Ok(Answer::Proposals(collected.proposals)),
        }
    }
}

impl Drop for RawInstance<'_> {
    fn drop(&mut self) {
        if let Some(destroy) = self.raw.table.destroy
            && !self.pointer.is_null()
        {
            self.raw.report.step("in destroy");
            // SAFETY: the instance came from `create` of the same table and is ended here, once.
            unsafe { destroy(self.pointer) };
            self.pointer = null_mut();
            self.raw.report.step("after destroy");
        }
    }
}

/// Pointers of one call beside its inputs.
#[derive(Clone, Copy)]
struct Places {
    services: *const abi::Services,
    results: *const abi::Results,
    score: *mut u8,
    found: *mut u8,
    labels: *const abi::Labels,
    error: *mut abi::ErrorText,
}

fn violated(violation: &check::Violation) -> Finding {
    let check::Violation { field, value, expected } = violation;
    Finding::failed(
        format!("answered {field} = {value}; expected {expected}"),
        "check this value before it is returned; the host drops a run with such an answer",
    )
}
