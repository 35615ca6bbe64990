//! Where each part of a prior comes from.

use super::nmea::SentenceCounts;

/// What said a part of a prior.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PriorOrigin {
    /// `capture.json`.
    Capture,
    /// An NMEA log.
    Nmea,
    /// The EXIF of a photo.
    Photo,
    /// The ground of the map below the position.
    Ground,
}

impl PriorOrigin {
    /// `capture`, `nmea`, `photo` or `ground`.
    pub fn name(self) -> &'static str {
        match self {
            Self::Capture => "capture",
            Self::Nmea => "nmea",
            Self::Photo => "photo",
            Self::Ground => "ground",
        }
    }
}

/// Where each part of a prior comes from, and what a user should know about it.
#[derive(Clone, Debug, PartialEq)]
pub struct PriorReport {
    /// Of the position.
    pub position_from: PriorOrigin,
    /// Of the height.
    pub height_from: PriorOrigin,
    /// Of the heading; `None` where it is not known.
    pub heading_from: Option<PriorOrigin>,
    /// What the NMEA log had.
    pub sentences: Option<SentenceCounts>,
    /// What was assumed or passed over, a sentence each.
    pub notes: Vec<String>,
}

impl PriorReport {
    pub(super) fn new(position_from: PriorOrigin) -> Self {
        Self { position_from, height_from: position_from, heading_from: None, sentences: None, notes: Vec::new() }
    }
}
