//! The map in other formats.
