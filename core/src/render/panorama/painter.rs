//! Draws panoramas, one position after the other: what showed last time first, then what of the scene that does not
//! hide.

use super::cone::Cone;
use super::grid::{PanoramaGrid, Sector};
use super::reach::{Frame, Reach};
use crate::render::Scene;
use crate::render::band::{Band, Block, LANES};
use crate::render::code::Code;
use crate::render::occlusion::{CERTAIN, Occlusion};
use crate::render::shown::Shown;
use nalgebra::Vector3;
use pulp::{Arch, Simd, WithSimd};

/// Triangles drawn before it is looked at what they hide, and growth of that number from one look to the next.
const FIRST_LOOK: usize = 64;
const LOOK_GROWTH: usize = 2;

/// A panorama of a scene from one position, drawn anew from position to position; fastest when positions that follow
/// each other see much the same. One per thread.
#[derive(Clone, Debug)]
pub struct Panorama {
    arch: Arch,
    grid: PanoramaGrid,
    sector: Sector,
    frame: Frame,
    /// A row of the band is a column of the sector, from the lowest cell up; depths are horizontal distances.
    band: Band,
    occlusion: Occlusion,
    shown: Shown,
    stack: Vec<u32>,
    eye: [f64; 3],
    /// The triangle whose texture was looked at last, and its gradients.
    textured: Option<(u32, [Vector3<f64>; 2])>,
}

impl Panorama {
    /// A panorama over `grid` of which the `wanted` columns will be looked at, for the best instruction set that the
    /// processor has.
    pub fn new(grid: &PanoramaGrid, wanted: &[bool]) -> Self {
        Self::with(Arch::new(), grid, wanted)
    }

    /// The same for the instruction set that every processor has; its cells are the same.
    pub fn baseline(grid: &PanoramaGrid, wanted: &[bool]) -> Self {
        Self::with(Arch::Scalar, grid, wanted)
    }

    fn with(arch: Arch, grid: &PanoramaGrid, wanted: &[bool]) -> Self {
        let sector = grid.sector(wanted);
        Self {
            arch,
            frame: Frame::new(grid, &sector),
            grid: grid.clone(),
            sector,
            band: Band::default(),
            occlusion: Occlusion::default(),
            shown: Shown::default(),
            stack: Vec::new(),
            eye: [0.0; 3],
            textured: None,
        }
    }

    /// Draws `scene` as seen from `eye`, an offset from the scene's origin.
    pub fn draw(&mut self, scene: &Scene, eye: [f64; 3]) {
        self.start(scene, eye);
        let arch = self.arch;
        arch.dispatch(Draw { panorama: self, scene });
        self.shown.look(&self.band);
        self.shown.finish_look();
    }

    /// The same cells by drawing one triangle after the other, none left out: slow.
    pub fn draw_one_by_one(&mut self, scene: &Scene, eye: [f64; 3]) {
        self.start(scene, eye);
        let arch = self.arch;
        for triangle in 0..scene.positions().len() as u32 {
            arch.dispatch(DrawOne { panorama: self, scene, triangle });
        }
    }

    fn start(&mut self, scene: &Scene, eye: [f64; 3]) {
        (self.eye, self.textured) = (eye, None);
        self.band.clear(0, self.sector.count, self.grid.rows(), Code::sky(scene.sky()));
        self.shown.fit(scene.positions().len());
    }

    /// The triangle that shows in a cell and its horizontal distance, metres; `None` for sky and in columns that are not
    /// wanted.
    pub fn cell(&self, column: usize, row: usize) -> Option<(u32, f32)> {
        let block = &self.band.row(self.sector.slot(column, self.grid.columns())?)[row / LANES];
        let triangle = Code(block.codes[row % LANES]).triangle()?;
        Some((triangle, 1.0 / block.inverse_depths[row % LANES]))
    }

    /// Classes of a wanted column of the `scene` just drawn, lowest row first, into as many bytes as there are rows.
    pub fn classes(&mut self, scene: &Scene, column: usize, classes: &mut [u8]) {
        let Some(slot) = self.sector.slot(column, self.grid.columns()) else { return };
        let Self { grid, sector, band, textured, eye, .. } = self;
        for (block, (first, classes)) in band.row(slot).iter().zip((0..).step_by(LANES).zip(classes.chunks_mut(LANES)))
        {
            let mut looked_up = false;
            for (class, &code) in classes.iter_mut().zip(&block.codes) {
                *class = Code(code).class();
                looked_up |= *class == Code::LOOKED_UP;
            }
            if !looked_up {
                continue;
            }
            for (lane, class) in classes.iter_mut().enumerate().filter(|(_, class)| **class == Code::LOOKED_UP) {
                let Some(triangle) = Code(block.codes[lane]).triangle() else {
                    *class = scene.sky().0;
                    continue;
                };
                let gradients = match textured {
                    Some((known, gradients)) if *known == triangle => *gradients,
                    _ => {
                        let gradients = uv_gradients(scene, triangle, *eye);
                        *textured = Some((triangle, gradients));
                        gradients
                    }
                };
                let direction = Vector3::new(sector.sin[slot], sector.cos[slot], grid.tangent(first + lane));
                let distance_m = 1.0 / f64::from(block.inverse_depths[lane]);
                let uv = gradients.map(|gradient| (gradient.dot(&direction) * distance_m) as f32);
                *class = scene.class_at(triangle as usize, uv).0;
            }
        }
    }
}

fn uv_gradients(scene: &Scene, triangle: u32, eye: [f64; 3]) -> [Vector3<f64>; 2] {
    let cone = Cone::new(&corners(scene, triangle, eye));
    cone.map_or_else(Default::default, |cone| cone.uv_gradients(&scene.uvs()[triangle as usize]))
}

#[inline(always)]
fn corners(scene: &Scene, triangle: u32, eye: [f64; 3]) -> [[f64; 3]; 3] {
    scene.positions()[triangle as usize].map(|corner| [0, 1, 2].map(|axis| f64::from(corner[axis]) - eye[axis]))
}

/// Draws all of a scene.
struct Draw<'a> {
    panorama: &'a mut Panorama,
    scene: &'a Scene,
}

impl WithSimd for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panorama, scene } = self;
        let Panorama { grid, sector, frame, band, occlusion, shown, stack, eye, .. } = panorama;
        for &triangle in shown.triangles() {
            let corners = corners(scene, triangle, *eye);
            if let Some(reach) = frame.of_triangle(&corners)
                && let Some(cone) = Cone::new(&corners)
            {
                cone.paint(simd, band, (grid, sector), &reach, scene.codes()[triangle as usize]);
            }
        }
        occlusion.take(band);
        let (mut painted, mut next_look) = (0, FIRST_LOOK);
        let mut walk = scene.hierarchy().start(eye.map(|value| value as f32), stack);
        while let Some(place) = walk.next() {
            if !frame.of_box(place.bounds(), *eye).is_some_and(|reach| may_show(occlusion, band, &reach)) {
                continue;
            }
            let Some(cluster) = place.cluster() else {
                walk.enter(place);
                continue;
            };
            for triangle in scene.clusters()[cluster].triangles.clone() {
                if shown.holds(triangle as u32) {
                    continue;
                }
                let corners = corners(scene, triangle as u32, *eye);
                if let Some(reach) = frame.of_triangle(&corners)
                    && may_show(occlusion, band, &reach)
                    && let Some(cone) = Cone::new(&corners)
                {
                    cone.paint(simd, band, (grid, sector), &reach, scene.codes()[triangle]);
                    painted += 1;
                }
            }
            if painted >= next_look {
                occlusion.take(band);
                next_look = painted * LOOK_GROWTH;
            }
        }
    }
}

/// Whether not all that something can touch is hidden, by tiles as they were and then by cells as they are. What is drawn
/// is never nearer than its reach says, so what is hidden could not even be equal.
#[inline(always)]
fn may_show(occlusion: &Occlusion, band: &Band, reach: &Reach) -> bool {
    let shows = |[first, end]: [i32; 2]| {
        first < end
            && !occlusion.hides(reach.rows, [first, end], reach.nearest)
            && (first..end).any(|column| shows_in_column(band.row(column as usize), reach))
    };
    reach.columns.into_iter().any(shows)
}

/// Whether something can be as near as one of the cells of a column that it can touch.
#[inline(always)]
fn shows_in_column(blocks: &[Block], reach: &Reach) -> bool {
    let nearest = reach.nearest * (1.0 + CERTAIN);
    let [first, end] = reach.rows.map(|row| row as usize);
    let length = (end - first) as u32;
    let touched = first / LANES..end.div_ceil(LANES);
    touched.clone().zip(&blocks[touched]).any(|(index, block)| {
        let mut shows = false;
        for lane in 0..LANES {
            let inside = ((index * LANES + lane) as u32).wrapping_sub(first as u32) < length;
            shows |= inside & (block.inverse_depths[lane] <= nearest);
        }
        shows
    })
}

/// Draws one triangle.
struct DrawOne<'a> {
    panorama: &'a mut Panorama,
    scene: &'a Scene,
    triangle: u32,
}

impl WithSimd for DrawOne<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { panorama: Panorama { grid, sector, frame, band, eye, .. }, scene, triangle } = self;
        let corners = corners(scene, triangle, *eye);
        if let Some(reach) = frame.of_triangle(&corners)
            && let Some(cone) = Cone::new(&corners)
        {
            cone.paint(simd, band, (grid, sector), &reach, scene.codes()[triangle as usize]);
        }
    }
}
