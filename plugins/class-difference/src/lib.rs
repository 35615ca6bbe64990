//! Change detector on class differences (Lee & Hsu, §3.6, Eq. 8), and what a pose and a segmenter that are both a
//! little wrong ask for beyond it.
//!
//! A pixel is a change when photo and view have different classes there **and** the view has the photo's class nowhere
//! within reach of the pose error ([`tolerance`], [`realign`]); changed pixels of one photo class that touch are one
//! region ([`region`]); descriptors that the map shows are judged as a whole ([`removal`]). With `profile = paper` it is
//! Eq. 8 alone ([`pairs`]).
#![forbid(unsafe_code)]

pub mod components;
pub mod detector;
pub mod hidden;
pub mod judge;
pub mod pairs;
pub mod raster;
pub mod realign;
pub mod region;
pub mod removal;
pub mod settings;
pub mod tolerance;
pub mod uncovered;

pub use detector::ClassDifference;
pub use settings::Settings;

resurvey_plugin::export_detector!(ClassDifference);
