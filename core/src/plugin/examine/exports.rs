//! Which symbols a library offers to others: its declaration and nothing else.

use super::super::error::PluginError;
use super::super::registry;
use super::finding::Finding;
use super::raw::apart;
use object::{Object, ObjectSymbol};
use resurvey_schema::abi::SYMBOL_FAMILY;
use std::path::Path;

/// What linkers add by themselves.
const OF_THE_LINKER: [&str; 8] =
    ["_init", "_fini", "_edata", "_end", "__bss_start", "__end__", "_bss_end__", "__bss_end__"];
/// Names that a message lists at most.
const LISTED: usize = 5;

/// Whether the declaration is the only symbol that `path` exports. Weak and unique symbols (templates of C++, such as those
/// behind `std::make_shared`) do not count: whichever of several is taken is the same, and no flag of every compiler hides
/// them.
pub(super) fn only_the_declaration(path: &Path, bytes: &[u8]) -> Finding {
    match registry::read_declaration(path, bytes) {
        Err(fault) => return PluginError::from(registry::refusal(path, fault)).into(),
        Ok(declared) if declared.is_executable() => return apart(),
        Ok(_) => {}
    }
    let file = match object::File::parse(bytes) {
        Ok(file) => file,
        Err(error) => return PluginError::from(not_readable(path, &error)).into(),
    };
    let mut others: Vec<String> = file
        .dynamic_symbols()
        .filter(|symbol| symbol.is_definition() && symbol.is_global() && !symbol.is_weak() && !is_unique(symbol))
        .filter_map(|symbol| {
            symbol.name().ok().map(|name| name.strip_prefix('_').filter(|_| is_mach_o(&file)).unwrap_or(name))
        })
        .filter(|name| !name.starts_with(SYMBOL_FAMILY) && !OF_THE_LINKER.contains(name))
        // Mangled names of the standard library of C++, which no flag hides.
        .filter(|name| {
            !["_ZNS", "_ZNKS", "_ZS", "_ZTIS", "_ZTSS", "_ZTVS", "_ZGVNS"].iter().any(|start| name.starts_with(start))
        })
        .map(str::to_owned)
        .collect();
    others.sort();
    others.dedup();
    if others.is_empty() {
        return Finding::passed("the declaration alone");
    }
    let (count, shown) = (others.len(), others[..others.len().min(LISTED)].join(", "));
    let more = if count > LISTED { ", …" } else { "" };
    Finding::failed(
        format!("expected one exported symbol, the declaration; found {count} more: {shown}{more}"),
        "make functions static, or compile with -fvisibility=hidden (in C++ also -fno-gnu-unique, and with libraries that are \
         linked in -Wl,--exclude-libs,ALL); others of the same name would be called instead",
    )
}

/// Whether the linker makes one of all symbols of this name, in whatever library: GNU's extension of ELF for C++.
fn is_unique(symbol: &object::Symbol<'_, '_>) -> bool {
    const STB_GNU_UNIQUE: u8 = 10;
    matches!(symbol.flags(), object::SymbolFlags::Elf { st_info, .. } if st_info >> 4 == STB_GNU_UNIQUE)
}

fn is_mach_o(file: &object::File<'_>) -> bool {
    file.format() == object::BinaryFormat::MachO
}

fn not_readable(path: &Path, error: &object::Error) -> super::super::error::Refusal {
    super::super::error::Refusal {
        name: path.display().to_string(),
        path: Some(path.to_owned()),
        stage: super::super::error::Stage::Header,
        reason: error.to_string(),
        advice: "check that the file is a whole plugin library".to_owned(),
    }
}
