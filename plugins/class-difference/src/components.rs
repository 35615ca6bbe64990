//! Connected components, holes and thickness of pixel sets.

/// Groups the pixels of equal value into 8-connected components, in row-major order of their first pixel; pixels
/// without a value belong to none.
pub fn components<T: Copy + PartialEq>(values: &[Option<T>], width: usize) -> Vec<Vec<usize>> {
    let mut seen = vec![false; values.len()];
    let mut found = Vec::new();
    for first in 0..values.len() {
        let Some(value) = values[first].filter(|_| !seen[first]) else { continue };
        let mut pixels = vec![first];
        seen[first] = true;
        let mut next = 0;
        while let Some(&pixel) = pixels.get(next) {
            next += 1;
            for_neighbours(pixel, width, values.len(), |near| {
                if !seen[near] && values[near] == Some(value) {
                    seen[near] = true;
                    pixels.push(near);
                }
            });
        }
        found.push(pixels);
    }
    found
}

/// Calls `visit` with the up to eight neighbours of `pixel` in an image of `len` pixels.
pub fn for_neighbours(pixel: usize, width: usize, len: usize, mut visit: impl FnMut(usize)) {
    let column = pixel % width;
    let start = if column == 0 { 0 } else { 1 };
    let end = if column + 1 == width { 0 } else { 1 };
    let rows = [pixel.checked_sub(width), Some(pixel), (pixel + width < len).then_some(pixel + width)];
    for middle in rows.into_iter().flatten() {
        (middle - start..=middle + end).filter(|near| *near != pixel).for_each(&mut visit);
    }
}

/// Radius of the largest disk inside the set `mask` (row-major, `width` columns), pixels; beyond the mask is outside.
/// Chamfer 3-4 distances (Borgefors 1986), within 6 % of the true ones.
pub fn inscribed_radius_px(mask: &[bool], width: usize) -> f64 {
    let (stride, height) = (width + 2, mask.len() / width.max(1));
    let mut distance = vec![0u32; stride * (height + 2)];
    for (row, values) in mask.chunks_exact(width.max(1)).enumerate() {
        for (column, inside) in values.iter().enumerate().filter(|(_, inside)| **inside) {
            let at = (row + 1) * stride + column + 1;
            debug_assert!(*inside);
            distance[at] = [(at - 1, 3), (at - stride, 3), (at - stride - 1, 4), (at - stride + 1, 4)]
                .map(|(near, step)| distance[near] + step)
                .into_iter()
                .fold(u32::MAX, u32::min);
        }
    }
    let mut largest = 0;
    for at in (0..distance.len()).rev().filter(|at| at + stride + 1 < stride * (height + 2)) {
        if distance[at] > 0 {
            let backward = [(at + 1, 3), (at + stride, 3), (at + stride + 1, 4), (at + stride - 1, 4)];
            distance[at] = backward.map(|(near, step)| distance[near] + step).into_iter().fold(distance[at], u32::min);
            largest = largest.max(distance[at]);
        }
    }
    f64::from(largest) / 3.0
}

/// Fills the holes of `mask` (row-major, `width` columns) that have at most `limit_px` pixels.
pub fn fill_holes(mask: &mut [u8], width: usize, limit_px: usize) {
    let outside: Vec<Option<()>> = mask.iter().map(|inside| (*inside == 0).then_some(())).collect();
    let height = mask.len() / width.max(1);
    for hole in components(&outside, width) {
        let touches_border = |pixel: &usize| {
            let (column, row) = (pixel % width, pixel / width);
            column == 0 || row == 0 || column + 1 == width || row + 1 == height
        };
        if hole.len() <= limit_px && !hole.iter().any(touches_border) {
            hole.into_iter().for_each(|pixel| mask[pixel] = 1);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn pixels_that_touch_at_a_corner_are_one_component() {
        let values = [Some(1), None, None, Some(1)];
        assert_eq!(components(&values, 2), vec![vec![0, 3]]);
    }

    #[test]
    fn the_largest_disk_in_a_rectangle_has_half_its_shorter_side() {
        assert!((inscribed_radius_px(&[true; 21 * 9], 21) - 5.0).abs() < 1e-9, "distance to the first pixel outside");
    }

    #[test]
    fn only_small_holes_are_filled() {
        let mut mask = [1u8; 7 * 7];
        mask[3 * 7 + 3] = 0;
        mask[6 * 7 + 3] = 0;
        fill_holes(&mut mask, 7, 1);
        assert_eq!((mask[3 * 7 + 3], mask[6 * 7 + 3]), (1, 0), "a notch in the border is no hole");
    }
}
