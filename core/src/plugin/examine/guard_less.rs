//! Lent memory on systems without page protection here: what is written around it is found, what is read is not.

/// What stands around the lent bytes.
const CANARY: u8 = 0xA5;
/// Bytes of it on both sides.
const MARGIN: usize = 64;

/// Bytes between two margins.
pub(super) struct Block {
    all: &'static mut [u64],
    length: usize,
}

impl Block {
    /// `bytes`, aligned to 8.
    pub(super) fn new(_: &'static str, bytes: &[u8], _: usize) -> Option<Self> {
        let words = bytes.len().div_ceil(8) + 2 * MARGIN / 8;
        let all = Box::leak(vec![u64::from_ne_bytes([CANARY; 8]); words].into_boxed_slice());
        for (index, chunk) in bytes.chunks(8).enumerate() {
            let mut word = [CANARY; 8];
            word[..chunk.len()].copy_from_slice(chunk);
            all[MARGIN / 8 + index] = u64::from_ne_bytes(word);
        }
        Some(Self { all, length: bytes.len() })
    }

    /// The first byte lent.
    pub(super) fn data(&self) -> *mut u8 {
        self.all.as_ptr().wrapping_add(MARGIN / 8).cast::<u8>().cast_mut()
    }

    /// Nothing here.
    pub(super) fn seal(&self) {}

    /// Nothing here.
    pub(super) fn close(&self) {}

    /// The bytes now; `None` when something around them was overwritten.
    pub(super) fn bytes(&self) -> Option<Vec<u8>> {
        let all: Vec<u8> = self.all.iter().flat_map(|word| word.to_ne_bytes()).collect();
        let (before, rest) = all.split_at(MARGIN);
        let (bytes, after) = rest.split_at(self.length);
        before.iter().chain(after).all(|byte| *byte == CANARY).then(|| bytes.to_vec())
    }
}
