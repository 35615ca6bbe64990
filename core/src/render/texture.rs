//! Classes of label textures: nearest texel, never blended.

use crate::mesh::{LabelTexture, Wrap};
use resurvey_schema::ClassId;

/// Class of the texel at (u, v): column floor(u·width), row floor(v·height) from the top, wrapped as the texture says;
/// void where a coordinate is not finite or the texture is empty.
pub fn texel_class(texture: &LabelTexture, u: f32, v: f32) -> ClassId {
    let labels = &texture.labels;
    match (texel(texture.wrap_u, u, labels.width()), texel(texture.wrap_v, v, labels.height())) {
        (Some(column), Some(row)) => ClassId(labels.at(column, row)),
        _ => ClassId::VOID,
    }
}

/// Texel of `coordinate` in a row of `size`.
fn texel(wrap: Wrap, coordinate: f32, size: u32) -> Option<u32> {
    if !coordinate.is_finite() || size == 0 {
        return None;
    }
    let share = match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Clamp => coordinate,
        Wrap::Mirror => 1.0 - (coordinate.rem_euclid(2.0) - 1.0).abs(),
    };
    // A share a rounding below zero becomes 1.0 in `Repeat`; `as` saturates, which is what `Clamp` needs.
    Some(((share * size as f32) as u32).min(size - 1))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::image::LabelImage;

    fn classes(wrap: Wrap, coordinates: &[f32]) -> Vec<u8> {
        let labels = LabelImage::from_values(4, 1, vec![10, 11, 12, 13]).unwrap();
        let texture = LabelTexture { name: String::new(), labels, wrap_u: wrap, wrap_v: Wrap::Clamp };
        coordinates.iter().map(|&u| texel_class(&texture, u, 0.5).0).collect()
    }

    #[test]
    fn a_texel_covers_its_share_of_the_texture_up_to_its_right_edge() {
        assert_eq!(classes(Wrap::Clamp, &[0.0, 0.249_99, 0.25, 0.5, 0.75, 0.999_99]), [10, 10, 11, 12, 13, 13]);
    }

    #[test]
    fn outside_0_to_1_the_wrap_rule_decides() {
        assert_eq!(classes(Wrap::Repeat, &[1.0, 1.3, -0.1, -1e-9, 7.6]), [10, 11, 13, 13, 12]);
        assert_eq!(classes(Wrap::Clamp, &[1.0, 1.3, -0.1, -7.0]), [13, 13, 10, 10]);
        assert_eq!(classes(Wrap::Mirror, &[1.1, 1.3, -0.1, -0.3, 2.1]), [13, 12, 10, 11, 10]);
    }

    #[test]
    fn coordinates_that_are_not_numbers_are_void() {
        assert_eq!(classes(Wrap::Repeat, &[f32::NAN, f32::INFINITY]), [255, 255]);
    }

    #[test]
    fn the_first_row_is_the_top() {
        let labels = LabelImage::from_values(1, 2, vec![1, 2]).unwrap();
        let texture = LabelTexture { name: String::new(), labels, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat };
        assert_eq!(texel_class(&texture, 0.5, 0.1), ClassId(1));
        assert_eq!(texel_class(&texture, 0.5, 0.9), ClassId(2));
    }
}
