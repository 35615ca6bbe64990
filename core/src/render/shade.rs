//! Second pass: classes of the pixels, from the triangles that show.

use super::band::{Band, LANES};
use super::code::Code;
use super::projection::Projection;
use super::scene::Scene;
use super::setup::HomogeneousTriangle;
use super::texels::Texels;
use crate::mesh::Surface;
use pulp::{Arch, Simd, WithSimd};

/// Textured triangles whose texels are remembered from row to row.
const REMEMBERED: usize = 512;

/// Writes classes.
#[derive(Clone, Debug, Default)]
pub(super) struct Shader {
    /// By the last bits of the triangle's index: triangle and texels.
    texels: Vec<Option<(u32, Texels)>>,
}

impl Shader {
    /// Begins an image.
    pub(super) fn start(&mut self) {
        self.texels.clear();
        self.texels.resize(REMEMBERED, None);
    }

    /// Classes of the rows of a band.
    pub(super) fn fill(&mut self, arch: Arch, scene: &Scene, projection: &Projection, band: &Band, pixels: &mut [u8]) {
        arch.dispatch(Fill { shader: self, scene, projection, band, pixels });
    }
}

struct Fill<'a> {
    shader: &'a mut Shader,
    scene: &'a Scene,
    projection: &'a Projection,
    band: &'a Band,
    pixels: &'a mut [u8],
}

impl WithSimd for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { shader, scene, projection, band, pixels } = self;
        for (row, pixels) in pixels.chunks_exact_mut(band.width().max(1)).enumerate().take(band.rows()) {
            let mut looks_up = 0_u32;
            let mut blocks = band.row(row).iter();
            let mut whole = pixels.chunks_exact_mut(LANES);
            for (pixels, block) in (&mut whole).zip(&mut blocks) {
                let mut highest = 0;
                for lane in 0..LANES {
                    let class = block.codes[lane] & u32::from(Code::LOOKED_UP);
                    pixels[lane] = class as u8;
                    highest = if class > highest { class } else { highest };
                }
                looks_up |= u32::from(highest == u32::from(Code::LOOKED_UP));
            }
            for (pixel, code) in whole.into_remainder().iter_mut().zip(blocks.flat_map(|block| &block.codes)) {
                *pixel = Code(*code).class();
                looks_up |= u32::from(*pixel == Code::LOOKED_UP);
            }
            if looks_up != 0 {
                shader.look_up(scene, projection, (band, row), pixels);
            }
        }
    }
}

impl Shader {
    /// Fills in the classes that are not in the codes.
    #[inline(always)]
    fn look_up(&mut self, scene: &Scene, projection: &Projection, (band, row): (&Band, usize), pixels: &mut [u8]) {
        let blocks = band.row(row);
        let code = |u: usize| blocks[u / LANES].codes[u % LANES];
        let mut u = 0;
        while u < pixels.len() {
            if pixels[u] != Code::LOOKED_UP {
                u += 1;
                continue;
            }
            let (first, run) = (u, code(u));
            while u < pixels.len() && code(u) == run {
                let whole = u % LANES == 0 && u + LANES <= pixels.len() && blocks[u / LANES].codes == [run; LANES];
                u += if whole { LANES } else { 1 };
            }
            let pixels = &mut pixels[first..u];
            let Some(triangle) = Code(run).triangle() else {
                pixels.fill(scene.sky().0);
                continue;
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
                        texels.fill(texture, [first, band.first_row() + row], pixels);
                    }
                }
            }
        }
    }
}
