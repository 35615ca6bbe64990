//! The move of a surface at which the classes of its template agree best with the photo.

use crate::sample::Sample;
use crate::surface::{cross, dot, unit};
use resurvey_class_difference::raster::Rasters;
use resurvey_plugin::schema::{ClassId, ClassKind, ClassTable};

/// Steps from no move to the farthest one.
const STEPS: i32 = 6;
/// Finest step of the search, pixels.
const FINEST_PX: f64 = 0.5;
/// What a move of one standard deviation costs, disagreeing pixels: a contour that wanders by 5 px over 28 px.
const MOVE_COST_PX: f64 = 140.0;
/// What a sample counts that something hides in the photo.
const HIDDEN_WORTH: f64 = 0.5;
/// Samples that say something about a surface, at least.
const MIN_SAMPLES: usize = 40;

/// Where a surface is found.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Fit {
    /// How far it is from its place on the map: E, N, H, metres.
    pub move_m: [f64; 3],
    /// Share of the samples, hidden ones left out, that the photo agrees with there.
    pub share: f64,
    /// Samples that are not hidden there.
    pub seen: usize,
}

/// How far a surface may be off, at a range.
#[derive(Clone, Copy, Debug)]
pub struct Reach {
    /// Standard deviation, pixels.
    pub sigma_px: f64,
    /// Farthest move, pixels.
    pub limit_px: f64,
    /// Metres across the line of sight for a pixel.
    pub metre_per_px: f64,
    /// Pixels of the whole template, of which the samples are a part.
    pub template_px: usize,
}

/// The best move of `samples` within reach; `None` when there is too little to go by.
pub fn fit(rasters: &Rasters, classes: &ClassTable, samples: &[Sample], reach: &Reach) -> Option<Fit> {
    if samples.len() < MIN_SAMPLES || !reach.metre_per_px.is_finite() {
        return None;
    }
    let axes = axes(samples);
    let hides = hiding(classes, samples);
    let unit_cost = MOVE_COST_PX / reach.template_px.max(1) as f64 / reach.sigma_px.powi(2).max(1e-6);
    let cost = |steps_px: [f64; 3]| unit_cost * dot(steps_px, steps_px);
    let worth =
        |steps_px: [f64; 3]| agreement(rasters, samples, &hides, metres(&axes, steps_px, reach)).0 - cost(steps_px);
    let stride_px = (reach.limit_px / f64::from(STEPS)).max(1.0);
    let mut best = (worth([0.0; 3]), [0.0; 3]);
    let consider = |steps_px: [f64; 3], best: &mut (f64, [f64; 3])| {
        let is_within = dot(steps_px, steps_px) <= reach.limit_px.powi(2);
        let value = if is_within { worth(steps_px) } else { f64::NEG_INFINITY };
        let is_better = value > best.0;
        if is_better {
            *best = (value, steps_px);
        }
        is_better
    };
    for (right, up) in (-STEPS..=STEPS).flat_map(|up| (-STEPS..=STEPS).map(move |right| (right, up))) {
        consider([f64::from(right) * stride_px, f64::from(up) * stride_px, 0.0], &mut best);
    }
    let mut step_px = stride_px / 2.0;
    while step_px >= FINEST_PX {
        let from = best.1;
        let mut is_better = false;
        for (axis, sign) in (0..3).flat_map(|axis| [(axis, 1.0), (axis, -1.0)]) {
            let mut to = from;
            to[axis] += sign * step_px;
            is_better |= consider(to, &mut best);
        }
        if !is_better {
            step_px /= 2.0;
        }
    }
    let move_m = metres(&axes, best.1, reach);
    let (_, share, seen) = agreement(rasters, samples, &hides, move_m);
    (seen >= MIN_SAMPLES).then_some(Fit { move_m, share, seen })
}

/// Right, up and away from the camera, towards the samples.
fn axes(samples: &[Sample]) -> [[f64; 3]; 3] {
    let sum = samples
        .iter()
        .fold([0.0; 3], |sum: [f64; 3], sample| std::array::from_fn(|axis| sum[axis] + sample.direction[axis]));
    let away = unit(sum);
    let level = unit([away[1], -away[0], 0.0]);
    let right = if level[0].is_finite() { level } else { [1.0, 0.0, 0.0] };
    [right, cross(right, away), away]
}

fn metres(axes: &[[f64; 3]; 3], steps_px: [f64; 3], reach: &Reach) -> [f64; 3] {
    std::array::from_fn(|part| (0..3).map(|axis| axes[axis][part] * steps_px[axis]).sum::<f64>() * reach.metre_per_px)
}

/// Classes of the photo that say nothing about the samples: void, objects, and ignored ones that the template lacks.
fn hiding(classes: &ClassTable, samples: &[Sample]) -> [bool; 256] {
    let mut own = [false; 256];
    samples.iter().for_each(|sample| own[usize::from(sample.class)] = true);
    std::array::from_fn(|class| {
        let id = ClassId(class as u8);
        id == ClassId::VOID || (!own[class] && classes.kind(id) != ClassKind::Material)
    })
}

/// Worth of a move, share of the seen samples that agree, and number of seen ones.
fn agreement(rasters: &Rasters, samples: &[Sample], hides: &[bool; 256], move_m: [f64; 3]) -> (f64, f64, usize) {
    let (mut agreeing, mut seen) = (0usize, 0usize);
    for sample in samples {
        if let Some(pixel) = sample.moved(move_m, rasters) {
            let class = rasters.photo[pixel];
            agreeing += usize::from(class == sample.class);
            seen += usize::from(!hides[usize::from(class)]);
        }
    }
    let hidden = samples.len() - seen;
    let worth = (agreeing as f64 + HIDDEN_WORTH * hidden as f64) / samples.len().max(1) as f64;
    (worth, agreeing as f64 / seen.max(1) as f64, seen)
}
