//! CIELAB under D65 (CIE 15:2004) from sRGB (IEC 61966-2-1), and the colour difference of 1976.

/// A colour: lightness 0–100, green to red, blue to yellow.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lab([f64; 3]);

/// Rows give X, Y, Z of linear red, green and blue.
const XYZ_OF_RGB: [[f64; 3]; 3] = [
    [0.412_456_4, 0.357_576_1, 0.180_437_5],
    [0.212_672_9, 0.715_152_2, 0.072_175_0],
    [0.019_333_9, 0.119_192_0, 0.950_304_1],
];
/// The white of D65, 2° observer.
const WHITE: [f64; 3] = [0.950_47, 1.0, 1.088_83];

impl Lab {
    /// The colour of an sRGB pixel.
    pub fn of_srgb(colour: [u8; 3]) -> Self {
        let linear = colour.map(|value| {
            let value = f64::from(value) / 255.0;
            if value <= 0.040_45 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) }
        });
        let [x, y, z] = std::array::from_fn(|axis| {
            let sum: f64 = XYZ_OF_RGB[axis].iter().zip(linear).map(|(weight, value)| weight * value).sum();
            compressed(sum / WHITE[axis])
        });
        Self([116.0 * y - 16.0, 500.0 * (x - y), 200.0 * (y - z)])
    }
}

/// The cube root, with the straight piece near black.
fn compressed(ratio: f64) -> f64 {
    const KAPPA: f64 = 24_389.0 / 27.0;
    if ratio > 216.0 / 24_389.0 { ratio.cbrt() } else { (KAPPA * ratio + 16.0) / 116.0 }
}

/// ΔE*ab of 1976: the distance in CIELAB. About 2.3 is just noticeable.
pub fn delta_e(Lab(a): Lab, Lab(b): Lab) -> f64 {
    a.iter().zip(b).map(|(one, other)| (one - other).powi(2)).sum::<f64>().sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Values of B. Lindbloom's calculator for sRGB, D65.
    #[test]
    fn the_primaries_are_where_the_tables_have_them() {
        let known = [
            ([255, 0, 0], [53.2408, 80.0925, 67.2032]),
            ([0, 255, 0], [87.7347, -86.1827, 83.1793]),
            ([0, 0, 255], [32.2970, 79.1875, -107.8602]),
            ([255, 255, 255], [100.0, 0.0053, -0.0104]),
            ([0, 0, 0], [0.0, 0.0, 0.0]),
        ];
        for (colour, expected) in known {
            let off = delta_e(Lab::of_srgb(colour), Lab(expected));
            assert!(off < 0.02, "{colour:?} is {off} off");
        }
    }
}
