//! Memory whose every misuse ends the process at once: what is lent ends where a forbidden page begins, can be made
//! read-only for the length of a call, and unreadable after it.
#![allow(unsafe_code)]

use super::fault;
use std::ptr::null_mut;

/// What stands around the lent bytes.
const CANARY: u8 = 0xA5;

/// Bytes that end at a forbidden page. Never given back: a plugin that keeps a pointer must not find other things there.
pub(super) struct Block {
    base: *mut u8,
    data: *mut u8,
    /// Bytes from `base` to the forbidden page.
    writable: usize,
    length: usize,
    slot: usize,
}

impl Block {
    /// `bytes`, aligned to `alignment` (at most 8), called `name` in messages; `None` when the system has no more memory.
    pub(super) fn new(name: &'static str, bytes: &[u8], alignment: usize) -> Option<Self> {
        // SAFETY: asks for a number.
        let page = usize::try_from(unsafe { libc::sysconf(libc::_SC_PAGESIZE) }).ok()?;
        let writable = bytes.len().max(1).next_multiple_of(8).next_multiple_of(page);
        let access = libc::PROT_READ | libc::PROT_WRITE;
        let flags = libc::MAP_PRIVATE | libc::MAP_ANONYMOUS;
        // SAFETY: new pages, wherever the system has room.
        let base = unsafe { libc::mmap(null_mut(), writable + page, access, flags, -1, 0) };
        if base == libc::MAP_FAILED {
            return None;
        }
        let base = base.cast::<u8>();
        // SAFETY: the last page of the mapping just made.
        unsafe { libc::mprotect(base.add(writable).cast(), page, libc::PROT_NONE) };
        // SAFETY: `writable` bytes were mapped, and nobody else knows them.
        unsafe { base.write_bytes(CANARY, writable) };
        // SAFETY: the length, rounded up to 8 at most, is not above `writable`.
        let data = unsafe { base.add(writable - bytes.len().next_multiple_of(alignment)) };
        // SAFETY: `bytes.len()` bytes are writable at `data`, and new memory overlaps nothing.
        unsafe { data.copy_from_nonoverlapping(bytes.as_ptr(), bytes.len()) };
        let slot = fault::watch(name, base as usize, data as usize + bytes.len(), base as usize + writable + page);
        Some(Self { base, data, writable, length: bytes.len(), slot })
    }

    /// The first byte lent.
    pub(super) fn data(&self) -> *mut u8 {
        self.data
    }

    /// Writing to it ends the process from now on.
    pub(super) fn seal(&self) {
        self.protect(libc::PROT_READ);
    }

    /// So does reading.
    pub(super) fn close(&self) {
        fault::closed(self.slot);
        self.protect(libc::PROT_NONE);
    }

    fn protect(&self, access: i32) {
        // SAFETY: pages of this mapping alone; nothing of ours lies in them but the bytes lent.
        unsafe { libc::mprotect(self.base.cast(), self.writable, access) };
    }

    /// The bytes now; `None` when something around them was overwritten.
    pub(super) fn bytes(&self) -> Option<&[u8]> {
        // SAFETY: mapped and initialised in `new`, readable until `close`; the plugin's call is over.
        let all = unsafe { std::slice::from_raw_parts(self.base, self.writable) };
        let start = self.data as usize - self.base as usize;
        let (before, rest) = all.split_at(start);
        let (bytes, after) = rest.split_at(self.length);
        before.iter().chain(after).all(|byte| *byte == CANARY).then_some(bytes)
    }
}
