//! The functions of a plugin, filled in by its entry.

use super::call::{Comparison, Photo, Picture, View};
use super::record::{Image, Labels, Text};
use super::result::{Localization, Region, Results};
use super::{Services, Status};

/// An instance of a plugin: opaque, never called from two threads at once, may move between threads.
#[derive(Debug)]
#[repr(C)]
pub struct Instance {
    private: [u8; 0],
}

/// What the host says of itself to the entry function.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct HostInfo {
    /// Bytes of this struct.
    pub size: u32,
    /// Major version of the line that the host speaks.
    pub abi_major: u16,
    /// Minor version.
    pub abi_minor: u16,
    /// Version of the program, for messages alone.
    pub version: Text,
}

/// A buffer of the caller for the text of an error. What does not fit is cut at a character.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct ErrorText {
    /// Bytes of this struct.
    pub size: u32,
    /// Bytes in `data`.
    pub capacity: u32,
    /// Bytes written: the callee sets it.
    pub length: u32,
    /// Zero.
    pub reserved: u32,
    /// UTF-8, without a terminator.
    pub data: *mut u8,
}

/// The functions of a plugin. The host hands it in zeroed with `size` set; what a kind does not need stays null. The last
/// argument takes the text of an error and may be null.
#[derive(Clone, Copy, Debug, Default)]
#[repr(C)]
pub struct Table {
    /// Bytes of this struct, set by the host and left alone by the plugin.
    pub size: u32,
    /// Zero.
    pub reserved: u32,
    /// JSON schema of the settings; lives as long as the library.
    pub settings_schema: Text,
    /// Makes an instance from complete, checked settings (a JSON object).
    pub create: Option<unsafe extern "C" fn(settings: Text, instance: *mut *mut Instance, *mut ErrorText) -> Status>,
    /// Ends an instance; null is allowed.
    pub destroy: Option<unsafe extern "C" fn(*mut Instance)>,
    /// Matcher in `score` form: similarity of photo and view, 0–1.
    pub score: Option<
        unsafe extern "C" fn(
            *mut Instance,
            photo: *const Image,
            view: *const View,
            score: *mut f64,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Matcher in `search` form.
    pub search: Option<
        unsafe extern "C" fn(
            *mut Instance,
            *const Services,
            *const Photo,
            *const Results,
            *mut Localization,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Change detector.
    pub detect: Option<
        unsafe extern "C" fn(
            *mut Instance,
            *const Services,
            *const Comparison,
            *const Results,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Descriptor estimator; regions lie `region_step` bytes apart.
    pub estimate: Option<
        unsafe extern "C" fn(
            *mut Instance,
            *const Services,
            *const Comparison,
            regions: *const Region,
            region_count: usize,
            region_step: usize,
            *const Results,
            *mut ErrorText,
        ) -> Status,
    >,
    /// Segmenter: fills the labels, each a class of the map or 255.
    pub segment: Option<
        unsafe extern "C" fn(*mut Instance, *const Services, *const Picture, *const Labels, *mut ErrorText) -> Status,
    >,
}
