//! What a plugin must leave as it was: floating-point mode, working directory, locale, signal handlers.
#![allow(unsafe_code)]

use super::finding::Finding;

/// The state of the process that a plugin must not change.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Manners {
    floating_point: u64,
    directory: Vec<u8>,
    locale: Vec<u8>,
    handlers: Vec<usize>,
}

impl Manners {
    /// As it is now, in this thread.
    pub(super) fn now() -> Self {
        Self { floating_point: floating_point(), directory: directory(), locale: locale(), handlers: handlers() }
    }

    /// What `later` has changed, by the time named `when`.
    pub(super) fn change(&self, later: &Self, when: &str) -> Option<Finding> {
        if self.floating_point != later.floating_point {
            let (before, after) = (self.floating_point, later.floating_point);
            return Some(Finding::failed(
                format!("the floating-point mode changed {when}: control word {before:#x} became {after:#x}"),
                "build without -ffast-math (it links code that sets the mode), or put the mode back before you return",
            ));
        }
        if self.directory != later.directory {
            let [before, after] = [self, later].map(|state| String::from_utf8_lossy(&state.directory).into_owned());
            return Some(Finding::failed(
                format!("the working directory changed {when}: {before} became {after}"),
                "open files by their whole path instead",
            ));
        }
        if self.locale != later.locale {
            let [before, after] = [self, later].map(|state| String::from_utf8_lossy(&state.locale).into_owned());
            return Some(Finding::failed(
                format!("the locale changed {when}: {before:?} became {after:?}"),
                "use uselocale in your own thread, or functions that take a locale",
            ));
        }
        let changed = self.handlers.iter().zip(&later.handlers).position(|(before, after)| before != after)?;
        Some(Finding::failed(
            format!("the handler of signal {} changed {when}", changed + 1),
            "leave signals to the program",
        ))
    }
}

/// Control bits alone: what was rounded or divided by zero since is no mode.
#[cfg(target_arch = "x86_64")]
fn floating_point() -> u64 {
    const STATUS: u32 = 0x3f;
    let (mut sse, mut x87) = (0_u32, 0_u16);
    // SAFETY: stores 4 bytes at the address given and changes nothing else.
    unsafe { std::arch::asm!("stmxcsr [{}]", in(reg) &raw mut sse, options(nostack, preserves_flags)) };
    // SAFETY: stores 2 bytes at the address given and changes nothing else.
    unsafe { std::arch::asm!("fnstcw [{}]", in(reg) &raw mut x87, options(nostack, preserves_flags)) };
    u64::from(x87) << 32 | u64::from(sse & !STATUS)
}

#[cfg(target_arch = "aarch64")]
fn floating_point() -> u64 {
    let control: u64;
    // SAFETY: reads a register.
    unsafe { std::arch::asm!("mrs {}, fpcr", out(reg) control, options(nomem, nostack, preserves_flags)) };
    control
}

#[cfg(not(any(target_arch = "x86_64", target_arch = "aarch64")))]
fn floating_point() -> u64 {
    0
}

#[cfg(unix)]
fn directory() -> Vec<u8> {
    let mut bytes = vec![0_u8; libc::PATH_MAX as usize];
    // SAFETY: as many bytes are writable as the call is told.
    let found = unsafe { libc::getcwd(bytes.as_mut_ptr().cast(), bytes.len()) };
    if found.is_null() { Vec::new() } else { bytes.split(|byte| *byte == 0).next().unwrap_or_default().to_vec() }
}

#[cfg(unix)]
fn locale() -> Vec<u8> {
    // SAFETY: null asks without setting.
    let name = unsafe { libc::setlocale(libc::LC_ALL, std::ptr::null()) };
    if name.is_null() {
        return Vec::new();
    }
    // SAFETY: a text with a zero at its end, valid until the next call.
    unsafe { std::ffi::CStr::from_ptr(name) }.to_bytes().to_vec()
}

#[cfg(unix)]
fn handlers() -> Vec<usize> {
    const SIGNALS: std::ops::RangeInclusive<i32> = 1..=31;
    let handler = |signal| {
        // SAFETY: all-zero is a valid action.
        let mut action: libc::sigaction = unsafe { std::mem::zeroed() };
        // SAFETY: null sets nothing; the old action has room.
        unsafe { libc::sigaction(signal, std::ptr::null(), &raw mut action) };
        action.sa_sigaction
    };
    SIGNALS.map(handler).collect()
}

#[cfg(not(unix))]
fn directory() -> Vec<u8> {
    Vec::new()
}

#[cfg(not(unix))]
fn locale() -> Vec<u8> {
    Vec::new()
}

#[cfg(not(unix))]
fn handlers() -> Vec<usize> {
    Vec::new()
}
