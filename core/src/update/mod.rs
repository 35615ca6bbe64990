//! One capture becomes one update transaction: localize, detect, estimate, commit.
