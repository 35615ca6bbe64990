//! Buildings in plan: the map cut at one height.

use resurvey_core::render::{Scene, horizontal_cut};

/// A line in plan: easting and northing of both ends, metres.
pub type Line = [[f64; 2]; 2];

/// Where the objects of `scene` cross `height_m`, as far as it touches the box from `low` to `high`.
pub fn footprints(scene: &Scene, height_m: f64, [low, high]: [[f64; 2]; 2]) -> Vec<Line> {
    let origin = scene.origin();
    let cut_m = height_m - origin.height_m;
    let start = [origin.easting_m, origin.northing_m];
    let is_near = |line: &Line| {
        (0..2)
            .all(|axis| line[0][axis].min(line[1][axis]) <= high[axis] && line[0][axis].max(line[1][axis]) >= low[axis])
    };
    let triangles = scene.objects().iter().flat_map(|object| &scene.positions()[object.triangles.clone()]);
    let cuts = triangles.filter_map(|triangle| horizontal_cut(triangle, cut_m));
    cuts.map(|line| line.map(|end| [0, 1].map(|axis| end[axis] + start[axis]))).filter(is_near).collect()
}

#[cfg(test)]
mod tests {
    use super::horizontal_cut as cut;

    #[test]
    fn a_wall_is_a_line_and_the_floor_is_none() {
        let wall = [[0.0, 5.0, 0.0], [10.0, 5.0, 0.0], [10.0, 5.0, 4.0]];
        let [mut ends @ [_, _]] = [cut(&wall, 1.0).unwrap()];
        ends.sort_by(|a, b| a[0].total_cmp(&b[0]));
        // The hypotenuse passes x = 2.5 at a quarter of its height.
        assert!((ends[0][0] - 2.5).abs() < 1e-12 && (ends[1][0] - 10.0).abs() < 1e-12);
        assert_eq!(cut(&[[0.0, 0.0, 0.0], [9.0, 0.0, 0.0], [0.0, 9.0, 0.0]], 0.0), None);
        assert_eq!(cut(&wall, 4.0), None, "the upper end is open");
    }
}
