//! Which triangles showed in an image: a good guess at what shows in the next.

use super::band::Band;
use super::code::Code;

/// Triangles that showed when it was last looked.
#[derive(Clone, Debug, Default)]
pub(super) struct Shown {
    triangles: Vec<u32>,
    held: Flags,
    /// Of the look that is under way.
    found: Vec<u32>,
    found_flags: Flags,
}

/// A bit per triangle.
#[derive(Clone, Debug, Default)]
struct Flags(Vec<u64>);

impl Shown {
    /// Makes it fit a scene of so many triangles; what is known of another scene is a bad guess and nothing worse.
    pub(super) fn fit(&mut self, triangles: usize) {
        if self.held.0.len() != triangles.div_ceil(64) {
            self.triangles.clear();
            for flags in [&mut self.held, &mut self.found_flags] {
                flags.0.clear();
                flags.0.resize(triangles.div_ceil(64), 0);
            }
        }
    }

    /// The triangles, rising.
    #[inline(always)]
    pub(super) fn triangles(&self) -> &[u32] {
        &self.triangles
    }

    #[inline(always)]
    pub(super) fn holds(&self, triangle: u32) -> bool {
        self.held.has(triangle)
    }

    /// Looks at a band of the image.
    pub(super) fn look(&mut self, band: &Band) {
        let mut last = 0;
        for blocks in (0..band.rows()).map(|row| band.row(row)) {
            for block in blocks {
                if block.is_all(Code(last)) {
                    continue;
                }
                for &code in &block.codes {
                    if code != last {
                        last = code;
                        let triangle = Code(code).triangle().filter(|&triangle| !self.found_flags.has(triangle));
                        if let Some(triangle) = triangle {
                            self.found_flags.turn(triangle);
                            self.found.push(triangle);
                        }
                    }
                }
            }
        }
    }

    /// Takes what was found since the last time as what shows.
    pub(super) fn finish_look(&mut self) {
        self.triangles.iter().for_each(|&triangle| self.held.turn(triangle));
        self.found.sort_unstable();
        self.found.iter().for_each(|&triangle| self.held.turn(triangle));
        self.found.iter().for_each(|&triangle| self.found_flags.turn(triangle));
        std::mem::swap(&mut self.triangles, &mut self.found);
        self.found.clear();
    }
}

impl Flags {
    #[inline(always)]
    fn has(&self, triangle: u32) -> bool {
        self.0[triangle as usize / 64] >> (triangle % 64) & 1 == 1
    }

    fn turn(&mut self, triangle: u32) {
        self.0[triangle as usize / 64] ^= 1 << (triangle % 64);
    }
}
