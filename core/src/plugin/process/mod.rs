//! Plugins in processes of their own: `docs/plugin-wire.md` has the words. `child` starts and ends the process, `link` is
//! the host's end of its wire, `apart` an instance in it, `desk` what the host does for it; `serve` is the other end, for
//! libraries, and `asking` the services there.

mod apart;
mod asking;
mod batches;
mod call_log;
mod child;
mod desk;
mod fingerprint;
mod lending;
mod link;
mod memory;
mod program;
mod serve;
mod talk;
mod translate;
mod wire;

use super::isolation::Isolation;

pub(super) use apart::Apart;
pub use child::SERVE;
pub(super) use fingerprint::Fingerprint;
pub(super) use program::Program;
pub use serve::serve;
