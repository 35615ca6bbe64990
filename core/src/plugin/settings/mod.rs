//! Settings of a plugin: checked against its schema and completed with its defaults before it is made.

mod schema;
mod values;

pub use schema::{Setting, SettingsError, SettingsSchema, ValueType};
pub use values::{Assignment, Settings};
