//! Requirements of Alg. 1: each is a number beside its limit, and missing one is a result, not an error.

use resurvey_plugin::Error;
use resurvey_plugin::schema::{ChangeRegion, Rejection};

/// A requirement that is not met.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Unmet {
    /// Its short stable name.
    pub requirement: &'static str,
    /// What was measured.
    pub measured: f64,
    /// What it was measured against.
    pub limit: f64,
    /// Unit of both.
    pub unit: &'static str,
}

impl Unmet {
    /// The rejection of `region` for this reason.
    pub fn rejection(&self, region: &ChangeRegion) -> Rejection {
        Rejection {
            class_before: region.class_before,
            class_after: region.class_after,
            pixels: region.pixels,
            requirement: self.requirement.to_owned(),
            measured: self.measured,
            limit: self.limit,
            unit: self.unit.to_owned(),
        }
    }
}

/// Why there is no descriptor.
#[derive(Clone, Debug, PartialEq)]
pub enum Stop {
    /// A requirement is not met.
    Unmet(Unmet),
    /// The host could not answer.
    Host(Error),
}

impl From<Unmet> for Stop {
    fn from(unmet: Unmet) -> Self {
        Self::Unmet(unmet)
    }
}

impl From<Error> for Stop {
    fn from(error: Error) -> Self {
        Self::Host(error)
    }
}

/// Nothing when `measured` ≤ `limit`.
pub fn at_most(requirement: &'static str, measured: f64, limit: f64, unit: &'static str) -> Result<(), Unmet> {
    // Written so that NaN is refused.
    if measured <= limit { Ok(()) } else { Err(Unmet { requirement, measured, limit, unit }) }
}

/// Nothing when `measured` ≥ `limit`.
pub fn at_least(requirement: &'static str, measured: f64, limit: f64, unit: &'static str) -> Result<(), Unmet> {
    if measured >= limit { Ok(()) } else { Err(Unmet { requirement, measured, limit, unit }) }
}
