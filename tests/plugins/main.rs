//! Plugins written with the SDK, called by the host: linked in and as libraries.
#![allow(clippy::unwrap_used, clippy::panic)] // also in the helpers of a test

mod answers;
mod libraries;
mod scene;
mod services;
