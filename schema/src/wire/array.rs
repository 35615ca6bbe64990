//! Where an array lies in the shared memory, in the words of NumPy.

use serde::{Deserialize, Deserializer, Serialize};

/// Type of the values of an array, as NumPy writes it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Dtype {
    /// Byte: a class, or 0 and 1.
    #[serde(rename = "|u1")]
    U8,
    /// `u32`.
    #[serde(rename = "<u4")]
    U32,
    /// `f32`.
    #[serde(rename = "<f4")]
    F32,
    /// `f64`.
    #[serde(rename = "<f8")]
    F64,
    /// [`ViewFeature`](crate::service::ViewFeature), 16 bytes.
    #[serde(rename = "|V16")]
    ViewFeature,
    /// [`RayHit`](crate::abi::RayHit), 72 bytes.
    #[serde(rename = "|V72")]
    RayHit,
}

impl Dtype {
    /// Bytes of one value.
    pub fn bytes(self) -> usize {
        match self {
            Self::U8 => 1,
            Self::U32 | Self::F32 => 4,
            Self::F64 => 8,
            Self::ViewFeature => 16,
            Self::RayHit => 72,
        }
    }
}

/// An array in the shared memory: what `numpy.ndarray(shape, dtype, buffer, offset, strides)` takes.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Array {
    /// Type of the values.
    pub dtype: Dtype,
    /// Values along each axis, the slowest first.
    pub shape: Vec<usize>,
    /// Bytes from one value to the next along each axis.
    pub strides: Vec<usize>,
    /// Bytes from the start of the memory to the first value.
    pub offset: usize,
}

impl Array {
    /// An array without gaps, row-major.
    pub fn packed(dtype: Dtype, shape: &[usize], offset: usize) -> Self {
        let mut strides = vec![dtype.bytes(); shape.len()];
        for axis in (1..shape.len()).rev() {
            strides[axis - 1] = strides[axis].saturating_mul(shape[axis]);
        }
        Self { dtype, shape: shape.to_vec(), strides, offset }
    }

    /// Bytes that an array of `shape` takes without gaps; `None` when no memory is that large.
    pub fn packed_bytes(dtype: Dtype, shape: &[usize]) -> Option<usize> {
        shape.iter().try_fold(dtype.bytes(), |bytes, length| bytes.checked_mul(*length))
    }
}

/// A number that may be NaN, which JSON cannot say: `null` stands for it.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
#[serde(transparent)]
pub struct Number(pub f64);

impl<'de> Deserialize<'de> for Number {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        Ok(Self(Option::<f64>::deserialize(deserializer)?.unwrap_or(f64::NAN)))
    }
}

impl From<f64> for Number {
    fn from(value: f64) -> Self {
        Self(value)
    }
}

impl From<Number> for f64 {
    fn from(Number(value): Number) -> Self {
        value
    }
}
