//! The tables of a map file. A released file never changes: a new format is a new migration.

/// `application_id` of a map file: the letters `RSVY`.
pub const APPLICATION_ID: i32 = 0x5253_5659;

/// Migrations in order; a file with `user_version` n has had the first n of them.
pub const MIGRATIONS: &[&str] = &[
    include_str!("../sql/0001_map.sql"),
    include_str!("../sql/0002_history.sql"),
    include_str!("../sql/0003_index.sql"),
    include_str!("../sql/0004_seals.sql"),
];

/// The index of the newest format for one connection to an older map.
pub const INDEX_BESIDE: &str = include_str!("../sql/index_beside.sql");

/// Takes it away again.
pub const INDEX_BESIDE_END: &str = include_str!("../sql/index_beside_end.sql");
