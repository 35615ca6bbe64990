//! The detector: surfaces, their moves, the view made anew, and what differs from it.

use crate::behind::is_seen_through;
use crate::compose::compose;
use crate::fit::{Fit, Reach, fit};
use crate::sample::samples;
use crate::settings::{SCHEMA, Settings};
use crate::surface::{SKY, Surfaces, surfaces};
use crate::template::templates;
use crate::thick::is_thin;
use resurvey_class_difference::judge::{Judge, Sight, different};
use resurvey_class_difference::raster::Rasters;
use resurvey_class_difference::settings::Settings as Compared;
use resurvey_class_difference::tolerance::Tolerance;
use resurvey_plugin::schema::{ChangeRegion, ClassKind};
use resurvey_plugin::{Comparison, Detector, Error, Host, Plugin};

/// Farthest that a surface is moved, pixels.
const MAX_MOVE_PX: f64 = 48.0;
/// A surface is not where the photo looks when even its best place agrees with less than this share.
const MISSING_SHARE: f64 = 0.5;

/// Detects changes as differences of class from the view with every surface in its place.
pub struct Aligned {
    settings: Settings,
}

impl Plugin for Aligned {
    const NAME: &'static str = "aligned";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str =
        "regions in which the photo has another class than the map, every surface aligned first";
    const SETTINGS: &'static str = SCHEMA;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Detector for Aligned {
    fn detect(&mut self, host: &dyn Host, comparison: &Comparison<'_>) -> Result<Vec<ChangeRegion>, Error> {
        let rasters = &Rasters::new(comparison)?;
        let points = points(comparison, rasters)?;
        let settings = &self.settings.compared().for_photo(&comparison.estimate);
        let tolerance = &Tolerance::new(comparison, settings);
        let tolerance_px = &tolerance.per_pixel(rasters);
        let surfaces = surfaces(rasters, &points);
        let fits = fits(host, comparison, rasters, &surfaces, (tolerance, settings))?;
        let is_missing: Vec<bool> = fits.iter().map(|fit| fit.is_some_and(|fit| fit.share < MISSING_SHARE)).collect();
        let min_share = self.settings.min_fit_share;
        let fits: Vec<Option<Fit>> = fits.into_iter().map(|fit| fit.filter(|fit| fit.share >= min_share)).collect();
        let moves_m = moves(&surfaces, rasters.width, &fits);
        let composed = compose(host, comparison, rasters, &surfaces, &moves_m)?;
        let is_aligned = |pixel: usize| {
            let surface = surfaces.of[composed.from[pixel]];
            surface == SKY || fits[surface as usize].is_some()
        };
        let left_px = &self.left_px(comparison, settings, &composed.rasters, &is_aligned);
        let judge = Judge { host, comparison, settings, rasters, tolerance, tolerance_px };
        let different = &different(&composed.rasters, host.classes());
        let mut sight = Sight::new(&composed.rasters, left_px, different);
        // Either is proof of a change: the class is nowhere near, or what differs is too thick.
        let thin = is_thin(&composed.rasters, different, left_px);
        sight.explained.iter_mut().zip(thin).for_each(|(explained, thin)| *explained &= thin);
        let is_missing = |pixel: usize| {
            rasters.features[pixel] == 0 && surfaces.of[pixel] != SKY && is_missing[surfaces.of[pixel] as usize]
        };
        let mut regions = Vec::new();
        for region in judge.regions(sight)? {
            let is_new = host.classes().kind(region.class_after) == ClassKind::Material;
            if !is_new || !is_seen_through(host, comparison, rasters, &is_missing, &region)? {
                regions.push(region);
            }
        }
        Ok(regions)
    }
}

impl Aligned {
    /// The tolerance per pixel: all of it where nothing could be aligned.
    fn left_px(
        &self,
        comparison: &Comparison<'_>,
        settings: &Compared,
        rasters: &Rasters,
        is_aligned: &dyn Fn(usize) -> bool,
    ) -> Vec<u8> {
        let left = self.left_over(comparison, settings).per_pixel(rasters);
        let whole = Tolerance::new(comparison, settings).per_pixel(rasters);
        (0..left.len()).map(|pixel| if is_aligned(pixel) { left[pixel] } else { whole[pixel] }).collect()
    }

    /// The tolerance that is left in a surface that has been aligned.
    fn left_over(&self, comparison: &Comparison<'_>, settings: &Compared) -> Tolerance {
        let share = self.settings.left_over_share;
        let mut close = *comparison;
        let estimate = &mut close.estimate;
        estimate.covariance = estimate.covariance.map(|row| row.map(|value| value * share * share));
        estimate.height_sigma_m *= share;
        estimate.tilt_sigma_rad *= share;
        if let Some(alignment) = &mut estimate.alignment {
            alignment.covariance = alignment.covariance.map(|row| row.map(|value| value * share * share));
        }
        let settings = Compared { map_tolerance_m: settings.map_tolerance_m * share, ..settings.clone() };
        Tolerance::new(&close, &settings)
    }
}

fn points(comparison: &Comparison<'_>, rasters: &Rasters) -> Result<Vec<[f32; 3]>, Error> {
    let points = comparison.view.points;
    let found = [points.width() as usize, points.height() as usize];
    if found != [rasters.width, rasters.height] {
        let [width, height] = found;
        return Err(Error(format!(
            "expected points of {}×{} pixels, found {width}×{height}",
            rasters.width, rasters.height
        )));
    }
    Ok((0..points.height()).flat_map(|row| points.row(row)).copied().collect())
}

fn fits(
    host: &dyn Host,
    comparison: &Comparison<'_>,
    rasters: &Rasters,
    surfaces: &Surfaces,
    (tolerance, settings): (&Tolerance, &Compared),
) -> Result<Vec<Option<Fit>>, Error> {
    let reach_px = usize::from(settings.max_tolerance_px);
    let templates = templates(rasters, surfaces, reach_px);
    let focal_px = comparison.camera.fx.max(comparison.camera.fy);
    templates
        .iter()
        .map(|(places, template_px)| {
            if host.cancelled() {
                return Err(Error("cancelled".to_owned()));
            }
            let samples = samples(host, &comparison.estimate.pose, rasters, places)?;
            let mut ranges_m: Vec<f64> = samples.iter().map(|sample| sample.range_m).collect();
            ranges_m.sort_by(f64::total_cmp);
            let Some(range_m) = ranges_m.get(ranges_m.len() / 2).copied() else { return Ok(None) };
            let within_px = (tolerance.at_px(range_m) - settings.label_jitter_px).max(0.0);
            let reach = Reach {
                sigma_px: within_px / settings.tolerance_sigmas.max(1.0),
                limit_px: within_px.min(MAX_MOVE_PX),
                metre_per_px: range_m / focal_px,
                template_px: *template_px,
            };
            Ok(fit(rasters, host.classes(), &samples, &reach))
        })
        .collect()
}

/// The move of every surface; that of one without a fit is the mean of those beside it.
fn moves(surfaces: &Surfaces, width: usize, fits: &[Option<Fit>]) -> Vec<[f64; 3]> {
    let mut sums = vec![([0.0; 3], 0.0); surfaces.count];
    let of = &surfaces.of;
    for pixel in 0..of.len() {
        let right = (pixel % width + 1 < width).then_some(pixel + 1);
        let below = (pixel + width < of.len()).then_some(pixel + width);
        for near in right.into_iter().chain(below) {
            for (to, from) in [(of[pixel], of[near]), (of[near], of[pixel])] {
                if to == from || to == SKY || from == SKY {
                    continue;
                }
                if let Some(fit) = fits[from as usize] {
                    let (sum, weight) = &mut sums[to as usize];
                    *sum = std::array::from_fn(|axis| sum[axis] + fit.move_m[axis]);
                    *weight += 1.0;
                }
            }
        }
    }
    let mean = |(sum, weight): &([f64; 3], f64)| sum.map(|part| if *weight > 0.0 { part / weight } else { 0.0 });
    fits.iter().zip(&sums).map(|(fit, sum)| fit.map_or_else(|| mean(sum), |fit| fit.move_m)).collect()
}
