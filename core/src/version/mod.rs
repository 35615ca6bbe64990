//! The values of history: version ids, deltas, update transactions. No SQL, no file.
