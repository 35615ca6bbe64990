//! Re-alignment: which differences a small shift of the view explains. A class that the view has within the tolerance
//! of a pixel may well belong there, so its appearance at the pixel is no evidence of a change.

/// For every pixel with `asked`, whether `labels` has the pixel's `photo` class within its tolerance; `false` elsewhere.
pub fn explained(photo: &[u8], labels: &[u8], tolerance_px: &[u8], width: usize, asked: &[bool]) -> Vec<bool> {
    let mut wanted = [false; 256];
    for (class, _) in photo.iter().zip(asked).filter(|(_, asked)| **asked) {
        wanted[usize::from(*class)] = true;
    }
    let mut found = vec![false; photo.len()];
    let mut distance = Vec::new();
    for class in (0..=255u8).filter(|class| wanted[usize::from(*class)]) {
        vertical_distance(labels, width, class, &mut distance);
        for (row, start) in (0..photo.len()).step_by(width.max(1)).enumerate() {
            let distance = &distance[start..start + width];
            for column in 0..width {
                let index = row * width + column;
                if asked[index] && photo[index] == class {
                    found[index] = is_within(distance, column, u32::from(tolerance_px[index]));
                }
            }
        }
    }
    found
}

/// Rows to the nearest pixel of `class` in the same column, at most 255.
fn vertical_distance(labels: &[u8], width: usize, class: u8, distance: &mut Vec<u8>) {
    distance.clear();
    distance.extend(labels.iter().map(|label| if *label == class { 0 } else { u8::MAX }));
    for start in (width..labels.len()).step_by(width.max(1)) {
        let (above, here) = distance.split_at_mut(start);
        for (here, above) in here.iter_mut().zip(&above[start - width..]) {
            *here = (*here).min(above.saturating_add(1));
        }
    }
    for start in (width..labels.len()).step_by(width.max(1)).rev() {
        let (here, below) = distance.split_at_mut(start);
        for (here, below) in here[start - width..].iter_mut().zip(below) {
            *here = (*here).min(below.saturating_add(1));
        }
    }
}

fn is_within(distance: &[u8], column: usize, radius_px: u32) -> bool {
    let squared = radius_px * radius_px;
    let reaches = |at: usize, across: u32| {
        let down = u32::from(distance[at]);
        down * down + across * across <= squared
    };
    (0..=radius_px).any(|across| {
        let (left, right) = (column.checked_sub(across as usize), column + across as usize);
        left.is_some_and(|left| reaches(left, across)) || (right < distance.len() && reaches(right, across))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_class_is_explained_exactly_within_the_tolerance_disk() {
        let (width, height) = (21, 21);
        let mut labels = vec![0u8; width * height];
        labels[10 * width + 10] = 1;
        let photo = vec![1u8; width * height];
        let found = explained(&photo, &labels, &vec![5; width * height], width, &vec![true; width * height]);
        for (index, found) in found.into_iter().enumerate() {
            let (across, down) = (index % width, index / width);
            assert_eq!(found, across.abs_diff(10).pow(2) + down.abs_diff(10).pow(2) <= 25, "at {across}, {down}");
        }
    }
}
