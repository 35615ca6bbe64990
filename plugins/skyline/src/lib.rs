//! VPS matcher on the skyline alone.
#![forbid(unsafe_code)]
