//! The bytes of a glTF file: its container, its buffers, and numbers out of accessors, all checked against the sizes
//! that really are there.

use super::ImportError;
use super::gltf_schema::{Accessor, BufferView, Root};
use super::model::check_count;
use super::neighbours::Neighbours;

/// Most bytes of all buffers together.
const MAX_BUFFER_BYTES: usize = 1 << 32;

/// The error that `reason` at the JSON path or file part `at` is.
pub(super) fn damaged(at: impl Into<String>, reason: impl Into<String>) -> ImportError {
    ImportError::DamagedGltf { at: at.into(), reason: reason.into() }
}

/// The JSON text and the binary chunk of a `.glb` or `.gltf` file.
pub(super) fn split_container(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), ImportError> {
    if !bytes.starts_with(b"glTF") {
        return Ok((bytes.strip_prefix(b"\xEF\xBB\xBF").unwrap_or(bytes), None));
    }
    let header = "the GLB header";
    let (version, length) = match (word(bytes, 4), word(bytes, 8)) {
        (Some(version), Some(length)) => (version, length as usize),
        _ => return Err(damaged(header, format!("expected 12 bytes, found {}", bytes.len()))),
    };
    if version != 2 {
        return Err(damaged(header, format!("expected version 2, found {version}")));
    }
    let file = bytes
        .get(12..length)
        .ok_or_else(|| damaged(header, format!("expected {length} bytes in the file, found {}", bytes.len())))?;
    let (json, rest) = glb_chunk(file, "the JSON chunk", *b"JSON")?;
    match rest.is_empty() {
        true => Ok((json, None)),
        false => glb_chunk(rest, "the BIN chunk", *b"BIN\0").map(|(binary, _)| (json, Some(binary))),
    }
}

fn glb_chunk<'a>(bytes: &'a [u8], name: &str, kind: [u8; 4]) -> Result<(&'a [u8], &'a [u8]), ImportError> {
    let length = word(bytes, 0).ok_or_else(|| damaged(name, "expected a chunk header"))? as usize;
    if bytes.get(4..8) != Some(&kind) {
        return Err(damaged(name, format!("expected the chunk type {:?}", String::from_utf8_lossy(&kind))));
    }
    let body = &bytes[8..];
    if body.len() < length {
        return Err(damaged(name, format!("expected {length} bytes, found {}", body.len())));
    }
    let (body, rest) = body.split_at(length);
    // Writers pad chunks to four bytes; some count the padding, some do not.
    Ok((body, if rest.len() < 8 { &[] } else { rest }))
}

fn word(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|bytes| u32::from_le_bytes(*bytes))
}

/// The content of a `data:` URI; `None` when `uri` is not one.
pub(super) fn data_uri(uri: &str) -> Option<Result<Vec<u8>, String>> {
    let (header, data) = uri.strip_prefix("data:")?.split_once(',').unwrap_or(("", ""));
    if !header.ends_with(";base64") {
        return Some(Err("expected a data URI in base64".to_owned()));
    }
    Some(decode_base64(data).ok_or_else(|| "the base64 text of the data URI is damaged".to_owned()))
}

/// RFC 4648, section 4; the padding may be missing.
fn decode_base64(text: &str) -> Option<Vec<u8>> {
    let text = text.trim_end_matches('=');
    let mut bytes = Vec::with_capacity(text.len() * 3 / 4);
    for group in text.as_bytes().chunks(4) {
        let mut bits = 0u32;
        for &character in group {
            let value = match character {
                b'A'..=b'Z' => character - b'A',
                b'a'..=b'z' => character - b'a' + 26,
                b'0'..=b'9' => character - b'0' + 52,
                b'+' => 62,
                b'/' => 63,
                _ => return None,
            };
            bits = bits << 6 | u32::from(value);
        }
        let whole = match group.len() {
            4 => 3,
            3 => 2,
            2 => 1,
            _ => return None,
        };
        let aligned = bits << (6 * (4 - group.len()));
        bytes.extend_from_slice(&aligned.to_be_bytes()[1..=whole]);
    }
    Some(bytes)
}

/// A URI's text with its `%20` and the like decoded (RFC 3986, 2.1).
pub(super) fn percent_decoded(uri: &str) -> String {
    let mut bytes = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&first, tail)) = rest.split_first() {
        let code = tail.get(..2).and_then(|digits| std::str::from_utf8(digits).ok());
        let decoded = code.filter(|_| first == b'%').and_then(|digits| u8::from_str_radix(digits, 16).ok());
        bytes.push(decoded.unwrap_or(first));
        rest = if decoded.is_some() { &tail[2..] } else { tail };
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// The buffers of a file, and what its accessors hold.
pub(super) struct Buffers<'a> {
    root: &'a Root,
    contents: Vec<Vec<u8>>,
}

impl<'a> Buffers<'a> {
    /// Loads every buffer of `root`: the binary chunk, data URIs, files beside the model.
    pub fn load(root: &'a Root, binary: Option<&[u8]>, neighbours: &Neighbours) -> Result<Self, ImportError> {
        let mut contents = Vec::new();
        let mut total = 0;
        for (index, buffer) in root.buffers.iter().enumerate() {
            let at = || format!("buffers[{index}]");
            let content = match (&buffer.uri, binary) {
                (Some(uri), _) => data_uri(uri)
                    .unwrap_or_else(|| neighbours.read(&percent_decoded(uri)))
                    .map_err(|reason| damaged(at(), reason))?,
                (None, Some(binary)) if index == 0 => binary.to_vec(),
                (None, _) => return Err(damaged(at(), "expected a URI or a binary chunk, found neither")),
            };
            // Many buffers may name the same file: a small one could ask for any amount of memory.
            total += content.len();
            if total > MAX_BUFFER_BYTES {
                return Err(ImportError::TooMany { what: "bytes of buffers", limit: MAX_BUFFER_BYTES });
            }
            if content.len() < buffer.byte_length {
                let (expected, found) = (buffer.byte_length, content.len());
                return Err(damaged(at(), format!("expected {expected} bytes, found {found}")));
            }
            contents.push(content);
        }
        Ok(Self { root, contents })
    }

    /// The bytes of buffer view `index`, and its stride.
    pub fn view(&self, index: usize) -> Result<(&[u8], Option<usize>), ImportError> {
        let at = || format!("bufferViews[{index}]");
        let BufferView { buffer, byte_offset, byte_length, byte_stride } =
            self.root.buffer_views.get(index).ok_or_else(|| damaged(at(), "there is no such buffer view"))?;
        let content =
            self.contents.get(*buffer).ok_or_else(|| damaged(at(), format!("there is no buffer {buffer}")))?;
        let bytes = byte_offset.checked_add(*byte_length).and_then(|end| content.get(*byte_offset..end));
        let bytes = bytes.ok_or_else(|| {
            let found = content.len();
            damaged(
                at(),
                format!("expected {byte_length} bytes from {byte_offset} in buffer {buffer} of {found} bytes"),
            )
        })?;
        Ok((bytes, *byte_stride))
    }

    /// The elements of accessor `index`, which must have `N` components; integers are exact or, when the accessor says
    /// so, normalized to 0…1 or −1…1 (glTF 2.0, 3.11).
    pub fn elements<const N: usize>(&self, index: usize) -> Result<Vec<[f64; N]>, ImportError> {
        let at = || format!("accessors[{index}]");
        let accessor = self.accessor(index)?;
        let shape = ["SCALAR", "VEC2", "VEC3", "VEC4"][N - 1];
        if accessor.shape != shape {
            return Err(damaged(at(), format!("expected {shape}, found {:?}", accessor.shape)));
        }
        check_count("vertices or indices", accessor.count)?;
        let number = Number::new(accessor.component_type, accessor.normalized)
            .ok_or_else(|| damaged(at(), format!("unknown component type {}", accessor.component_type)))?;
        let mut elements = match (accessor.buffer_view, &accessor.sparse) {
            (Some(view), _) => self.packed(view, accessor.byte_offset, accessor.count, number, &at)?,
            (None, Some(_)) => vec![[0.0; N]; accessor.count],
            (None, None) => return Err(damaged(at(), "expected a buffer view or sparse values, found neither")),
        };
        if let Some(sparse) = &accessor.sparse {
            check_count("sparse values", sparse.count)?;
            let place = Number::index(sparse.indices.component_type)
                .ok_or_else(|| damaged(at(), "expected unsigned sparse indices"))?;
            let (view, offset) = (sparse.indices.buffer_view, sparse.indices.byte_offset);
            let places = self.packed::<1>(view, offset, sparse.count, place, &at)?;
            let (view, offset) = (sparse.values.buffer_view, sparse.values.byte_offset);
            let values = self.packed::<N>(view, offset, sparse.count, number, &at)?;
            for ([place], value) in places.into_iter().zip(values) {
                let count = accessor.count;
                *elements
                    .get_mut(place as usize)
                    .ok_or_else(|| damaged(at(), format!("expected sparse indices below {count}, found {place}")))? =
                    value;
            }
        }
        Ok(elements)
    }

    /// The vertex indices in accessor `index`.
    pub fn indices(&self, index: usize) -> Result<Vec<u32>, ImportError> {
        let found = self.accessor(index)?.component_type;
        if Number::index(found).is_none() {
            return Err(damaged(
                format!("accessors[{index}]"),
                format!("expected unsigned indices, found type {found}"),
            ));
        }
        Ok(self.elements::<1>(index)?.into_iter().map(|[value]| value as u32).collect())
    }

    fn accessor(&self, index: usize) -> Result<&'a Accessor, ImportError> {
        let missing = || damaged(format!("accessors[{index}]"), "there is no such accessor");
        self.root.accessors.get(index).ok_or_else(missing)
    }

    fn packed<const N: usize>(
        &self,
        view: usize,
        offset: usize,
        count: usize,
        number: Number,
        at: &dyn Fn() -> String,
    ) -> Result<Vec<[f64; N]>, ImportError> {
        let (bytes, stride) = self.view(view)?;
        let size = N * number.bytes();
        let stride = stride.unwrap_or(size);
        let end = count.saturating_sub(1).checked_mul(stride).and_then(|last| last.checked_add(offset + size));
        if stride < size || (count > 0 && end.is_none_or(|end| end > bytes.len())) {
            let found = bytes.len();
            let reason = format!("expected {count} elements of {size} bytes, {stride} apart, from byte {offset}");
            return Err(damaged(at(), format!("{reason} in bufferViews[{view}] of {found} bytes")));
        }
        let element = |index: usize| {
            let start = offset + index * stride;
            std::array::from_fn(|axis| number.read(&bytes[start + axis * number.bytes()..]))
        };
        Ok((0..count).map(element).collect())
    }
}

/// How a number is stored.
#[derive(Clone, Copy)]
enum Number {
    I8 { normalized: bool },
    U8 { normalized: bool },
    I16 { normalized: bool },
    U16 { normalized: bool },
    U32,
    F32,
}

impl Number {
    fn new(component_type: u32, normalized: bool) -> Option<Self> {
        Some(match component_type {
            5120 => Self::I8 { normalized },
            5121 => Self::U8 { normalized },
            5122 => Self::I16 { normalized },
            5123 => Self::U16 { normalized },
            5125 => Self::U32,
            5126 => Self::F32,
            _ => return None,
        })
    }

    fn index(component_type: u32) -> Option<Self> {
        matches!(component_type, 5121 | 5123 | 5125).then(|| Self::new(component_type, false)).flatten()
    }

    fn bytes(self) -> usize {
        match self {
            Self::I8 { .. } | Self::U8 { .. } => 1,
            Self::I16 { .. } | Self::U16 { .. } => 2,
            Self::U32 | Self::F32 => 4,
        }
    }

    /// The number that `bytes` begin with; NaN when they are too few.
    fn read(self, bytes: &[u8]) -> f64 {
        let four = bytes.first_chunk::<4>().copied();
        let two = bytes.first_chunk::<2>().copied();
        let one = bytes.first_chunk::<1>().copied();
        let scaled = |value: Option<f64>, normalized: bool, most: f64| {
            value.map(|value| if normalized { (value / most).max(-1.0) } else { value })
        };
        match self {
            Self::I8 { normalized } => scaled(one.map(|one| f64::from(i8::from_le_bytes(one))), normalized, 127.0),
            Self::U8 { normalized } => scaled(one.map(|[one]| f64::from(one)), normalized, 255.0),
            Self::I16 { normalized } => scaled(two.map(|two| f64::from(i16::from_le_bytes(two))), normalized, 32_767.0),
            Self::U16 { normalized } => scaled(two.map(|two| f64::from(u16::from_le_bytes(two))), normalized, 65_535.0),
            Self::U32 => four.map(|four| f64::from(u32::from_le_bytes(four))),
            Self::F32 => four.map(|four| f64::from(f32::from_le_bytes(four))),
        }
        .unwrap_or(f64::NAN)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_follows_rfc_4648() {
        // The test vectors of RFC 4648, section 10.
        for (text, bytes) in [("", ""), ("Zg==", "f"), ("Zm8=", "fo"), ("Zm9v", "foo"), ("Zm9vYmE=", "fooba")] {
            assert_eq!(decode_base64(text).unwrap(), bytes.as_bytes());
        }
        assert!(decode_base64("Zm9vY").is_none() && decode_base64("Zm 9").is_none());
        assert_eq!(percent_decoded("my%20wall%2.png%"), "my wall%2.png%");
    }

    #[test]
    fn integers_are_normalized_as_the_specification_says() {
        // glTF 2.0, 3.11: f = max(c / 127, −1), f = c / 65535.
        assert!((Number::new(5120, true).unwrap().read(&[0x80]) + 1.0).abs() < 1e-12);
        assert!((Number::new(5123, true).unwrap().read(&[0xFF, 0xFF]) - 1.0).abs() < 1e-12);
        assert!((Number::new(5122, false).unwrap().read(&[0xFE, 0xFF]) + 2.0).abs() < 1e-12);
        assert!(Number::F32.read(&[0, 0]).is_nan());
    }
}
