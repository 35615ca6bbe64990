//! How plugins from files are kept apart from the host.

use std::path::PathBuf;
use std::time::Duration;

/// What a plugin may take in a process of its own.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Isolation {
    /// The program that becomes the process when its first argument is [`SERVE`](super::SERVE): one that then calls
    /// [`serve`](super::serve). Without it, files are refused.
    pub program: Option<PathBuf>,
    /// Own time that a plugin has for one call; scoring one view is a call.
    pub call_limit: Duration,
    /// Address space, MiB, as far as the system allows it; 0 is no limit.
    pub memory_mib: u64,
    /// Whether what was lent is overwritten after each call, and lent elsewhere in the next: for tests, which find a plugin
    /// that keeps it.
    pub forgets: bool,
}

impl Isolation {
    /// Seconds of [`call_limit`](Self::call_limit): a search that drives thousands of views through a slow language.
    pub const DEFAULT_CALL_LIMIT_S: f64 = 120.0;
    /// MiB of [`memory_mib`](Self::memory_mib): room for the libraries that numerical plugins load.
    pub const DEFAULT_MEMORY_MIB: u64 = 8192;
}

impl Default for Isolation {
    fn default() -> Self {
        Self {
            program: None,
            call_limit: Duration::from_secs_f64(Self::DEFAULT_CALL_LIMIT_S),
            memory_mib: Self::DEFAULT_MEMORY_MIB,
            forgets: false,
        }
    }
}
