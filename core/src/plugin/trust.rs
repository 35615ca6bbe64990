//! Which library files may be loaded: those that nobody else can change and whose digest is on the user's list.

use super::declaration::Fault;
use super::error::Stage;
use super::info::Digest;
use std::collections::HashSet;
use std::path::Path;

/// Refuses a file that others may write, or replace.
pub(super) fn check_permissions(path: &Path) -> Result<(), Fault> {
    let what = [(path, "the file"), (path.parent().unwrap_or(path), "its directory")];
    match what.into_iter().find(|(path, _)| others_may_write(path)) {
        None => Ok(()),
        Some((path, what)) => {
            let advice = format!("run \"chmod o-w {}\", or install it from a source you trust", path.display());
            Err((Stage::Permissions, format!("every user of this machine may write {what}"), advice))
        }
    }
}

/// Refuses a program that its owner may not execute.
#[cfg(unix)]
pub(super) fn check_executable(path: &Path) -> Result<(), Fault> {
    use std::os::unix::fs::PermissionsExt;
    let owner_executes = 0o100;
    if std::fs::metadata(path).is_ok_and(|metadata| metadata.permissions().mode() & owner_executes != 0) {
        return Ok(());
    }
    let advice = format!("run \"chmod u+x {}\"", path.display());
    Err((Stage::Permissions, "it is a program that nobody may execute".to_owned(), advice))
}

/// Elsewhere no program is started.
#[cfg(not(unix))]
pub(super) fn check_executable(_: &Path) -> Result<(), Fault> {
    Ok(())
}

/// Refuses a file whose digest is not allowed.
pub(super) fn check_allowed(path: &Path, sha256: Digest, allowed: &HashSet<Digest>) -> Result<(), Fault> {
    if allowed.contains(&sha256) {
        return Ok(());
    }
    let file = path.display();
    let advice = format!("if you trust it, run \"resurvey plugins install {file}\", or add --allow-plugin {sha256}");
    Err((Stage::AllowList, format!("SHA-256 {sha256} is not on the list of allowed plugins"), advice))
}

/// Whether the mode lets others write; a sticky directory lets them add files but not replace this one.
#[cfg(unix)]
fn others_may_write(path: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    let (others_write, sticky) = (0o002, 0o1000);
    std::fs::metadata(path).is_ok_and(|metadata| {
        let mode = metadata.permissions().mode();
        mode & others_write != 0 && !(metadata.is_dir() && mode & sticky != 0)
    })
}

/// Elsewhere the allow-list has to do alone.
#[cfg(not(unix))]
fn others_may_write(_: &Path) -> bool {
    false
}
