//! Says which lent memory was misused, and how, when the system stops a plugin for it.
#![allow(unsafe_code)]

use std::ffi::c_void;
use std::fs::File;
use std::os::fd::AsRawFd;
use std::ptr::null_mut;
use std::sync::atomic::{AtomicBool, AtomicI32, AtomicPtr, AtomicUsize, Ordering};

/// Blocks that are known at a time; older ones are forgotten first.
const SLOTS: usize = 512;
/// Exit code of a process that ends here; the report says why.
const EXIT_CODE: i32 = 98;

struct Slot {
    name: AtomicPtr<u8>,
    name_length: AtomicUsize,
    start: AtomicUsize,
    data_end: AtomicUsize,
    end: AtomicUsize,
    is_closed: AtomicBool,
}

static SLOT: [Slot; SLOTS] = [const {
    Slot {
        name: AtomicPtr::new(null_mut()),
        name_length: AtomicUsize::new(0),
        start: AtomicUsize::new(0),
        data_end: AtomicUsize::new(0),
        end: AtomicUsize::new(0),
        is_closed: AtomicBool::new(false),
    }
}; SLOTS];
static NEXT: AtomicUsize = AtomicUsize::new(0);
static REPORT: AtomicI32 = AtomicI32::new(-1);

/// Remembers a block from address `start` to `end`, whose lent bytes end at `data_end`.
pub(super) fn watch(name: &'static str, start: usize, data_end: usize, end: usize) -> usize {
    let index = NEXT.fetch_add(1, Ordering::Relaxed) % SLOTS;
    let slot = &SLOT[index];
    slot.name.store(name.as_ptr().cast_mut(), Ordering::Relaxed);
    slot.name_length.store(name.len(), Ordering::Relaxed);
    slot.data_end.store(data_end, Ordering::Relaxed);
    slot.start.store(start, Ordering::Relaxed);
    slot.is_closed.store(false, Ordering::Relaxed);
    slot.end.store(end, Ordering::Relaxed);
    index
}

/// The block's call is over.
pub(super) fn closed(slot: usize) {
    SLOT[slot].is_closed.store(true, Ordering::Relaxed);
}

/// From now on a fault on a watched block is written to `report` before the process ends.
pub(super) fn tell(report: &File) {
    REPORT.store(report.as_raw_fd(), Ordering::Relaxed);
    for signal in [libc::SIGSEGV, libc::SIGBUS] {
        // SAFETY: all-zero is a valid action; its mask is then empty.
        let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
        action.sa_sigaction = on_fault as *const () as usize;
        action.sa_flags = libc::SA_SIGINFO | libc::SA_ONSTACK;
        // SAFETY: the handler has the form that SA_SIGINFO asks for and does only what a handler may.
        unsafe { libc::sigaction(signal, &raw const action, null_mut()) };
    }
}

/// Only loads of atomics, `write` and `_exit`: anything else may hang in a handler.
extern "C" fn on_fault(signal: i32, info: *mut libc::siginfo_t, _: *mut c_void) {
    // SAFETY: the system hands in what SA_SIGINFO promises.
    let address = unsafe { (*info).si_addr() } as usize;
    let is_in =
        |slot: &&Slot| (slot.start.load(Ordering::Relaxed)..slot.end.load(Ordering::Relaxed)).contains(&address);
    let Some(slot) = SLOT.iter().find(is_in) else {
        // Somebody else's memory: let the system end the process as it would.
        // SAFETY: the default action, for the fault that happens again on return.
        unsafe { libc::signal(signal, libc::SIG_DFL) };
        return;
    };
    let how: &[u8] = if slot.is_closed.load(Ordering::Relaxed) {
        b"used after the call"
    } else if address >= slot.data_end.load(Ordering::Relaxed) {
        b"overrun: something behind its end was read or written"
    } else {
        b"written to"
    };
    say(b"fault\t");
    // SAFETY: name and length are those of a text that lives as long as the program.
    say(unsafe {
        std::slice::from_raw_parts(slot.name.load(Ordering::Relaxed), slot.name_length.load(Ordering::Relaxed))
    });
    say(b"\t");
    say(how);
    say(b"\n");
    // SAFETY: ends the process without running anything.
    unsafe { libc::_exit(EXIT_CODE) };
}

fn say(bytes: &[u8]) {
    // SAFETY: as many bytes as the slice has, to a file that stays open.
    unsafe { libc::write(REPORT.load(Ordering::Relaxed), bytes.as_ptr().cast(), bytes.len()) };
}
