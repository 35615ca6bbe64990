//! Reads what a plugin says of itself: from a library file, before any of its code runs, or from a built-in declaration.

use super::error::Stage;
use super::info::Kind;
use object::{Object, ObjectSegment};
use resurvey_schema::abi::{
    self, ABI_MAJOR, ABI_MINOR, Declaration, ENTRY_OFFSET, HEADER_BYTES, MAGIC, SYMBOL_FAMILY, SYMBOL_PREFIX,
};
use std::mem::offset_of;

/// A declaration whose header is one that this host can load.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Declared {
    /// Of a library.
    pub symbol: String,
    pub header: [u8; HEADER_BYTES],
    pub kind: Kind,
    pub name: String,
    pub version: String,
    pub summary: String,
}

impl Declared {
    /// Whether it is an executable that speaks the wire, and no library.
    pub(super) fn is_executable(&self) -> bool {
        self.header == [0; HEADER_BYTES]
    }
}

/// Stage, reason, advice.
pub(super) type Fault = (Stage, String, String);

/// Reads the one declaration of the library in `bytes`.
pub(super) fn read_library(bytes: &[u8]) -> Result<Declared, Fault> {
    let header = |reason: String| (Stage::Header, reason, "check that the file is a whole plugin library".to_owned());
    let file = object::File::parse(bytes).map_err(|error| header(format!("not a library of this system: {error}")))?;
    if let Some(expected) = host_architecture()
        && file.architecture() != expected
    {
        return Err(header(format!("built for {:?}, this host is {expected:?}", file.architecture())));
    }
    let exports = file.exports().map_err(|error| header(format!("its exported symbols cannot be read: {error}")))?;
    let named = exports.iter().filter_map(|export| {
        let name = std::str::from_utf8(export.name()).ok()?;
        // Mach-O puts an underscore before every C name.
        let name = name.strip_prefix('_').unwrap_or(name);
        name.starts_with(SYMBOL_FAMILY).then_some((name, export.address()))
    });
    let (symbol, address) = match named.collect::<Vec<_>>()[..] {
        [] => return Err(header(format!("exports no symbol that begins with {SYMBOL_PREFIX}"))),
        [(name, address)] => (name, address),
        [(one, _), (other, _), ..] => {
            return Err(header(format!("exports more than one declaration: {one} and {other}")));
        }
    };
    if !symbol.starts_with(SYMBOL_PREFIX) {
        let major: String = symbol[SYMBOL_FAMILY.len()..].chars().take_while(char::is_ascii_digit).collect();
        return Err(other_abi(&major));
    }
    let head = bytes_at(&file, address, HEADER_BYTES).ok_or_else(|| header(format!("{symbol} is cut off")))?;
    let size = check_header(head)?;
    let whole = bytes_at(&file, address, size).ok_or_else(|| header(format!("{symbol} is cut off")))?;
    read_texts(whole, symbol)
}

/// Reads a declaration that is part of this program.
pub(super) fn read_builtin(declaration: &Declaration) -> Result<Declared, Fault> {
    let mut bytes = [0; size_of::<Declaration>()];
    bytes[..HEADER_BYTES].copy_from_slice(&header_bytes(&declaration.header));
    let texts = [
        (offset_of!(Declaration, name), &declaration.name[..]),
        (offset_of!(Declaration, version), &declaration.version[..]),
        (offset_of!(Declaration, summary), &declaration.summary[..]),
    ];
    for (offset, text) in texts {
        bytes[offset..offset + text.len()].copy_from_slice(text);
    }
    check_header(&bytes)?;
    read_texts(&bytes, "")
}

/// The header as it lies in memory and in the file.
pub(super) fn header_bytes(header: &abi::Header) -> [u8; HEADER_BYTES] {
    let mut bytes = [0; HEADER_BYTES];
    let fields: [&[u8]; 8] = [
        &header.magic,
        &header.abi_major.to_ne_bytes(),
        &header.abi_minor.to_ne_bytes(),
        &header.size.to_ne_bytes(),
        &header.min_host_minor.to_ne_bytes(),
        &header.kind.to_ne_bytes(),
        &header.flags.to_ne_bytes(),
        &header.reserved,
    ];
    for (to, from) in bytes.iter_mut().zip(fields.into_iter().flatten()) {
        *to = *from;
    }
    bytes
}

/// Checks the header at the start of `bytes`; gives the bytes of the declaration that this host reads.
fn check_header(bytes: &[u8]) -> Result<usize, Fault> {
    let header = |reason: String| (Stage::Header, reason, "ask its author for a build against the header".to_owned());
    let u16_at = |offset: usize| u16::from_ne_bytes([bytes[offset], bytes[offset + 1]]);
    if bytes[..8] != MAGIC {
        return Err(header(format!("expected the letters RESURVEY, found {}", bytes[..8].escape_ascii())));
    }
    let (major, minor) = (u16_at(offset_of!(abi::Header, abi_major)), u16_at(offset_of!(abi::Header, abi_minor)));
    if major != ABI_MAJOR {
        return Err(other_abi(&format!("{major}.{minor}")));
    }
    let needed = u16_at(offset_of!(abi::Header, min_host_minor));
    if needed > ABI_MINOR {
        let reason = format!("plugin needs a host of ABI {major}.{needed}, this host speaks {}", spoken());
        return Err((Stage::Abi, reason, "upgrade resurvey".to_owned()));
    }
    let at = offset_of!(abi::Header, size);
    let size = u32::from_ne_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]]) as usize;
    let least = size_of::<Declaration>();
    if size < least {
        return Err(header(format!("expected a declaration of at least {least} bytes, found {size}")));
    }
    Ok(least)
}

fn read_texts(bytes: &[u8], symbol: &str) -> Result<Declared, Fault> {
    let fault = |reason: String| (Stage::Header, reason, "ask its author for a build against the header".to_owned());
    let text = |what: &str, from: usize, to: usize| {
        let field = bytes[from..to].split(|byte| *byte == 0).next().unwrap_or_default();
        let text = std::str::from_utf8(field).ok().filter(|text| !text.chars().any(char::is_control));
        text.map(str::to_owned).ok_or_else(|| fault(format!("{what} is not a line of UTF-8")))
    };
    let (name_at, version_at) = (offset_of!(Declaration, name), offset_of!(Declaration, version));
    let summary_at = offset_of!(Declaration, summary);
    let name = text("its name", name_at, version_at)?;
    if !allowed_name(&name) {
        return Err(fault(format!("expected a name of a–z, 0–9 and dashes, found {name:?}")));
    }
    let number = u16::from_ne_bytes([bytes[KIND_OFFSET], bytes[KIND_OFFSET + 1]]);
    let unknown_kind = || {
        let known = "1 (matcher), 2 (detector), 3 (estimator) and 4 (segmenter)";
        let reason = format!("plugin is of kind {number}, this host knows {known}");
        (Stage::Abi, reason, "upgrade resurvey".to_owned())
    };
    let mut header = [0; HEADER_BYTES];
    header.copy_from_slice(&bytes[..ENTRY_OFFSET]);
    Ok(Declared {
        symbol: symbol.to_owned(),
        header,
        kind: Kind::from_number(number).ok_or_else(unknown_kind)?,
        name,
        version: text("its version", version_at, summary_at)?,
        summary: text("its summary", summary_at, size_of::<Declaration>())?,
    })
}

/// Whether a plugin may have this name.
pub(super) fn allowed_name(name: &str) -> bool {
    let allowed = |c: char| c.is_ascii_lowercase() || c.is_ascii_digit() || c == '-';
    !name.is_empty() && name.chars().all(allowed)
}

const KIND_OFFSET: usize = offset_of!(abi::Header, kind);

fn spoken() -> String {
    format!("{ABI_MAJOR}.0 to {ABI_MAJOR}.{ABI_MINOR}")
}

fn other_abi(theirs: &str) -> Fault {
    let reason = format!("plugin speaks ABI {theirs}, this host speaks {}", spoken());
    (Stage::Abi, reason, format!("upgrade resurvey, or install a build for ABI {ABI_MAJOR}"))
}

fn bytes_at<'a>(file: &object::File<'a>, address: u64, length: usize) -> Option<&'a [u8]> {
    let inside = |segment: object::Segment<'a, '_>| segment.data_range(address, length as u64).ok().flatten();
    file.segments().find_map(inside).filter(|bytes| bytes.len() == length)
}

/// What libraries for this host are built for; `None` where nobody has looked.
fn host_architecture() -> Option<object::Architecture> {
    if cfg!(target_arch = "x86_64") {
        Some(object::Architecture::X86_64)
    } else if cfg!(target_arch = "aarch64") {
        Some(object::Architecture::Aarch64)
    } else {
        None
    }
}
