//! The part of a triangle that lies in the box in which local offsets are exact (Sutherland & Hodgman 1974).

use crate::crs::LOCAL_LIMIT_M;

/// A corner: offset from the scene's origin, metres, and texture coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Corner {
    pub(super) offset: [f64; 3],
    pub(super) uv: [f64; 2],
}

/// The triangle within 2048 m of the origin along every axis, as triangles; none when it lies outside or a coordinate
/// is not a number.
pub(super) fn within_reach(triangle: [Corner; 3]) -> Vec<[Corner; 3]> {
    if !triangle.iter().flat_map(|corner| &corner.offset).all(|value| value.is_finite()) {
        return Vec::new();
    }
    let mut polygon = triangle.to_vec();
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            polygon = cut(&polygon, axis, side);
        }
    }
    let (Some(&first), rest) = (polygon.first(), polygon.get(1..).unwrap_or_default()) else { return Vec::new() };
    rest.windows(2).map(|pair| [first, pair[0], pair[1]]).collect()
}

/// The part of a convex polygon with `side` · offset at most the limit along `axis`.
fn cut(polygon: &[Corner], axis: usize, side: f64) -> Vec<Corner> {
    let beyond = |corner: &Corner| side * corner.offset[axis] - LOCAL_LIMIT_M;
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (index, from) in polygon.iter().enumerate() {
        let to = &polygon[(index + 1) % polygon.len()];
        if beyond(from) <= 0.0 {
            kept.push(*from);
        }
        if (beyond(from) <= 0.0) != (beyond(to) <= 0.0) {
            let share = beyond(from) / (beyond(from) - beyond(to));
            let between = |a: f64, b: f64| a + share * (b - a);
            let mut corner = Corner {
                offset: std::array::from_fn(|k| between(from.offset[k], to.offset[k])),
                uv: std::array::from_fn(|k| between(from.uv[k], to.uv[k])),
            };
            corner.offset[axis] = side * LOCAL_LIMIT_M;
            kept.push(corner);
        }
    }
    kept
}
