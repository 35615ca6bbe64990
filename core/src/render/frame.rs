//! The depth and triangle buffers of one image.

/// Per pixel, the inverse depth of the nearest triangle so far and which one it is.
#[derive(Clone, Debug, Default)]
pub(super) struct Frame {
    width: usize,
    height: usize,
    inverse_depths: Vec<f32>,
    ids: Vec<u32>,
}

/// Pixels `first..end` of row `v` of a triangle whose inverse depth is `start + step · (u − first)` at column `u`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Span {
    pub(super) v: usize,
    pub(super) first: usize,
    pub(super) end: usize,
    pub(super) start: f32,
    pub(super) step: f32,
}

impl Frame {
    /// Makes the frame empty, `width × height` pixels.
    pub(super) fn clear(&mut self, width: usize, height: usize) {
        (self.width, self.height) = (width, height);
        self.inverse_depths.clear();
        self.inverse_depths.resize(width * height, 0.0);
        self.ids.clear();
        self.ids.resize(width * height, 0);
    }

    pub(super) fn width(&self) -> usize {
        self.width
    }

    pub(super) fn height(&self) -> usize {
        self.height
    }

    /// Ids of row `v`; 0 where nothing was drawn.
    pub(super) fn ids(&self, v: usize) -> &[u32] {
        &self.ids[v * self.width..(v + 1) * self.width]
    }

    /// Inverse depths of row `v`; 0 where nothing was drawn.
    pub(super) fn inverse_depths(&self, v: usize) -> &[f32] {
        &self.inverse_depths[v * self.width..(v + 1) * self.width]
    }

    /// Draws triangle `id` where it is nearer than what is there; among equals the first drawn stays.
    pub(super) fn draw(&mut self, span: Span, id: u32) {
        let row = span.v * self.width;
        let depths = &mut self.inverse_depths[row + span.first..row + span.end];
        let ids = &mut self.ids[row + span.first..row + span.end];
        for (index, (nearest, winner)) in depths.iter_mut().zip(ids).enumerate() {
            let inverse_depth = span.start + span.step * (index as i32) as f32;
            // Masks instead of a choice: a choice becomes a branch per pixel, this becomes vector code.
            let nearer = u32::from(inverse_depth > *nearest).wrapping_neg();
            *nearest = f32::from_bits((inverse_depth.to_bits() & nearer) | (nearest.to_bits() & !nearer));
            *winner = (id & nearer) | (*winner & !nearer);
        }
    }
}
