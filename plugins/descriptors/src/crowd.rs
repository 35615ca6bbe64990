//! Several objects in one region, by synthesis: as many silhouettes of the predefined size as are needed to explain the
//! region, where their union fits it best. One may hide a part of another.

use crate::evidence::{Evidence, Says};
use crate::sight::Sight;
use crate::silhouette::{Silhouette, radius_m};
use nalgebra::{Matrix2, Vector2, Vector3};
use resurvey_plugin::Error;

/// Objects of a region, at most.
const MAX_OBJECTS: usize = 8;
/// Share of the smallest silhouette by which one object more must lower the misfit: in generated captures pairs that
/// overlap gave 0.2 to 0.7, single objects less than 0.2 where they gave more than noise.
const MIN_GAIN: f64 = 0.2;
/// The same in strips as high as the silhouette and as wide as label contours wander (1σ): single objects gave up to 1, pairs 2 to 38.
const MIN_GAIN_SIGMAS: f64 = 2.0;
/// Share of its visible silhouette that is of the region, at least.
const MIN_INSIDE: f64 = 0.7;
/// Share of its silhouette that nothing hides, at least.
const MIN_VISIBLE: f64 = 0.25;
/// Misfit of all over the pixels of the region, at most.
const MAX_MISFIT: f64 = 0.35;
/// Widths and heights, over those of the predefined size, of the fewer objects that compete with one more: one that is
/// large for its class is not two. That two are, both at once, is less likely than that noise has grown them a little.
const SIZES: [f64; 3] = [1.0, 1.15, 1.3];
const SIZES_OF_SEVERAL: [f64; 2] = [1.0, 1.15];
/// Two objects are at least this many sides apart.
const MIN_APART: f64 = 0.95;
/// Starts that are refined.
const KEPT: usize = 4;
/// First and smallest step of the search, metres across; along the line of sight more, as the ground is foreshortened.
const FIRST_STEP_M: f64 = 0.4;
const LAST_STEP_M: f64 = 0.02;
/// Length over which label contours wander together, pixels.
const WANDER_PX: f64 = 24.0;
/// 1σ by which the silhouette of a square differs from the cylinder's, over all headings, as a share of the side.
const SHAPE_SIGMA: f64 = 0.1;
/// Distance outside a contour at which the region must have ended, pixels beyond 1σ of the labels.
const OUTSIDE_PX: f64 = 3.0;

/// One object of a crowd.
#[derive(Clone, Debug)]
pub struct Member {
    /// Centre of its base, offset from the camera, metres.
    pub foot: Vector3<f64>,
    silhouette: Silhouette,
}

/// What a crowd is looked for in.
#[derive(Clone, Copy)]
pub struct Search<'a> {
    /// The photo and the map.
    pub sight: &'a Sight<'a>,
    /// What the pixels say.
    pub evidence: &'a Evidence,
    /// The predefined size, metres.
    pub size_m: [f64; 3],
}

/// Objects that together explain a region, and how many pixels they leave or take wrongly.
#[derive(Clone, Debug)]
struct Crowd {
    members: Vec<Member>,
    misfit_px: f64,
}

impl Search<'_> {
    /// The objects that explain the region clearly better than one does; `None` when one does as well, or nothing does.
    pub fn objects(&self, starts: &[Vector3<f64>]) -> Result<Option<Vec<Member>>, Error> {
        let mut single = Vec::new();
        for start in starts {
            single.extend(self.member(*start)?);
        }
        let firsts = single.iter().map(|member| vec![member.clone()]);
        let Some(mut best) = self.best(firsts.collect())? else { return Ok(None) };
        while best.members.len() < MAX_OBJECTS {
            let pairs = best.members.len() == 1;
            let bases = if pairs { single.iter().map(|one| vec![one.clone()]).collect() } else { vec![] };
            let bases: Vec<Vec<Member>> = bases.into_iter().chain([best.members.clone()]).collect();
            let more =
                bases.iter().flat_map(|base| single.iter().map(|one| [&base[..], std::slice::from_ref(one)].concat()));
            let Some(more) = self.best(more.collect())? else { break };
            // Those that are left when one goes may do better than those found before.
            let fewer = (0..more.members.len()).map(|gone| {
                let stay = more.members.iter().enumerate().filter(|(index, _)| *index != gone);
                stay.map(|(_, member)| member.clone()).collect()
            });
            if let Some(fewer) = self.best(fewer.collect())?
                && fewer.misfit_px < best.misfit_px
            {
                best = fewer;
            }
            if !self.is_better(&more, self.large_misfit_px(&best)?) {
                break;
            }
            best = more;
        }
        let explains = best.misfit_px <= MAX_MISFIT * self.evidence.region_px;
        Ok((best.members.len() > 1 && explains).then_some(best.members))
    }

    /// The misfit of as many objects at the size that suits them best.
    fn large_misfit_px(&self, crowd: &Crowd) -> Result<f64, Error> {
        let mut least_px = crowd.misfit_px;
        let sizes = if crowd.members.len() > 1 { &SIZES_OF_SEVERAL[..] } else { &SIZES[..] };
        for [width, height] in sizes.iter().flat_map(|width| sizes.iter().map(move |height| [width, height])) {
            let [x, y, z] = self.size_m;
            let search = Search { size_m: [x * width, y * width, z * height], ..*self };
            let mut members = Vec::new();
            for member in &crowd.members {
                members.extend(search.member(member.foot)?);
            }
            if let Some(large) = search.best(vec![members])? {
                least_px = least_px.min(large.misfit_px);
            }
        }
        Ok(least_px)
    }

    /// 1σ of each coordinate together of member `index`, metres, from the contours that are seen of it; infinite where
    /// they leave a direction open.
    pub fn sigma_m(&self, members: &[Member], index: usize) -> Result<f64, Error> {
        let member = &members[index];
        let step_m = LAST_STEP_M;
        let mut moved = Vec::new();
        for step in [Vector3::x(), Vector3::y()] {
            let Some(member) = self.member(member.foot + step * step_m)? else { return Ok(f64::INFINITY) };
            moved.push(member.silhouette);
        }
        let jitter_px = self.sight.settings.label_jitter_px.max(1.0);
        let mut information = Matrix2::zeros();
        for (at, normal, length_px) in member.silhouette.contour() {
            if self.ends_at(members, index, &at, &normal) {
                let here = member.silhouette.reach_px(&normal);
                let slope = Vector2::new(moved[0].reach_px(&normal) - here, moved[1].reach_px(&normal) - here) / step_m;
                information += slope * slope.transpose() * (length_px / (WANDER_PX * jitter_px * jitter_px));
            }
        }
        let shape_m = SHAPE_SIGMA * (self.size_m[0] + self.size_m[1]) / 2.0;
        let variance = information.try_inverse().map_or(f64::INFINITY, |covariance| covariance.trace());
        Ok(if variance >= 0.0 { (variance + shape_m * shape_m).sqrt() } else { f64::INFINITY })
    }

    /// Whether the region ends at the contour of member `index`, and not because another one or something else begins.
    fn ends_at(&self, members: &[Member], index: usize, at: &Vector2<f64>, normal: &Vector2<f64>) -> bool {
        let reach_px = OUTSIDE_PX + self.sight.settings.label_jitter_px;
        let pixel = |by: f64| {
            let at = at + normal * by;
            [at.x.floor() as i64, at.y.floor() as i64]
        };
        let says = |[u, v]: [i64; 2]| self.evidence.at(u, v);
        let is_own = |[u, v]: [i64; 2]| {
            members.iter().enumerate().all(|(other, one)| other == index || !one.silhouette.contains(u, v))
        };
        let (outside, inside) = (pixel(reach_px), pixel(-reach_px));
        says(outside) == Says::Empty && says(inside) == Says::Region && is_own(outside) && is_own(inside)
    }

    /// An object that stands about at `foot`, on the ground there; `None` where it would not be seen.
    fn member(&self, foot: Vector3<f64>) -> Result<Option<Member>, Error> {
        let above = foot + Vector3::new(0.0, 0.0, self.size_m[2] / 2.0);
        let ground_m = match above.iter().all(|x| x.is_finite()) {
            true => self.sight.host.ground_height(self.sight.to_grid(&above))?,
            false => return Ok(None),
        };
        let own_m = self.sight.pose().position.height_m;
        // A step in the ground is no slope.
        let near = |height_m: &f64| (height_m - foot.z).abs() < self.size_m[2] / 2.0;
        let height_m = ground_m.map(|ground_m| ground_m - own_m).filter(near).unwrap_or(foot.z);
        let foot = Vector3::new(foot.x, foot.y, height_m);
        let silhouette = Silhouette::new(self.sight, &foot, self.size_m)?;
        Ok(silhouette.map(|silhouette| Member { foot, silhouette }))
    }

    /// The best of `crowds` after each of the most promising has been refined.
    fn best(&self, crowds: Vec<Vec<Member>>) -> Result<Option<Crowd>, Error> {
        let mut crowds: Vec<Crowd> = crowds
            .into_iter()
            .map(|members| Crowd { misfit_px: self.misfit_px(&members), members })
            .filter(|crowd| crowd.misfit_px.is_finite())
            .collect();
        crowds.sort_by(|a, b| a.misfit_px.total_cmp(&b.misfit_px));
        crowds.truncate(KEPT);
        let mut best: Option<Crowd> = None;
        for crowd in crowds {
            let refined = self.refine(crowd)?;
            if best.as_ref().is_none_or(|best| refined.misfit_px < best.misfit_px) {
                best = Some(refined);
            }
        }
        Ok(best)
    }

    /// Moves one member at a time, along its line of sight and across, as long as that lowers the misfit (pattern search,
    /// Hooke & Jeeves 1961).
    fn refine(&self, mut crowd: Crowd) -> Result<Crowd, Error> {
        let mut step_m = FIRST_STEP_M;
        while step_m >= LAST_STEP_M {
            let mut moved = false;
            for index in 0..crowd.members.len() {
                moved |= self.shift(&mut crowd, index, step_m)?;
            }
            if !moved {
                step_m /= 2.0;
            }
        }
        Ok(crowd)
    }

    /// Whether a step of member `index` lowers the misfit; takes the best one.
    fn shift(&self, crowd: &mut Crowd, index: usize, step_m: f64) -> Result<bool, Error> {
        let foot = crowd.members[index].foot;
        let range_m = foot.xy().norm().max(1e-3);
        let along = Vector3::new(foot.x, foot.y, 0.0) / range_m;
        let across = Vector3::new(along.y, -along.x, 0.0);
        let deep_m = step_m * (range_m / foot.z.abs().max(0.5)).clamp(1.0, 4.0);
        let mut best = crowd.misfit_px;
        for step in [across * step_m, across * -step_m, along * deep_m, along * -deep_m] {
            let Some(member) = self.member(foot + step)? else { continue };
            let before = std::mem::replace(&mut crowd.members[index], member);
            let misfit_px = self.misfit_px(&crowd.members);
            if misfit_px < best {
                best = misfit_px;
            } else {
                crowd.members[index] = before;
            }
        }
        let is_better = best < crowd.misfit_px;
        crowd.misfit_px = best;
        Ok(is_better)
    }

    /// Pixels of the region that no member explains, and pixels of members where the map is seen; infinite where two
    /// stand in the same place.
    fn misfit_px(&self, members: &[Member]) -> f64 {
        let apart_m = MIN_APART * self.size_m[0].min(self.size_m[1]);
        for (index, member) in members.iter().enumerate() {
            if members[..index].iter().any(|other| (other.foot - member.foot).xy().norm() < apart_m) {
                return f64::INFINITY;
            }
        }
        let [region, empty] = self.union(members);
        self.evidence.region_px - region + empty
    }

    /// Pixels of the region, and pixels that show the map, in the union of `members`.
    fn union(&self, members: &[Member]) -> [f64; 2] {
        let rows = members.iter().map(|member| member.silhouette.rows());
        let (top, bottom) =
            rows.fold((i64::MAX, i64::MIN), |(top, bottom), rows| (top.min(rows.start), bottom.max(rows.end)));
        let mut sum = [0.0; 2];
        for v in top.max(0)..bottom.min(i64::from(self.sight.size()[1])) {
            let mut spans: [[i64; 2]; MAX_OBJECTS] = [[0, 0]; MAX_OBJECTS];
            members.iter().zip(&mut spans).for_each(|(member, span)| *span = member.silhouette.span(v));
            let spans = &mut spans[..members.len().min(MAX_OBJECTS)];
            spans.sort_unstable();
            let mut done = i64::MIN;
            for [left, right] in spans {
                let [region, empty] = self.evidence.count(v, [(*left).max(done), *right]);
                sum = [sum[0] + region, sum[1] + empty];
                done = done.max(*right);
            }
        }
        sum
    }

    /// Whether `more` explains the region clearly better than fewer that leave `fewer_px`, and each member is plainly seen.
    fn is_better(&self, more: &Crowd, fewer_px: f64) -> bool {
        let least_px = more.members.iter().map(|member| member.silhouette.area_px()).fold(f64::INFINITY, f64::min);
        let rows = more.members.iter().map(|member| member.silhouette.rows().count()).min().unwrap_or(0);
        let noise_px = MIN_GAIN_SIGMAS * self.sight.settings.label_jitter_px * rows as f64;
        let gain_px = fewer_px - more.misfit_px;
        gain_px >= noise_px.max(MIN_GAIN * least_px)
            && (0..more.members.len()).all(|index| self.is_seen(&more.members, index))
    }

    /// Whether enough of member `index` is visible, and most of that of the region.
    fn is_seen(&self, members: &[Member], index: usize) -> bool {
        let member = &members[index];
        let nearer: Vec<Member> = members
            .iter()
            .enumerate()
            .filter(|(other, one)| *other != index && one.foot.norm() < member.foot.norm())
            .map(|(_, one)| one.clone())
            .collect();
        let [before_region, before_empty] = self.union(&nearer);
        let [region, empty] = self.union(&[&nearer[..], std::slice::from_ref(member)].concat());
        let (region, empty) = (region - before_region, empty - before_empty);
        let visible = region + empty;
        region >= MIN_INSIDE * visible && visible >= MIN_VISIBLE * member.silhouette.area_px()
    }
}

/// Where objects may stand that reach down to `low` or up to `high` along the rays of a column of the region: ground
/// contacts and directions, offsets from the camera.
pub fn starts(size_m: [f64; 3], lows: &[Vector3<f64>], highs: &[Vector3<f64>]) -> Vec<Vector3<f64>> {
    let radius_m = radius_m(size_m);
    let Some(nearest) = lows.iter().min_by(|a, b| a.norm().total_cmp(&b.norm())) else { return Vec::new() };
    let beyond = |point: Vector3<f64>, by_m: f64| {
        let ahead = Vector3::new(point.x, point.y, 0.0).try_normalize(1e-9).unwrap_or_else(Vector3::zeros);
        point + ahead * by_m
    };
    let head_m = nearest.z + size_m[2];
    // From above the far edge of the top is the highest, from below the near one.
    let to_centre_m = if head_m < 0.0 { -radius_m } else { radius_m };
    let from_head = highs.iter().filter_map(|direction| {
        let times = head_m / direction.z;
        let top = direction * times;
        let is_ahead = times > 0.0 && times.is_finite() && top.norm() < 10.0 * nearest.norm();
        is_ahead.then(|| beyond(Vector3::new(top.x, top.y, nearest.z), to_centre_m))
    });
    lows.iter().map(|low| beyond(*low, radius_m)).chain(from_head).collect()
}
