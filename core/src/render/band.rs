//! The depth and triangle buffers of a band of rows: few enough rows that they stay in a core's cache.

use super::code::Code;

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
    /// index shows.
    #[inline(always)]
    pub(super) fn draw(&mut self, row: usize, span: Span, code: Code) {
        let Span { first, end, anchor, start, step } = span;
        let blocks = &mut self.blocks[row * self.blocks_per_row..(row + 1) * self.blocks_per_row];
        let (from, to) = (first as usize / LANES, (end as usize).div_ceil(LANES));
        let mut column = (from * LANES) as i32;
        for block in &mut blocks[from..to] {
            let past = column as f32 - anchor;
            let (low, high) = (first - column, end - column);
            for lane in 0..LANES {
                let inverse_depth = start + step * (past + lane as f32);
                let (nearest, winner) = (block.inverse_depths[lane], block.codes[lane]);
                let equal = inverse_depth.to_bits() == nearest.to_bits();
                let nearer = (inverse_depth > nearest) | (equal & (code.0 < winner));
                let inside = ((lane as i32) >= low) & ((lane as i32) < high);
                // Masks instead of a choice: a choice becomes a branch per pixel, this becomes vector code.
                let mask = u32::from(nearer & inside).wrapping_neg();
                block.inverse_depths[lane] =
                    f32::from_bits((inverse_depth.to_bits() & mask) | (nearest.to_bits() & !mask));
                block.codes[lane] = (code.0 & mask) | (winner & !mask);
            }
            column += LANES as i32;
        }
    }
}
