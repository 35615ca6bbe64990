//! Classes of the pixels that a textured triangle covers: texture coordinates divided by depth are linear in the pixel.

use super::scene::Scene;
use super::setup::HomogeneousTriangle;
use super::texture::texel_class;
use crate::mesh::{LabelTexture, Surface, Wrap};
use resurvey_schema::ClassId;

/// Pixels worked on at once, so that the compiler uses vector code for all but the look-up.
const LANES: usize = 16;
/// Texture coordinates stay this share of their range, or of the texture, inside it: rounding at a rim does not wrap
/// round to the other side.
const INSET: f64 = 1e-6;

/// Texture coordinates of a triangle as functions of the pixel, in texels.
#[derive(Clone, Copy, Debug)]
pub(super) struct Texels {
    /// Column over depth and row over depth as linear forms of (u, v, 1).
    forms: [[f64; 3]; 2],
    inverse_depth: [f64; 3],
    low: [f32; 2],
    high: [f32; 2],
    size: [f32; 2],
    rule: Rule,
}

/// How a position becomes a texel.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Rule {
    /// Its whole part.
    Direct,
    /// The remainder of its whole part; positions are not negative.
    Repeat,
    /// As the texture says, one by one.
    Any,
}

impl Texels {
    /// Texels of triangle `index` of the scene; `None` when its surface has no texture.
    pub(super) fn new(scene: &Scene, index: u32, triangle: &HomogeneousTriangle) -> Option<Self> {
        let Surface::Texture(texture) = scene.surface(index as usize) else { return None };
        let uvs = &scene.uvs()[index as usize];
        let mut texels = Self {
            forms: [[0.0; 3]; 2],
            inverse_depth: triangle.inverse_depth(),
            low: [0.0; 2],
            high: [0.0; 2],
            size: [texture.labels.width() as f32, texture.labels.height() as f32],
            rule: Rule::Direct,
        };
        for axis in 0..2 {
            let wrap = [texture.wrap_u, texture.wrap_v][axis];
            texels.set_axis(axis, wrap, triangle.attribute(uvs.map(|uv| f64::from(uv[axis]))), uvs.map(|uv| uv[axis]));
        }
        Some(texels)
    }

    /// Classes of the pixels from column `u`, row `v` on.
    #[inline(always)]
    pub(super) fn fill(&self, texture: &LabelTexture, [u, v]: [usize; 2], pixels: &mut [u8]) {
        let (x, y) = (u as f64 + 0.5, v as f64 + 0.5);
        let start = |[along_u, along_v, constant]: [f64; 3]| (along_u * x + (along_v * y + constant)) as f32;
        let lines = [self.forms[0], self.forms[1], self.inverse_depth].map(|form| (start(form), form[0] as f32));
        match self.rule {
            Rule::Direct => self.look_up(texture, lines, pixels, |position, _| position),
            Rule::Repeat => self.look_up(texture, lines, pixels, |position, size| {
                held(position - floor(position / size).0 * size, 0.0, size - 1.0)
            }),
            Rule::Any => {
                for (index, pixel) in pixels.iter_mut().enumerate() {
                    let [column, row] = self.position(lines, index as f32);
                    *pixel = texel_class(texture, column / self.size[0], row / self.size[1]).0;
                }
            }
        }
    }

    #[inline(always)]
    fn look_up(
        &self,
        texture: &LabelTexture,
        lines: [(f32, f32); 3],
        pixels: &mut [u8],
        wrapped: impl Fn(f32, f32) -> f32,
    ) {
        let labels = texture.labels.values();
        let width = texture.labels.width();
        for (index, chunk) in pixels.chunks_mut(LANES).enumerate() {
            let first = (index * LANES) as f32;
            let mut texels = [0_u32; LANES];
            for (lane, texel) in texels.iter_mut().enumerate() {
                let [column, row] = self.position(lines, first + (lane as i32) as f32);
                let (_, column) = floor(wrapped(column, self.size[0]));
                let (_, row) = floor(wrapped(row, self.size[1]));
                *texel = row.wrapping_mul(width).wrapping_add(column);
            }
            let class = |texel: u32| labels.get(texel as usize).copied().unwrap_or(ClassId::VOID.0);
            let mut differing = 0;
            for lane in 1..LANES {
                differing |= texels[lane] ^ texels[0];
            }
            // Near the camera a texel covers many pixels.
            let mut classes = [0; LANES];
            if differing == 0 {
                classes = [class(texels[0]); LANES];
            } else {
                for lane in 0..LANES {
                    classes[lane] = class(texels[lane]);
                }
            }
            chunk.copy_from_slice(&classes[..chunk.len()]);
        }
    }

    /// Column and row, texels, `along` pixels from where `lines` start.
    #[inline(always)]
    fn position(&self, lines: [(f32, f32); 3], along: f32) -> [f32; 2] {
        let [column, row, inverse_depth] = lines.map(|(start, step)| start + step * along);
        let depth = 1.0 / inverse_depth;
        [held(column * depth, self.low[0], self.high[0]), held(row * depth, self.low[1], self.high[1])]
    }

    fn set_axis(&mut self, axis: usize, wrap: Wrap, form: [f64; 3], coordinates: [f32; 3]) {
        let size = f64::from(self.size[axis]);
        let [a, b, c] = coordinates.map(f64::from);
        let (low, high) = (a.min(b).min(c), a.max(b).max(c));
        let (low, high) = (low + (high - low) * INSET, high - (high - low) * INSET);
        // A whole number of periods off, everything is where it was, and nothing is negative.
        let shift = match wrap {
            Wrap::Repeat => low.floor(),
            Wrap::Mirror => 2.0 * (low / 2.0).floor(),
            Wrap::Clamp => 0.0,
        };
        let within_one = low - shift >= 0.0 && high - shift <= 1.0;
        let rule = match wrap {
            _ if within_one => Rule::Direct,
            Wrap::Clamp => Rule::Direct,
            Wrap::Repeat => Rule::Repeat,
            Wrap::Mirror => Rule::Any,
        };
        self.rule = match (self.rule, rule) {
            (Rule::Any, _) | (_, Rule::Any) => Rule::Any,
            (Rule::Repeat, _) | (_, Rule::Repeat) => Rule::Repeat,
            _ => Rule::Direct,
        };
        let (first, last) = if rule == Rule::Direct { (0.0, 1.0 - INSET) } else { (f64::NEG_INFINITY, f64::INFINITY) };
        self.low[axis] = ((low - shift).clamp(first, last) * size) as f32;
        self.high[axis] = ((high - shift).clamp(first, last) * size) as f32;
        self.forms[axis] = std::array::from_fn(|k| (form[k] - shift * self.inverse_depth[k]) * size);
    }
}

// `f32::max`, `f32::floor` and `as` take detours, for NaN, for a call and for what does not fit, that keep the compiler
// from vector code.

/// `value`, or the limit that it passes; `low` for NaN.
#[inline(always)]
fn held(value: f32, low: f32, high: f32) -> f32 {
    let value = if value > low { value } else { low };
    if value < high { value } else { high }
}

/// The whole part of a value from 0 to 2²², as float and as integer; some number for any other value.
#[inline(always)]
fn floor(value: f32) -> (f32, u32) {
    /// Its neighbours are 1 apart, so that adding it rounds to a whole number, which is then in its low bits.
    const WHOLE: f32 = 8_388_608.0;
    let shifted = value + WHOLE;
    let nearest = shifted - WHOLE;
    let above = nearest > value;
    (nearest - f32::from(u8::from(above)), (shifted.to_bits() & 0x7F_FFFF).wrapping_sub(u32::from(above)))
}
