//! Every position and heading around the prior, compared on panoramas.

use crate::likeness::{Compared, Likeness};
use crate::mode::{Mode, angle_between, log_prior};
use crate::settings::Settings;
use resurvey_plugin::schema::{GridPoint, Pose};
use resurvey_plugin::{ClassCounts, CompareRequest, Error, Host, Level, PanoramaRequest, Photo};
use std::collections::BTreeSet;

/// Positions a call to the host: large enough to feed every core, small enough to stop soon after a cancel.
const POSITIONS_PER_CALL: usize = 256;
/// The same where every heading is a view of its own.
const POSITIONS_PER_EXACT_CALL: usize = 16;
/// The largest radius, metres: maps are loaded about this far around the prior.
const LARGEST_M: f64 = 400.0;
/// Candidates that are scored again on full views where the grid is the answer.
const BEST_OF_GRID: usize = 100;
/// One column a degree: headings are whole columns.
const COLUMNS: u32 = 360;

/// All candidates of the sweep.
pub struct Coarse {
    /// The best heading at each position.
    pub best: Vec<Mode>,
    /// Candidates that were scored.
    pub scored: u64,
    /// Candidates left out because they are inside a building.
    pub skipped: u64,
    /// Easting, northing, best score.
    pub heat: Vec<[f64; 3]>,
}

/// Furthest positions that are searched at the full density; a wider circle is searched coarsely first.
const DENSE_M: f64 = 60.0;
/// Widest spacing of the coarse positions, metres: streets are wider.
const WIDEST_M: f64 = 4.0;
/// Coarse places around which the search goes on.
const PLACES: usize = 60;
/// A prior that is less sure than this widens the search: metres and radians.
const UNSURE: [f64; 2] = [20.0, 30.0 * std::f64::consts::PI / 180.0];
/// How many σ the widened search goes out.
const SIGMAS: f64 = 2.5;

/// Scores candidates.
pub struct Sweep<'a, 'p> {
    /// Services of the host.
    pub host: &'a dyn Host,
    /// The photo.
    pub photo: &'a Photo<'p>,
    /// Settings.
    pub settings: &'a Settings,
    /// Classes that count.
    pub compared: &'a Compared,
    /// The score.
    pub likeness: &'a Likeness,
}

impl Sweep<'_, '_> {
    /// Every candidate of the search, or of a wide one every candidate around the best places.
    pub fn run(&self) -> Result<Coarse, Error> {
        let centre = self.photo.prior.pose.position;
        let radius_m = self.radius_m();
        let spacing_m = self.settings.spacing_m;
        if radius_m <= DENSE_M.max(self.settings.radius_m) {
            return self.score(&positions(&centre, radius_m, spacing_m));
        }
        let wide_m = (radius_m / DENSE_M).clamp(spacing_m, WIDEST_M.max(spacing_m));
        let mut coarse = self.score(&positions(&centre, radius_m, wide_m))?;
        let places = distinct(&coarse.best, PLACES, wide_m, 10_f64.to_radians());
        let mut seen = BTreeSet::new();
        let around = places.iter().flat_map(|place| positions(&place.pose.position, wide_m, spacing_m));
        let key = |point: &GridPoint| [point.easting_m, point.northing_m].map(|metres| (metres * 100.0).round() as i64);
        let dense: Vec<GridPoint> = around.filter(|position| seen.insert(key(position))).collect();
        let fine = self.score(&dense)?;
        coarse.scored += fine.scored;
        coarse.skipped += fine.skipped;
        coarse.best.extend(fine.best);
        Ok(coarse)
    }

    /// How far from the prior the search goes, metres.
    pub fn radius_m(&self) -> f64 {
        let Settings { radius_m, widen, .. } = *self.settings;
        let sigma_m = self.photo.prior.position_sigma_m;
        if widen && sigma_m > UNSURE[0] { radius_m.max(SIGMAS * sigma_m).min(LARGEST_M) } else { radius_m }
    }

    /// The candidates next to `pose` on the grid: a step of position, of heading, or of both.
    pub fn neighbours(&self, pose: &Pose) -> Result<Vec<Pose>, Error> {
        let (spacing_m, centre) = (self.settings.spacing_m, self.photo.prior.pose);
        let step_rad = f64::from(self.settings.yaw_step_deg).to_radians();
        let request = self.request();
        let last_rad = request.first_yaw_rad + step_rad * f64::from(request.yaw_count - 1);
        let mut neighbours = Vec::new();
        for (east, north) in (-1..=1).flat_map(|east| (-1..=1).map(move |north| (f64::from(east), f64::from(north)))) {
            let GridPoint { easting_m, northing_m, height_m } = pose.position;
            let position = GridPoint::new(easting_m + east * spacing_m, northing_m + north * spacing_m, height_m);
            if position.plan_distance_m(&centre.position) > self.radius_m() + 1e-6 {
                continue;
            }
            for turn in [-1.0, 0.0, 1.0] {
                let yaw_rad = pose.yaw_rad + turn * step_rad;
                let is_in_range = (request.first_yaw_rad - 1e-9..=last_rad + 1e-9).contains(&yaw_rad);
                let is_itself = east.abs() + north.abs() + f64::abs(turn) < 0.5;
                if is_in_range && !is_itself {
                    neighbours.push(Pose { position, yaw_rad, ..*pose });
                }
            }
        }
        if self.settings.skip_inside {
            let positions: Vec<GridPoint> = neighbours.iter().map(|pose| pose.position).collect();
            let mut inside = self.host.inside_solid(&positions)?.into_iter();
            neighbours.retain(|_| !inside.next().unwrap_or(false));
        }
        Ok(neighbours)
    }

    fn yaw_range_deg(&self) -> f64 {
        let Settings { yaw_range_deg, widen, .. } = *self.settings;
        let sigma = self.photo.prior.yaw_sigma_rad;
        let wide_deg = (SIGMAS * sigma).to_degrees().min(180.0);
        if widen && sigma > UNSURE[1] { yaw_range_deg.max(wide_deg) } else { yaw_range_deg }
    }

    fn score(&self, positions: &[GridPoint]) -> Result<Coarse, Error> {
        let inside =
            if self.settings.skip_inside { self.host.inside_solid(positions)? } else { vec![false; positions.len()] };
        let is_free = |(position, inside): (&GridPoint, &bool)| (!inside).then_some(*position);
        let free: Vec<GridPoint> = positions.iter().zip(&inside).filter_map(is_free).collect();
        let request = self.request();
        let headings = request.yaw_count as usize;
        let mut coarse = Coarse {
            best: Vec::new(),
            scored: (free.len() * headings) as u64,
            skipped: ((positions.len() - free.len()) * headings) as u64,
            heat: Vec::new(),
        };
        let mut bests = BestBy::each(self.settings);
        let per_call = if self.settings.exhaustive { POSITIONS_PER_EXACT_CALL } else { POSITIONS_PER_CALL };
        for (call, positions) in free.chunks(per_call).enumerate() {
            if self.host.cancelled() {
                return Err(Error("cancelled".to_owned()));
            }
            let scores = if self.settings.exhaustive {
                self.on_views(&request, positions, &mut bests)?
            } else {
                self.on_panoramas(&request, positions)?
            };
            for (position, scores) in positions.iter().zip(scores.chunks(headings)) {
                let heat = scores.iter().fold(0.0, |best: f64, &score| best.max(score));
                coarse.heat.push([position.easting_m, position.northing_m, heat]);
                coarse.best.extend(peaks(self.photo, self.settings, &request, *position, scores));
            }
            self.host.progress(0.6 * ((call + 1) * per_call) as f64 / free.len().max(1) as f64);
        }
        bests.iter().for_each(|best| best.log(self.host));
        Ok(coarse)
    }

    /// Scores position by position, heading by heading, on panoramas.
    fn on_panoramas(&self, request: &PanoramaRequest, positions: &[GridPoint]) -> Result<Vec<f64>, Error> {
        let counts = self.host.compare_panoramas(request, positions)?;
        Ok(counts.chunks(self.compared.classes).map(|counts| self.likeness.of_panorama(counts)).collect())
    }

    /// The same on views of the photo's full size.
    fn on_views(
        &self,
        request: &PanoramaRequest,
        positions: &[GridPoint],
        bests: &mut [BestBy],
    ) -> Result<Vec<f64>, Error> {
        let full = CompareRequest {
            stride: 1,
            ignored_in_photo: request.ignored_in_photo,
            ignored_in_view: request.ignored_in_view,
            boundary_tolerance_px: self.settings.boundary_tolerance_px,
        };
        let headings = 0..request.yaw_count as usize;
        let poses: Vec<Pose> = positions
            .iter()
            .flat_map(|position| headings.clone().map(|index| candidate(self.photo, request, *position, index)))
            .collect();
        let counts = self.host.compare_views(&full, &poses)?;
        for best in bests {
            for (pose, counts) in poses.iter().zip(&counts) {
                best.take(*pose, counts);
            }
        }
        Ok(counts.iter().map(|counts| self.likeness.of_view(counts)).collect())
    }

    fn request(&self) -> PanoramaRequest {
        let pose = &self.photo.prior.pose;
        let step_deg = f64::from(self.settings.yaw_step_deg);
        let full_circle = (360 / self.settings.yaw_step_deg).max(1);
        let steps = (self.yaw_range_deg() / step_deg).floor();
        let first_yaw_deg = pose.yaw_rad.to_degrees() - steps * step_deg;
        PanoramaRequest {
            pitch_rad: pose.pitch_rad,
            roll_rad: pose.roll_rad,
            first_yaw_rad: first_yaw_deg.round().to_radians(),
            yaw_step_columns: self.settings.yaw_step_deg * COLUMNS / 360,
            yaw_count: (2 * steps as u32 + 1).min(full_circle),
            columns: COLUMNS,
            ignored_in_photo: self.compared.ignored_in_photo,
            ignored_in_view: self.compared.ignored_in_view,
        }
    }
}

/// The best candidate by one metric alone.
struct BestBy {
    metric: &'static str,
    likeness: Likeness,
    best: Option<(f64, Pose)>,
}

impl BestBy {
    /// One for each metric of Lee & Hsu (Eq. 5), with the class weights of `settings`.
    fn each(settings: &Settings) -> [Self; 3] {
        [("Dice", [1.0, 0.0, 0.0]), ("Jaccard", [0.0, 1.0, 0.0]), ("boundary F1", [0.0, 0.0, 1.0])].map(
            |(metric, [dice, jaccard, boundary_f1])| {
                let alone = Settings { dice, jaccard, boundary_f1, agreement: 0.0, ..settings.clone() };
                Self { metric, likeness: Likeness::new(&alone), best: None }
            },
        )
    }

    fn take(&mut self, pose: Pose, counts: &[ClassCounts]) {
        let score = self.likeness.of_view(counts);
        if self.best.is_none_or(|(best, _)| score > best) {
            self.best = Some((score, pose));
        }
    }

    fn log(&self, host: &dyn Host) {
        if let Some((score, Pose { position, yaw_rad, .. })) = self.best {
            let (east, north, yaw) = (position.easting_m, position.northing_m, yaw_rad.to_degrees());
            let line = format!("best by {}: {score:.4} at E {east:.2} N {north:.2}, heading {yaw:.1}°", self.metric);
            host.log(Level::Info, &line);
        }
    }
}

/// Grid positions within `radius_m` of `centre`, the centre among them.
fn positions(centre: &GridPoint, radius_m: f64, spacing_m: f64) -> Vec<GridPoint> {
    let reach = (radius_m / spacing_m).floor() as i64;
    let offsets = (-reach..=reach).flat_map(|north| (-reach..=reach).map(move |east| (east, north)));
    offsets
        .map(|(east, north)| (east as f64 * spacing_m, north as f64 * spacing_m))
        .filter(|(east_m, north_m)| east_m.hypot(*north_m) <= radius_m + 1e-9)
        .map(|(east_m, north_m)| {
            GridPoint::new(centre.easting_m + east_m, centre.northing_m + north_m, centre.height_m)
        })
        .collect()
}

/// The candidate at heading `index` of `request`.
fn candidate(photo: &Photo<'_>, request: &PanoramaRequest, position: GridPoint, index: usize) -> Pose {
    let step_rad = f64::from(request.yaw_step_columns) * std::f64::consts::TAU / f64::from(request.columns);
    let yaw_rad = request.first_yaw_rad + index as f64 * step_rad;
    let prior = &photo.prior.pose;
    Pose { position, yaw_rad, pitch_rad: prior.pitch_rad, roll_rad: prior.roll_rad }
}

/// The headings of a position whose score is no lower than that of their neighbours.
fn peaks(
    photo: &Photo<'_>,
    settings: &Settings,
    request: &PanoramaRequest,
    position: GridPoint,
    scores: &[f64],
) -> Vec<Mode> {
    let at = |index: usize| scores.get(index).copied().unwrap_or(f64::NEG_INFINITY);
    let is_peak = |index: usize| {
        let before = if index == 0 { f64::NEG_INFINITY } else { at(index - 1) };
        at(index) >= before && at(index) >= at(index + 1)
    };
    (0..scores.len())
        .filter(|&index| is_peak(index))
        .map(|index| {
            let pose = candidate(photo, request, position, index);
            let log_prior = if settings.use_prior { log_prior(&photo.prior, &pose) } else { 0.0 };
            Mode { pose, score: scores[index], log_posterior: settings.evidence * scores[index] + log_prior }
        })
        .collect()
}

/// The candidates that are looked at more closely, best first: those that differ from one another by more than 2 m or 6°.
/// Where the grid is the answer, also the best whatever their distance.
pub fn modes(coarse: &Coarse, settings: &Settings) -> Vec<Mode> {
    let mut modes = distinct(&coarse.best, settings.modes, 2.0, 6_f64.to_radians());
    if !settings.refine {
        let known: Vec<Pose> = modes.iter().map(|mode| mode.pose).collect();
        let others = sorted(&coarse.best).into_iter().take(BEST_OF_GRID).filter(|mode| !known.contains(&mode.pose));
        modes.extend(others);
    }
    modes
}

fn sorted(modes: &[Mode]) -> Vec<Mode> {
    let mut modes = modes.to_vec();
    modes.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    modes
}

/// At most `count` of `modes`, best first, with `apart_m` or `apart_rad` between any two.
fn distinct(modes: &[Mode], count: usize, apart_m: f64, apart_rad: f64) -> Vec<Mode> {
    let mut kept: Vec<Mode> = Vec::new();
    for candidate in sorted(modes) {
        let near = |mode: &Mode| {
            mode.pose.position.plan_distance_m(&candidate.pose.position) <= apart_m
                && angle_between(mode.pose.yaw_rad, candidate.pose.yaw_rad).abs() <= apart_rad
        };
        if !kept.iter().any(near) {
            kept.push(candidate);
            if kept.len() == count {
                break;
            }
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_papers_radius_and_spacing_give_its_number_of_positions() {
        // Lee & Hsu: 40 m radius, 1 m grid; 5 025 positions.
        assert_eq!(positions(&GridPoint::new(835_600.0, 817_800.0, 6.0), 40.0, 1.0).len(), 5025);
    }
}
