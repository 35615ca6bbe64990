-- The index of format 3 for one connection to a map of an older format that cannot be migrated, because it is only read. The
-- name hides the older index.
CREATE TEMP TABLE feature_index (
    cell INTEGER NOT NULL,
    from_version INTEGER NOT NULL,
    lives BLOB NOT NULL,
    PRIMARY KEY (cell, from_version)
) STRICT, WITHOUT ROWID;
