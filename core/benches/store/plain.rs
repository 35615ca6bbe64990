//! The obvious design to compare with: the same rows under an R*Tree of their boxes alone, and the version as a filter.

use resurvey_core::version::{BoxMm, VersionId};
use rusqlite::{Connection, named_params};
use std::path::Path;

const COPY: &str = "PRAGMA journal_mode = WAL; PRAGMA cache_size = -65536;
    ATTACH :map AS map;
    CREATE TABLE feature (id INTEGER PRIMARY KEY, fid INTEGER, from_version INTEGER, to_version INTEGER, state BLOB);
    CREATE VIRTUAL TABLE place USING rtree_i32 (id, e0, e1, n0, n1, h0, h1);
    BEGIN;
    INSERT INTO feature SELECT id, fid, from_version, to_version, state FROM map.feature_version ORDER BY id;
    INSERT INTO place SELECT id, e0, e1, n0, n1, h0, h1 FROM map.feature_index ORDER BY id;
    COMMIT;";
const QUERY: &str = "SELECT f.id, f.fid, f.from_version, f.to_version, f.state
    FROM place AS p CROSS JOIN feature AS f ON f.id = p.id
    WHERE p.e0 <= :e1 AND p.e1 >= :e0 AND p.n0 <= :n1 AND p.n1 >= :n0
        AND f.from_version <= :version AND (f.to_version IS NULL OR f.to_version > :version) ORDER BY f.fid";

/// A copy of a map's features in the obvious design.
pub struct Plain(Connection);

impl Plain {
    /// Copies the map at `map` into a new file at `path`.
    pub fn copy_of(map: &Path, path: &Path) -> Self {
        let connection = Connection::open(path).expect("a new file");
        let name = map.to_str().expect("a Unicode path").replace('\'', "''");
        connection.execute_batch(&COPY.replace(":map", &format!("'{name}'"))).expect("the rows are copied");
        Self(connection)
    }

    /// How many features lay in `region` at `version`; reads their states as the store does, but decodes none.
    pub fn features_in(&self, region: &BoxMm, version: VersionId) -> usize {
        let ([e0, n0, _], [e1, n1, _]) = (region.min(), region.max());
        let mut statement = self.0.prepare_cached(QUERY).expect("valid SQL");
        let parameters = named_params! {":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":version": version.0 as i64};
        let mut rows = statement.query(parameters).expect("a query");
        let mut states = Vec::new();
        while let Some(row) = rows.next().expect("a row") {
            states.push(row.get::<_, Vec<u8>>(4).expect("a state"));
        }
        states.len()
    }
}
