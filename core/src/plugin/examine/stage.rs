//! The toy place that a plugin is tried in; whoever has the real services builds it.

use super::super::services::Services;
use crate::image::LabelImage;
use resurvey_schema::service::Prior;
use resurvey_schema::{Intrinsics, MaterialDescriptor, Pose};

/// Builds the toy place.
pub trait Stage: Sync {
    /// Shows the place through a camera of `width` × `height` pixels; an error says why such a camera cannot be.
    fn show(&self, width: u32, height: u32, act: &mut dyn FnMut(&Place<'_>)) -> Result<(), String>;
}

/// A street whose map, photos and measures are known.
#[derive(Clone, Copy)]
pub struct Place<'a> {
    /// The camera of every photo.
    pub camera: Intrinsics,
    /// Where the photos were taken.
    pub pose: Pose,
    /// Other poses, each with another view.
    pub elsewhere: &'a [Pose],
    /// What the phone thinks.
    pub prior: Prior,
    /// Map and photo show the same.
    pub same: Side<'a>,
    /// The photo shows a banner that the map does not have.
    pub came: Side<'a>,
    /// The map has a banner that the photo does not show.
    pub went: Side<'a>,
    /// Every pixel of the photo is void.
    pub blank: Side<'a>,
    /// The banner of `came` and `went`.
    pub banner: &'a MaterialDescriptor,
}

/// A map and a photo.
#[derive(Clone, Copy)]
pub struct Side<'a> {
    /// The services on the map.
    pub services: &'a dyn Services,
    /// Labels of the photo.
    pub photo: &'a LabelImage,
}
