//! Limits on the process of a trial.
#![allow(unsafe_code)]

/// Gives the process at most `bytes` of address space, and no core file.
#[cfg(unix)]
pub(super) fn set(bytes: u64) {
    for (resource, limit) in [(libc::RLIMIT_AS, bytes), (libc::RLIMIT_CORE, 0)] {
        let limit = libc::rlimit { rlim_cur: limit as libc::rlim_t, rlim_max: limit as libc::rlim_t };
        // SAFETY: a whole struct is readable. Where the system refuses, the time limit of the parent is left.
        unsafe { libc::setrlimit(resource, &raw const limit) };
    }
}

/// Elsewhere the time limit of the parent has to do alone.
#[cfg(not(unix))]
pub(super) fn set(_: u64) {}
