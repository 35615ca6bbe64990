//! The memory that host and plugin share: one file, mapped by both, that only grows.
#![allow(unsafe_code)]

use memmap2::{MmapOptions, MmapRaw};
use resurvey_schema::ClassId;
use resurvey_schema::abi::RayHit;
use resurvey_schema::service::{ClassCounts, ViewFeature};
use resurvey_schema::wire::{Array, CANCEL_AT, Dtype, MEMORY_HEADER, MEMORY_MAGIC, SCORED_AT};
use std::fs::File;
use std::io;
use std::sync::atomic::{AtomicU8, AtomicU32, Ordering};

/// Bytes at the start; a call that needs more makes it grow.
const FIRST_BYTES: usize = 64 << 10;
/// Every array begins at a multiple of this: a cache line, and the widest vector.
const ALIGNMENT: usize = 64;

/// Values that may be copied as bytes in both directions.
///
/// # Safety
/// Any bytes are a value, and the type has no reference or pointer.
pub(in super::super) unsafe trait Plain: Copy {
    /// What one value is made of.
    const DTYPE: Dtype;
}

// SAFETY: numbers, and records of numbers; padding is never read.
unsafe impl Plain for u8 {
    const DTYPE: Dtype = Dtype::U8;
}
// SAFETY: as above.
unsafe impl Plain for ClassId {
    const DTYPE: Dtype = Dtype::U8;
}
// SAFETY: as above.
unsafe impl Plain for u32 {
    const DTYPE: Dtype = Dtype::U32;
}
// SAFETY: as above.
unsafe impl Plain for ClassCounts {
    const DTYPE: Dtype = Dtype::U32;
}
// SAFETY: as above.
unsafe impl Plain for f32 {
    const DTYPE: Dtype = Dtype::F32;
}
// SAFETY: as above.
unsafe impl Plain for f64 {
    const DTYPE: Dtype = Dtype::F64;
}
// SAFETY: as above.
unsafe impl<T: Plain, const N: usize> Plain for [T; N] {
    const DTYPE: Dtype = T::DTYPE;
}
// SAFETY: as above.
unsafe impl Plain for ViewFeature {
    const DTYPE: Dtype = Dtype::ViewFeature;
}
// SAFETY: as above.
unsafe impl Plain for RayHit {
    const DTYPE: Dtype = Dtype::RayHit;
}

/// The mapped file. The other side may write to it at any time: what is read is copied first and checked then.
#[derive(Debug)]
pub(in super::super) struct SharedMemory {
    file: File,
    map: MmapRaw,
    /// Maps that pointers of the call in progress may point into.
    older: Vec<MmapRaw>,
}

impl SharedMemory {
    /// New memory that nobody can cut: a file that shrinks under a map ends the process that reads it.
    pub(in super::super) fn new() -> io::Result<Self> {
        use rustix::fs::{MemfdFlags, SealFlags, fcntl_add_seals, memfd_create};
        let file = memfd_create("resurvey-plugin", MemfdFlags::CLOEXEC | MemfdFlags::ALLOW_SEALING)?;
        fcntl_add_seals(&file, SealFlags::SHRINK)?;
        let file = File::from(file);
        allocate(&file, FIRST_BYTES)?;
        let memory = Self { map: map(&file, FIRST_BYTES)?, file, older: Vec::new() };
        memory.write(0, &MEMORY_MAGIC);
        Ok(memory)
    }

    /// The memory that the host made.
    pub(in super::super) fn open(file: File) -> io::Result<Self> {
        let bytes = usize::try_from(file.metadata()?.len()).map_err(io::Error::other)?;
        let memory = Self { map: map(&file, bytes)?, file, older: Vec::new() };
        let mut magic = [0; MEMORY_MAGIC.len()];
        if memory.bytes() < MEMORY_HEADER || !memory.read_into(0, &mut magic) || magic != MEMORY_MAGIC {
            return Err(io::Error::other("descriptor 0 is not the memory of a plugin wire"));
        }
        Ok(memory)
    }

    /// The file, to hand on.
    pub(in super::super) fn file(&self) -> io::Result<File> {
        self.file.try_clone()
    }

    /// Bytes that are mapped.
    pub(in super::super) fn bytes(&self) -> usize {
        self.map.len()
    }

    /// Makes the file hold at least `bytes`.
    pub(in super::super) fn grow(&mut self, bytes: usize) -> io::Result<()> {
        if bytes > self.bytes() {
            let doubled = bytes.checked_next_power_of_two().unwrap_or(bytes);
            allocate(&self.file, doubled)?;
            self.map = map(&self.file, doubled)?;
        }
        Ok(())
    }

    /// Maps what the host has added; what was lent before stays where it is until [`forget_older`](Self::forget_older).
    pub(in super::super) fn follow(&mut self, bytes: usize) -> io::Result<()> {
        if bytes > self.bytes() {
            self.older.push(std::mem::replace(&mut self.map, map(&self.file, bytes)?));
        }
        Ok(())
    }

    /// Ends what was lent in earlier calls.
    pub(in super::super) fn forget_older(&mut self) {
        self.older.clear();
    }

    /// Copies `values` to `offset`; `false`, with nothing written, when they do not fit.
    pub(in super::super) fn write<T: Plain>(&self, offset: usize, values: &[T]) -> bool {
        let Some(place) = self.place(offset, size_of_val(values)) else { return false };
        // SAFETY: `place` has that many bytes, by the line above; the map belongs to no Rust value.
        unsafe { std::ptr::copy_nonoverlapping(values.as_ptr().cast::<u8>(), place, size_of_val(values)) };
        true
    }

    /// Copies from `offset` over `values`; `false` when there is less.
    pub(in super::super) fn read_into<T: Plain>(&self, offset: usize, values: &mut [T]) -> bool {
        let bytes = size_of_val(values);
        let Some(place) = self.place(offset, bytes) else { return false };
        // SAFETY: `place` has that many bytes, by the line above; any bytes are values of a `Plain` type.
        unsafe { std::ptr::copy_nonoverlapping(place.cast_const(), values.as_mut_ptr().cast::<u8>(), bytes) };
        true
    }

    /// The values of a packed array whose rows of the last axes make one `T`; `None` when it is not one or lies outside.
    pub(in super::super) fn array<T: Plain>(&self, array: &Array) -> Option<Vec<T>> {
        let packed = Array::packed(array.dtype, &array.shape, array.offset);
        let bytes = Array::packed_bytes(array.dtype, &array.shape)?;
        if array.dtype != T::DTYPE || bytes % size_of::<T>() != 0 || (bytes > 0 && packed.strides != array.strides) {
            return None;
        }
        let place = self.place(array.offset, bytes)?;
        let count = bytes / size_of::<T>();
        let mut values = Vec::<T>::with_capacity(count);
        // SAFETY: `place` has that many bytes and the vector as much room; any bytes are values of a `Plain` type.
        unsafe { std::ptr::copy_nonoverlapping(place.cast_const(), values.as_mut_ptr().cast::<u8>(), bytes) };
        // SAFETY: `count` values were written just now.
        unsafe { values.set_len(count) };
        Some(values)
    }

    /// Where `bytes` bytes lie; valid until [`grow`](Self::grow), or [`forget_older`](Self::forget_older) after
    /// [`follow`](Self::follow).
    pub(in super::super) fn place(&self, offset: usize, bytes: usize) -> Option<*mut u8> {
        let end = offset.checked_add(bytes)?;
        // Arithmetic alone, without a claim on the memory.
        (end <= self.bytes()).then(|| self.map.as_mut_ptr().wrapping_add(offset))
    }

    /// Asks the plugin to end its call, or not.
    pub(in super::super) fn set_cancelled(&self, cancelled: bool) {
        self.cancel_byte().store(u8::from(cancelled), Ordering::Relaxed);
    }

    /// Whether the call is to end.
    pub(in super::super) fn cancelled(&self) -> bool {
        self.cancel_byte().load(Ordering::Relaxed) != 0
    }

    /// Views scored since the start, as the plugin counts.
    pub(in super::super) fn scored(&self) -> u32 {
        self.scored_count().load(Ordering::Relaxed)
    }

    /// Counts one more.
    pub(in super::super) fn count_scored(&self) {
        self.scored_count().fetch_add(1, Ordering::Relaxed);
    }

    fn cancel_byte(&self) -> &AtomicU8 {
        // SAFETY: the file has a header (checked in `open`, made in `new`) and never shrinks; a byte is aligned.
        unsafe { AtomicU8::from_ptr(self.map.as_mut_ptr().wrapping_add(CANCEL_AT)) }
    }

    fn scored_count(&self) -> &AtomicU32 {
        // SAFETY: as above; maps begin at pages, so that byte 16 is aligned for a `u32`.
        unsafe { AtomicU32::from_ptr(self.map.as_mut_ptr().wrapping_add(SCORED_AT).cast::<u32>()) }
    }
}

/// The next place for an array.
pub(in super::super) fn aligned(offset: usize) -> usize {
    offset.next_multiple_of(ALIGNMENT)
}

/// Gives the file its bytes now: a page that is missing later ends the process that touches it.
fn allocate(file: &File, bytes: usize) -> io::Result<()> {
    Ok(rustix::fs::fallocate(file, rustix::fs::FallocateFlags::empty(), 0, bytes as u64)?)
}

/// The first `bytes` of the file, however long the other side has made it.
fn map(file: &File, bytes: usize) -> io::Result<MmapRaw> {
    MmapOptions::new().len(bytes).map_raw(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_side_writes_the_other_reads_also_after_it_has_grown() {
        let mut host = SharedMemory::new().unwrap();
        let mut plugin = SharedMemory::open(host.file().unwrap()).unwrap();
        let far = 1 << 20;
        assert!(!host.write(far, &[1.5_f64]));
        host.grow(far + 8).unwrap();
        assert!(host.write(far, &[1.5_f64]));
        let array = Array::packed(Dtype::F64, &[1], far);
        assert_eq!(plugin.array::<f64>(&array), None);
        plugin.follow(host.bytes()).unwrap();
        assert_eq!(plugin.array::<f64>(&array), Some(vec![1.5]));
        host.set_cancelled(true);
        plugin.count_scored();
        assert!(plugin.cancelled());
        assert_eq!(host.scored(), 1);
    }

    #[test]
    fn nobody_can_cut_the_file_under_the_others_map() {
        let memory = SharedMemory::new().unwrap();
        let error = memory.file().unwrap().set_len(0).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::PermissionDenied);
    }

    #[test]
    fn the_host_maps_what_it_has_made_and_not_what_a_plugin_makes_of_it() {
        let mut memory = SharedMemory::new().unwrap();
        memory.file().unwrap().set_len(1 << 40).unwrap();
        assert_eq!(memory.bytes(), FIRST_BYTES);
        memory.grow(FIRST_BYTES + 1).unwrap();
        assert_eq!(memory.bytes(), 2 * FIRST_BYTES);
        assert_eq!(memory.array::<u8>(&Array::packed(Dtype::U8, &[1 << 20], 0)), None);
    }

    #[test]
    fn arrays_that_lie_outside_or_are_no_arrays_are_none() {
        let memory = SharedMemory::new().unwrap();
        let array = |dtype, shape: &[usize], offset| Array::packed(dtype, shape, offset);
        assert_eq!(memory.array::<[f64; 3]>(&array(Dtype::F64, &[2, 3], 4096)), Some(vec![[0.0; 3]; 2]));
        for wrong in [
            array(Dtype::F64, &[2, 2], 4096),
            array(Dtype::F32, &[2, 3], 4096),
            array(Dtype::F64, &[usize::MAX, 3], 4096),
            array(Dtype::F64, &[2, 3], usize::MAX - 8),
            array(Dtype::F64, &[2, 3], memory.bytes() - 40),
            Array { strides: vec![48, 8], ..array(Dtype::F64, &[2, 3], 4096) },
        ] {
            assert_eq!(memory.array::<[f64; 3]>(&wrong), None, "{wrong:?}");
        }
        assert!(SharedMemory::open(tempfile::tempfile().unwrap()).is_err());
    }
}
