//! Which plugin files may be loaded: those that nobody else can change and whose digest is on the user's list.
//!
//! A file is read and hashed by its path and opened by its path: libraries find what lies beside them that way. Whoever
//! could put another file there in between must be the user or root.

use super::declaration::Fault;
use super::error::Stage;
use super::info::Digest;
use std::collections::HashSet;
use std::path::Path;

/// Refuses a file or directory that others may write, or replace: by its mode, by its owner or by a directory above it.
pub(super) fn check_permissions(path: &Path) -> Result<(), Fault> {
    let real = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    for (depth, path) in real.ancestors().enumerate() {
        let what = match depth {
            0 if path.is_dir() => "the directory",
            0 => "the file",
            1 => "its directory",
            _ => "a directory above it",
        };
        // Of a directory further up the mode counts alone: it may be a mount of somebody else's.
        let is_near = depth <= 1;
        if let Some((reason, advice)) = writer(path, what, is_near) {
            return Err((Stage::Permissions, reason, format!("{advice}, or install it from a source you trust")));
        }
    }
    Ok(())
}

/// Who else may write to `path`, and what to do about it.
#[cfg(unix)]
fn writer(path: &Path, what: &str, is_near: bool) -> Option<(String, String)> {
    use std::os::unix::fs::MetadataExt;
    const OTHERS_WRITE: u32 = 0o002;
    const GROUP_WRITES: u32 = 0o020;
    const STICKY: u32 = 0o1000;
    let (place, metadata) = (path.display(), std::fs::metadata(path).ok()?);
    let (mode, owner, group) = (metadata.mode(), metadata.uid(), metadata.gid());
    // Others add files to a sticky directory, and do not replace those of the user.
    let is_sticky = metadata.is_dir() && mode & STICKY != 0;
    if mode & OTHERS_WRITE != 0 && !is_sticky {
        return Some((format!("every user of this machine may write {what}"), format!("run \"chmod o-w {place}\"")));
    }
    // A user's own group has the user's number and nobody else in it.
    if mode & GROUP_WRITES != 0 && !is_sticky && group != owner {
        return Some((format!("everyone in group {group} may write {what}"), format!("run \"chmod g-w {place}\"")));
    }
    let is_trusted = [rustix::process::geteuid().as_raw(), 0].contains(&owner);
    (is_near && !is_trusted).then(|| {
        (
            format!("{what} belongs to user {owner}, neither to you nor to root"),
            "copy it to a directory of yours".to_owned(),
        )
    })
}

/// Elsewhere the allow-list has to do alone.
#[cfg(not(unix))]
fn writer(_: &Path, _: &str, _: bool) -> Option<(String, String)> {
    None
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

#[cfg(test)]
#[cfg(unix)]
mod tests {
    use super::*;
    use std::os::unix::fs::{PermissionsExt, chown};

    fn set_mode(path: &Path, mode: u32) {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    }

    #[test]
    fn a_file_that_anyone_else_can_write_or_replace_is_refused_by_name() {
        let top = tempfile::tempdir().unwrap();
        let directory = top.path().join("plugins");
        let file = directory.join("libx.so");
        std::fs::create_dir(&directory).unwrap();
        std::fs::write(&file, "x").unwrap();
        for (path, mode) in [(top.path(), 0o755), (&directory, 0o755), (&file, 0o644)] {
            set_mode(path, mode);
        }
        assert_eq!(check_permissions(&file), Ok(()));
        for (path, mode, words) in [
            (file.as_path(), 0o646, "every user of this machine may write the file"),
            (&directory, 0o757, "every user of this machine may write its directory"),
            (top.path(), 0o757, "every user of this machine may write a directory above it"),
        ] {
            let before = std::fs::metadata(path).unwrap().permissions().mode();
            set_mode(path, mode);
            let (stage, reason, advice) = check_permissions(&file).unwrap_err();
            assert_eq!((stage, reason.as_str()), (Stage::Permissions, words));
            assert!(advice.contains(&format!("chmod o-w {}", path.display())), "{advice}");
            set_mode(path, before);
        }
        // Others may add to a sticky directory, and not replace.
        set_mode(top.path(), 0o1777);
        assert_eq!(check_permissions(&file), Ok(()));
    }

    #[test]
    fn groups_of_several_and_other_owners_are_others_too() {
        let directory = tempfile::tempdir().unwrap();
        let file = directory.path().join("libx.so");
        std::fs::write(&file, "x").unwrap();
        set_mode(&file, 0o664);
        // Only root may give a file away.
        if chown(&file, Some(0), Some(12_345)).is_err() {
            return;
        }
        let reason = check_permissions(&file).unwrap_err().1;
        assert_eq!(reason, "everyone in group 12345 may write the file");
        chown(&file, Some(0), Some(0)).unwrap();
        assert_eq!(check_permissions(&file), Ok(()), "a group of one's own");
        chown(&file, Some(12_345), Some(12_345)).unwrap();
        let reason = check_permissions(&file).unwrap_err().1;
        assert_eq!(reason, "the file belongs to user 12345, neither to you nor to root");
    }
}
