//! The colours of the heat map.

use super::canvas::Colour;

pub(super) const PAPER: Colour = [255, 255, 255];
pub(super) const INK: Colour = [26, 26, 26];
pub(super) const SOFT_INK: Colour = [82, 82, 82];
pub(super) const PRIOR: Colour = [0, 0, 0];
/// A red that viridis does not hold and that differs from black and white in lightness.
pub(super) const ESTIMATE: Colour = [214, 0, 50];
/// Bright inside a dark rim, where the others are dark inside a bright one.
pub(super) const TRUTH: Colour = [255, 255, 255];
pub(super) const ABSENT: Colour = [226, 226, 226];
pub(super) const ABSENT_HATCH: Colour = [208, 208, 208];

/// Viridis, by Stéfan van der Walt, Nathaniel Smith and Eric Firing (CC0, `github.com/BIDS/colormap`), at 33 equal
/// steps: red, green, blue. Between them a straight line is within 1.8 of the 256 original colours in each channel.
#[rustfmt::skip]
const VIRIDIS: [u32; 33] = [
    0x440154, 0x470d60, 0x48186a, 0x482374, 0x472d7b, 0x453681, 0x424086, 0x3f4989, 0x3b528b, 0x375a8d, 0x33638d,
    0x2f6a8e, 0x2c728e, 0x297a8e, 0x26818e, 0x23898e, 0x21908c, 0x1f988b, 0x1f9f88, 0x21a685, 0x28ae80, 0x31b57b,
    0x3ebc74, 0x4cc26c, 0x5dc963, 0x6ece58, 0x82d34c, 0x96d83f, 0xabdc32, 0xc0df24, 0xd5e21a, 0xeae51a, 0xfde725,
];

/// The colour for `share` of the range, 0 dark blue to 1 yellow, equally far apart to the eye.
pub(super) fn viridis(share: f64) -> Colour {
    let position = share.clamp(0.0, 1.0) * (VIRIDIS.len() - 1) as f64;
    let below = (position as usize).min(VIRIDIS.len() - 2);
    let channel = |step: usize, shift: u32| f64::from(VIRIDIS[step] >> shift & 0xff);
    [16, 8, 0].map(|shift| {
        let (low, high) = (channel(below, shift), channel(below + 1, shift));
        (low + (high - low) * (position - below as f64)).round() as u8
    })
}
