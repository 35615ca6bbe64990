//! Exact Euclidean distance from the nearest marked pixel in linear time: lower envelopes of parabolas, along columns
//! and then rows (Felzenszwalb & Huttenlocher, Theory of Computing 2012).

/// Distance of each pixel from the nearest `marked` one, pixels; infinite where none is marked.
pub fn distances(marked: &[bool], width: usize) -> Vec<f32> {
    let height = marked.len() / width.max(1);
    let mut squares = along_columns(marked, width, height);
    let mut envelope = Envelope::default();
    let mut row = vec![0.0; width];
    for squares in squares.chunks_exact_mut(width.max(1)) {
        row.copy_from_slice(squares);
        envelope.lower(&row, squares);
    }
    squares.iter_mut().for_each(|square| *square = square.sqrt());
    squares
}

/// Squares of the distances along columns alone: of marks, one sweep down and one up are exact.
fn along_columns(marked: &[bool], width: usize, height: usize) -> Vec<f32> {
    let mut distances = vec![f32::INFINITY; marked.len()];
    for index in 0..marked.len() {
        let above = if index >= width { distances[index - width] + 1.0 } else { f32::INFINITY };
        distances[index] = if marked[index] { 0.0 } else { above };
    }
    for index in (0..(height.max(1) - 1) * width).rev() {
        distances[index] = distances[index].min(distances[index + width] + 1.0);
    }
    distances.iter_mut().for_each(|distance| *distance *= *distance);
    distances
}

/// The parabolas that are lowest somewhere, and from where on each is.
#[derive(Default)]
struct Envelope {
    parabolas: Vec<(f32, usize)>,
}

impl Envelope {
    /// For every place of a row the least of `heights[other] + (place - other)²`.
    fn lower(&mut self, heights: &[f32], lowest: &mut [f32]) {
        self.parabolas.clear();
        for (place, height) in heights.iter().enumerate().filter(|(_, height)| height.is_finite()) {
            let mut from = f32::NEG_INFINITY;
            while let Some(&(last_from, last)) = self.parabolas.last() {
                let (p, q) = (place as f32, last as f32);
                from = ((height + p * p) - (heights[last] + q * q)) / (2.0 * (p - q));
                if from > last_from {
                    break;
                }
                self.parabolas.pop();
                from = f32::NEG_INFINITY;
            }
            self.parabolas.push((from, place));
        }
        let mut parabolas = self.parabolas.iter().peekable();
        let mut current = None;
        for (place, lowest) in lowest.iter_mut().enumerate() {
            while let Some(next) = parabolas.next_if(|(from, _)| *from <= place as f32) {
                current = Some(next.1);
            }
            *lowest = current.map_or(f32::INFINITY, |other: usize| {
                let away = place as f32 - other as f32;
                heights[other] + away * away
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn distances_are_those_of_the_definition(marked in prop::collection::vec(prop::bool::weighted(0.06), 15 * 11)) {
            let width = 15;
            let at = |index: usize| ((index % width) as f64, (index / width) as f64);
            for (index, found) in distances(&marked, width).into_iter().enumerate() {
                let (u, v) = at(index);
                let away = |other: usize| (u - at(other).0).hypot(v - at(other).1);
                let marks = (0..marked.len()).filter(|other| marked[*other]);
                let expected = marks.map(away).fold(f64::INFINITY, f64::min);
                prop_assert!(expected.is_infinite() && found.is_infinite() || (expected - f64::from(found)).abs() < 1e-4);
            }
        }
    }

    #[test]
    fn an_image_without_pixels_has_no_distances() {
        assert_eq!(distances(&[], 0), Vec::<f32>::new());
        assert_eq!(distances(&[], 5), Vec::<f32>::new());
    }
}
