//! One-bit images, 64 pixels a word, rows padded to whole words: boundaries and disk dilation in a few operations a
//! word.

/// A binary image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bits {
    words_per_row: usize,
    width: usize,
    height: usize,
    words: Vec<u64>,
}

impl Bits {
    pub(super) fn new(width: usize, height: usize) -> Self {
        let words_per_row = width.div_ceil(64);
        Self { words_per_row, width, height, words: vec![0; words_per_row * height] }
    }

    /// Ones where `pick` holds.
    pub(super) fn from_pixels(width: usize, values: &[u8], pick: impl Fn(u8) -> bool) -> Self {
        let mut bits = Self::new(width, values.len().checked_div(width).unwrap_or(0));
        for (row, pixels) in bits.words.chunks_mut(bits.words_per_row.max(1)).zip(values.chunks(width.max(1))) {
            for (word, chunk) in row.iter_mut().zip(pixels.chunks(64)) {
                *word = chunk.iter().enumerate().fold(0, |word, (bit, &value)| word | u64::from(pick(value)) << bit);
            }
        }
        bits
    }

    pub(super) fn count(&self) -> u32 {
        self.words.iter().map(|word| word.count_ones()).sum()
    }

    pub(super) fn count_and(&self, other: &Self) -> u32 {
        self.words.iter().zip(&other.words).map(|(a, b)| (a & b).count_ones()).sum()
    }

    pub(super) fn and(mut self, other: &Self) -> Self {
        self.words.iter_mut().zip(&other.words).for_each(|(a, b)| *a &= b);
        self
    }

    fn row(&self, v: usize) -> &[u64] {
        &self.words[v * self.words_per_row..(v + 1) * self.words_per_row]
    }

    /// Ones of `self` that have a 4-neighbour inside the image that is zero.
    pub(super) fn boundary(&self) -> Self {
        let mut out = Self::new(self.width, self.height);
        for v in 0..self.height {
            let (row, above) = (self.row(v), self.row(v.saturating_sub(1)));
            let below = self.row((v + 1).min(self.height - 1));
            for w in 0..self.words_per_row {
                let inside = row[w] & self.left_of(row, w) & self.right_of(row, w) & above[w] & below[w];
                out.words[v * self.words_per_row + w] = row[w] & !inside;
            }
        }
        out
    }

    /// Each pixel's left neighbour; the first column has itself.
    fn left_of(&self, row: &[u64], w: usize) -> u64 {
        let carry = if w == 0 { row[0] & 1 } else { row[w - 1] >> 63 };
        row[w] << 1 | carry
    }

    /// Each pixel's right neighbour; the last column has itself.
    fn right_of(&self, row: &[u64], w: usize) -> u64 {
        let last = (self.width - 1) % 64;
        if w + 1 < self.words_per_row {
            row[w] >> 1 | row[w + 1] << 63
        } else {
            (row[w] >> 1 & !(1 << last)) | row[w] & 1 << last
        }
    }

    /// Ones within Euclidean distance `radius_px` (pixel centres) of a one.
    pub(super) fn dilated(&self, radius_px: f64) -> Self {
        let mut out = Self::new(self.width, self.height);
        let reach = radius_px.max(0.0).floor() as usize;
        for dv in 0..=reach {
            let half = (radius_px * radius_px - (dv * dv) as f64).max(0.0).sqrt().floor() as usize;
            let wide = self.dilated_along_rows(half);
            for v in 0..self.height {
                for target in [v.checked_sub(dv), (dv > 0).then_some(v + dv)].into_iter().flatten() {
                    if target < self.height {
                        let start = target * self.words_per_row;
                        for (word, &add) in out.words[start..start + self.words_per_row].iter_mut().zip(wide.row(v)) {
                            *word |= add;
                        }
                    }
                }
            }
        }
        out
    }

    fn dilated_along_rows(&self, half: usize) -> Self {
        let mut out = self.clone();
        let mut done = 0;
        while done < half {
            let step = (half - done).min(done.max(1)).min(63);
            for row in out.words.chunks_mut(self.words_per_row) {
                spread(row, step);
            }
            done += step;
        }
        out.clear_padding();
        out
    }

    fn clear_padding(&mut self) {
        let used = self.width % 64;
        if used != 0 {
            for row in self.words.chunks_mut(self.words_per_row) {
                row[self.words_per_row - 1] &= (1 << used) - 1;
            }
        }
    }
}

/// ORs a row with itself shifted by `step` (1–63) pixels to both sides.
fn spread(row: &mut [u64], step: usize) {
    let source = row.to_vec();
    for w in 0..row.len() {
        let from_left = if w == 0 { 0 } else { source[w - 1] >> (64 - step) };
        let from_right = if w + 1 == row.len() { 0 } else { source[w + 1] << (64 - step) };
        row[w] |= source[w] << step | from_left | source[w] >> step | from_right;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn at(values: &[u8], width: usize, u: i64, v: i64) -> Option<bool> {
        let height = (values.len() / width) as i64;
        ((0..width as i64).contains(&u) && (0..height).contains(&v))
            .then(|| values[v as usize * width + u as usize] == 1)
    }

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(64))]
        #[test]
        fn dilation_and_boundary_are_those_of_the_definition(
            width in 1_usize..150, height in 1_usize..20, seed in any::<u64>(), radius in 0.0_f64..9.5
        ) {
            let mut state = seed;
            let values: Vec<u8> = (0..width * height).map(|_| {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                u8::from(state >> 58 < 3)
            }).collect();
            let bits = Bits::from_pixels(width, &values, |value| value == 1);
            let reach = radius.floor() as i64;
            let (mut dilated, mut boundary) = (values.clone(), values.clone());
            for v in 0..height as i64 {
                for u in 0..width as i64 {
                    let index = v as usize * width + u as usize;
                    let near = (-reach..=reach).flat_map(|dv| (-reach..=reach).map(move |du| (du, dv)))
                        .filter(|(du, dv)| ((du * du + dv * dv) as f64) <= radius * radius)
                        .any(|(du, dv)| at(&values, width, u + du, v + dv) == Some(true));
                    let edge = [(1, 0), (-1, 0), (0, 1), (0, -1)].iter()
                        .any(|(du, dv)| at(&values, width, u + du, v + dv) == Some(false));
                    dilated[index] = u8::from(near);
                    boundary[index] = u8::from(values[index] == 1 && edge);
                }
            }
            prop_assert_eq!(bits.dilated(radius), Bits::from_pixels(width, &dilated, |value| value == 1));
            prop_assert_eq!(bits.boundary(), Bits::from_pixels(width, &boundary, |value| value == 1));
        }
    }
}
