//! The map file: versions, features, observations in SQLite. All SQL of the project is here.
