//! Invented material descriptors in a square, about as dense as a city's facades, and transactions of them.

use jiff::Timestamp;
use resurvey_core::store::{MapFile, NewMap};
use resurvey_core::version::{BoxMm, FeatureState, Frame, UpdateTransaction, VersionId, VersionKind};
use resurvey_schema::{ClassId, ClassTable, Descriptor, GridPoint, MaterialDescriptor, Uncertainty};
use std::path::Path;

const EAST_M: f64 = 836_000.0;
const NORTH_M: f64 = 818_000.0;
/// Of them in 100 m × 100 m.
const DENSITY: f64 = 724.0;

/// Pseudo-random numbers in 0…1 (Marsaglia's xorshift), the same in every run.
pub struct Random(pub u64);

impl Random {
    /// The next one.
    pub fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// One of `count`.
    pub fn index(&mut self, count: usize) -> usize {
        (self.next() * count as f64) as usize
    }

    /// Two of its uncertainties always differ.
    pub fn uncertainty(&mut self) -> Uncertainty {
        Uncertainty { position_m: 0.05 + self.next(), size_m: Some(0.1), area_m2: Some(0.3) }
    }

    /// A banner of 3 × 2 m somewhere in a square of `side_m`, between these shares of its height.
    pub fn banner(&mut self, side_m: f64, [south, north]: [f64; 2]) -> FeatureState {
        let (e, n) = (EAST_M + side_m * self.next(), NORTH_M + side_m * (south + (north - south) * self.next()));
        let corner = |de, dh| GridPoint::new(e + de, n, 8.0 + dh);
        FeatureState::Descriptor(Descriptor::Material(MaterialDescriptor {
            class: ClassId(3),
            corners: [corner(0.0, 0.0), corner(3.0, 0.0), corner(3.0, 2.0), corner(0.0, 2.0)],
            normal: [0.0, -1.0, 0.0],
            sigma: Some(self.uncertainty()),
        }))
    }

    /// The same banner, measured again.
    pub fn measured_again(&mut self, state: &FeatureState) -> FeatureState {
        let mut after = state.clone();
        if let FeatureState::Descriptor(Descriptor::Material(banner)) = &mut after {
            banner.sigma = Some(self.uncertainty());
        }
        after
    }
}

/// Side of the square in which this many stand, metres.
pub fn side_m(features: usize) -> f64 {
    100.0 * (features as f64 / DENSITY).sqrt()
}

/// A square of `side_m` whose lower left corner is at these shares of a square of `whole_m`.
pub fn square(whole_m: f64, share: f64, side_m: f64) -> BoxMm {
    let (e, n) = (EAST_M + share * (whole_m - side_m), NORTH_M + share * (whole_m - side_m));
    BoxMm::of_plan(e, n, e + side_m, n + side_m).expect("finite and ordered")
}

/// A time: the bench asks no clock for it.
pub fn now() -> Timestamp {
    Timestamp::from_second(1_772_323_200).expect("in range")
}

/// An empty map in a new file.
pub fn new_map(path: &Path) -> MapFile {
    let new = NewMap {
        map_id: "bench".to_owned(),
        frame: Frame { crs: "EPSG:2326".to_owned(), vertical_datum: "hkpd".to_owned() },
        classes: ClassTable::default(),
        author: "survey".to_owned(),
        message: "an empty map".to_owned(),
    };
    MapFile::create(path, &new, now()).expect("a new map")
}

/// A transaction against `base`, still empty.
pub fn transaction(base: VersionId) -> UpdateTransaction {
    UpdateTransaction::new(base, VersionKind::Update, "phone 7", "a bench")
}
