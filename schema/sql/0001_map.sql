-- A map, format 1: one SQLite file. docs/file-format.md says what each value means byte by byte.
-- Times are microseconds since 1970-01-01T00:00:00Z. Lengths are millimetres. Digests are SHA-256, 32 bytes.

PRAGMA application_id = 1381193305; -- 'RSVY'

CREATE TABLE meta (
    only_row INTEGER PRIMARY KEY CHECK (only_row = 1),
    format TEXT NOT NULL,
    map_id TEXT NOT NULL,
    crs TEXT NOT NULL,
    vertical_datum TEXT NOT NULL,
    created_at INTEGER NOT NULL,
    -- Subtracted from eastings and northings in feature_index, so that 32 bits reach; set with the first feature.
    index_e0 INTEGER,
    index_n0 INTEGER,
    CHECK ((index_e0 IS NULL) = (index_n0 IS NULL))
) STRICT;

-- History: dense numbers from 0, a total order. Rows never change.
CREATE TABLE version (
    version INTEGER PRIMARY KEY CHECK (version BETWEEN 0 AND 2147483646),
    kind TEXT NOT NULL CHECK (kind IN ('init', 'import', 'update', 'revert', 'apply', 'merge')),
    committed_at INTEGER NOT NULL,
    observed_at INTEGER,
    author TEXT NOT NULL,
    message TEXT NOT NULL,
    base_version INTEGER REFERENCES version (version),
    reverts INTEGER REFERENCES version (version),
    added INTEGER NOT NULL CHECK (added >= 0),
    modified INTEGER NOT NULL CHECK (modified >= 0),
    removed INTEGER NOT NULL CHECK (removed >= 0),
    -- Envelope of everything the version changed; null when it changed no feature.
    e0 INTEGER, e1 INTEGER, n0 INTEGER, n1 INTEGER, h0 INTEGER, h1 INTEGER,
    idempotency_key TEXT UNIQUE,
    evidence BLOB CHECK (length(evidence) = 32),
    hash BLOB NOT NULL CHECK (length(hash) = 32),
    CHECK (base_version < version),
    CHECK (reverts < version)
) STRICT;

CREATE INDEX version_committed_at ON version (committed_at);

-- The whole class table at every version that changed it.
CREATE TABLE class (
    from_version INTEGER NOT NULL REFERENCES version (version),
    class INTEGER NOT NULL CHECK (class BETWEEN 0 AND 254),
    name TEXT NOT NULL,
    red INTEGER NOT NULL CHECK (red BETWEEN 0 AND 255),
    green INTEGER NOT NULL CHECK (green BETWEEN 0 AND 255),
    blue INTEGER NOT NULL CHECK (blue BETWEEN 0 AND 255),
    kind TEXT NOT NULL CHECK (kind IN ('material', 'dynamic', 'ignored')),
    along_m REAL,
    across_m REAL,
    up_m REAL,
    PRIMARY KEY (from_version, class)
) STRICT, WITHOUT ROWID;

-- Meshes with their label textures, once each, under the digest of the bytes as stored.
CREATE TABLE geometry (
    digest BLOB PRIMARY KEY CHECK (length(digest) = 32),
    bytes BLOB NOT NULL
) STRICT;

-- One row per feature and life span [from_version, to_version); to_version is null while the row is live.
CREATE TABLE feature_version (
    id INTEGER PRIMARY KEY,
    fid INTEGER NOT NULL CHECK (fid BETWEEN 1 AND 9007199254740991),
    from_version INTEGER NOT NULL REFERENCES version (version),
    to_version INTEGER REFERENCES version (version),
    kind TEXT NOT NULL CHECK (kind IN ('object', 'material', 'dynamic')),
    class INTEGER CHECK (class BETWEEN 0 AND 254),
    geometry BLOB REFERENCES geometry (digest),
    state BLOB NOT NULL,
    CHECK (to_version > from_version),
    CHECK ((kind = 'object') = (geometry IS NOT NULL)),
    CHECK ((kind = 'object') = (class IS NULL))
) STRICT;

CREATE UNIQUE INDEX feature_version_live ON feature_version (fid) WHERE to_version IS NULL;
CREATE UNIQUE INDEX feature_version_life ON feature_version (fid, from_version);
CREATE INDEX feature_version_begin ON feature_version (from_version);
CREATE INDEX feature_version_end ON feature_version (to_version) WHERE to_version IS NOT NULL;
CREATE INDEX feature_version_geometry ON feature_version (geometry) WHERE geometry IS NOT NULL;

-- The box of every row of feature_version and the versions it lived in, both ends inclusive; v1 is 2147483647 while live.
CREATE VIRTUAL TABLE feature_index USING rtree_i32 (id, e0, e1, n0, n1, h0, h1, v0, v1);

-- Every attempt to update the map, the refused ones too. version is null for an attempt that made none.
CREATE TABLE observation (
    id INTEGER PRIMARY KEY,
    version INTEGER UNIQUE REFERENCES version (version),
    base_version INTEGER NOT NULL REFERENCES version (version),
    recorded_at INTEGER NOT NULL,
    capture BLOB NOT NULL CHECK (length(capture) = 32),
    decision TEXT NOT NULL,
    labels BLOB CHECK (length(labels) = 32),
    body TEXT NOT NULL,
    digest BLOB NOT NULL CHECK (length(digest) = 32)
) STRICT;

CREATE INDEX observation_capture ON observation (capture);

-- Label images of observations. A row may be missing although an observation names it: keeping images is optional.
CREATE TABLE label_image (
    digest BLOB PRIMARY KEY CHECK (length(digest) = 32),
    bytes BLOB NOT NULL
) STRICT;

-- Updates that wait for review; operations are deltas against base_version.
CREATE TABLE proposal (
    id INTEGER PRIMARY KEY,
    base_version INTEGER NOT NULL REFERENCES version (version),
    kind TEXT NOT NULL CHECK (kind IN ('import', 'update', 'revert', 'apply', 'merge')),
    proposed_at INTEGER NOT NULL,
    observed_at INTEGER,
    author TEXT NOT NULL,
    message TEXT NOT NULL,
    idempotency_key TEXT,
    -- What was looked at; null when the proposal does not depend on it.
    e0 INTEGER, e1 INTEGER, n0 INTEGER, n1 INTEGER, h0 INTEGER, h1 INTEGER,
    operations BLOB NOT NULL,
    observation INTEGER REFERENCES observation (id),
    status TEXT NOT NULL CHECK (status IN ('open', 'accepted', 'rejected')),
    decided_at INTEGER,
    decided_by TEXT,
    note TEXT,
    version INTEGER REFERENCES version (version),
    CHECK ((status = 'open') = (decided_at IS NULL)),
    CHECK ((status = 'accepted') = (version IS NOT NULL))
) STRICT;

CREATE INDEX proposal_open ON proposal (id) WHERE status = 'open';

CREATE TABLE tag (
    name TEXT PRIMARY KEY,
    version INTEGER NOT NULL REFERENCES version (version),
    tagged_at INTEGER NOT NULL
) STRICT, WITHOUT ROWID;

-- History is written once: only an open life span may end, and only once.
CREATE TRIGGER version_is_final BEFORE UPDATE ON version
BEGIN SELECT RAISE (ABORT, 'a version never changes'); END;
CREATE TRIGGER version_is_kept BEFORE DELETE ON version
BEGIN SELECT RAISE (ABORT, 'a version is never deleted'); END;
CREATE TRIGGER feature_version_is_final
BEFORE UPDATE OF id, fid, from_version, kind, class, geometry, state ON feature_version
BEGIN SELECT RAISE (ABORT, 'only the end of a life span changes'); END;
CREATE TRIGGER feature_version_ends_once BEFORE UPDATE OF to_version ON feature_version WHEN OLD.to_version IS NOT NULL
BEGIN SELECT RAISE (ABORT, 'a life span ends once'); END;
CREATE TRIGGER feature_version_is_kept BEFORE DELETE ON feature_version
BEGIN SELECT RAISE (ABORT, 'a life span is never deleted'); END;
CREATE TRIGGER class_is_final BEFORE UPDATE ON class
BEGIN SELECT RAISE (ABORT, 'a class row never changes'); END;
CREATE TRIGGER class_is_kept BEFORE DELETE ON class
BEGIN SELECT RAISE (ABORT, 'a class row is never deleted'); END;
CREATE TRIGGER geometry_is_final BEFORE UPDATE ON geometry
BEGIN SELECT RAISE (ABORT, 'geometry never changes'); END;
