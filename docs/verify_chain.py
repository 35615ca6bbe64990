#!/usr/bin/env python3
"""Recomputes the hash chain of a resurvey map from docs/file-format.md alone, and the digests of whole states and the seals
that stand beside it; needs only Python 3.9 or later.

    python3 docs/verify_chain.py MAP.rsv
"""
import hashlib
import sqlite3
import struct
import sys

KINDS = {"material": 0, "dynamic": 1, "ignored": 2}
BOX = "e0, e1, n0, n1, h0, h1"
# What the seal of a row is the digest of, the key first; from format 4.
SEALED = {
    "meta": "SELECT seal, only_row, format, map_id, crs, vertical_datum, created_at FROM meta",
    "version": "SELECT seal, version, kind, committed_at, observed_at, author, message, base_version, reverts, added,"
               " modified, removed, v.e0, v.e1, v.n0, v.n1, v.h0, v.h1, idempotency_key, evidence, hash, request,"
               " l.e0, l.e1, l.n0, l.n1, l.h0, l.h1 FROM version AS v LEFT JOIN looked_at AS l USING (version)",
    "forgotten": "SELECT seal, version, has_state, operations, last_fid, forgotten_at, state FROM forgotten",
    "observation": "SELECT seal, id, version, base_version, recorded_at, capture, decision, labels, body, digest"
                   " FROM observation",
    "proposal": "SELECT seal, id, base_version, kind, proposed_at, observed_at, author, message, idempotency_key,"
                f" {BOX}, operations, observation, status, decided_at, decided_by, note, version FROM proposal",
    "tag": "SELECT seal, name, version, tagged_at FROM tag",
}


def text(value):
    data = value.encode()
    return struct.pack("<Q", len(data)) + data


def class_table(db, version):
    """The class table that `version` brought; nothing if it brought none."""
    rows = db.execute("SELECT class, name, red, green, blue, kind, along_m, across_m, up_m FROM class"
                      " WHERE from_version = ? ORDER BY class", (version,)).fetchall()
    if not rows:
        return b""
    out = struct.pack("<H", len(rows))
    for index, name, red, green, blue, kind, *size in rows:
        out += bytes([index]) + text(name)
        out += bytes([red, green, blue, KINDS[kind]])
        if kind == "dynamic":
            out += struct.pack("<3d", *size)
    return out


def operations(db, version):
    out = b"resurvey.operations/1\n"
    if version == 0:
        crs, datum = db.execute("SELECT crs, vertical_datum FROM meta").fetchone()
        out += b"\1" + text(crs) + text(datum)
    else:
        out += b"\0"
    classes = class_table(db, version)
    out += (b"\1" if classes else b"\0") + classes
    before = dict(db.execute("SELECT fid, state FROM feature_version WHERE to_version = ?", (version,)))
    after = dict(db.execute("SELECT fid, state FROM feature_version WHERE from_version = ?", (version,)))
    fids = sorted(before.keys() | after.keys())
    out += struct.pack("<Q", len(fids))
    for fid in fids:
        out += struct.pack("<QB", fid, (fid in before) + 2 * (fid in after))
        out += before.get(fid, b"") + after.get(fid, b"")
    return out


def whole_state(db, version, before):
    """The state at `version`, and the lives that ended since `before`, the last version whose state is whole."""
    brought, = db.execute("SELECT max(from_version) FROM class WHERE from_version <= ?", (version,)).fetchone()
    sha = hashlib.sha256(b"resurvey.state/1\n" + class_table(db, brought))
    for fid, since, state in db.execute(
            "SELECT fid, from_version, state FROM feature_version WHERE from_version <= ?1"
            " AND (to_version IS NULL OR to_version > ?1) ORDER BY fid", (version,)):
        sha.update(struct.pack("<QQ", fid, since) + state)
    sha.update(bytes(8))
    for life in db.execute("SELECT fid, from_version, to_version FROM feature_version"
                           " WHERE to_version > ? AND to_version <= ? ORDER BY fid, from_version", (before, version)):
        sha.update(struct.pack("<3Q", *life))
    sha.update(bytes(8))
    return sha.digest()


def value(one):
    if one is None:
        return b"\0"
    if isinstance(one, int):
        return b"\1" + struct.pack("<q", one)
    if isinstance(one, str):
        return b"\3" + text(one)
    return b"\4" + struct.pack("<Q", len(one)) + one


def chain(db, forgotten):
    """Prints every version; the number of those that are not what their hash says."""
    parent, bad = bytes(32), 0
    for version, stored, evidence in db.execute("SELECT version, hash, evidence FROM version ORDER BY version"):
        if evidence is not None:
            body, = db.execute("SELECT body FROM observation WHERE version = ?", (version,)).fetchone()
            assert hashlib.sha256(body.encode()).digest() == evidence, f"version {version}: other evidence"
        digest = forgotten.get(version) or hashlib.sha256(operations(db, version)).digest()
        found = hashlib.sha256(b"resurvey.version/1\n" + parent + digest + (evidence or bytes(32))).digest()
        bad += found != stored
        print(version, found.hex(), "ok" if found == stored else f"differs from {stored.hex()}")
        parent = stored
    return bad


def states(db):
    """Prints the versions whose state the chain does not prove any more; the number of those that are another."""
    bad, whole = 0, 0
    for version, has_state, stored in db.execute(
            "SELECT v.version, coalesce(f.has_state, 2), f.state FROM version AS v"
            " LEFT JOIN forgotten AS f USING (version) ORDER BY v.version").fetchall():
        if has_state == 1:
            found = whole_state(db, version, whole)
            bad += found != stored
            print("state of", version, found.hex(), "ok" if found == stored else "is another")
        if has_state != 0:
            whole = version
    return bad


def seals(db):
    """Prints the rows that are not what their seal says; their number."""
    bad = 0
    for table, sql in SEALED.items():
        for seal, *values in db.execute(sql):
            found = hashlib.sha256(b"resurvey.seal/1\n" + value(table) + b"".join(map(value, values))).digest()
            if found != seal:
                bad += 1
                print(table, values[0], "is not what its seal says")
    print("seals", "ok" if not bad else f"{bad} broken")
    return bad


def main(path):
    db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    user_version, = db.execute("PRAGMA user_version").fetchone()
    forgotten = dict(db.execute("SELECT version, operations FROM forgotten")) if user_version >= 2 else {}
    bad = chain(db, forgotten)
    if user_version >= 4:
        bad += states(db) + seals(db)
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
