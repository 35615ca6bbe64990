//! Descriptors of the map that the view shows: still there, gone, or hidden. Judged as a whole, since the photo may
//! show anything where one stood, classes that are otherwise ignored among them.
//!
//! All descriptors of a class are looked for at one common shift, near ones shifted more than far ones: the pose error
//! moves them together, so one that is gone cannot pass for its neighbour.

use crate::raster::Rasters;
use crate::settings::Settings;
use crate::tolerance::Tolerance;

/// Pixels looked at per descriptor and shift, at most.
const SAMPLES: usize = 300;
/// Shifts tried along each axis on either side of none.
const SHIFTS: i64 = 6;
/// Share of matching pixels that the largest shift must gain over none: small errors are likelier than large ones.
const SHIFT_COST: f64 = 0.15;
/// Largest shift, as a multiple of the largest tolerance of a pixel.
const MAX_SHIFT: f64 = 4.0;

/// Share of its pixels that show another class than its own, at least, to judge by.
const MIN_FREE: f64 = 0.4;

/// From this share of its pixels on that show its class, at its best shift, it may still be there.
const DOUBTFUL: f64 = 0.5;

/// What there is to judge by.
pub struct Evidence<'a> {
    /// Photo and view.
    pub rasters: &'a Rasters,
    /// The tolerance.
    pub tolerance: &'a Tolerance,
    /// Whether the map without descriptors explains the photo's class, per pixel.
    pub shows_behind: &'a [bool],
    /// The settings.
    pub settings: &'a Settings,
}

/// A descriptor in the view.
pub struct Seen {
    /// Its pixels.
    pub pixels: Vec<usize>,
    samples: Vec<usize>,
    class: u8,
    reach_px: f64,
    /// Right and down, pixels.
    shift: [i64; 2],
    still_share: f64,
}

/// The descriptors in the view, by feature value.
pub fn seen(evidence: &Evidence<'_>) -> Vec<Seen> {
    let features = &evidence.rasters.features;
    let mut pixels_of = std::collections::BTreeMap::<u32, Vec<usize>>::new();
    for (pixel, feature) in features.iter().enumerate().filter(|(_, feature)| **feature > 0) {
        pixels_of.entry(*feature).or_default().push(pixel);
    }
    let mut all: Vec<Seen> = pixels_of.into_values().map(|pixels| sighting(evidence, pixels)).collect();
    let mut classes: Vec<u8> = all.iter().map(|seen| seen.class).collect();
    classes.sort_unstable();
    classes.dedup();
    for class in classes {
        let mut group: Vec<&mut Seen> = all.iter_mut().filter(|seen| seen.class == class).collect();
        let best = common_shift(evidence.rasters, &group);
        for seen in &mut group {
            settle(evidence.rasters, seen, best);
        }
    }
    all
}

impl Seen {
    /// Whether the photo shows it, shifted or not.
    pub fn is_still_there(&self, settings: &Settings) -> bool {
        self.still_share >= settings.still_share
    }

    /// Its pixels at which the photo shows another class.
    pub fn free(&self, rasters: &Rasters) -> Vec<usize> {
        self.pixels.iter().copied().filter(|pixel| rasters.photo[*pixel] != self.class).collect()
    }

    /// Whether the photo shows what is behind it instead. Where it shows the descriptor's own class after all, another
    /// of its kind stands in front.
    /// Where much of it still seems to be there, that must be `claimed` by something new.
    pub fn is_gone(&self, evidence: &Evidence<'_>, claimed: &[bool]) -> bool {
        let free = self.free(evidence.rasters);
        let covered = || self.pixels.iter().filter(|pixel| evidence.rasters.photo[**pixel] == self.class);
        let is_replaced = covered().filter(|pixel| claimed[**pixel]).count() * 2 >= covered().count();
        if self.still_share >= DOUBTFUL && !is_replaced {
            return false;
        }
        let behind = free.iter().filter(|pixel| evidence.shows_behind[**pixel]).count();
        free.len() as f64 >= MIN_FREE * self.pixels.len() as f64
            && behind as f64 >= evidence.settings.removal_share * free.len() as f64
            && !self.is_still_there(evidence.settings)
    }

    /// Marks in `accounted` the pixels that show it in the photo, and those up to `margin_px` around.
    pub fn account(&self, rasters: &Rasters, margin_px: i64, accounted: &mut [bool]) {
        for pixel in &self.pixels {
            for (right, down) in (-margin_px..=margin_px).flat_map(|d| (-margin_px..=margin_px).map(move |r| (r, d))) {
                if let Some(at) = moved(rasters, *pixel, [self.shift[0] + right, self.shift[1] + down]) {
                    accounted[at] |= rasters.photo[at] == self.class;
                }
            }
        }
    }
}

fn sighting(evidence: &Evidence<'_>, pixels: Vec<usize>) -> Seen {
    let rasters = evidence.rasters;
    let mut ranges_m: Vec<f32> = pixels.iter().map(|pixel| rasters.range_m[*pixel]).collect();
    ranges_m.sort_by(f32::total_cmp);
    let limit_px = MAX_SHIFT * f64::from(evidence.settings.max_tolerance_px);
    let reach_px = evidence.tolerance.at_px(f64::from(ranges_m[ranges_m.len() / 2])).min(limit_px);
    let samples = pixels.iter().copied().step_by(pixels.len().div_ceil(SAMPLES)).collect();
    Seen { class: rasters.view[pixels[0]], samples, pixels, reach_px, shift: [0, 0], still_share: 0.0 }
}

/// The shift, in steps, at which the photo shows most of `group`.
fn common_shift(rasters: &Rasters, group: &[&mut Seen]) -> [i64; 2] {
    let total: usize = group.iter().map(|seen| seen.samples.len()).sum();
    let worth = |steps: [i64; 2]| {
        let matching: f64 = group.iter().map(|seen| share(rasters, seen, steps) * seen.samples.len() as f64).sum();
        let far = (steps[0].pow(2) + steps[1].pow(2)) as f64 / (SHIFTS * SHIFTS) as f64;
        matching / total.max(1) as f64 - SHIFT_COST * far
    };
    let steps = (-SHIFTS..=SHIFTS).flat_map(|down| (-SHIFTS..=SHIFTS).map(move |right| [right, down]));
    steps.map(|steps| (worth(steps), steps)).max_by(|a, b| a.0.total_cmp(&b.0)).map_or([0, 0], |(_, steps)| steps)
}

/// Sets where `seen` itself fits best within a step of the common shift.
fn settle(rasters: &Rasters, seen: &mut Seen, common: [i64; 2]) {
    let near = (-1..=1).flat_map(|down| (-1..=1).map(move |right| [common[0] + right, common[1] + down]));
    let best = near.map(|steps| (share(rasters, seen, steps), steps)).max_by(|a, b| a.0.total_cmp(&b.0));
    if let Some((still_share, steps)) = best {
        seen.shift = shift_px(seen, steps);
        seen.still_share = still_share;
    }
}

/// Share of the samples at which the photo, at a shift, has the descriptor's class.
fn share(rasters: &Rasters, seen: &Seen, steps: [i64; 2]) -> f64 {
    let shift = shift_px(seen, steps);
    let shows = |pixel: &&usize| moved(rasters, **pixel, shift).is_some_and(|at| rasters.photo[at] == seen.class);
    seen.samples.iter().filter(shows).count() as f64 / seen.samples.len() as f64
}

fn shift_px(seen: &Seen, steps: [i64; 2]) -> [i64; 2] {
    steps.map(|step| (step as f64 * seen.reach_px / SHIFTS as f64).round() as i64)
}

fn moved(rasters: &Rasters, pixel: usize, [right, down]: [i64; 2]) -> Option<usize> {
    let (width, height) = (rasters.width as i64, rasters.height as i64);
    let (u, v) = (pixel as i64 % width + right, pixel as i64 / width + down);
    ((0..width).contains(&u) && (0..height).contains(&v)).then_some((v * width + u) as usize)
}
