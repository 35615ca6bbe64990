//! Surfaces of the view: connected pixels on one plane. A panel on a wall belongs to the wall.

use resurvey_class_difference::raster::Rasters;

/// How far a neighbour may lie off the plane at a pixel, metres and share of the range.
const OFF_PLANE_M: f64 = 0.03;
const OFF_PLANE_SHARE: f64 = 0.002;
/// Cosine of the largest angle between the normals of neighbours, 15°.
const MIN_COSINE: f64 = 0.966;
/// Surfaces with fewer pixels join a neighbour.
const MIN_PX: usize = 150;
/// A neighbour is at a similar range when it is nearer or farther by at most this share.
const SIMILAR_SHARE: f64 = 0.15;
/// Where nothing is hit.
pub const SKY: u32 = u32::MAX;

/// The surfaces of a view.
pub struct Surfaces {
    /// Surface of every pixel, [`SKY`] where nothing is hit.
    pub of: Vec<u32>,
    /// Number of surfaces.
    pub count: usize,
}

/// Cuts a view with the given points into surfaces, numbered by their first pixel.
pub fn surfaces(rasters: &Rasters, points: &[[f32; 3]]) -> Surfaces {
    let normals = normals(rasters, points);
    let mut sets = Sets::new(points.len());
    let width = rasters.width;
    for pixel in 0..points.len() {
        let right = (pixel % width + 1 < width).then_some(pixel + 1);
        let below = (pixel + width < points.len()).then_some(pixel + width);
        for near in right.into_iter().chain(below) {
            let is_same =
                lies_on(rasters, points, &normals, pixel, near) && lies_on(rasters, points, &normals, near, pixel);
            if is_same {
                sets.join(pixel, near);
            }
        }
    }
    numbered(rasters, &mut sets)
}

/// Whether `near` lies on the plane at `pixel`.
fn lies_on(rasters: &Rasters, points: &[[f32; 3]], normals: &[[f64; 3]], pixel: usize, near: usize) -> bool {
    let step: [f64; 3] = std::array::from_fn(|axis| f64::from(points[near][axis]) - f64::from(points[pixel][axis]));
    let limit_m = OFF_PLANE_M + OFF_PLANE_SHARE * f64::from(rasters.range_m[pixel]);
    dot(normals[pixel], step).abs() <= limit_m && dot(normals[pixel], normals[near]) >= MIN_COSINE
}

/// Unit normals towards the camera; NaN where they are unknown.
fn normals(rasters: &Rasters, points: &[[f32; 3]]) -> Vec<[f64; 3]> {
    let (width, len) = (rasters.width, points.len());
    let difference = |pixel: usize, before: Option<usize>, after: Option<usize>| {
        // The nearer of the two neighbours: across an edge there is a long step.
        let step = |near: usize, sign: f64| -> [f64; 3] {
            std::array::from_fn(|axis| sign * (f64::from(points[near][axis]) - f64::from(points[pixel][axis])))
        };
        let steps = [before.map(|near| step(near, -1.0)), after.map(|near| step(near, 1.0))];
        let known = steps.into_iter().flatten().filter(|step| step.iter().all(|part| part.is_finite()));
        known.min_by(|a, b| dot(*a, *a).total_cmp(&dot(*b, *b)))
    };
    (0..len)
        .map(|pixel| {
            let column = pixel % width;
            let along = difference(pixel, (column > 0).then(|| pixel - 1), (column + 1 < width).then_some(pixel + 1));
            let down = difference(pixel, pixel.checked_sub(width), (pixel + width < len).then_some(pixel + width));
            match (along, down) {
                (Some(along), Some(down)) => unit(cross(along, down)),
                _ => [f64::NAN; 3],
            }
        })
        .collect()
}

/// Surfaces by number, the small ones joined to what is beside them.
fn numbered(rasters: &Rasters, sets: &mut Sets) -> Surfaces {
    let (width, len) = (rasters.width, rasters.range_m.len());
    let mut sizes = vec![0usize; len];
    (0..len).for_each(|pixel| sizes[sets.root(pixel)] += 1);
    for pixel in 0..len {
        let right = (pixel % width + 1 < width).then_some(pixel + 1);
        let below = (pixel + width < len).then_some(pixel + width);
        for near in right.into_iter().chain(below) {
            let (a, b) = (sets.root(pixel), sets.root(near));
            let is_small = sizes[a].min(sizes[b]) < MIN_PX;
            if a != b && is_small && is_similar(rasters.range_m[pixel], rasters.range_m[near]) {
                let total = sizes[a] + sizes[b];
                sets.join(a, b);
                sizes[sets.root(a)] = total;
            }
        }
    }
    let mut numbers = vec![SKY; len];
    let mut count = 0;
    let of = (0..len)
        .map(|pixel| {
            if rasters.is_sky(pixel) {
                return SKY;
            }
            let root = sets.root(pixel);
            if numbers[root] == SKY {
                numbers[root] = count;
                count += 1;
            }
            numbers[root]
        })
        .collect();
    Surfaces { of, count: count as usize }
}

/// Whether two ranges are so similar that a step between them is no edge; never where nothing is hit.
pub fn is_similar(a_m: f32, b_m: f32) -> bool {
    a_m.is_finite() && b_m.is_finite() && f64::from((a_m - b_m).abs()) <= SIMILAR_SHARE * f64::from(a_m.min(b_m))
}

/// Disjoint sets (Tarjan 1975), the smallest member as root.
struct Sets(Vec<usize>);

impl Sets {
    fn new(len: usize) -> Self {
        Self((0..len).collect())
    }

    fn root(&mut self, mut member: usize) -> usize {
        while self.0[member] != member {
            self.0[member] = self.0[self.0[member]];
            member = self.0[member];
        }
        member
    }

    fn join(&mut self, a: usize, b: usize) {
        let (a, b) = (self.root(a), self.root(b));
        self.0[a.max(b)] = a.min(b);
    }
}

/// Scalar product.
pub fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Vector product.
pub fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// The direction of `a`; NaN of nothing.
pub fn unit(a: [f64; 3]) -> [f64; 3] {
    let length = dot(a, a).sqrt();
    a.map(|part| part / length)
}
