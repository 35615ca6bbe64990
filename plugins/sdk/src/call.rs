//! The functions that the host calls, for any type that implements a kind.

use crate::abi_host::AbiHost;
use crate::borrow::{self, fill, growing, wrong};
use crate::caught::caught;
use crate::deliver;
use crate::kinds::{Detector, Error, Estimator, Plugin, Scorer, Searcher, Segmenter};
use resurvey_schema::abi::{
    self, ABI_MAJOR, ErrorText, Growing, HostInfo, Instance, STATUS_FAILED, STATUS_OK, STATUS_PANICKED, Status, Table,
    Text,
};

/// What an [`Instance`] pointer of this SDK points to.
struct Held<T> {
    poisoned: bool,
    plugin: T,
}

/// Fills the table of a matcher in `score` form.
pub(crate) unsafe extern "C" fn enter_scorer<T: Scorer>(
    host: *const HostInfo,
    table: *mut Table,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: the host calls its entry as the header says; likewise in the four below.
    unsafe { enter::<T>(host, table, error, Table { score: Some(score::<T>), ..Table::new() }) }
}

/// Fills the table of a matcher in `search` form.
pub(crate) unsafe extern "C" fn enter_searcher<T: Searcher>(
    host: *const HostInfo,
    table: *mut Table,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `enter_scorer`.
    unsafe { enter::<T>(host, table, error, Table { search: Some(search::<T>), ..Table::new() }) }
}

/// Fills the table of a change detector.
pub(crate) unsafe extern "C" fn enter_detector<T: Detector>(
    host: *const HostInfo,
    table: *mut Table,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `enter_scorer`.
    unsafe { enter::<T>(host, table, error, Table { detect: Some(detect::<T>), ..Table::new() }) }
}

/// Fills the table of a descriptor estimator.
pub(crate) unsafe extern "C" fn enter_estimator<T: Estimator>(
    host: *const HostInfo,
    table: *mut Table,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `enter_scorer`.
    unsafe { enter::<T>(host, table, error, Table { estimate: Some(estimate::<T>), ..Table::new() }) }
}

/// Fills the table of a segmenter.
pub(crate) unsafe extern "C" fn enter_segmenter<T: Segmenter>(
    host: *const HostInfo,
    table: *mut Table,
    error: *mut ErrorText,
) -> Status {
    // SAFETY: as in `enter_scorer`.
    unsafe { enter::<T>(host, table, error, Table { segment: Some(segment::<T>), ..Table::new() }) }
}

/// # Safety
/// The arguments are those of an entry function.
unsafe fn enter<T: Plugin>(host: *const HostInfo, to: *mut Table, error: *mut ErrorText, functions: Table) -> Status {
    let table = Table {
        settings_schema: Text::of(T::SETTINGS),
        create: Some(create::<T>),
        destroy: Some(destroy::<T>),
        ..functions
    };
    let body = || {
        // SAFETY: the caller's promise.
        let host = unsafe { growing(host) }?;
        if host.abi_major != ABI_MAJOR {
            return Err(Error(format!("plugin speaks ABI {ABI_MAJOR}, the host ABI {}", host.abi_major)));
        }
        // SAFETY: the caller's promise.
        unsafe { fill(to, &table) }
    };
    // SAFETY: the caller's promise.
    unsafe { finish(error, caught(body)) }
}

/// Turns an outcome into a status, and writes its text.
///
/// # Safety
/// `error` is null or a buffer of the host.
unsafe fn finish(error: *mut ErrorText, outcome: Result<Result<(), Error>, String>) -> Status {
    let (status, text) = match outcome {
        Ok(Ok(())) => return STATUS_OK,
        Ok(Err(Error(text))) => (STATUS_FAILED, text),
        Err(text) => (STATUS_PANICKED, text),
    };
    // SAFETY: the caller's promise.
    let Ok(buffer) = (unsafe { growing(error) }) else { return status };
    if !buffer.data.is_null() {
        let is_end = |length: &usize| text.is_char_boundary(*length);
        let length = (0..=text.len().min(buffer.capacity as usize)).rev().find(is_end).unwrap_or(0);
        // SAFETY: the host lends `capacity` writable bytes, and `length` is not above that.
        unsafe { std::ptr::copy_nonoverlapping(text.as_ptr(), buffer.data, length) };
        // SAFETY: `length` was there in the first version of the struct.
        unsafe { (&raw mut (*error).length).write(length as u32) };
    }
    status
}

unsafe extern "C" fn create<T: Plugin>(settings: Text, to: *mut *mut Instance, error: *mut ErrorText) -> Status {
    let body = || {
        if to.is_null() {
            return wrong("the host handed in no place for the instance");
        }
        // SAFETY: the host lends the text for this call.
        let text = unsafe { borrow::text(settings) }?;
        let settings = serde_json::from_str(text).map_err(|error| Error(format!("settings: {error}")))?;
        let held = Box::new(Held { poisoned: false, plugin: T::create(settings)? });
        // SAFETY: not null, and the host's place for a pointer.
        unsafe { to.write(Box::into_raw(held).cast()) };
        Ok(())
    };
    // SAFETY: the host lends the buffer for this call.
    unsafe { finish(error, caught(body)) }
}

unsafe extern "C" fn destroy<T: Plugin>(instance: *mut Instance) {
    if instance.is_null() {
        return;
    }
    // SAFETY: the pointer came from `create::<T>` and the host gives it back once.
    let held = unsafe { Box::from_raw(instance.cast::<Held<T>>()) };
    if held.poisoned {
        // Whatever a panic left half done is not touched again.
        std::mem::forget(held);
    } else {
        // `destroy` has no place for an error: whoever reads standard error is told.
        if let Err(text) = caught(|| drop(held)) {
            eprintln!("plugin {} panicked in destroy: {text}", T::NAME);
        }
    }
}

/// Runs one call on an instance; after a panic it is not used again.
///
/// # Safety
/// `instance` came from `create::<T>` and nobody else uses it; `error` is null or a buffer of the host.
unsafe fn call<T: Plugin>(
    instance: *mut Instance,
    error: *mut ErrorText,
    body: impl FnOnce(&mut T) -> Result<(), Error>,
) -> Status {
    // SAFETY: the caller's promise.
    let Some(held) = (unsafe { instance.cast::<Held<T>>().as_mut() }) else {
        // SAFETY: the caller's promise.
        return unsafe { finish(error, Ok(wrong("the instance is null"))) };
    };
    let outcome = if held.poisoned {
        Err("this instance panicked in an earlier call".to_owned())
    } else {
        caught(|| body(&mut held.plugin))
    };
    held.poisoned |= outcome.is_err();
    // SAFETY: the caller's promise.
    unsafe { finish(error, outcome) }
}

unsafe extern "C" fn score<T: Scorer>(
    instance: *mut Instance,
    photo: *const abi::Image,
    view: *const abi::View,
    to: *mut f64,
    error: *mut ErrorText,
) -> Status {
    let body = |plugin: &mut T| {
        // SAFETY: the host lends an image for this call.
        let photo = match unsafe { photo.as_ref() } {
            // SAFETY: as above.
            Some(photo) => unsafe { borrow::image(photo) }?,
            None => return wrong("the photo is null"),
        };
        // SAFETY: the host lends the view for this call.
        let score = plugin.score(photo, &unsafe { borrow::view(view) }?)?;
        // SAFETY: null or the host's place for a number.
        match unsafe { to.as_mut() } {
            Some(to) => *to = score,
            None => return wrong("there is no place for the score"),
        }
        Ok(())
    };
    // SAFETY: the host calls as the header says.
    unsafe { call(instance, error, body) }
}

unsafe extern "C" fn search<T: Searcher>(
    instance: *mut Instance,
    services: *const abi::Services,
    photo: *const abi::Photo,
    results: *const abi::Results,
    to: *mut abi::Localization,
    error: *mut ErrorText,
) -> Status {
    let body = |plugin: &mut T| {
        // SAFETY: the host lends services, photo and results for this call.
        let (host, photo) = unsafe { (AbiHost::new(services)?, borrow::photo(photo)?) };
        let found = plugin.search(&host, &photo)?;
        // SAFETY: as above.
        unsafe { deliver::heat(results, &found.heat) }?;
        // SAFETY: the host's place for the answer.
        unsafe { fill(to, &deliver::localization_record(&found)) }
    };
    // SAFETY: the host calls as the header says.
    unsafe { call(instance, error, body) }
}

unsafe extern "C" fn detect<T: Detector>(
    instance: *mut Instance,
    services: *const abi::Services,
    comparison: *const abi::Comparison,
    results: *const abi::Results,
    error: *mut ErrorText,
) -> Status {
    let body = |plugin: &mut T| {
        // SAFETY: the host lends services, comparison and results for this call.
        let (host, comparison) = unsafe { (AbiHost::new(services)?, borrow::comparison(comparison)?) };
        let found = plugin.detect(&host, &comparison)?;
        // SAFETY: as above.
        unsafe { deliver::regions(results, &found) }
    };
    // SAFETY: the host calls as the header says.
    unsafe { call(instance, error, body) }
}

unsafe extern "C" fn estimate<T: Estimator>(
    instance: *mut Instance,
    services: *const abi::Services,
    comparison: *const abi::Comparison,
    regions: *const abi::Region,
    count: usize,
    step: usize,
    results: *const abi::Results,
    error: *mut ErrorText,
) -> Status {
    let body = |plugin: &mut T| {
        // SAFETY: the host lends services, comparison, regions and results for this call.
        let (host, comparison) = unsafe { (AbiHost::new(services)?, borrow::comparison(comparison)?) };
        // SAFETY: as above.
        let regions = unsafe { borrow::regions(regions, count, step) }?;
        let found = plugin.estimate(&host, &comparison, &regions)?;
        // SAFETY: as above.
        unsafe { deliver::proposals(results, &found) }
    };
    // SAFETY: the host calls as the header says.
    unsafe { call(instance, error, body) }
}

unsafe extern "C" fn segment<T: Segmenter>(
    instance: *mut Instance,
    services: *const abi::Services,
    picture: *const abi::Picture,
    labels: *const abi::Labels,
    error: *mut ErrorText,
) -> Status {
    let body = |plugin: &mut T| {
        // SAFETY: the host lends services and picture for this call.
        let (host, picture) = unsafe { (AbiHost::new(services)?, growing(picture)?) };
        // SAFETY: as above: what a picture points to lives with it.
        let photo = unsafe { borrow::image(&picture.pixels) }?;
        let found = plugin.segment(&host, photo)?;
        // SAFETY: the host lends the place for this call.
        unsafe { deliver::labels(labels, (photo.width(), photo.height()), &found) }
    };
    // SAFETY: the host calls as the header says.
    unsafe { call(instance, error, body) }
}
