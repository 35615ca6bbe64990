//! Plugin host: finds, loads and calls matchers, detectors and estimators through the C ABI.
