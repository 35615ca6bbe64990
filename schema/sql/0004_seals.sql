-- Format 4: digests of what the hash chain does not cover, so that what changes in it by accident is found, and what a
-- request with an idempotency key asked for. docs/file-format.md says of which bytes each is the digest.

-- What was asked for with the idempotency key: the same key with anything else is refused. Null where there is no key, and
-- for versions of older formats.
ALTER TABLE version ADD COLUMN request BLOB CHECK (length(request) = 32);

-- The seal of a row: digest of its other columns. Each row has one; that of a version also covers its row of looked_at.
ALTER TABLE version ADD COLUMN seal BLOB CHECK (length(seal) = 32);
ALTER TABLE observation ADD COLUMN seal BLOB CHECK (length(seal) = 32);
ALTER TABLE proposal ADD COLUMN seal BLOB CHECK (length(seal) = 32);
ALTER TABLE tag ADD COLUMN seal BLOB CHECK (length(seal) = 32);
-- That of meta does not cover the origin of the index, which goes with the index.
ALTER TABLE meta ADD COLUMN seal BLOB CHECK (length(seal) = 32);

-- Digest of the whole state where has_state is 1: what the hash chain proved of it until gc removed the way to it.
ALTER TABLE forgotten ADD COLUMN state BLOB CHECK (length(state) = 32);
ALTER TABLE forgotten ADD COLUMN seal BLOB CHECK (length(seal) = 32);

-- A version is sealed in the transaction that makes it, and never changes then.
DROP TRIGGER version_is_final;
CREATE TRIGGER version_is_final BEFORE UPDATE ON version WHEN OLD.seal IS NOT NULL
BEGIN SELECT RAISE (ABORT, 'a version never changes'); END;

-- When more is forgotten, the digests of states are made anew.
DROP TRIGGER forgotten_is_final;
CREATE TRIGGER forgotten_is_final BEFORE UPDATE ON forgotten
WHEN NEW.has_state > OLD.has_state OR NEW.version <> OLD.version OR NEW.operations <> OLD.operations
    OR NEW.last_fid <> OLD.last_fid
BEGIN SELECT RAISE (ABORT, 'what is forgotten stays so'); END;
