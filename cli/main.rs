//! The resurvey command line.
fn main() {}
