//! Descriptors of the map that the view shows: still there, gone, or hidden. Judged as a whole, since the photo may
//! show anything where one stood, classes that are otherwise ignored among them.

use crate::raster::Rasters;
use crate::settings::Settings;

/// Pixels looked at per shift, at most.
const SAMPLES: usize = 400;
/// Shifts tried along each axis on either side of none.
const SHIFTS: i64 = 4;

/// What there is to judge by.
pub struct Evidence<'a> {
    /// Photo and view.
    pub rasters: &'a Rasters,
    /// Tolerance per pixel.
    pub tolerance_px: &'a [u8],
    /// Whether the map without descriptors explains the photo's class, per pixel.
    pub shows_behind: &'a [bool],
}

/// Pixels of every descriptor that is gone, by feature value; `min_px(class)` of them must be visible.
pub fn removed(evidence: &Evidence<'_>, settings: &Settings, min_px: impl Fn(u8) -> usize) -> Vec<Vec<usize>> {
    let features = &evidence.rasters.features;
    let count = features.iter().copied().max().unwrap_or(0) as usize;
    let mut pixels_of = vec![Vec::new(); count + 1];
    for (pixel, feature) in features.iter().enumerate().filter(|(_, feature)| **feature > 0) {
        pixels_of[*feature as usize].push(pixel);
    }
    let is_gone = |pixels: &Vec<usize>| {
        let Some(first) = pixels.first() else { return false };
        let behind = pixels.iter().filter(|pixel| evidence.shows_behind[**pixel]).count();
        pixels.len() >= min_px(evidence.rasters.view[*first])
            && behind as f64 >= settings.removal_share * pixels.len() as f64
            && still_share(evidence, pixels) < settings.still_share
    };
    pixels_of.into_iter().filter(is_gone).collect()
}

/// Largest share of the descriptor's pixels on which the photo, shifted by up to the tolerance, shows its class. Pixels
/// that another descriptor of the same class accounts for do not count.
fn still_share(evidence: &Evidence<'_>, pixels: &[usize]) -> f64 {
    let rasters = evidence.rasters;
    let (class, feature) = (rasters.view[pixels[0]], rasters.features[pixels[0]]);
    let mut tolerances: Vec<u8> = pixels.iter().map(|pixel| evidence.tolerance_px[*pixel]).collect();
    tolerances.sort_unstable();
    let tolerance_px = i64::from(tolerances[tolerances.len() / 2]);
    let samples: Vec<usize> = pixels.iter().copied().step_by(pixels.len().div_ceil(SAMPLES)).collect();
    let (width, height) = (rasters.width as i64, rasters.height as i64);
    let shows_it = |pixel: usize, right: i64, down: i64| {
        let (u, v) = (pixel as i64 % width + right, pixel as i64 / width + down);
        if !(0..width).contains(&u) || !(0..height).contains(&v) {
            return false;
        }
        let at = (v * width + u) as usize;
        let other_one = rasters.features[at] != 0 && rasters.features[at] != feature && rasters.view[at] == class;
        rasters.photo[at] == class && !other_one
    };
    let shift = |step: i64| step * tolerance_px / SHIFTS;
    let shifts = || (-SHIFTS..=SHIFTS).flat_map(|down| (-SHIFTS..=SHIFTS).map(move |right| (right, down)));
    let most = shifts()
        .map(|(right, down)| samples.iter().filter(|pixel| shows_it(**pixel, shift(right), shift(down))).count())
        .max();
    most.unwrap_or(0) as f64 / samples.len() as f64
}
