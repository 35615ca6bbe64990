//! Invented places with known truth: segmented models, captures of them, and what was changed. Everything follows from
//! a seed. Photos are cast ray by ray over the generator's own boxes, never by the product's renderer, so that the truth
//! stays independent of what it judges. The layout on disk and the meaning of every number are those of the project's
//! scored captures (`docs/accuracy.md`).
#![allow(dead_code, unused_imports, reason = "examples, tests and benches each use a part of this module")]

pub mod camera;
pub mod capture;
pub mod caster;
pub mod change;
pub mod clutter;
pub mod cut;
pub mod facade;
pub mod glb;
pub mod hall;
pub mod hide;
pub mod kind;
pub mod label_png;
pub mod model;
pub mod noise;
pub mod photo;
pub mod placing;
pub mod prior;
pub mod random;
pub mod replace;
pub mod scene;
pub mod second;
pub mod seen;
pub mod street;
pub mod suite;
pub mod three_ds;
pub mod together;
pub mod truth;
pub mod world;

pub use capture::{Case, CaseSpec};
pub use kind::ChangeKind;
pub use noise::NoiseLevel;
pub use photo::Photo;
pub use scene::{Scene, SceneKind};
pub use suite::{
    Changes, Suite, every_suite, full_suite, write_case, write_map, write_suite, write_suite_with_seconds,
};
pub use truth::{TrueChange, Truth};
