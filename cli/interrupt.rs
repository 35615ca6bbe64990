//! Ctrl-C: a run that calls plugins ends at its next step, with the map as it was. A second Ctrl-C ends the program at
//! once, as the first does where no plugin runs.

use std::io;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Whether the user wants a run to end.
#[derive(Clone, Debug, Default)]
pub struct Interrupt {
    asked: Arc<AtomicBool>,
    /// Whether nobody looks at `asked`.
    is_deaf: Arc<AtomicBool>,
}

impl Interrupt {
    /// The Ctrl-C of this program from now on.
    pub fn of_terminal() -> io::Result<Self> {
        let interrupt = Self::default();
        interrupt.is_deaf.store(true, Ordering::SeqCst);
        #[cfg(unix)]
        {
            use signal_hook::{consts::SIGINT, flag};
            // In this order: the first one asks, the second one finds that it was asked before.
            flag::register_conditional_default(SIGINT, Arc::clone(&interrupt.is_deaf))?;
            flag::register_conditional_default(SIGINT, Arc::clone(&interrupt.asked))?;
            flag::register(SIGINT, Arc::clone(&interrupt.asked))?;
        }
        Ok(interrupt)
    }

    /// From now on somebody looks at [`is_asked`](Self::is_asked).
    pub(crate) fn listen(&self) {
        self.is_deaf.store(false, Ordering::SeqCst);
    }

    /// Whether the run is to end.
    pub(crate) fn is_asked(&self) -> bool {
        self.asked.load(Ordering::SeqCst)
    }
}
