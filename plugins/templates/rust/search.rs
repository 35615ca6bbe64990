//! A matcher that searches by itself: it compares a panorama at every place of a grid with the photo, climbs from the best
//! headings, and says how sure it is. The host renders and counts; where to look, and what to make of the counts, is decided
//! here.
#![forbid(unsafe_code)]

use resurvey_plugin::schema::{ClassId, ClassKind, GridPoint, Localization, Pose, RunnerUp};
use resurvey_plugin::{ClassCounts, ClassSet, CompareRequest, Error, Host, PanoramaRequest, Photo, Plugin, Searcher};
use std::f64::consts::TAU;

resurvey_plugin::export_searcher!(MyMatcher);

/// Of a panorama: 2° each.
const COLUMNS: u32 = 180;
/// A request is answered as a whole: short ones let a cancel through within 200 ms.
const PLACES_AT_A_TIME: usize = 16;
/// The likelihood of a pose is exp(SHARPNESS · score).
const SHARPNESS: f64 = 75.0;
/// Of a climb: easting, northing, height, metres; yaw, pitch, roll, radians. A metre aside and four degrees nearly keep what
/// is 15 m ahead in its place.
const FIRST_STEPS: [f64; 6] = [1.0, 1.0, 0.3, 0.07, 0.0175, 0.0175];
const HALVINGS: u32 = 5;
/// How many hills are climbed.
const HILLS: usize = 8;

/// Compares panoramas over a grid, then climbs. Its fields are the settings, which the host checks and completes from
/// [`Plugin::SETTINGS`].
#[derive(serde::Deserialize)]
pub struct MyMatcher {
    step_m: f64,
    reach: f64,
}

impl Plugin for MyMatcher {
    const NAME: &'static str = "my-plugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Compares panoramas over a grid, then climbs from the best headings";
    const SETTINGS: &'static str = r#"{"type": "object", "additionalProperties": false, "properties": {
        "step_m": {"type": "number", "default": 3, "minimum": 0.5, "maximum": 20,
                   "description": "distance between the places of the grid, metres"},
        "reach": {"type": "number", "default": 2.5, "minimum": 0.5, "maximum": 4,
                  "description": "how far around the prior is searched, in its sigmas"}}}"#;
    type Settings = Self;

    fn create(settings: Self) -> Result<Self, Error> {
        Ok(settings)
    }
}

impl Searcher for MyMatcher {
    fn search(&mut self, host: &dyn Host, photo: &Photo<'_>) -> Result<Localization, Error> {
        if photo.labels.rows().flatten().all(|label| *label == ClassId::VOID.0) {
            return Err("expected labels in the photo, found only void".into());
        }
        let views = Views::new(host, photo);
        let (tried, skipped) = self.panoramas(&views)?;
        let hills: Result<Vec<Scored>, Error> =
            apart(&tried).into_iter().map(|start| views.climb(start.pose)).collect();
        let mut hills = hills?;
        hills.sort_by(|a, b| b.score.total_cmp(&a.score));
        let best = *hills.first().ok_or("expected a place outside of buildings, found none")?;
        let runner_up = hills.iter().find(|hill| hill.distance_m(&best) > 2.5).map(|hill| RunnerUp {
            distance_m: hill.distance_m(&best),
            score_ratio: likelihood(hill.score, best.score),
        });
        Ok(Localization {
            pose: pose(best.pose),
            score: best.score,
            covariance: views.covariance(best)?,
            alignment: None,
            runner_up,
            candidates: tried.len() as u64,
            skipped,
            heat: heat(&tried),
        })
    }
}

impl MyMatcher {
    /// Every heading at every place outside of buildings, and how many places were inside.
    fn panoramas(&self, views: &Views<'_>) -> Result<(Vec<Scored>, u64), Error> {
        let (host, prior) = (views.host, views.photo.prior);
        let Pose { position: middle, yaw_rad, pitch_rad, roll_rad } = prior.pose;
        let radius_m = self.reach * prior.position_sigma_m;
        let steps = (radius_m / self.step_m) as i32;
        let offsets = (-steps..=steps).flat_map(|east| (-steps..=steps).map(move |north| [east, north]));
        let places: Vec<GridPoint> = offsets
            .map(|offset| offset.map(|steps| f64::from(steps) * self.step_m))
            .filter(|[east_m, north_m]| east_m.hypot(*north_m) <= radius_m)
            .map(|[east_m, north_m]| GridPoint {
                easting_m: middle.easting_m + east_m,
                northing_m: middle.northing_m + north_m,
                ..middle
            })
            .collect();
        let inside = host.inside_solid(&places)?;
        let outside: Vec<GridPoint> =
            places.into_iter().zip(&inside).filter(|(_, inside)| !**inside).map(|(place, _)| place).collect();

        let column_rad = TAU / f64::from(COLUMNS);
        let turns = ((self.reach * prior.yaw_sigma_rad / column_rad).ceil() as u32).min(COLUMNS / 2);
        let first = (yaw_rad / column_rad).round() - f64::from(turns);
        let yaws: Vec<f64> = (0..=2 * turns).map(|turn| (first + f64::from(turn)) * column_rad).collect();
        let request = PanoramaRequest {
            pitch_rad,
            roll_rad,
            first_yaw_rad: yaws[0],
            yaw_step_columns: 1,
            yaw_count: yaws.len() as u32,
            columns: COLUMNS,
            ignored_in_photo: views.hidden,
            ignored_in_view: ClassSet::default(),
        };
        let mut tried = Vec::new();
        for (index, places) in outside.chunks(PLACES_AT_A_TIME).enumerate() {
            views.check_cancelled()?;
            host.progress(0.5 * (index * PLACES_AT_A_TIME) as f64 / outside.len() as f64);
            let counts = host.compare_panoramas(&request, places)?;
            let of_heading = counts.len() / (places.len() * yaws.len());
            let headings = places.iter().flat_map(|at| yaws.iter().map(move |yaw_rad| (at, yaw_rad)));
            tried.extend(headings.zip(counts.chunks(of_heading)).map(|((at, yaw_rad), counts)| Scored {
                pose: [at.easting_m, at.northing_m, at.height_m, *yaw_rad, pitch_rad, roll_rad],
                score: share(counts),
            }));
        }
        Ok((tried, inside.iter().filter(|inside| **inside).count() as u64))
    }
}

/// Easting, northing, height, yaw, pitch, roll, and how well the view from there fits.
#[derive(Clone, Copy, Debug)]
struct Scored {
    pose: [f64; 6],
    score: f64,
}

impl Scored {
    /// In plan.
    fn distance_m(&self, other: &Self) -> f64 {
        (self.pose[0] - other.pose[0]).hypot(self.pose[1] - other.pose[1])
    }
}

fn pose([easting_m, northing_m, height_m, yaw_rad, pitch_rad, roll_rad]: [f64; 6]) -> Pose {
    Pose { position: GridPoint { easting_m, northing_m, height_m }, yaw_rad, pitch_rad, roll_rad }
}

/// The likelihood of a score over that of the best.
fn likelihood(score: f64, best: f64) -> f64 {
    (SHARPNESS * (score - best)).min(0.0).exp()
}

/// Share of the compared pixels whose class is the same; 0 where nothing was compared.
fn share(counts: &[ClassCounts]) -> f64 {
    let compared: u32 = counts.iter().map(|class| class.photo).sum();
    let same: u32 = counts.iter().map(|class| class.both).sum();
    f64::from(same) / f64::from(compared.max(1))
}

/// The best score at every place.
fn heat(tried: &[Scored]) -> Vec<[f64; 3]> {
    let of_place = |headings: &[Scored]| {
        let best = headings.iter().map(|one| one.score).fold(0.0, f64::max);
        [headings[0].pose[0], headings[0].pose[1], best]
    };
    tried.chunk_by(|a, b| a.pose[..2] == b.pose[..2]).map(of_place).collect()
}

/// The best that are more than 3 m or 6° from each other.
fn apart(tried: &[Scored]) -> Vec<Scored> {
    let mut order: Vec<&Scored> = tried.iter().collect();
    order.sort_by(|a, b| b.score.total_cmp(&a.score));
    let mut taken: Vec<Scored> = Vec::new();
    for one in order {
        let is_far = |other: &Scored| one.distance_m(other) > 3.0 || (one.pose[3] - other.pose[3]).abs() > 0.1;
        if taken.len() < HILLS && taken.iter().all(is_far) {
            taken.push(*one);
        }
    }
    taken
}

/// Views compared with the photo, at a fourth of its size.
struct Views<'a> {
    host: &'a dyn Host,
    photo: &'a Photo<'a>,
    /// What moves hides the map: it takes no part.
    hidden: ClassSet,
}

impl<'a> Views<'a> {
    fn new(host: &'a dyn Host, photo: &'a Photo<'a>) -> Self {
        let mut hidden = ClassSet::default();
        for class in host.classes().iter().filter(|class| class.kind == ClassKind::Dynamic) {
            hidden.insert(class.index);
        }
        Self { host, photo, hidden }
    }

    fn check_cancelled(&self) -> Result<(), Error> {
        if self.host.cancelled() { Err("cancelled".into()) } else { Ok(()) }
    }

    fn scores(&self, poses: &[[f64; 6]]) -> Result<Vec<f64>, Error> {
        self.check_cancelled()?;
        let request = CompareRequest {
            stride: (self.photo.labels.width() / 240).max(1),
            ignored_in_photo: self.hidden,
            ignored_in_view: ClassSet::default(),
            boundary_tolerance_px: 0.0,
        };
        let poses: Vec<Pose> = poses.iter().copied().map(pose).collect();
        Ok(self.host.compare_views(&request, &poses)?.iter().map(|counts| share(counts)).collect())
    }

    /// How far height, pitch and roll are from what the phone knows of them, as a loss of score.
    fn loss(&self, [_, _, height_m, _, pitch_rad, roll_rad]: [f64; 6]) -> f64 {
        let prior = self.photo.prior;
        let off = |value: f64, prior: f64, sigma: f64| ((value - prior) / sigma.max(1e-6)).powi(2);
        let squares = off(height_m, prior.pose.position.height_m, prior.height_sigma_m)
            + off(pitch_rad, prior.pose.pitch_rad, prior.tilt_sigma_rad)
            + off(roll_rad, prior.pose.roll_rad, prior.tilt_sigma_rad);
        squares / (2.0 * SHARPNESS)
    }

    /// The top of the hill: a compass search with ever shorter steps (Hooke & Jeeves 1961), along every axis, and sideways
    /// with a turn.
    fn climb(&self, start: [f64; 6]) -> Result<Scored, Error> {
        let signs = [-1.0, 1.0];
        let along = (0..6).flat_map(|axis| signs.map(|sign| vec![(axis, sign)]));
        let turning = [0, 1]
            .into_iter()
            .flat_map(|axis| signs.into_iter().flat_map(move |there| signs.map(|turn| vec![(axis, there), (3, turn)])));
        let directions: Vec<Vec<(usize, f64)>> = along.chain(turning).collect();
        let mut best = Scored { pose: start, score: self.scores(&[start])?[0] };
        let (mut steps, mut halvings) = (FIRST_STEPS, 0);
        for _ in 0..60 {
            let step = |direction: &Vec<(usize, f64)>| {
                let mut pose = best.pose;
                direction.iter().for_each(|(axis, sign)| pose[*axis] += sign * steps[*axis]);
                pose
            };
            let poses: Vec<[f64; 6]> = directions.iter().map(step).collect();
            let scores = self.scores(&poses)?;
            let tried = poses.into_iter().zip(scores).map(|(pose, score)| Scored { pose, score });
            let worth = |one: &Scored| one.score - self.loss(one.pose);
            let top = tried.max_by(|a, b| worth(a).total_cmp(&worth(b))).unwrap_or(best);
            if worth(&top) > worth(&best) {
                best = top;
            } else if halvings == HALVINGS {
                break;
            } else {
                (steps, halvings) = (steps.map(|step| step / 2.0), halvings + 1);
            }
        }
        Ok(best)
    }

    /// Second moments of the likelihood over 2 m and 2° around the best; at least 0.1 m and 0.1°.
    fn covariance(&self, best: Scored) -> Result<[[f64; 3]; 3], Error> {
        let spread =
            |half: f64, count: i32| (-count..=count).map(move |step| half * f64::from(step) / f64::from(count));
        let (mut total, mut sum, mut squares) = (0.0, [0.0; 3], [[0.0; 3]; 3]);
        for turn in spread(0.035, 2) {
            for east in spread(2.0, 3) {
                let offsets: Vec<[f64; 3]> = spread(2.0, 3).map(|north| [east, north, turn]).collect();
                let moved = |[east, north, turn]: &[f64; 3]| {
                    let [e, n, height, yaw, pitch, roll] = best.pose;
                    [e + east, n + north, height, yaw + turn, pitch, roll]
                };
                let scores = self.scores(&offsets.iter().map(moved).collect::<Vec<_>>())?;
                for (offset, score) in offsets.iter().zip(scores) {
                    let weight = likelihood(score, best.score);
                    total += weight;
                    for i in 0..3 {
                        sum[i] += weight * offset[i];
                        (0..3).for_each(|j| squares[i][j] += weight * offset[i] * offset[j]);
                    }
                }
            }
        }
        let least = [0.1, 0.1, 0.1_f64.to_radians()];
        Ok(std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                let floor = if i == j { least[i] * least[i] } else { 0.0 };
                squares[i][j] / total - sum[i] / total * (sum[j] / total) + floor
            })
        }))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::Prior;
    use resurvey_plugin::toy::{ToyCamera, ToyHost, ToyScene, create};

    /// The phone believes to stand in the middle of the street corner; it does not.
    const BELIEVED: Pose =
        Pose { position: GridPoint::new(0.0, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 };
    const TRUTH: Pose =
        Pose { position: GridPoint::new(0.8, -0.6, 1.6), yaw_rad: 0.07, pitch_rad: 0.02, roll_rad: 0.0 };

    fn world() -> ToyHost {
        let mut world = ToyHost::new(ToyScene::corner(), ToyCamera::intrinsics(64, 48, 120.0));
        world.photo_labels = world.labels(&TRUTH);
        world
    }

    fn search(world: &ToyHost) -> Result<Localization, Error> {
        let (position_sigma_m, height_sigma_m, yaw_sigma_rad, tilt_sigma_rad) = (1.5, 0.1, 0.07, 0.02);
        let prior = Prior { pose: BELIEVED, position_sigma_m, height_sigma_m, yaw_sigma_rad, tilt_sigma_rad };
        create::<MyMatcher>(r#"{"step_m": 1.5, "reach": 1}"#)?.search(world, &world.photo(prior).unwrap())
    }

    #[test]
    fn the_pose_of_the_photo_is_found() {
        let found = search(&world()).unwrap();
        let off_m = found.pose.position.plan_distance_m(&TRUTH.position);
        assert!(off_m < 0.5 && (found.pose.yaw_rad - TRUTH.yaw_rad).abs() < 0.03 && found.score > 0.95, "{found:?}");
        assert!(found.covariance[0][0] > 0.0 && found.candidates > 20);
    }

    #[test]
    fn a_photo_without_labels_has_no_answer() {
        let mut blank = world();
        blank.photo_labels.fill(255);
        assert!(search(&blank).is_err());
    }

    #[test]
    fn it_ends_when_it_is_cancelled() {
        let mut cancelled = world();
        cancelled.is_cancelled = true;
        assert!(search(&cancelled).is_err());
    }
}
