//! The plugin's end of the wire: calls of the host, made on a library.
#![allow(unsafe_code)]

use super::asking::Asking;
use super::memory::SharedMemory;
use super::translate;
use super::wire::{Silence, Wire};
use crate::plugin::error::PluginError;
use crate::plugin::instance::Instance;
use crate::plugin::lend::{self, LentComparison};
use crate::plugin::line;
use resurvey_schema::abi::{self, Growing};
use resurvey_schema::service::ViewFeature;
use resurvey_schema::wire::{
    Array, DetectCall, Dtype, EstimateCall, ScoreCall, SearchCall, SegmentCall, ToHost, ToPlugin, WireRegion, WireViews,
};
use std::io;
use std::sync::{Mutex, MutexGuard, PoisonError};

/// Wire and memory.
pub(super) struct Ends {
    pub(super) wire: Wire,
    pub(super) memory: SharedMemory,
}

/// Both, for all threads of the plugin.
pub(super) struct Talk {
    ends: Mutex<Ends>,
    /// The same memory for what is read and counted without a lock.
    flags: SharedMemory,
}

/// The host lent something that is not there: a bug, which the plugin never sees.
fn not_lent(what: &str) -> PluginError {
    PluginError::InvalidInput { plugin: "of this process".to_owned(), text: format!("{what} is not in the memory") }
}

impl Talk {
    pub(super) fn new(ends: Ends) -> io::Result<Self> {
        let flags = SharedMemory::open(ends.memory.file()?)?;
        Ok(Self { ends: Mutex::new(ends), flags })
    }

    pub(super) fn lock(&self) -> MutexGuard<'_, Ends> {
        self.ends.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Says one message.
    pub(super) fn say(&self, message: &ToHost) -> Result<(), Silence> {
        self.lock().wire.send(message, || true)
    }

    /// The next message.
    pub(super) fn hear(&self) -> Result<ToPlugin, Silence> {
        self.lock().wire.receive()
    }

    /// Whether the call is to end.
    pub(super) fn cancelled(&self) -> bool {
        self.flags.cancelled()
    }

    /// Makes one call.
    pub(super) fn call(&self, instance: &mut Instance, call: &ToPlugin) -> Result<ToHost, PluginError> {
        match call {
            ToPlugin::Score(call) => self.score(instance, call),
            ToPlugin::Search(call) => self.search(instance, call),
            ToPlugin::Detect(call) => self.detect(instance, call),
            ToPlugin::Estimate(call) => self.estimate(instance, call),
            ToPlugin::Segment(call) => self.segment(instance, call),
            _ => Err(not_lent("the call")),
        }
    }

    /// Maps what a call lends.
    fn follow(&self, bytes: usize) -> Result<(), PluginError> {
        let memory = &mut self.lock().memory;
        memory.forget_older();
        memory.follow(bytes).map_err(|error| not_lent(&error.to_string()))
    }

    fn score(&self, instance: &mut Instance, call: &ScoreCall) -> Result<ToHost, PluginError> {
        self.follow(call.memory)?;
        let count = *call.scores.shape.first().unwrap_or(&0);
        for index in 0..count {
            if self.cancelled() {
                return Ok(ToHost::Cancelled {});
            }
            let (photo, view) = {
                let memory = &self.lock().memory;
                (image(memory, &call.photo, None)?, view(memory, &call.views, index)?)
            };
            // SAFETY: both point into the map, which stays until the next call.
            let score = unsafe { line::score(instance, &photo, &view) }?;
            let offset = call.scores.offset.saturating_add(index * size_of::<f64>());
            if !self.lock().memory.write(offset, &[score]) {
                return Err(not_lent("the place for the scores"));
            }
            self.flags.count_scored();
        }
        Ok(ToHost::Done { localization: None })
    }

    fn search(&self, instance: &mut Instance, call: &SearchCall) -> Result<ToHost, PluginError> {
        self.follow(call.memory)?;
        let labels = image(&self.lock().memory, &call.photo, None)?;
        let (camera, prior) = (translate::intrinsics(&call.camera), translate::prior(&call.prior));
        let (camera, prior) = (lend::camera(&camera), lend::prior(&prior));
        let photo = abi::Photo { labels, camera: &raw const camera, prior: &raw const prior, ..abi::Photo::new() };
        let asking = Asking::new(self, call.scratch, &call.classes)?;
        // SAFETY: the photo points into the map, which stays until the next call, and to values of this function.
        let found = unsafe { line::search(instance, &asking, &photo) }?;
        asking.deliver_heat(&found.heat)?;
        Ok(ToHost::Done { localization: Some(Box::new(translate::wire_localization(&found))) })
    }

    fn detect(&self, instance: &mut Instance, call: &DetectCall) -> Result<ToHost, PluginError> {
        let lent = comparison(self, call)?;
        let asking = Asking::new(self, call.scratch, &call.classes)?;
        // SAFETY: as in `search`; `lent` lives in this function.
        let regions = unsafe { line::detect(instance, &asking, &lent.record()) }?;
        asking.deliver_regions(&regions)?;
        Ok(ToHost::Done { localization: None })
    }

    fn estimate(&self, instance: &mut Instance, call: &EstimateCall) -> Result<ToHost, PluginError> {
        let lent = comparison(self, &call.comparison)?;
        let records = {
            let memory = &self.lock().memory;
            call.regions.iter().map(|one| region(memory, one)).collect::<Result<Vec<_>, _>>()?
        };
        let asking = Asking::new(self, call.comparison.scratch, &call.comparison.classes)?;
        // SAFETY: as in `detect`.
        let proposals = unsafe { line::estimate(instance, &asking, &lent.record(), &records) }?;
        asking.deliver_proposals(&proposals)?;
        Ok(ToHost::Done { localization: None })
    }

    fn segment(&self, instance: &mut Instance, call: &SegmentCall) -> Result<ToHost, PluginError> {
        self.follow(call.memory)?;
        let pixels = image(&self.lock().memory, &call.photo, None)?;
        let picture = abi::Picture { pixels, ..abi::Picture::new() };
        let asking = Asking::new(self, call.scratch, &call.classes)?;
        // SAFETY: as in `search`.
        let labels = unsafe { line::segment(instance, &asking, &picture) }?;
        if !self.lock().memory.write(call.labels.offset, labels.values()) {
            return Err(not_lent("the place for the labels"));
        }
        Ok(ToHost::Done { localization: None })
    }
}

/// What a comparison points to, in the memory.
fn comparison(talk: &Talk, call: &DetectCall) -> Result<LentComparison, PluginError> {
    talk.follow(call.memory)?;
    let memory = &talk.lock().memory;
    Ok(LentComparison {
        photo: image(memory, &call.photo, None)?,
        view: view(memory, &call.views, 0)?,
        camera: lend::camera(&translate::intrinsics(&call.camera)),
        estimate: lend::estimate(&translate::estimate(&call.estimate)),
    })
}

/// An image of the memory: the whole array, or number `index` of a stack.
fn image(memory: &SharedMemory, array: &Array, index: Option<usize>) -> Result<abi::Image, PluginError> {
    let missing = || not_lent("an image");
    let (shape, strides) = (&array.shape[..], &array.strides[..]);
    let skipped = usize::from(index.is_some());
    let (Some([height, width]), Some(row_bytes)) = (shape.get(skipped..skipped + 2), strides.get(skipped)) else {
        return Err(missing());
    };
    let start = match index {
        Some(index) if index < shape[0] => index.checked_mul(strides[0]).and_then(|at| at.checked_add(array.offset)),
        Some(_) => None,
        None => Some(array.offset),
    };
    let bytes = row_bytes.checked_mul(*height);
    let place = start.zip(bytes).and_then(|(start, bytes)| memory.place(start, bytes));
    let (width, height) = (u32::try_from(*width).ok(), u32::try_from(*height).ok());
    match (place, width, height) {
        (Some(place), Some(width), Some(height)) => {
            Ok(abi::Image { data: place.cast_const().cast(), width, height, row_bytes: *row_bytes })
        }
        _ => Err(missing()),
    }
}

/// View `index` of a stack.
fn view(memory: &SharedMemory, views: &WireViews, index: usize) -> Result<abi::View, PluginError> {
    let mut origin = [f64::NAN; 3];
    let row = size_of_val(&origin);
    if !memory.read_into(views.origins.offset.saturating_add(index.saturating_mul(row)), &mut origin) {
        return Err(not_lent("the origin of a view"));
    }
    let table = &views.feature_table;
    let feature_count = *table.shape.first().unwrap_or(&0);
    let bytes = Array::packed_bytes(Dtype::ViewFeature, &[feature_count]);
    let place = bytes.and_then(|bytes| memory.place(table.offset, bytes));
    Ok(abi::View {
        origin,
        labels: image(memory, &views.labels, Some(index))?,
        range_m: image(memory, &views.range_m, Some(index))?,
        points: image(memory, &views.points, Some(index))?,
        features: image(memory, &views.features, Some(index))?,
        feature_table: place.ok_or_else(|| not_lent("the feature table"))?.cast_const().cast::<ViewFeature>(),
        feature_count,
        ..abi::View::new()
    })
}

fn region(memory: &SharedMemory, region: &WireRegion) -> Result<abi::Region, PluginError> {
    let mask_length = Array::packed_bytes(Dtype::U8, &region.mask.shape).unwrap_or(usize::MAX);
    let mask = memory.place(region.mask.offset, mask_length).ok_or_else(|| not_lent("the mask of a region"))?;
    let [left, top, right, bottom] = region.bounds;
    Ok(abi::Region {
        class_before: region.class_before,
        class_after: region.class_after,
        left,
        top,
        right,
        bottom,
        pixels: region.pixels,
        mask: mask.cast_const(),
        mask_length,
        ..abi::Region::new()
    })
}
