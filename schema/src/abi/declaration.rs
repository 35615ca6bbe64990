//! The one data symbol of a plugin: a frozen header without pointers, the entry function, and fixed texts.

use super::{ErrorText, HostInfo, Status, Table};

/// First eight bytes of every declaration.
pub const MAGIC: [u8; 8] = *b"RESURVEY";
/// Bytes of [`Header`], frozen for every version of the line.
pub const HEADER_BYTES: usize = 32;
/// Where [`Declaration::entry`] lies.
pub const ENTRY_OFFSET: usize = HEADER_BYTES;
/// The exported symbol is this and the name of the crate or library in letters, digits and underscores.
pub const SYMBOL_PREFIX: &str = "resurvey_plugin_v1__";
/// What the symbols of all versions of the line begin with.
pub const SYMBOL_FAMILY: &str = "resurvey_plugin_v";

/// What the host reads from the file before any code of the plugin runs; frozen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C)]
pub struct Header {
    /// [`MAGIC`].
    pub magic: [u8; 8],
    /// Major version of the line that the plugin speaks.
    pub abi_major: u16,
    /// Minor version.
    pub abi_minor: u16,
    /// Bytes of the whole declaration.
    pub size: u32,
    /// Lowest minor version of the host that the plugin can work with.
    pub min_host_minor: u16,
    /// `KIND_…`.
    pub kind: u16,
    /// No bit has a meaning yet: zero.
    pub flags: u32,
    /// Zero.
    pub reserved: [u8; 8],
}

/// Fills the table of a plugin; called once after loading.
pub type EntryFn = unsafe extern "C" fn(host: *const HostInfo, table: *mut Table, error: *mut ErrorText) -> Status;

/// The declaration that a plugin exports, or hands to a program that links it in.
///
/// Whoever registers one promises what the header asks of `entry` and of the functions that it fills in.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Declaration {
    /// Read from the file.
    pub header: Header,
    /// The first code of the plugin that runs.
    pub entry: EntryFn,
    /// Name on the command line: `a`–`z`, `0`–`9` and dashes; UTF-8, the rest zero, as in the other texts.
    pub name: [u8; 48],
    /// Version of the plugin.
    pub version: [u8; 24],
    /// One sentence for `plugins list`.
    pub summary: [u8; 160],
}

impl Declaration {
    /// A declaration for this version of the line; at compile time, a text that is too long does not compile.
    pub const fn new(kind: u16, entry: EntryFn, name: &str, version: &str, summary: &str) -> Self {
        let header = Header {
            magic: MAGIC,
            abi_major: super::ABI_MAJOR,
            abi_minor: super::ABI_MINOR,
            size: size_of::<Self>() as u32,
            // A host of minor 0 does not know the kind.
            min_host_minor: (kind == super::KIND_SEGMENTER) as u16,
            kind,
            flags: 0,
            reserved: [0; 8],
        };
        Self { header, entry, name: padded(name), version: padded(version), summary: padded(summary) }
    }
}

const fn padded<const N: usize>(text: &str) -> [u8; N] {
    assert!(text.len() < N, "name, version or summary of the plugin is too long: 47, 23 and 159 bytes are the limits");
    let (bytes, mut out, mut index) = (text.as_bytes(), [0; N], 0);
    while index < bytes.len() {
        out[index] = bytes[index];
        index += 1;
    }
    out
}
