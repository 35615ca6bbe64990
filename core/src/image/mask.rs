//! Which of 64 neighbouring pixels have a value, as the bits of a word.

use pulp::Simd;
#[cfg(target_arch = "x86_64")]
use pulp::{
    cast,
    x86::{V3, V4},
};
#[cfg(target_arch = "x86_64")]
use std::any::Any;

/// Bit i is set where pixel i is `value`.
#[inline(always)]
pub(crate) fn mask<S: Simd>(simd: S, pixels: &[u8; 64], value: u8) -> u64 {
    #[cfg(target_arch = "x86_64")]
    {
        let simd: &dyn Any = &simd;
        if let Some(simd) = simd.downcast_ref::<V4>() {
            let values = simd.avx512f._mm512_set1_epi8(value as i8);
            return simd.avx512bw._mm512_cmpeq_epi8_mask(cast(*pixels), values);
        }
        if let Some(simd) = simd.downcast_ref::<V3>() {
            let values = simd.avx._mm256_set1_epi8(value as i8);
            let [low, high]: [[u8; 32]; 2] = cast(*pixels);
            let low = simd.avx2._mm256_movemask_epi8(simd.avx2._mm256_cmpeq_epi8(cast(low), values));
            let high = simd.avx2._mm256_movemask_epi8(simd.avx2._mm256_cmpeq_epi8(cast(high), values));
            return u64::from(low as u32) | u64::from(high as u32) << 32;
        }
    }
    let _ = simd;
    let mut bits = [0_u8; 64];
    for (index, (bit, pixel)) in bits.iter_mut().zip(pixels).enumerate() {
        *bit = if *pixel == value { 1 << (index % 8) } else { 0 };
    }
    let mut mask = 0;
    for (group, bits) in bits.chunks_exact(8).enumerate() {
        mask |= u64::from(bits.iter().fold(0, |byte, bit| byte | bit)) << (8 * group);
    }
    mask
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use pulp::{Arch, WithSimd};

    struct Mask<'a>(&'a [u8; 64], u8);

    impl WithSimd for Mask<'_> {
        type Output = u64;

        fn with_simd<S: Simd>(self, simd: S) -> u64 {
            mask(simd, self.0, self.1)
        }
    }

    proptest! {
        #[test]
        fn a_bit_is_set_exactly_where_the_value_is(pixels in prop::collection::vec(0_u8..4, 64), value in 0_u8..4) {
            let pixels: [u8; 64] = pixels.try_into().unwrap();
            let expected = (0..64).filter(|&bit| pixels[bit] == value).fold(0_u64, |mask, bit| mask | 1 << bit);
            prop_assert_eq!(Arch::Scalar.dispatch(Mask(&pixels, value)), expected);
            prop_assert_eq!(Arch::new().dispatch(Mask(&pixels, value)), expected);
            #[cfg(target_arch = "x86_64")]
            if let Some(simd) = V3::try_new() {
                prop_assert_eq!(Simd::vectorize(simd, Mask(&pixels, value)), expected);
            }
        }
    }
}
