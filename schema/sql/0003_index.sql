-- Format 3: the index of features by cell and stretch of versions, in place of the R*Tree. docs/performance.md compares them.

DROP TABLE feature_index;

-- Every life of the features of a cell that some version has from from_version until the next block of the cell. It
-- repeats what feature_version says, and can be made anew from there.
CREATE TABLE feature_index (
    cell INTEGER NOT NULL,
    from_version INTEGER NOT NULL,
    lives BLOB NOT NULL,
    PRIMARY KEY (cell, from_version)
) STRICT, WITHOUT ROWID;
