//! One-bit images, 64 pixels a word: boundaries and disk dilation in a few operations a word.
//!
//! Every row ends with a word of zeros or more, and so do the image and its top: neighbours of a word are the words before and
//! after it and those one row away, at the border too.

use crate::image::mask;
use pulp::Simd;

/// Pixels in a word.
pub(super) const WORD: usize = 64;

/// Words worked on at once; rows are padded to whole groups.
const GROUP: usize = 8;

/// Size of a binary image.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Size {
    width: usize,
    height: usize,
}

/// A binary image.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Bits {
    size: Size,
    words: Vec<u64>,
}

impl Size {
    pub(super) fn new(width: usize, height: usize) -> Self {
        Self { width, height }
    }

    fn words_per_row(self) -> usize {
        (self.width.div_ceil(WORD) + 1).next_multiple_of(GROUP)
    }

    /// Index of the first word of row `v`.
    #[inline(always)]
    pub(super) fn row(self, v: usize) -> usize {
        (v + 1) * self.words_per_row()
    }

    /// The words between those above the image and those below it.
    fn inside(self) -> std::ops::Range<usize> {
        self.row(0)..self.row(self.height)
    }
}

impl Bits {
    /// All zeros.
    pub(super) fn new(size: Size) -> Self {
        Self { size, words: vec![0; size.words_per_row() * (size.height + 2)] }
    }

    /// Ones where `pick` holds.
    pub(super) fn from_pixels(size: Size, values: &[u8], pick: impl Fn(u8) -> bool) -> Self {
        let mut bits = Self::new(size);
        for (v, pixels) in values.chunks(size.width.max(1)).enumerate() {
            for (word, pixels) in bits.words[size.row(v)..].iter_mut().zip(pixels.chunks(WORD)) {
                *word = pixels.iter().enumerate().fold(0, |word, (bit, &value)| word | u64::from(pick(value)) << bit);
            }
        }
        bits
    }

    pub(super) fn size(&self) -> Size {
        self.size
    }

    #[inline(always)]
    pub(super) fn clear(&mut self) {
        self.words.fill(0);
    }

    /// Takes one word of a row from 64 pixels: ones where they are `value`.
    #[inline(always)]
    pub(super) fn set_word<S: Simd>(&mut self, simd: S, index: usize, pixels: &[u8; WORD], value: u8) {
        self.words[index] = mask(simd, pixels, value);
    }

    #[inline(always)]
    pub(super) fn clear_word(&mut self, index: usize) {
        self.words[index] = 0;
    }

    #[inline(always)]
    pub(super) fn add_word(&mut self, index: usize, bits: u64) {
        self.words[index] |= bits;
    }

    #[inline(always)]
    pub(super) fn count(&self) -> u32 {
        let mut count = 0;
        for word in &self.words {
            count += word.count_ones();
        }
        count
    }

    #[inline(always)]
    pub(super) fn count_and(&self, other: &Self) -> u32 {
        let mut count = 0;
        for (a, b) in self.words.iter().zip(&other.words) {
            count += (a & b).count_ones();
        }
        count
    }

    #[inline(always)]
    pub(super) fn and(&mut self, other: &Self) {
        for (a, b) in self.words.iter_mut().zip(&other.words) {
            *a &= b;
        }
    }

    #[inline(always)]
    pub(super) fn or(&mut self, other: &Self) {
        for (a, b) in self.words.iter_mut().zip(&other.words) {
            *a |= b;
        }
    }

    /// Ones of `self` that have a 4-neighbour inside the image (all ones in `whole`) that is zero.
    #[inline(always)]
    pub(super) fn boundary_into(&self, whole: &Self, out: &mut Self) {
        let inside = self.size.inside();
        let (count, row) = (inside.len(), self.size.words_per_row());
        let from = |first: usize| first..first + count;
        let (here, up, down) = (inside.clone(), from(inside.start - row), from(inside.start + row));
        let (left, right) = (from(inside.start - 1), from(inside.start + 1));
        let (x, all) = (&self.words, &whole.words);
        let (x_up, x_down, x_left, x_right) = (&x[up.clone()], &x[down.clone()], &x[left.clone()], &x[right.clone()]);
        let (all_up, all_down, all_left, all_right) = (&all[up], &all[down], &all[left], &all[right]);
        let (x, all, out) = (&x[here.clone()], &all[here.clone()], &mut out.words[here]);
        for k in 0..count {
            let zero = !x[k] & all[k];
            let beside = zero << 1 | (!x_left[k] & all_left[k]) >> 63 | zero >> 1 | (!x_right[k] & all_right[k]) << 63;
            out[k] = x[k] & (beside | (!x_up[k] & all_up[k]) | (!x_down[k] & all_down[k]));
        }
    }

    /// Index of every group of words in which `where_ones` has ones, and the disks around the ones of `self` there; past
    /// the border of the image undefined. `wide` is scratch space.
    #[inline(always)]
    fn dilate(
        &self,
        disk: &Disk,
        where_ones: &Self,
        wide: &mut Vec<Self>,
        mut found: impl FnMut(usize, &[u64; GROUP]),
    ) {
        let row = self.size.words_per_row();
        self.widen(disk, wide);
        for v in 0..self.size.height {
            let first = self.size.row(v);
            for start in (first..first + row).step_by(GROUP) {
                let mut any = 0;
                for word in &where_ones.words[start..start + GROUP] {
                    any |= word;
                }
                if any == 0 {
                    continue;
                }
                let mut group = [0; GROUP];
                for &(dv, width) in &disk.rows {
                    let words = &wide[width].words;
                    if v + dv < self.size.height {
                        add(&mut group, &words[start + dv * row..start + dv * row + GROUP]);
                    }
                    if dv > 0 && dv <= v {
                        add(&mut group, &words[start - dv * row..start - dv * row + GROUP]);
                    }
                }
                found(start, &group);
            }
        }
    }

    /// Makes `wide[i]` the ones of `self` widened along rows by the disk's width number i.
    #[inline(always)]
    fn widen(&self, disk: &Disk, wide: &mut Vec<Self>) {
        // The last one is spare.
        wide.resize(disk.widths.len() + 1, Self::new(self.size));
        let mut done = 0;
        for (index, &half) in disk.widths.iter().enumerate() {
            let (narrower, rest) = wide.split_at_mut(index);
            let (this, spare) = rest.split_at_mut(1);
            let Some(spare) = spare.last_mut() else { return };
            let source = narrower.last().unwrap_or(self);
            let step = half - done;
            if step == 1 {
                source.spread_into(step, &mut this[0]);
                done = half;
            } else {
                this[0].words.copy_from_slice(&source.words);
            }
            while done < half {
                let step = (half - done).min(done.max(1)).min(WORD - 1);
                this[0].spread_into(step, spare);
                std::mem::swap(&mut this[0].words, &mut spare.words);
                done += step;
            }
        }
    }

    /// Ones within a disk of a one, where `where_ones` has ones.
    pub(super) fn dilated(&self, disk: &Disk, where_ones: &Self) -> Self {
        let mut out = Self::new(self.size);
        self.dilate(disk, where_ones, &mut Vec::new(), |start, group| {
            out.words[start..start + GROUP].copy_from_slice(group);
        });
        out.and(where_ones);
        out
    }

    /// How many ones of `of` lie within a disk of a one of `self`; `wide` is scratch space.
    #[inline(always)]
    pub(super) fn count_near(&self, disk: &Disk, of: &Self, wide: &mut Vec<Self>) -> u32 {
        let mut count = 0;
        self.dilate(disk, of, wide, |start, group| {
            for (a, b) in group.iter().zip(&of.words[start..start + GROUP]) {
                count += (a & b).count_ones();
            }
        });
        count
    }

    /// ORs all rows with themselves shifted by `step` (1–63) pixels to both sides.
    #[inline(always)]
    fn spread_into(&self, step: usize, out: &mut Self) {
        let inside = self.size.inside();
        let (count, row) = (inside.len(), self.size.words_per_row());
        let (x, left) = (&self.words[inside.clone()], &self.words[inside.start - 1..inside.end - 1]);
        let right = &self.words[inside.start + 1..inside.end + 1];
        let out = &mut out.words[inside];
        let back = WORD - step;
        for k in 0..count {
            out[k] = x[k] | x[k] << step | left[k] >> back | x[k] >> step | right[k] << back;
        }
        // What leaves a row does not enter the next.
        let used = self.size.width.div_ceil(WORD);
        out.chunks_exact_mut(row).for_each(|row| row[used] = 0);
    }
}

#[inline(always)]
fn add(to: &mut [u64; GROUP], from: &[u64]) {
    for (to, from) in to.iter_mut().zip(from) {
        *to |= from;
    }
}

/// The pixels whose centres lie within a radius of a centre.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Disk {
    /// How far its rows reach to either side, each width once, narrowest first.
    widths: Vec<usize>,
    /// Distance of a row of it from its middle, and the number of that row's width.
    rows: Vec<(usize, usize)>,
}

impl Disk {
    pub(super) fn new(radius_px: f64) -> Self {
        let reach = radius_px.max(0.0).floor() as usize;
        let half = |dv: usize| (radius_px * radius_px - (dv * dv) as f64).max(0.0).sqrt().floor() as usize;
        let mut widths: Vec<usize> = (0..=reach).rev().map(half).collect();
        widths.dedup();
        let row = |dv: usize| (dv, widths.partition_point(|&width| width < half(dv)));
        Self { rows: (0..=reach).map(row).collect(), widths }
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
            let size = Size::new(width, height);
            let ones = |values: &[u8]| Bits::from_pixels(size, values, |value| value == 1);
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
            let whole = Bits::from_pixels(size, &values, |_| true);
            prop_assert_eq!(&ones(&values).dilated(&Disk::new(radius), &whole), &ones(&dilated));
            let mut found = Bits::new(size);
            ones(&values).boundary_into(&whole, &mut found);
            prop_assert_eq!(&found, &ones(&boundary));
        }
    }
}
