//! The most frequent label in a square around each pixel.

use std::ops::Range;

/// `labels` of `width × height` pixels, each replaced by the most frequent one within `radius`: its own where it is among
/// the most frequent, else the lowest of them. `None` when `cancelled` says so. Linear in pixels times radius.
pub fn filtered(
    labels: Vec<u8>,
    (width, height): (usize, usize),
    radius: usize,
    cancelled: &dyn Fn() -> bool,
) -> Option<Vec<u8>> {
    if radius == 0 {
        return Some(labels);
    }
    let mut out = Vec::with_capacity(labels.len());
    for row in 0..height {
        if cancelled() {
            return None;
        }
        let rows = row.saturating_sub(radius)..(row + radius + 1).min(height);
        let mut window = Window { labels: &labels, width, rows, counts: [0; 256] };
        (0..radius).for_each(|column| window.add(column));
        for column in 0..width {
            window.add(column + radius);
            if column > radius {
                window.remove(column - radius - 1);
            }
            out.push(window.most_frequent(labels[row * width + column]));
        }
    }
    Some(out)
}

/// Counts of the labels in some columns of some rows.
struct Window<'a> {
    labels: &'a [u8],
    width: usize,
    rows: Range<usize>,
    counts: [u32; 256],
}

impl Window<'_> {
    /// A column outside of the image has nothing to count.
    fn add(&mut self, column: usize) {
        for row in self.rows.clone().filter(|_| column < self.width) {
            self.counts[usize::from(self.labels[row * self.width + column])] += 1;
        }
    }

    fn remove(&mut self, column: usize) {
        for row in self.rows.clone() {
            self.counts[usize::from(self.labels[row * self.width + column])] -= 1;
        }
    }

    fn most_frequent(&self, own: u8) -> u8 {
        let most = self.counts.iter().copied().max().unwrap_or_default();
        if self.counts[usize::from(own)] == most {
            return own;
        }
        self.counts.iter().position(|count| *count == most).map_or(own, |label| label as u8)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn of(labels: &[u8], size: (usize, usize), radius: usize) -> Vec<u8> {
        filtered(labels.to_vec(), size, radius, &|| false).unwrap()
    }

    #[test]
    fn a_single_wrong_pixel_is_outvoted() {
        let mut speckled = vec![3; 25];
        speckled[12] = 7;
        assert_eq!(of(&speckled, (5, 5), 1), vec![3; 25]);
        assert_eq!(of(&speckled, (5, 5), 0), speckled);
    }

    #[test]
    fn a_straight_border_stays_where_it_is() {
        let halves: Vec<u8> = (0..8 * 6).map(|at| u8::from(at % 8 >= 3)).collect();
        for radius in [1, 2] {
            assert_eq!(of(&halves, (8, 6), radius), halves, "radius {radius}");
        }
    }

    #[test]
    fn a_square_larger_than_the_image_is_the_whole_image() {
        assert_eq!(of(&[1, 2, 2], (3, 1), 20), [2, 2, 2]);
        assert_eq!(of(&[], (0, 0), 1), [0; 0]);
    }
}
