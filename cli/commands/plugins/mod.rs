//! `resurvey plugins`.

mod check;
mod install;
pub mod installed;
mod list;
mod new;
mod place;
mod process;
mod remove;
mod template;
mod trial;

use crate::args::{PluginSearch, Plugins};
use crate::console::Console;
use crate::failure::Failure;
use crate::tools::registry;

/// Lists, describes, checks, installs, removes or begins plugins.
pub fn run(command: &Plugins, search: &PluginSearch, console: &mut Console<'_>) -> Result<u8, Failure> {
    match command {
        Plugins::List { verbose } => list::list(&registry(search)?, *verbose, console),
        Plugins::Info { name } => list::info(&registry(search)?, name, console),
        Plugins::Check(options) => check::run(options, console),
        Plugins::Install(options) => install::run(options, &registry(search)?, console),
        Plugins::New(options) => new::run(options, &registry(search)?, console),
        Plugins::Remove { which } => remove::run(which, console),
    }
}
