//! The canonical bytes of states and class tables: one value, one byte string. Little-endian throughout;
//! docs/file-format.md is the definition.

use super::{BoxMm, Digest, FeatureState};
use resurvey_schema::{
    ClassId, ClassKind, ClassTable, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor, Uncertainty,
};

const MATERIAL: u8 = 1;
const DYNAMIC: u8 = 2;
const OBJECT: u8 = 3;

const HAS_SIGMA: u8 = 1;
const HAS_SIGMA_SIZE: u8 = 2;
const HAS_SIGMA_AREA: u8 = 4;
const HAS_YAW: u8 = 8;

/// Bytes that are not the canonical form of anything.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("at byte {at}: expected {expected}")]
pub struct CanonicalError {
    /// What should have stood there.
    pub expected: &'static str,
    /// Where.
    pub at: usize,
}

impl FeatureState {
    /// The canonical bytes.
    pub fn to_bytes(&self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(160);
        self.push_bytes(&mut bytes);
        bytes
    }

    /// Appends the canonical bytes; they say themselves where they end.
    pub(super) fn push_bytes(&self, bytes: &mut Vec<u8>) {
        match self {
            Self::Descriptor(Descriptor::Material(material)) => {
                bytes.extend([MATERIAL, material.class.0, sigma_flags(material.sigma)]);
                material.corners.iter().for_each(|corner| push_numbers(bytes, &<[f64; 3]>::from(*corner)));
                push_numbers(bytes, &material.normal);
                push_sigma(bytes, material.sigma);
            }
            Self::Descriptor(Descriptor::Dynamic(dynamic)) => {
                let yaw = if dynamic.yaw_rad.is_some() { HAS_YAW } else { 0 };
                bytes.extend([DYNAMIC, dynamic.class.0, sigma_flags(dynamic.sigma) | yaw]);
                push_numbers(bytes, &<[f64; 3]>::from(dynamic.position));
                push_numbers(bytes, &dynamic.size_m);
                push_numbers(bytes, dynamic.yaw_rad.as_slice());
                push_sigma(bytes, dynamic.sigma);
            }
            Self::Object { name, geometry, bounds } => {
                bytes.push(OBJECT);
                push_text(bytes, name);
                bytes.extend(geometry.0);
                bounds.min().iter().chain(&bounds.max()).for_each(|value| bytes.extend(value.to_le_bytes()));
            }
        }
    }

    /// The state whose canonical form is all of `bytes`.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, CanonicalError> {
        let mut reader = Reader::new(bytes);
        let state = reader.state()?;
        reader.end()?;
        Ok(state)
    }
}

/// The canonical bytes of a class table.
pub(super) fn class_table_bytes(classes: &ClassTable) -> Vec<u8> {
    let mut bytes = (classes.iter().count() as u16).to_le_bytes().to_vec();
    for class in classes.iter() {
        let kind = match class.kind {
            ClassKind::Material => 0,
            ClassKind::Dynamic => 1,
            ClassKind::Ignored => 2,
        };
        bytes.push(class.index.0);
        push_text(&mut bytes, &class.name);
        bytes.extend(class.colour);
        bytes.push(kind);
        class.size_m.iter().for_each(|size| push_numbers(&mut bytes, size));
    }
    bytes
}

pub(super) fn push_text(bytes: &mut Vec<u8>, text: &str) {
    bytes.extend((text.len() as u64).to_le_bytes());
    bytes.extend(text.as_bytes());
}

/// Appends the IEEE 754 bits of `values`; −0 is written as 0, so that equal numbers have equal bytes.
fn push_numbers(bytes: &mut Vec<u8>, values: &[f64]) {
    values.iter().for_each(|value| bytes.extend((value + 0.0).to_le_bytes()));
}

fn sigma_flags(sigma: Option<Uncertainty>) -> u8 {
    sigma.map_or(0, |sigma| {
        HAS_SIGMA | sigma.size_m.map_or(0, |_| HAS_SIGMA_SIZE) | sigma.area_m2.map_or(0, |_| HAS_SIGMA_AREA)
    })
}

fn push_sigma(bytes: &mut Vec<u8>, sigma: Option<Uncertainty>) {
    if let Some(Uncertainty { position_m, size_m, area_m2 }) = sigma {
        push_numbers(bytes, &[position_m]);
        push_numbers(bytes, size_m.as_slice());
        push_numbers(bytes, area_m2.as_slice());
    }
}

/// Reads canonical bytes front to back.
pub(super) struct Reader<'b> {
    bytes: &'b [u8],
    at: usize,
}

impl<'b> Reader<'b> {
    pub(super) fn new(bytes: &'b [u8]) -> Self {
        Self { bytes, at: 0 }
    }

    pub(super) fn wrong<T>(&self, expected: &'static str) -> Result<T, CanonicalError> {
        Err(CanonicalError { expected, at: self.at })
    }

    pub(super) fn end(&self) -> Result<(), CanonicalError> {
        if self.at == self.bytes.len() { Ok(()) } else { self.wrong("the end") }
    }

    pub(super) fn take(&mut self, count: usize, expected: &'static str) -> Result<&'b [u8], CanonicalError> {
        match self.bytes.get(self.at..).and_then(|rest| rest.get(..count)) {
            Some(taken) => {
                self.at += count;
                Ok(taken)
            }
            None => self.wrong(expected),
        }
    }

    fn array<const N: usize>(&mut self, expected: &'static str) -> Result<[u8; N], CanonicalError> {
        let taken = self.take(N, expected)?;
        taken.try_into().or_else(|_| self.wrong(expected))
    }

    pub(super) fn byte(&mut self, expected: &'static str) -> Result<u8, CanonicalError> {
        self.array::<1>(expected).map(|[byte]| byte)
    }

    pub(super) fn count(&mut self, expected: &'static str) -> Result<u64, CanonicalError> {
        self.array(expected).map(u64::from_le_bytes)
    }

    fn text(&mut self, expected: &'static str) -> Result<String, CanonicalError> {
        let length = self.count(expected)?;
        let taken = self.take(usize::try_from(length).unwrap_or(usize::MAX), expected)?;
        std::str::from_utf8(taken).map(str::to_owned).or_else(|_| self.wrong("UTF-8"))
    }

    fn number(&mut self) -> Result<f64, CanonicalError> {
        let value = self.array("a number").map(f64::from_le_bytes)?;
        if value.is_finite() { Ok(value) } else { self.wrong("a finite number before this") }
    }

    fn numbers(&mut self) -> Result<[f64; 3], CanonicalError> {
        Ok([self.number()?, self.number()?, self.number()?])
    }

    fn sigma(&mut self, flags: u8) -> Result<Option<Uncertainty>, CanonicalError> {
        if flags & HAS_SIGMA == 0 {
            return if flags & (HAS_SIGMA_SIZE | HAS_SIGMA_AREA) == 0 { Ok(None) } else { self.wrong("a sigma") };
        }
        let position_m = self.number()?;
        let size_m = if flags & HAS_SIGMA_SIZE != 0 { Some(self.number()?) } else { None };
        let area_m2 = if flags & HAS_SIGMA_AREA != 0 { Some(self.number()?) } else { None };
        Ok(Some(Uncertainty { position_m, size_m, area_m2 }))
    }

    pub(super) fn state(&mut self) -> Result<FeatureState, CanonicalError> {
        match self.byte("a state")? {
            MATERIAL => self.material(),
            DYNAMIC => self.dynamic(),
            OBJECT => self.object(),
            _ => self.wrong("1, 2 or 3 before this"),
        }
    }

    fn material(&mut self) -> Result<FeatureState, CanonicalError> {
        let class = ClassId(self.byte("a class")?);
        let flags = self.byte("flags")?;
        if flags & !(HAS_SIGMA | HAS_SIGMA_SIZE | HAS_SIGMA_AREA) != 0 {
            return self.wrong("known flags before this");
        }
        let mut corners = [GridPoint::new(0.0, 0.0, 0.0); 4];
        for corner in &mut corners {
            *corner = self.numbers()?.into();
        }
        let normal = self.numbers()?;
        let sigma = self.sigma(flags)?;
        Ok(FeatureState::Descriptor(Descriptor::Material(MaterialDescriptor { class, corners, normal, sigma })))
    }

    fn dynamic(&mut self) -> Result<FeatureState, CanonicalError> {
        let class = ClassId(self.byte("a class")?);
        let flags = self.byte("flags")?;
        if flags & !(HAS_SIGMA | HAS_SIGMA_SIZE | HAS_SIGMA_AREA | HAS_YAW) != 0 {
            return self.wrong("known flags before this");
        }
        let position = self.numbers()?.into();
        let size_m = self.numbers()?;
        let yaw_rad = if flags & HAS_YAW != 0 { Some(self.number()?) } else { None };
        let sigma = self.sigma(flags)?;
        let dynamic = DynamicDescriptor { class, position, size_m, yaw_rad, sigma };
        Ok(FeatureState::Descriptor(Descriptor::Dynamic(dynamic)))
    }

    fn object(&mut self) -> Result<FeatureState, CanonicalError> {
        let name = self.text("a name")?;
        let geometry = Digest(self.array("a digest")?);
        let mut ends = [0; 6];
        for end in &mut ends {
            *end = i64::from_le_bytes(self.array("a box")?);
        }
        let [e0, n0, h0, e1, n1, h1] = ends;
        match BoxMm::from_mm([e0, n0, h0], [e1, n1, h1]) {
            Some(bounds) => Ok(FeatureState::Object { name, geometry, bounds }),
            None => self.wrong("a box with ordered ends before this"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn number() -> impl Strategy<Value = f64> {
        prop_oneof![Just(0.0), Just(-0.0), -1e9..1e9_f64, Just(f64::MIN_POSITIVE), Just(836_694.05)]
    }

    fn sigma() -> impl Strategy<Value = Option<Uncertainty>> {
        let sigma = (number(), proptest::option::of(number()), proptest::option::of(number()));
        proptest::option::of(sigma.prop_map(|(position_m, size_m, area_m2)| Uncertainty {
            position_m,
            size_m,
            area_m2,
        }))
    }

    fn state() -> impl Strategy<Value = FeatureState> {
        let three = || [number(), number(), number()];
        let material = (any::<u8>(), [three(), three(), three(), three()], three(), sigma());
        let dynamic = (any::<u8>(), three(), three(), proptest::option::of(number()), sigma());
        let object = (".*", any::<[u8; 32]>(), proptest::array::uniform6(-1_000_000_i64..1_000_000));
        prop_oneof![
            material.prop_map(|(class, corners, normal, sigma)| {
                let corners = corners.map(GridPoint::from);
                FeatureState::Descriptor(Descriptor::Material(MaterialDescriptor {
                    class: ClassId(class),
                    corners,
                    normal,
                    sigma,
                }))
            }),
            dynamic.prop_map(|(class, position, size_m, yaw_rad, sigma)| {
                FeatureState::Descriptor(Descriptor::Dynamic(DynamicDescriptor {
                    class: ClassId(class),
                    position: position.into(),
                    size_m,
                    yaw_rad,
                    sigma,
                }))
            }),
            object.prop_map(|(name, digest, [e, n, h, de, dn, dh])| FeatureState::Object {
                name,
                geometry: Digest(digest),
                bounds: BoxMm::from_mm([e, n, h], [e + de.abs(), n + dn.abs(), h + dh.abs()]).unwrap(),
            }),
        ]
    }

    proptest! {
        #[test]
        fn a_state_comes_back_from_its_bytes_and_has_no_others(state in state()) {
            let bytes = state.to_bytes();
            let back = FeatureState::from_bytes(&bytes).unwrap();
            prop_assert_eq!(&back, &state);
            prop_assert_eq!(back.to_bytes(), bytes);
        }

        #[test]
        fn bytes_cut_short_or_run_on_are_refused(state in state(), cut in any::<proptest::sample::Index>()) {
            let mut bytes = state.to_bytes();
            prop_assert!(FeatureState::from_bytes(&bytes[..cut.index(bytes.len())]).is_err());
            bytes.push(0);
            prop_assert!(FeatureState::from_bytes(&bytes).is_err());
        }

        #[test]
        fn any_bytes_are_read_without_a_panic(mut bytes in proptest::collection::vec(any::<u8>(), 0..200), kind in 0_u8..5) {
            if let Some(first) = bytes.first_mut() {
                *first = kind;
            }
            if let Ok(state) = FeatureState::from_bytes(&bytes) {
                prop_assert_eq!(FeatureState::from_bytes(&state.to_bytes()), Ok(state));
            }
        }
    }

    #[test]
    fn the_bytes_of_a_chair_are_those_of_the_format_page() {
        let chair = FeatureState::Descriptor(Descriptor::Dynamic(DynamicDescriptor {
            class: ClassId(5),
            position: GridPoint::new(1.0, -0.0, 2.0),
            size_m: [0.5, 0.5, 1.0],
            yaw_rad: Some(1.0),
            sigma: None,
        }));
        // python3: struct.pack("<3B7d", 2, 5, 8, 1, 0, 2, .5, .5, 1, 1).hex()
        let expected = "020508000000000000f03f00000000000000000000000000000040000000000000e03f000000000000e03f\
            000000000000f03f000000000000f03f";
        let bytes: String = chair.to_bytes().iter().map(|byte| format!("{byte:02x}")).collect();
        assert_eq!(bytes, expected);
    }
}
