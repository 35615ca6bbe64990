//! Which differences a shift explains, by their thickness.
//!
//! Where the photo is the view shifted by s, a disk wider than |s| cannot lie in the pixels that have one class in the
//! photo and another in the view: the disk would hold a pixel and that pixel less s, and the view there has the photo's
//! class. So what is thicker than the tolerance is a change, however near the view has the same class.

use resurvey_class_difference::raster::Rasters;

/// Chamfer steps across and diagonally (Borgefors 1986), thirds of a pixel.
const ACROSS: u32 = 3;
const DIAGONAL: u32 = 4;

/// For every pixel with `different`, whether no disk wider than the tolerance around it holds the pixel and lies in
/// different pixels of the same class of the photo; `false` elsewhere.
pub fn is_thin(rasters: &Rasters, different: &[bool], tolerance_px: &[u8]) -> Vec<bool> {
    let class = |pixel: usize| different[pixel].then(|| rasters.photo[pixel]);
    let classes: Vec<Option<u8>> = (0..different.len()).map(class).collect();
    let depth = depths(&classes, rasters.width);
    let mut reach: Vec<u32> = (0..depth.len())
        .map(|pixel| {
            // A disk whose centre is d pixels from the first pixel outside is 2 d - 1 wide.
            let is_thick = 2 * depth[pixel] > ACROSS * (u32::from(tolerance_px[pixel]) + 1);
            if is_thick { depth[pixel] } else { 0 }
        })
        .collect();
    for pixel in 0..reach.len() {
        reach[pixel] = spread(&classes, &reach, pixel, before(pixel, rasters.width));
    }
    for pixel in (0..reach.len()).rev() {
        reach[pixel] = spread(&classes, &reach, pixel, after(pixel, rasters.width, classes.len()));
    }
    (0..reach.len()).map(|pixel| different[pixel] && reach[pixel] == 0).collect()
}

/// Distance to the first pixel of another class; 0 where there is none to be in.
fn depths(classes: &[Option<u8>], width: usize) -> Vec<u32> {
    let mut depth: Vec<u32> = classes.iter().map(|class| if class.is_some() { u32::MAX / 2 } else { 0 }).collect();
    let nearer = |depth: &[u32], pixel: usize, near: [Option<(usize, u32)>; 4]| {
        near.into_iter().fold(depth[pixel], |least, near| {
            let through = near
                .map_or(ACROSS, |(near, step)| if classes[near] == classes[pixel] { depth[near] + step } else { step });
            least.min(through)
        })
    };
    for pixel in 0..depth.len() {
        depth[pixel] = nearer(&depth, pixel, before(pixel, width));
    }
    for pixel in (0..depth.len()).rev() {
        depth[pixel] = nearer(&depth, pixel, after(pixel, width, classes.len()));
    }
    depth
}

fn spread(classes: &[Option<u8>], reach: &[u32], pixel: usize, near: [Option<(usize, u32)>; 4]) -> u32 {
    let same = near.into_iter().flatten().filter(|(near, _)| classes[*near] == classes[pixel]);
    same.fold(reach[pixel], |most, (near, step)| most.max(reach[near].saturating_sub(step)))
}

/// The neighbours above and left of a pixel, with the step to them.
fn before(pixel: usize, width: usize) -> [Option<(usize, u32)>; 4] {
    let (column, above) = (pixel % width, pixel.checked_sub(width));
    let (left, right) = (column > 0, column + 1 < width);
    [
        left.then(|| (pixel - 1, ACROSS)),
        above.filter(|_| left).map(|above| (above - 1, DIAGONAL)),
        above.map(|above| (above, ACROSS)),
        above.filter(|_| right).map(|above| (above + 1, DIAGONAL)),
    ]
}

/// The neighbours below and right of a pixel, with the step to them.
fn after(pixel: usize, width: usize, len: usize) -> [Option<(usize, u32)>; 4] {
    let (column, below) = (pixel % width, Some(pixel + width).filter(|below| *below < len));
    let (left, right) = (column > 0, column + 1 < width);
    [
        right.then(|| (pixel + 1, ACROSS)),
        below.filter(|_| right).map(|below| (below + 1, DIAGONAL)),
        below.map(|below| (below, ACROSS)),
        below.filter(|_| left).map(|below| (below - 1, DIAGONAL)),
    ]
}
