//! Every position and heading around the prior, compared on panoramas.

use crate::likeness::{Compared, Likeness};
use crate::mode::{Mode, angle_between, log_prior};
use crate::settings::Settings;
use resurvey_plugin::schema::{GridPoint, Pose};
use resurvey_plugin::{Error, Host, PanoramaRequest, Photo};

/// Positions a call to the host: large enough to feed every core, small enough to stop soon after a cancel.
const POSITIONS_PER_CALL: usize = 256;
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

/// Scores every candidate.
pub fn sweep(
    host: &dyn Host,
    photo: &Photo<'_>,
    settings: &Settings,
    compared: &Compared,
    likeness: &Likeness,
) -> Result<Coarse, Error> {
    let positions = positions(&photo.prior.pose.position, settings);
    let inside = if settings.skip_inside { host.inside_solid(&positions)? } else { vec![false; positions.len()] };
    let free: Vec<GridPoint> =
        positions.iter().zip(&inside).filter(|(_, inside)| !**inside).map(|(position, _)| *position).collect();
    let request = request(photo, settings, compared);
    let headings = request.yaw_count as usize;
    let mut coarse = Coarse {
        best: Vec::new(),
        scored: (free.len() * headings) as u64,
        skipped: ((positions.len() - free.len()) * headings) as u64,
        heat: Vec::new(),
    };
    for (chunk_index, chunk) in free.chunks(POSITIONS_PER_CALL).enumerate() {
        if host.cancelled() {
            return Err(Error("cancelled".to_owned()));
        }
        let counts = host.compare_panoramas(&request, chunk)?;
        for (position, of_position) in chunk.iter().zip(counts.chunks(headings * compared.classes)) {
            let scores: Vec<f64> =
                of_position.chunks(compared.classes).map(|counts| likeness.of_panorama(counts)).collect();
            let heat = scores.iter().fold(0.0, |best: f64, &score| best.max(score));
            coarse.heat.push([position.easting_m, position.northing_m, heat]);
            coarse.best.extend(peaks(photo, settings, &request, *position, &scores));
        }
        host.progress(0.6 * ((chunk_index + 1) * POSITIONS_PER_CALL) as f64 / free.len().max(1) as f64);
    }
    Ok(coarse)
}

/// Grid positions within the radius, the prior among them.
fn positions(centre: &GridPoint, settings: &Settings) -> Vec<GridPoint> {
    let reach = (settings.radius_m / settings.spacing_m).floor() as i64;
    let offsets = (-reach..=reach).flat_map(|north| (-reach..=reach).map(move |east| (east, north)));
    offsets
        .map(|(east, north)| (east as f64 * settings.spacing_m, north as f64 * settings.spacing_m))
        .filter(|(east_m, north_m)| east_m.hypot(*north_m) <= settings.radius_m + 1e-9)
        .map(|(east_m, north_m)| {
            GridPoint::new(centre.easting_m + east_m, centre.northing_m + north_m, centre.height_m)
        })
        .collect()
}

fn request(photo: &Photo<'_>, settings: &Settings, compared: &Compared) -> PanoramaRequest {
    let pose = &photo.prior.pose;
    let steps = (settings.yaw_range_deg / f64::from(settings.yaw_step_deg)).floor();
    let first_yaw_deg = pose.yaw_rad.to_degrees() - steps * f64::from(settings.yaw_step_deg);
    PanoramaRequest {
        pitch_rad: pose.pitch_rad,
        roll_rad: pose.roll_rad,
        first_yaw_rad: first_yaw_deg.round().to_radians(),
        yaw_step_columns: settings.yaw_step_deg * COLUMNS / 360,
        yaw_count: 2 * steps as u32 + 1,
        columns: COLUMNS,
        ignored_in_photo: compared.ignored_in_photo,
        ignored_in_view: compared.ignored_in_view,
    }
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
    let step_rad = f64::from(request.yaw_step_columns) * std::f64::consts::TAU / f64::from(request.columns);
    (0..scores.len())
        .filter(|&index| is_peak(index))
        .map(|index| {
            let yaw_rad = request.first_yaw_rad + index as f64 * step_rad;
            let prior = &photo.prior;
            let pose = Pose { position, yaw_rad, pitch_rad: prior.pose.pitch_rad, roll_rad: prior.pose.roll_rad };
            let log_prior = if settings.use_prior { log_prior(prior, &pose) } else { 0.0 };
            Mode { pose, score: scores[index], log_posterior: settings.evidence * scores[index] + log_prior }
        })
        .collect()
}

/// The best candidates that differ from one another by more than 2 m or 6°, best first.
pub fn distinct_modes(coarse: &Coarse, settings: &Settings) -> Vec<Mode> {
    const APART_M: f64 = 2.0;
    let apart_rad = 6.0_f64.to_radians();
    let mut order: Vec<&Mode> = coarse.best.iter().collect();
    order.sort_by(|a, b| b.log_posterior.total_cmp(&a.log_posterior));
    let mut modes: Vec<Mode> = Vec::new();
    for candidate in order {
        let near = |mode: &Mode| {
            mode.pose.position.plan_distance_m(&candidate.pose.position) <= APART_M
                && angle_between(mode.pose.yaw_rad, candidate.pose.yaw_rad).abs() <= apart_rad
        };
        if !modes.iter().any(near) {
            modes.push(*candidate);
            if modes.len() == settings.modes {
                break;
            }
        }
    }
    modes
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::settings::tests::defaults;

    #[test]
    fn the_papers_radius_and_spacing_give_its_number_of_positions() {
        // Lee & Hsu: 40 m radius, 1 m grid; 5 025 positions.
        assert_eq!(positions(&GridPoint::new(835_600.0, 817_800.0, 6.0), &defaults()).len(), 5025);
    }
}
