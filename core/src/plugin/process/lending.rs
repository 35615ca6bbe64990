//! What the host lends in one call: arrays one after the other in the shared memory.

use super::memory::{Plain, SharedMemory, aligned};
use crate::image::Raster;
use crate::plugin::input::ViewImages;
use resurvey_schema::service::ViewFeature;
use resurvey_schema::wire::{Array, Dtype, MEMORY_HEADER, Scratch, WireViews};
use std::io;
use std::ops::Range;

/// Least bytes that a plugin may write to in a call.
const SCRATCH_BYTES: usize = 1 << 20;
/// What stands where something was lent.
const FORGOTTEN: u8 = 0xA5;
/// Bytes that are lent one after the other before it is begun anew.
const MOST_FORGOTTEN: usize = 64 << 20;

/// The host's side of the memory.
#[derive(Debug)]
pub(super) struct Lending {
    pub(super) memory: SharedMemory,
    /// The first byte that is lent in this call.
    first: usize,
    /// The first byte that is not lent.
    next: usize,
    /// The first byte that was not lent in this call.
    end: usize,
    /// Whether nothing of a call is there in the next.
    forgets: bool,
    /// What the plugin may write to in this call.
    scratch: Range<usize>,
}

impl Lending {
    /// Nothing lent yet; with `forgets` a plugin that keeps what it was lent finds other things there.
    pub(super) fn new(forgets: bool) -> io::Result<Self> {
        let (memory, first) = (SharedMemory::new()?, MEMORY_HEADER);
        Ok(Self { memory, first, next: first, end: first, forgets, scratch: 0..0 })
    }

    /// Takes everything back.
    pub(super) fn start(&mut self) {
        if self.forgets {
            self.memory.write(self.first, &vec![FORGOTTEN; self.end - self.first]);
            self.first = if self.end < MOST_FORGOTTEN { aligned(self.end) } else { MEMORY_HEADER };
        }
        (self.next, self.end, self.scratch) = (self.first, self.first, 0..0);
        self.memory.set_cancelled(false);
    }

    /// Where the next array will lie.
    pub(super) fn mark(&self) -> usize {
        self.next
    }

    /// Takes back what was lent since `mark`.
    pub(super) fn back_to(&mut self, mark: usize) {
        self.next = mark;
    }

    /// A place for an array.
    pub(super) fn reserve(&mut self, dtype: Dtype, shape: &[usize]) -> io::Result<Array> {
        let offset = aligned(self.next);
        let end = Array::packed_bytes(dtype, shape).and_then(|bytes| offset.checked_add(bytes));
        let end = end.ok_or_else(|| io::Error::other("an array is larger than memory can be"))?;
        self.memory.grow(end)?;
        (self.next, self.end) = (end, self.end.max(end));
        Ok(Array::packed(dtype, shape, offset))
    }

    /// A copy of `values`, which are the rows of `shape`.
    pub(super) fn lend<T: Plain>(&mut self, shape: &[usize], values: &[T]) -> io::Result<Array> {
        let array = self.reserve(T::DTYPE, shape)?;
        self.memory.write(array.offset, values);
        Ok(array)
    }

    /// A copy of a raster.
    pub(super) fn raster<T: Plain>(&mut self, raster: &Raster<T>) -> io::Result<Array> {
        self.lend(&[raster.height() as usize, raster.width() as usize], raster.values())
    }

    /// A place for what the plugin sends, with at least a byte per pixel.
    pub(super) fn scratch(&mut self, pixels: usize) -> io::Result<Scratch> {
        let bytes = SCRATCH_BYTES.max(aligned(pixels));
        let array = self.reserve(Dtype::U8, &[bytes])?;
        self.scratch = array.offset..array.offset + bytes;
        Ok(Scratch { offset: array.offset, bytes })
    }

    /// A copy of an array that the plugin has sent; `None` when it is none of these values, or lies outside the scratch.
    pub(super) fn sent<T: Plain>(&self, array: &Array) -> Option<Vec<T>> {
        let bytes = Array::packed_bytes(array.dtype, &array.shape)?;
        let is_inside = array.offset >= self.scratch.start && array.offset.checked_add(bytes)? <= self.scratch.end;
        if is_inside || bytes == 0 { self.memory.array(array) } else { None }
    }

    /// Places for `count` views of one size, with the table that their features index.
    pub(super) fn reserve_views(
        &mut self,
        count: usize,
        (width, height): (u32, u32),
        table: &[ViewFeature],
    ) -> io::Result<WireViews> {
        let (width, height) = (width as usize, height as usize);
        Ok(WireViews {
            origins: self.reserve(Dtype::F64, &[count, 3])?,
            labels: self.reserve(Dtype::U8, &[count, height, width])?,
            range_m: self.reserve(Dtype::F32, &[count, height, width])?,
            points: self.reserve(Dtype::F32, &[count, height, width, 3])?,
            features: self.reserve(Dtype::U32, &[count, height, width])?,
            feature_table: self.lend(&[table.len()], table)?,
        })
    }

    /// Copies a view to place `index` of `views`, which are of its size.
    pub(super) fn put_view(&self, views: &WireViews, index: usize, view: &ViewImages<'_>) {
        let at = |array: &Array| array.offset + index * array.strides[0];
        self.memory.write(at(&views.origins), &<[f64; 3]>::from(view.origin));
        self.memory.write(at(&views.labels), view.labels.values());
        self.memory.write(at(&views.range_m), view.range_m.values());
        self.memory.write(at(&views.points), view.points.values());
        self.memory.write(at(&views.features), view.features.values());
    }
}

/// The first `count` views of `views`.
pub(super) fn first(views: &WireViews, count: usize) -> WireViews {
    let mut views = views.clone();
    for array in [&mut views.origins, &mut views.labels, &mut views.range_m, &mut views.points, &mut views.features] {
        array.shape[0] = count;
    }
    views
}

/// Bytes of one view of this size.
pub(super) fn view_bytes((width, height): (u32, u32)) -> usize {
    // Label, range, point and feature of a pixel.
    const PIXEL_BYTES: usize = 1 + 4 + 12 + 4;
    (width as usize * height as usize).saturating_mul(PIXEL_BYTES).max(1)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_to_be_forgotten_is_overwritten_and_lent_elsewhere() {
        let mut lending = Lending::new(true).unwrap();
        let first = lending.lend(&[4], &[7_u8; 4]).unwrap();
        lending.start();
        let second = lending.lend(&[4], &[8_u8; 4]).unwrap();
        assert_ne!(first.offset, second.offset);
        let at = |array: &Array| lending.memory.array::<u8>(array).unwrap();
        assert_eq!((at(&first), at(&second)), (vec![FORGOTTEN; 4], vec![8; 4]));
    }

    #[test]
    fn what_a_plugin_sends_lies_in_the_scratch_or_is_not_taken() {
        let mut lending = Lending::new(false).unwrap();
        let photo = lending.lend(&[8], &[7_u8; 8]).unwrap();
        let scratch = lending.scratch(0).unwrap();
        let array = |offset, length| Array::packed(Dtype::U8, &[length], offset);
        assert_eq!(lending.sent::<u8>(&array(scratch.offset, 3)), Some(vec![0; 3]));
        let end = scratch.offset + scratch.bytes;
        assert_eq!(lending.sent::<u8>(&array(end - 2, 2)), Some(vec![0; 2]));
        for wrong in [photo, array(end - 2, 3), array(end, usize::MAX), array(scratch.offset - 64, 65)] {
            assert_eq!(lending.sent::<u8>(&wrong), None, "{wrong:?}");
        }
        // Nothing lies nowhere.
        assert_eq!(lending.sent::<u8>(&array(0, 0)), Some(Vec::new()));
        lending.start();
        assert_eq!(lending.sent::<u8>(&array(scratch.offset, 3)), None);
    }
}
