//! Where classes meet and where the range jumps. An edge is marked on the left or upper of its two pixels.

/// Pixels whose right or lower neighbour has another class; only between pixels that are `shown`.
pub fn class_edges(labels: &[u8], width: usize, shown: &[bool]) -> Vec<bool> {
    let mut edges = vec![false; labels.len()];
    for (index, edge) in edges.iter_mut().enumerate() {
        let is_step = |other: usize| shown[other] && labels[other] != labels[index];
        let has_right = (index + 1) % width != 0 && is_step(index + 1);
        let has_lower = index + width < labels.len() && is_step(index + width);
        *edge = shown[index] && (has_right || has_lower);
    }
    edges
}

/// Pixels whose range differs from that of the right or lower neighbour by a jump: by more than `jump` of the larger
/// inverse range, and from what the surface on either side leads to expect.
///
/// Along a line of pixels the inverse range of a plane changes evenly but for the square of the angle between two rays
/// (0.1 % at 96 columns), so that ground near the horizon and walls seen along are no edges, and a corner is none where
/// it is further away than a few pixels are wide.
pub fn depth_edges(range_m: &[f32], width: usize, jump: f32) -> Vec<bool> {
    let inverse: Vec<f32> = range_m.iter().map(|range_m| if *range_m > 0.0 { range_m.recip() } else { 0.0 }).collect();
    let is_jump = |[before, here, next, after]: [usize; 4]| {
        let [before, here, next, after] = [before, here, next, after].map(|index| inverse[index]);
        let least = jump * here.max(next);
        let differs = |from: f32, to: f32| (from - to).abs() > least;
        differs(here, next) && differs(2.0 * here - before, next) && differs(2.0 * next - after, here)
    };
    let mut edges = vec![false; range_m.len()];
    for (index, edge) in edges.iter_mut().enumerate() {
        let column = index % width;
        let along = (1..).contains(&column) && column + 2 < width;
        let down = index >= width && index + 2 * width < range_m.len();
        *edge = (along && is_jump([index - 1, index, index + 1, index + 2]))
            || (down && is_jump([index - width, index, index + width, index + 2 * width]));
    }
    edges
}

#[cfg(test)]
mod tests {
    use super::*;

    fn marked(edges: &[bool]) -> Vec<usize> {
        edges.iter().enumerate().filter_map(|(index, edge)| edge.then_some(index)).collect()
    }

    #[test]
    fn a_class_edge_lies_left_of_and_above_its_step() {
        let labels = [0, 0, 1, 0, 0, 1, 2, 2, 2];
        assert_eq!(marked(&class_edges(&labels, 3, &[true; 9])), [1, 3, 4, 5]);
    }

    #[test]
    fn there_is_no_edge_against_what_is_not_shown() {
        let labels = [0, 7, 1];
        assert_eq!(marked(&class_edges(&labels, 3, &[true, false, true])), Vec::<usize>::new());
    }

    /// Ranges along a row of rays `step_rad` apart that hit walls given as distance and bearing of their normal.
    fn row(walls: [(f32, f32); 2], split: usize) -> Vec<f32> {
        let step_rad = 0.02;
        let range_m = |column: usize| {
            let (distance_m, normal_rad) = walls[usize::from(column >= split)];
            distance_m / (column as f32 * step_rad - normal_rad).cos()
        };
        (0..40).map(range_m).collect()
    }

    #[test]
    fn a_nearer_wall_before_another_is_a_depth_edge_and_a_wall_seen_along_is_not() {
        // The walls face the camera; 8 m before 12 m.
        assert_eq!(marked(&depth_edges(&row([(8.0, 0.4), (12.0, 0.4)], 20), 40, 0.1)), [19]);
        // A wall 1.5 m to the side, seen at up to 87° from its normal: the range grows by a third a pixel.
        assert_eq!(marked(&depth_edges(&row([(1.5, -0.74), (1.5, -0.74)], 20), 40, 0.1)), Vec::<usize>::new());
        // Two walls that meet: 45° to either side, at one range where they meet.
        let corner = row([(8.0, 0.4 - 0.785), (8.0, 0.4 + 0.785)], 20);
        assert_eq!(marked(&depth_edges(&corner, 40, 0.1)), Vec::<usize>::new());
    }

    #[test]
    fn the_sky_is_infinitely_far() {
        let mut ranges = row([(8.0, 0.4), (8.0, 0.4)], 20);
        ranges[20..].fill(f32::INFINITY);
        assert_eq!(marked(&depth_edges(&ranges, 40, 0.1)), [19]);
    }
}
