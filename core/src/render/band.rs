//! The depth and triangle buffers of a band of rows: few enough rows that they stay in a core's cache.

use super::code::Code;
use pulp::Simd;

/// Pixels worked on at once: one vector of the widest instruction set.
pub(super) const LANES: usize = 16;

/// Neighbouring pixels of a row: the inverse depth of the nearest triangle so far and which one it is.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(64))]
pub(super) struct Block {
    pub(super) inverse_depths: [f32; LANES],
    pub(super) codes: [u32; LANES],
}

/// Some rows of an image.
#[derive(Clone, Debug, Default)]
pub(super) struct Band {
    first_row: usize,
    rows: usize,
    width: usize,
    blocks_per_row: usize,
    blocks: Vec<Block>,
}

/// Pixels `first..end` of a row, whose inverse depth is `start` at column `anchor` and changes by `step` from column to
/// column; the anchor is the end where it is least, so that nothing cancels and the rounding is relative.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) first: i32,
    pub(super) end: i32,
    pub(super) anchor: f32,
    pub(super) start: f32,
    pub(super) step: f32,
}

impl Block {
    /// Whether all of its pixels have this code.
    #[inline(always)]
    pub(super) fn is_all(&self, code: Code) -> bool {
        let mut differing = 0;
        for lane in 0..LANES {
            differing |= self.codes[lane] ^ code.0;
        }
        differing == 0
    }
}

impl Band {
    /// Makes it empty: `rows` rows from `first_row` on of an image `width` wide.
    #[inline(always)]
    pub(super) fn clear(&mut self, first_row: usize, rows: usize, width: usize, sky: Code) {
        (self.first_row, self.rows, self.width) = (first_row, rows, width);
        self.blocks_per_row = width.div_ceil(LANES);
        let empty = Block { inverse_depths: [0.0; LANES], codes: [sky.0; LANES] };
        self.blocks.clear();
        self.blocks.resize(rows * self.blocks_per_row, empty);
        // What lies beyond the border hides everything.
        for block in self.blocks.chunks_exact_mut(self.blocks_per_row.max(1)).filter_map(|row| row.last_mut()) {
            let beyond = (width - 1) % LANES + 1..LANES;
            block.inverse_depths[beyond].fill(f32::INFINITY);
        }
    }

    /// Row of the image that is the first of the band.
    pub(super) fn first_row(&self) -> usize {
        self.first_row
    }

    /// Number of rows.
    pub(super) fn rows(&self) -> usize {
        self.rows
    }

    /// Pixels of a row.
    pub(super) fn width(&self) -> usize {
        self.width
    }

    /// Blocks of a row, counted from the first of the band.
    #[inline(always)]
    pub(super) fn row(&self, row: usize) -> &[Block] {
        &self.blocks[row * self.blocks_per_row..(row + 1) * self.blocks_per_row]
    }

    /// Draws a triangle's span in a row where it is nearer than what is there; among equals the one with the lower
    /// index shows. Blocks that `shows` does not pick are left as they are.
    #[inline(always)]
    pub(super) fn draw<S: Simd>(
        &mut self,
        simd: S,
        row: usize,
        span: Span,
        code: Code,
        shows: &impl Fn(usize) -> bool,
    ) {
        let Span { first, end, anchor, start, step } = span;
        let row = &mut self.blocks[row * self.blocks_per_row..(row + 1) * self.blocks_per_row];
        let (from, to) = (first as usize / LANES, (end as usize).div_ceil(LANES));
        let (lanes, lane_indices) = (S::as_simd_f32s(&LANE).0, S::as_simd_u32s(&LANE_INDEX).0);
        let (start, step, code) = (simd.splat_f32s(start), simd.splat_f32s(step), simd.splat_u32s(code.0));
        let length = simd.splat_u32s((end - first) as u32);
        for (index, block) in (from..to).zip(&mut row[from..to]) {
            if !shows(index) {
                continue;
            }
            let column = (index * LANES) as i32;
            let past = simd.splat_f32s(column as f32 - anchor);
            let inside = simd.splat_u32s((column - first) as u32);
            let nearest = S::as_mut_simd_f32s(&mut block.inverse_depths).0;
            let winner = S::as_mut_simd_u32s(&mut block.codes).0;
            for k in 0..nearest.len() {
                // No fused multiplication and addition: the same bits on every instruction set.
                let along = simd.mul_f32s(step, simd.add_f32s(past, lanes[k]));
                let inverse_depth = simd.add_f32s(start, along);
                let equal = simd.equal_f32s(inverse_depth, nearest[k]);
                let first_of_equals = simd.and_m32s(equal, simd.less_than_u32s(code, winner[k]));
                let nearer = simd.or_m32s(simd.greater_than_f32s(inverse_depth, nearest[k]), first_of_equals);
                let inside = simd.less_than_u32s(simd.add_u32s(inside, lane_indices[k]), length);
                let shows = simd.and_m32s(nearer, inside);
                nearest[k] = simd.select_f32s(shows, inverse_depth, nearest[k]);
                winner[k] = simd.select_u32s(shows, code, winner[k]);
            }
        }
    }
}

const LANE: [f32; LANES] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0, 8.0, 9.0, 10.0, 11.0, 12.0, 13.0, 14.0, 15.0];
const LANE_INDEX: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];
