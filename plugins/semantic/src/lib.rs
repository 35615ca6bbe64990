//! VPS matcher on semantic labels: Dice, Jaccard and boundary F1.
#![forbid(unsafe_code)]
