//! What a map is after its writer was killed, its disk failed or filled up, its log was lost, or bits of it flipped: at
//! the old version or the new one, and whole; or what is wrong is found. Through the built binary.
//!
//! Every write and sync of every command fails in turn. Of bits that flip and of lengths of a log a sample is taken;
//! `cargo test --test faults -- --ignored` takes thousands of bits and every length, which is hours.
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test's helpers may fail loudly")]

#[path = "faults/bits.rs"]
mod bits;
#[path = "common/mod.rs"]
mod common;
#[path = "faults/job.rs"]
mod job;
#[path = "faults/log.rs"]
mod log;
#[path = "faults/observed.rs"]
mod observed;
#[path = "faults/strace.rs"]
mod strace;
#[path = "../examples/synthetic/mod.rs"]
mod synthetic;
#[path = "faults/writes.rs"]
mod writes;
