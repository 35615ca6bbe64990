//! Which positions lie inside solid buildings: the scene cut at one height, and even-odd counts in plan.
//!
//! Real models have walls and roof as separate objects, walls of one building split by material, open tops and
//! bottoms, and windings not to be trusted; a horizontal cut needs none of that.

use super::scene::Scene;
use resurvey_schema::GridPoint;
use std::collections::HashMap;

/// Ends of segments nearer than this are one point, metres.
const JOIN_M: f64 = 0.01;
/// A position this near to a wall counts as neither side of it when enclosure is judged, metres.
const MARGIN_M: f64 = 0.05;

/// The solid parts of a scene at one height.
#[derive(Clone, Debug, PartialEq)]
pub struct SolidMask {
    origin: GridPoint,
    footprints: Vec<Footprint>,
}

/// Whether `point` lies inside a solid object of the base map; [`SolidMask`] answers for many positions at one height.
pub fn inside_solid(scene: &Scene, point: GridPoint) -> bool {
    SolidMask::at_height(scene, point.height_m).contains(point)
}

impl SolidMask {
    /// The cut of `scene` at `height_m`. An outline that encloses others at this height, such as a hall with shelves
    /// and chairs in it, is a room and not solid; descriptors are never solid but count as what a room holds.
    pub fn at_height(scene: &Scene, height_m: f64) -> Self {
        let cut_m = height_m - scene.origin().height_m;
        let slices = scene.objects().iter().map(|object| slice(scene, object.triangles.clone(), cut_m));
        let outlines = joined(slices.filter(|segments| !segments.is_empty()).collect());
        let contents = descriptors(scene).map(|triangles| slice(scene, triangles, cut_m));
        let contents: Vec<Footprint> = contents.filter(|segments| !segments.is_empty()).map(Footprint::new).collect();
        let is_room = |index: usize, outline: &Footprint| {
            let others = outlines.iter().enumerate().filter(|(other, _)| *other != index).map(|(_, other)| other);
            others.chain(&contents).any(|other| outline.encloses(other))
        };
        let footprints = outlines.iter().enumerate().filter(|(index, outline)| !is_room(*index, outline));
        Self { origin: scene.origin(), footprints: footprints.map(|(_, outline)| outline.clone()).collect() }
    }

    /// Whether the position lies inside a solid; its height is taken to be that of the cut.
    pub fn contains(&self, point: GridPoint) -> bool {
        let plan = [point.easting_m - self.origin.easting_m, point.northing_m - self.origin.northing_m];
        self.footprints.iter().any(|footprint| footprint.contains(plan))
    }
}

type Segment = [[f64; 2]; 2];

/// Segments of one outline in plan, offsets from the scene's origin, with the box around them.
#[derive(Clone, Debug, PartialEq)]
struct Footprint {
    segments: Vec<Segment>,
    low: [f64; 2],
    high: [f64; 2],
}

impl Footprint {
    fn new(segments: Vec<Segment>) -> Self {
        let ends = || segments.iter().flatten();
        let low = [0, 1].map(|axis| ends().fold(f64::INFINITY, |low, end| low.min(end[axis])));
        let high = [0, 1].map(|axis| ends().fold(f64::NEG_INFINITY, |high, end| high.max(end[axis])));
        Self { segments, low, high }
    }

    /// Even-odd in four directions; three must say inside, so that a gap in the outline spoils one of them only.
    fn contains(&self, point: [f64; 2]) -> bool {
        if (0..2).any(|axis| point[axis] < self.low[axis] || point[axis] > self.high[axis]) {
            return false;
        }
        let mut odd = [false; 4];
        for [a, b] in &self.segments {
            for (axis, across) in [(0, 1), (1, 0)] {
                if (a[across] > point[across]) != (b[across] > point[across]) {
                    let share = (point[across] - a[across]) / (b[across] - a[across]);
                    let crossing = a[axis] + share * (b[axis] - a[axis]);
                    odd[2 * axis + usize::from(crossing > point[axis])] ^= true;
                }
            }
        }
        odd.iter().filter(|odd| **odd).count() >= 3
    }

    /// Whether all of `other` lies inside, apart from what touches the outline.
    fn encloses(&self, other: &Self) -> bool {
        let fits = (0..2)
            .all(|axis| other.low[axis] >= self.low[axis] - MARGIN_M && other.high[axis] <= self.high[axis] + MARGIN_M);
        if !fits {
            return false;
        }
        let mut inside = false;
        for end in other.segments.iter().flatten() {
            if self.segments.iter().any(|segment| distance_m(segment, *end) <= MARGIN_M) {
                continue;
            }
            if !self.contains(*end) {
                return false;
            }
            inside = true;
        }
        inside
    }
}

/// Where triangles cross the height.
fn slice(scene: &Scene, triangles: std::ops::Range<usize>, cut_m: f64) -> Vec<Segment> {
    scene.positions()[triangles].iter().filter_map(|triangle| horizontal_cut(triangle, cut_m)).collect()
}

/// The line in plan in which a triangle (E, N, H) crosses a height; `None` where it does not.
pub fn horizontal_cut(triangle: &[[f32; 3]; 3], cut_m: f64) -> Option<[[f64; 2]; 2]> {
    let corners = triangle.map(|corner| corner.map(f64::from));
    let mut ends = [[0.0; 2]; 2];
    let mut count = 0;
    for (from, to) in [(0, 1), (1, 2), (2, 0)] {
        // Half-open, and always from the lower end: neighbours find the same point, and a corner counts once.
        let (low, high) = if corners[from][2] <= corners[to][2] { (from, to) } else { (to, from) };
        let (low, high) = (corners[low], corners[high]);
        if low[2] <= cut_m && high[2] > cut_m {
            let share = (cut_m - low[2]) / (high[2] - low[2]);
            ends[count.min(1)] = [0, 1].map(|axis| low[axis] + share * (high[axis] - low[axis]));
            count += 1;
        }
    }
    (count == 2).then_some(ends)
}

/// Outlines of the objects; objects whose open ends meet are parts of one outline.
fn joined(objects: Vec<Vec<Segment>>) -> Vec<Footprint> {
    let mut group: Vec<usize> = (0..objects.len()).collect();
    let mut first_at: HashMap<[i64; 2], usize> = HashMap::new();
    for (index, segments) in objects.iter().enumerate() {
        for end in open_ends(segments) {
            let other = *first_at.entry(end).or_insert(index);
            let (a, b) = (root(&group, index), root(&group, other));
            group[a.max(b)] = a.min(b);
        }
    }
    let mut outlines: Vec<Vec<Segment>> = vec![Vec::new(); objects.len()];
    for (index, segments) in objects.into_iter().enumerate() {
        outlines[root(&group, index)].extend(segments);
    }
    outlines.into_iter().filter(|segments| !segments.is_empty()).map(Footprint::new).collect()
}

fn root(group: &[usize], mut index: usize) -> usize {
    while group[index] != index {
        index = group[index];
    }
    index
}

/// Ends that an odd number of segments share.
fn open_ends(segments: &[Segment]) -> Vec<[i64; 2]> {
    let mut ends: Vec<[i64; 2]> =
        segments.iter().flatten().map(|end| end.map(|value| (value / JOIN_M).round() as i64)).collect();
    ends.sort_unstable();
    ends.chunk_by(|a, b| a == b).filter(|same| same.len() % 2 == 1).map(|same| same[0]).collect()
}

/// Triangles of each descriptor.
fn descriptors(scene: &Scene) -> impl Iterator<Item = std::ops::Range<usize>> {
    let first = scene.objects().last().map_or(0, |object| object.triangles.end);
    let mut start = first;
    let rest: Vec<u32> = (first..scene.positions().len()).map(|triangle| scene.feature(triangle)).collect();
    let lengths: Vec<usize> = rest.chunk_by(|a, b| a == b).map(<[u32]>::len).collect();
    lengths.into_iter().map(move |length| {
        let triangles = start..start + length;
        start = triangles.end;
        triangles
    })
}

fn distance_m([a, b]: &Segment, point: [f64; 2]) -> f64 {
    let along = [b[0] - a[0], b[1] - a[1]];
    let from = [point[0] - a[0], point[1] - a[1]];
    let length_m2 = along[0] * along[0] + along[1] * along[1];
    let share = ((from[0] * along[0] + from[1] * along[1]) / length_m2.max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
    (from[0] - share * along[0]).hypot(from[1] - share * along[1])
}
