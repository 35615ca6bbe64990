#!/usr/bin/env python3
"""Recomputes the hash chain of a resurvey map from docs/file-format.md alone; needs only Python 3.9 or later.

    python3 docs/verify_chain.py MAP.rsv
"""
import hashlib
import sqlite3
import struct
import sys


def text(value):
    data = value.encode()
    return struct.pack("<Q", len(data)) + data


def class_table(db, version):
    rows = db.execute("SELECT class, name, red, green, blue, kind, along_m, across_m, up_m FROM class"
                      " WHERE from_version = ? ORDER BY class", (version,)).fetchall()
    if not rows:
        return b"\0"
    out = b"\1" + struct.pack("<H", len(rows))
    for index, name, red, green, blue, kind, *size in rows:
        out += bytes([index]) + text(name)
        out += bytes([red, green, blue, {"material": 0, "dynamic": 1, "ignored": 2}[kind]])
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
    out += class_table(db, version)
    before = dict(db.execute("SELECT fid, state FROM feature_version WHERE to_version = ?", (version,)))
    after = dict(db.execute("SELECT fid, state FROM feature_version WHERE from_version = ?", (version,)))
    fids = sorted(before.keys() | after.keys())
    out += struct.pack("<Q", len(fids))
    for fid in fids:
        out += struct.pack("<QB", fid, (fid in before) + 2 * (fid in after))
        out += before.get(fid, b"") + after.get(fid, b"")
    return out


def main(path):
    db = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    forgotten = {}
    if db.execute("PRAGMA user_version").fetchone()[0] >= 2:
        forgotten = dict(db.execute("SELECT version, operations FROM forgotten"))
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
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
