//! Other designs to compare with, over the same rows: R*Trees of boxes, with the version as a filter or as a fourth axis.

use resurvey_core::version::{BoxMm, FeatureState, VersionId};
use rusqlite::{Connection, named_params, params};
use std::path::Path;

const TABLE: &str = "PRAGMA journal_mode = WAL; PRAGMA synchronous = OFF; PRAGMA cache_size = -65536;
    CREATE TABLE feature (id INTEGER PRIMARY KEY, fid INTEGER, from_version INTEGER, to_version INTEGER, state BLOB);";
/// Upper end of the fourth axis of what is live.
const LIVE: i64 = i32::MAX as i64;

/// How a design puts rows into its R*Tree and finds them there.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Design {
    /// The obvious one: boxes in an R*Tree, versions as a filter on the rows.
    VersionFilter,
    /// What format 2 of the map had: the first and last version are a fourth axis, on which one version is as long as so
    /// many millimetres are on the others.
    FourthAxis { version_mm: i64 },
}

/// A copy of a map's features in another design.
pub struct Copy {
    connection: Connection,
    design: Design,
}

impl Copy {
    /// Copies the map at `map` into a new file at `path`, as its versions would have written the rows.
    pub fn of(map: &Path, path: &Path, design: Design) -> Self {
        let copy = Self { connection: Connection::open(path).expect("a new file"), design };
        copy.connection.execute_batch(TABLE).expect("valid SQL");
        copy.connection.execute_batch(design.tree()).expect("valid SQL");
        copy.connection.execute_batch("BEGIN").expect("a transaction");
        copy.fill(&Connection::open(map).expect("the map opens"));
        copy.connection.execute_batch("COMMIT").expect("the rows are copied");
        copy
    }

    fn fill(&self, map: &Connection) {
        const ROWS: &str = "SELECT id, fid, from_version, to_version, state FROM feature_version ORDER BY id";
        const ENDED: &str = "SELECT id, to_version FROM feature_version WHERE to_version = ?1 ORDER BY id";
        let mut statement = map.prepare(ROWS).expect("valid SQL");
        let mut ended = map.prepare(ENDED).expect("valid SQL");
        let mut rows = statement.query([]).expect("rows");
        let mut version = 0;
        while let Some(row) = rows.next().expect("a row") {
            let (id, from): (i64, i64) = (row.get(0).expect("an id"), row.get(2).expect("a version"));
            while version < from {
                version += 1;
                let mut ends = ended.query([version]).expect("rows");
                while let Some(row) = ends.next().expect("a row") {
                    self.end(row.get(0).expect("an id"), version);
                }
            }
            let state: Vec<u8> = row.get(4).expect("a state");
            let bounds = FeatureState::from_bytes(&state).expect("a state").bounds().expect("a box");
            let (fid, to): (i64, Option<i64>) = (row.get(1).expect("a number"), row.get(3).expect("a version"));
            const ROW: &str = "INSERT INTO feature VALUES (?1, ?2, ?3, ?4, ?5)";
            self.connection
                .prepare_cached(ROW)
                .expect("valid SQL")
                .execute(params![id, fid, from, to, state])
                .expect("room");
            self.begin(id, &bounds, from);
        }
    }

    fn begin(&self, id: i64, bounds: &BoxMm, version: i64) {
        let ([e0, n0, h0], [e1, n1, h1]) = (bounds.min(), bounds.max());
        let written = match self.design {
            Design::VersionFilter => self
                .connection
                .prepare_cached("INSERT INTO place VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7)")
                .and_then(|mut insert| insert.execute(params![id, e0, e1, n0, n1, h0, h1])),
            Design::FourthAxis { version_mm } => self
                .connection
                .prepare_cached("INSERT INTO place VALUES (?1, ?2, ?3, ?4, ?5, ?6, ?7, ?8, ?9)")
                .and_then(|mut insert| insert.execute(params![id, e0, e1, n0, n1, h0, h1, version * version_mm, LIVE])),
        };
        written.expect("a box");
    }

    fn end(&self, id: i64, version: i64) {
        if let Design::FourthAxis { version_mm } = self.design {
            let update = self.connection.prepare_cached("UPDATE place SET v1 = ?2 WHERE id = ?1");
            update.and_then(|mut update| update.execute([id, version * version_mm - 1])).expect("a box");
        }
    }

    /// How many features lay in `region` at `version`; reads their states as the store does, but decodes none.
    pub fn features_in(&self, region: &BoxMm, version: VersionId) -> usize {
        let condition = match self.design {
            Design::VersionFilter => {
                "f.from_version <= :version AND (f.to_version IS NULL OR f.to_version > :version) AND :on_axis IS NULL"
            }
            Design::FourthAxis { .. } => "p.v0 <= :on_axis AND p.v1 >= :on_axis AND :version >= 0",
        };
        let on_axis = match self.design {
            Design::VersionFilter => None,
            Design::FourthAxis { version_mm } => Some(version.0 as i64 * version_mm),
        };
        let sql = format!(
            "SELECT f.id, f.fid, f.from_version, f.to_version, f.state
            FROM place AS p CROSS JOIN feature AS f ON f.id = p.id
            WHERE p.e0 <= :e1 AND p.e1 >= :e0 AND p.n0 <= :n1 AND p.n1 >= :n0 AND {condition} ORDER BY f.fid"
        );
        let ([e0, n0, _], [e1, n1, _]) = (region.min(), region.max());
        let mut statement = self.connection.prepare_cached(&sql).expect("valid SQL");
        let parameters = named_params! {
            ":e0": e0, ":e1": e1, ":n0": n0, ":n1": n1, ":version": version.0 as i64, ":on_axis": on_axis,
        };
        let mut rows = statement.query(parameters).expect("rows");
        let mut states = Vec::new();
        while let Some(row) = rows.next().expect("a row") {
            states.push(row.get::<_, Vec<u8>>(4).expect("a state"));
        }
        states.len()
    }
}

impl Design {
    fn tree(self) -> &'static str {
        match self {
            Self::VersionFilter => "CREATE VIRTUAL TABLE place USING rtree_i32 (id, e0, e1, n0, n1, h0, h1);",
            Self::FourthAxis { .. } => {
                "CREATE VIRTUAL TABLE place USING rtree_i32 (id, e0, e1, n0, n1, h0, h1, v0, v1);"
            }
        }
    }
}
