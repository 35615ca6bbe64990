//! Second pass: classes of the pixels, from the triangles that show.

use super::band::{Band, LANES};
use super::code::Code;
use super::projection::Projection;
use super::scene::Scene;
use super::setup::HomogeneousTriangle;
use super::texels::Texels;
use crate::image::mask;
use crate::mesh::Surface;
#[cfg(target_arch = "x86_64")]
use pulp::cast;
#[cfg(target_arch = "x86_64")]
use pulp::x86::{V3, V4};
use pulp::{Arch, Simd, WithSimd};
use resurvey_schema::ClassId;
#[cfg(target_arch = "x86_64")]
use std::any::Any;
#[cfg(target_arch = "x86_64")]
use std::arch::x86_64::{__m128i, __m256i};

/// Pixels of a word of a bit plane.
pub(super) const PIXELS_PER_WORD: usize = 64;

/// Textured triangles whose texels are remembered from row to row.
const REMEMBERED: usize = 512;

/// Writes classes.
#[derive(Clone, Debug, Default)]
pub(super) struct Shader {
    /// By the last bits of the triangle's index: triangle and texels.
    texels: Vec<Option<(u32, Texels)>>,
    classes: Vec<u8>,
}

impl Shader {
    /// Begins an image.
    pub(super) fn start(&mut self) {
        self.texels.clear();
        self.texels.resize(REMEMBERED, None);
    }

    /// Classes of the rows of a band, each row padded with void to a whole number of [`PIXELS_PER_WORD`].
    pub(super) fn rows(
        &mut self,
        arch: Arch,
        scene: &Scene,
        projection: &Projection,
        band: &Band,
    ) -> impl Iterator<Item = &[u8]> {
        let padded = band.width().next_multiple_of(PIXELS_PER_WORD).max(PIXELS_PER_WORD);
        self.classes.resize(band.rows() * padded, ClassId::VOID.0);
        arch.dispatch(Fill { shader: self, scene, projection, band, padded });
        self.classes.chunks_exact(padded).take(band.rows())
    }

    /// The same, without padding, into the pixels of an image.
    pub(super) fn fill(&mut self, arch: Arch, scene: &Scene, projection: &Projection, band: &Band, pixels: &mut [u8]) {
        let rows = self.rows(arch, scene, projection, band);
        for (pixels, classes) in pixels.chunks_exact_mut(band.width().max(1)).zip(rows) {
            pixels.copy_from_slice(&classes[..pixels.len()]);
        }
    }
}

struct Fill<'a> {
    shader: &'a mut Shader,
    scene: &'a Scene,
    projection: &'a Projection,
    band: &'a Band,
    padded: usize,
}

impl WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { shader, scene, projection, band, padded } = self;
        let mut all = std::mem::take(&mut shader.classes);
        for (row, pixels) in all.chunks_exact_mut(padded).enumerate().take(band.rows()) {
            for (pixels, block) in pixels.chunks_exact_mut(LANES).zip(band.row(row)) {
                pixels.copy_from_slice(&classes(simd, &block.codes));
            }
            pixels[band.width()..].fill(ClassId::VOID.0);
            shader.look_up(simd, scene, projection, (band, row), pixels);
        }
        shader.classes = all;
    }
}

/// Classes of a block, or that they are to be looked up.
#[inline(always)]
fn classes<S: Simd>(simd: S, codes: &[u32; LANES]) -> [u8; LANES] {
    #[cfg(target_arch = "x86_64")]
    {
        let simd: &dyn Any = &simd;
        if let Some(simd) = simd.downcast_ref::<V4>() {
            let class_bits = simd.avx512f._mm512_set1_epi32(i32::from(Code::LOOKED_UP));
            return cast(simd.avx512f._mm512_cvtepi32_epi8(simd.avx512f._mm512_and_si512(cast(*codes), class_bits)));
        }
        if let Some(simd) = simd.downcast_ref::<V3>() {
            let [low, high]: [__m256i; 2] = cast(*codes);
            let class_bits = simd.avx._mm256_set1_epi32(i32::from(Code::LOOKED_UP));
            let [low, high] =
                [simd.avx2._mm256_and_si256(low, class_bits), simd.avx2._mm256_and_si256(high, class_bits)];
            // Packing works within halves: the middle quarters change places.
            let packed = simd.avx2._mm256_permute4x64_epi64::<0b11_01_10_00>(simd.avx2._mm256_packus_epi32(low, high));
            let [low, high]: [__m128i; 2] = cast(packed);
            return cast(simd.sse2._mm_packus_epi16(low, high));
        }
    }
    let _ = simd;
    let mut classes = [0; LANES];
    for lane in 0..LANES {
        classes[lane] = Code(codes[lane]).class();
    }
    classes
}

impl Shader {
    /// Fills in the classes that are not in the codes.
    #[inline(always)]
    fn look_up<S: Simd>(
        &mut self,
        simd: S,
        scene: &Scene,
        projection: &Projection,
        (band, row): (&Band, usize),
        pixels: &mut [u8],
    ) {
        let blocks = band.row(row);
        let code = |u: usize| blocks[u / LANES].codes[u % LANES];
        let mut done = 0;
        for first in (0..band.width()).step_by(PIXELS_PER_WORD) {
            let Ok(word) = <&[u8; PIXELS_PER_WORD]>::try_from(&pixels[first..first + PIXELS_PER_WORD]) else { return };
            let from = |u: usize| if u - first < PIXELS_PER_WORD { u64::MAX << (u - first) } else { 0 };
            let mut missing = mask(simd, word, Code::LOOKED_UP) & from(done.max(first));
            while missing != 0 {
                let start = first + missing.trailing_zeros() as usize;
                let run = Code(code(start));
                let mut end = start + 1;
                while end < band.width() && code(end) == run.0 {
                    let whole =
                        end.is_multiple_of(LANES) && end + LANES <= band.width() && blocks[end / LANES].is_all(run);
                    end += if whole { LANES } else { 1 };
                }
                self.look_up_run(scene, projection, run, [start, band.first_row() + row], &mut pixels[start..end]);
                done = end;
                missing &= from(end);
            }
        }
    }

    #[inline(always)]
    fn look_up_run(
        &mut self,
        scene: &Scene,
        projection: &Projection,
        run: Code,
        [u, v]: [usize; 2],
        pixels: &mut [u8],
    ) {
        let Some(triangle) = run.triangle() else {
            pixels.fill(scene.sky().0);
            return;
        };
        match scene.surface(triangle as usize) {
            Surface::Class(class) => pixels.fill(class.0),
            Surface::Texture(texture) => {
                let remembered = &mut self.texels[triangle as usize % REMEMBERED];
                if !matches!(remembered, Some((of, _)) if *of == triangle) {
                    let seen = HomogeneousTriangle::new(scene, projection, triangle);
                    *remembered = Texels::new(scene, triangle, &seen).map(|texels| (triangle, texels));
                }
                if let Some((_, texels)) = remembered {
                    texels.fill(texture, [u, v], pixels);
                }
            }
        }
    }
}
