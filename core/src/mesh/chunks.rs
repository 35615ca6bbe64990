//! The chunks of a 3DS file: a 16-bit kind, a 32-bit length that includes these six bytes, and a body.

use super::ImportError;

/// Part of a file with a position to read at.
#[derive(Clone, Debug)]
pub(super) struct Cursor<'a> {
    file: &'a [u8],
    at: usize,
    end: usize,
}

/// One chunk; `body` starts after the length.
#[derive(Debug)]
pub(super) struct Chunk<'a> {
    pub kind: u16,
    pub body: Cursor<'a>,
}

const HEADER_BYTES: usize = 6;

impl<'a> Cursor<'a> {
    /// The whole of `file`.
    pub fn new(file: &'a [u8]) -> Self {
        Self { file, at: 0, end: file.len() }
    }

    /// The error that `reason` at this position is.
    pub fn damaged(&self, reason: String) -> ImportError {
        ImportError::Damaged3ds { offset: self.at, reason }
    }

    /// The next chunk; `None` at the end. Fewer bytes than a header are padding.
    pub fn chunk(&mut self) -> Result<Option<Chunk<'a>>, ImportError> {
        if self.end - self.at < HEADER_BYTES {
            return Ok(None);
        }
        let start = self.clone();
        let kind = self.u16()?;
        let length = self.u32()? as usize;
        let left = self.end - start.at;
        if length < HEADER_BYTES || length > left {
            return Err(start.damaged(format!(
                "expected a chunk length of {HEADER_BYTES} to {left} bytes, found {length} in chunk {kind:#06x}"
            )));
        }
        let end = start.at + length;
        let body = Self { file: self.file, at: self.at, end };
        self.at = end;
        Ok(Some(Chunk { kind, body }))
    }

    /// An unsigned 16-bit number.
    pub fn u16(&mut self) -> Result<u16, ImportError> {
        self.array().map(u16::from_le_bytes)
    }

    /// An unsigned 32-bit number.
    pub fn u32(&mut self) -> Result<u32, ImportError> {
        self.array().map(u32::from_le_bytes)
    }

    /// `N` 32-bit floating-point numbers.
    pub fn floats<const N: usize>(&mut self) -> Result<[f32; N], ImportError> {
        let mut values = [0.0; N];
        for value in &mut values {
            *value = f32::from_le_bytes(self.array()?);
        }
        Ok(values)
    }

    /// A text that a zero byte ends: UTF-8, else Latin-1.
    pub fn text(&mut self) -> Result<String, ImportError> {
        let rest = &self.file[self.at..self.end];
        let length = rest
            .iter()
            .position(|&byte| byte == 0)
            .ok_or_else(|| self.damaged("expected a name that ends with a zero byte".to_owned()))?;
        self.at += length + 1;
        Ok(match std::str::from_utf8(&rest[..length]) {
            Ok(text) => text.to_owned(),
            Err(_) => rest[..length].iter().map(|&byte| char::from(byte)).collect(),
        })
    }

    fn array<const N: usize>(&mut self) -> Result<[u8; N], ImportError> {
        let left = self.end - self.at;
        let bytes = self.file[self.at..self.end]
            .first_chunk::<N>()
            .ok_or_else(|| self.damaged(format!("expected {N} more bytes in this chunk, found {left}")))?;
        self.at += N;
        Ok(*bytes)
    }
}
