//! Change detector on class differences.
#![forbid(unsafe_code)]
