-- Format 2: what updates looked at, and versions that were forgotten on request.

-- The region that the writer of a version looked at: a change there from an older base contradicts what was seen.
CREATE TABLE looked_at (
    version INTEGER PRIMARY KEY REFERENCES version (version),
    e0 INTEGER NOT NULL, e1 INTEGER NOT NULL,
    n0 INTEGER NOT NULL, n1 INTEGER NOT NULL,
    h0 INTEGER NOT NULL, h1 INTEGER NOT NULL,
    CHECK (e0 <= e1 AND n0 <= n1 AND h0 <= h1)
) STRICT;

-- Versions of which gc removed something. Their rows in version stay, and by the digest of their operations so does the
-- hash chain. has_state is 1 where the state of the map is whole and only the way to it is gone: the first version that
-- was kept after forgotten ones.
CREATE TABLE forgotten (
    version INTEGER PRIMARY KEY REFERENCES version (version),
    has_state INTEGER NOT NULL CHECK (has_state IN (0, 1)),
    operations BLOB NOT NULL CHECK (length(operations) = 32),
    -- The highest number that a feature had by then: no number is given twice, also when all states under it are gone.
    last_fid INTEGER NOT NULL CHECK (last_fid BETWEEN 0 AND 9007199254740991),
    forgotten_at INTEGER NOT NULL
) STRICT;

-- An observation may name others by their digest.
CREATE INDEX observation_digest ON observation (digest);

-- Only a life span that no version has any more may go.
DROP TRIGGER feature_version_is_kept;
CREATE TRIGGER feature_version_is_kept BEFORE DELETE ON feature_version
WHEN OLD.to_version IS NULL OR OLD.to_version - OLD.from_version > (
    SELECT count(*) FROM forgotten
    WHERE has_state = 0 AND version >= OLD.from_version AND version < OLD.to_version)
BEGIN SELECT RAISE (ABORT, 'a life span is deleted only when all its versions are forgotten'); END;

CREATE TRIGGER forgotten_spares BEFORE INSERT ON forgotten
WHEN NEW.has_state = 0 AND (
    NEW.version = (SELECT max(version) FROM version) OR EXISTS (SELECT 1 FROM tag WHERE tag.version = NEW.version))
BEGIN SELECT RAISE (ABORT, 'head and tagged versions are not forgotten'); END;
CREATE TRIGGER forgotten_is_final BEFORE UPDATE ON forgotten
WHEN NEW.has_state = 1 OR NEW.version <> OLD.version OR NEW.operations <> OLD.operations OR NEW.last_fid <> OLD.last_fid
BEGIN SELECT RAISE (ABORT, 'what is forgotten stays so'); END;
CREATE TRIGGER forgotten_is_kept BEFORE DELETE ON forgotten
BEGIN SELECT RAISE (ABORT, 'what is forgotten stays so'); END;
CREATE TRIGGER looked_at_is_final BEFORE UPDATE ON looked_at
BEGIN SELECT RAISE (ABORT, 'what was looked at never changes'); END;
