//! Descriptor estimator: material rectangles and dynamic objects.
#![forbid(unsafe_code)]
