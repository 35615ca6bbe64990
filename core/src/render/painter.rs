//! Draws bands of rows: what showed last time first, then what of the scene that does not hide.

use super::band::{Band, Span};
use super::code::Code;
use super::edges::ROWS;
use super::occlusion::{Occlusion, TILE};
use super::projection::{Projection, Seen};
use super::scene::Scene;
use super::setup::{Setup, TOGETHER, prepare};
use super::shown::Shown;
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;

/// Rows of a band.
const BAND_ROWS: usize = 12 * TILE;
/// Images from one look at what shows to the next.
const LOOK_EVERY: u32 = 8;
/// Triangles drawn in a band before it is looked at what they hide.
const FIRST_LOOK: usize = 32;
/// Growth of the number of triangles from one such look to the next.
const LOOK_GROWTH: usize = 3;

/// What is drawn.
#[derive(Clone, Copy)]
pub(super) enum Triangles<'a> {
    All,
    /// Those with these indices.
    Only(&'a [u32]),
}

/// Buffers for bands and for what is known of the image before.
#[derive(Clone, Debug)]
pub(super) struct Painter {
    arch: Arch,
    band: Band,
    occlusion: Occlusion,
    setups: Vec<Setup>,
    /// Setups of what is drawn first, per band.
    first: Vec<Vec<u32>>,
    /// Of each cluster: the image for which it was prepared last, and its setups.
    prepared: Vec<Prepared>,
    /// Images drawn.
    images: u64,
    shown: Shown,
    until_look: u32,
    stack: Vec<u32>,
}

#[derive(Clone, Debug, Default)]
struct Prepared {
    image: u64,
    setups: Range<u32>,
}

impl Painter {
    pub(super) fn new(arch: Arch) -> Self {
        Self {
            arch,
            band: Band::default(),
            occlusion: Occlusion::default(),
            setups: Vec::new(),
            first: Vec::new(),
            prepared: Vec::new(),
            images: 0,
            shown: Shown::default(),
            until_look: 0,
            stack: Vec::new(),
        }
    }

    /// Makes the next image one of those in which it is looked at what shows.
    pub(super) fn look_next(&mut self) {
        self.until_look = 0;
    }

    /// Triangles that showed when it was last looked, rising.
    pub(super) fn shown(&self) -> &[u32] {
        self.shown.triangles()
    }

    /// Draws `rows` of the image, one band after the other, and lends each to `receive`.
    pub(super) fn draw(
        &mut self,
        scene: &Scene,
        triangles: Triangles,
        projection: &Projection,
        rows: Range<usize>,
        mut receive: impl FnMut(Arch, &Band),
    ) {
        let whole = matches!(triangles, Triangles::All);
        let looks = whole && self.until_look == 0;
        if whole {
            self.until_look = if looks { LOOK_EVERY - 1 } else { self.until_look - 1 };
        }
        let image = Image { scene, projection, rows: &rows, whole };
        let arch = self.arch;
        arch.dispatch(Start { painter: self, image, triangles });
        for index in 0..rows.len().div_ceil(BAND_ROWS) {
            arch.dispatch(Draw { painter: self, image, index });
            if looks {
                self.shown.look(&self.band);
            }
            receive(arch, &self.band);
        }
        if looks {
            self.shown.finish_look();
        }
    }
}

#[derive(Clone, Copy)]
struct Image<'a> {
    scene: &'a Scene,
    projection: &'a Projection,
    rows: &'a Range<usize>,
    /// Whether all of the scene is drawn.
    whole: bool,
}

/// Prepares what is drawn first.
struct Start<'a> {
    painter: &'a mut Painter,
    image: Image<'a>,
    triangles: Triangles<'a>,
}

impl WithSimd for Start<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let Self { painter, image: Image { scene, projection, rows, .. }, triangles } = self;
        let Painter { setups, first, prepared, images, shown, .. } = painter;
        *images += 1;
        setups.clear();
        prepared.resize(scene.clusters().len(), Prepared::default());
        shown.fit(scene.positions().len());
        let triangles = match triangles {
            Triangles::All => shown.triangles(),
            Triangles::Only(triangles) => triangles,
        };
        for triangles in triangles.chunks(TOGETHER) {
            prepare(scene, projection, rows, triangles, setups);
        }
        first.resize(rows.len().div_ceil(BAND_ROWS), Vec::new());
        first.iter_mut().for_each(Vec::clear);
        for (index, setup) in setups.iter().enumerate() {
            let [from, to] = setup.rows.map(|row| row as usize - rows.start);
            for band in &mut first[from / BAND_ROWS..(to - 1) / BAND_ROWS + 1] {
                band.push(index as u32);
            }
        }
    }
}

/// Draws one band.
struct Draw<'a> {
    painter: &'a mut Painter,
    image: Image<'a>,
    index: usize,
}

impl WithSimd for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, simd: S) {
        let Self { painter, image, index } = self;
        let Image { scene, projection, rows, whole } = image;
        let Painter { band, occlusion, setups, first, prepared, images, stack, shown, .. } = painter;
        let first_row = rows.start + index * BAND_ROWS;
        let band_rows = [first_row as i32, (first_row + BAND_ROWS).min(rows.end) as i32];
        band.clear(first_row, band_rows[1] as usize - first_row, projection.width as usize, Code::sky(scene.sky()));
        for &setup in &first[index] {
            paint(simd, band, &setups[setup as usize], band_rows);
        }
        if !whole {
            return;
        }
        occlusion.clear();
        if !first[index].is_empty() {
            occlusion.take(band);
        }
        let (mut painted, mut next_look) = (0, FIRST_LOOK);
        let mut walk = scene.hierarchy().start(projection.eye(), stack);
        while let Some(place) = walk.next() {
            let may_show = match projection.see(place.bounds()) {
                Seen::Outside => false,
                Seen::Anywhere => true,
                Seen::Within { columns, rows, nearest } => {
                    let rows = common(rows, band_rows);
                    rows[0] < rows[1] && !occlusion.hides(columns, rows, nearest)
                }
            };
            if !may_show {
                continue;
            }
            let Some(cluster) = place.cluster() else {
                walk.enter(place);
                continue;
            };
            let prepared = &mut prepared[cluster];
            if prepared.image != *images {
                let start = setups.len() as u32;
                prepare_others(&image, shown, scene.clusters()[cluster].triangles.clone(), setups);
                *prepared = Prepared { image: *images, setups: start..setups.len() as u32 };
            }
            for setup in &setups[prepared.setups.start as usize..prepared.setups.end as usize] {
                let rows = common(setup.rows, band_rows);
                if rows[0] < rows[1] && !occlusion.hides(setup.columns, rows, setup.nearest) {
                    paint_what_shows(simd, band, occlusion, setup, rows);
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

#[inline(always)]
fn common(a: [i32; 2], b: [i32; 2]) -> [i32; 2] {
    [a[0].max(b[0]), a[1].min(b[1])]
}

/// Adds the setups of those of `triangles` that may show and are not drawn first.
#[inline(always)]
fn prepare_others(image: &Image, shown: &Shown, triangles: Range<usize>, setups: &mut Vec<Setup>) {
    let (mut others, mut count) = ([0; TOGETHER], 0);
    for triangle in triangles.clone() {
        if !shown.holds(triangle as u32) {
            others[count] = triangle as u32;
            count += 1;
        }
        if count == TOGETHER || (count > 0 && triangle + 1 == triangles.end) {
            prepare(image.scene, image.projection, image.rows, &others[..count], setups);
            count = 0;
        }
    }
}

/// Draws a triangle into the rows of the band that it covers.
#[inline(always)]
fn paint<S: Simd>(simd: S, band: &mut Band, setup: &Setup, band_rows: [i32; 2]) {
    let [first_row, end_row] = common(setup.rows, band_rows);
    for row in (first_row..end_row).step_by(ROWS) {
        paint_rows(simd, band, setup, [row, end_row.min(row + ROWS as i32)], |_| true);
    }
}

/// The same, without the tiles in which all of it is hidden.
#[inline(always)]
fn paint_what_shows<S: Simd>(simd: S, band: &mut Band, occlusion: &Occlusion, setup: &Setup, rows: [i32; 2]) {
    let mut row = rows[0];
    while row < rows[1] {
        // Bands begin at a row of tiles, and a row of tiles is as high as rows are worked on at once.
        let end = rows[1].min(row + ROWS as i32 - (row - band.first_row() as i32) % TILE as i32);
        if !occlusion.hides(setup.columns, [row, end], setup.nearest) {
            let tiles = occlusion.tiles(row);
            paint_rows(simd, band, setup, [row, end], |block| !tiles.hide(block, setup.nearest));
        }
        row = end;
    }
}

/// Draws up to [`ROWS`] rows of a triangle, in the blocks that `shows` picks.
#[inline(always)]
fn paint_rows<S: Simd>(
    simd: S,
    band: &mut Band,
    setup: &Setup,
    [first_row, end_row]: [i32; 2],
    shows: impl Fn(usize) -> bool,
) {
    let [step, per_row, constant] = setup.inverse_depth;
    let columns = setup.edges.columns(first_row);
    let (mut anchors, mut starts) = ([0.0; ROWS], [0.0; ROWS]);
    for k in 0..ROWS {
        let y = f64::from(first_row) + 0.5 + k as f64;
        let anchor = f64::from(if step >= 0.0 { columns.first[k] } else { columns.end[k] - 1 });
        anchors[k] = anchor as f32;
        starts[k] = (step * (anchor + 0.5) + (per_row * y + constant)) as f32;
    }
    let row_in_band = first_row as usize - band.first_row();
    for k in 0..(end_row - first_row) as usize {
        let (first, end) = (columns.first[k], columns.end[k]);
        if first < end {
            let span = Span { first, end, anchor: anchors[k], start: starts[k], step: step as f32 };
            band.draw(simd, row_in_band + k, span, setup.code, &shows);
        }
    }
}
