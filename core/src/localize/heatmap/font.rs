//! A single-stroke alphabet for labels on a drawing, made for this project.
//!
//! A letter is one or more lines through points; a point is two digits in base 36, across then down, so `"0c40"` runs
//! from (0, 12) to (4, 0). Capitals stand from 0 to 12, small letters from 4; 16 is the depth of `g`.

use super::canvas::Point;

/// Height of a capital, in the units of the points.
pub(super) const CAPITAL_UNITS: f64 = 12.0;

/// Gap between letters, in the units of the points.
pub(super) const GAP_UNITS: f64 = 3.6;

/// Width of a space, in the units of the points, its gap not counted.
const SPACE_UNITS: f64 = 3.0;

/// Width of a digit: all stand in one column.
const DIGIT_UNITS: f64 = 6.0;

/// What stands for a letter that the alphabet lacks.
const UNKNOWN: &str = "00606c0c00";

/// The lines and the width of `letter`, in units.
pub(super) fn glyph(letter: char) -> (Vec<Vec<Point>>, f64) {
    if letter.is_whitespace() {
        return (Vec::new(), SPACE_UNITS);
    }
    let strokes = LETTERS.iter().find(|(known, _)| *known == letter).map_or(UNKNOWN, |(_, strokes)| *strokes);
    let lines: Vec<Vec<Point>> = strokes.split(' ').map(points).collect();
    let right = lines.iter().flatten().map(|point| point[0]).fold(0.0, f64::max);
    (lines, if letter.is_ascii_digit() { DIGIT_UNITS } else { right })
}

fn points(line: &str) -> Vec<Point> {
    let value = |letter: char| f64::from(letter.to_digit(36).unwrap_or(0));
    let values: Vec<f64> = line.chars().map(value).collect();
    values.chunks_exact(2).map(|pair| [pair[0], pair[1]]).collect()
}

/// Every letter with its lines.
#[rustfmt::skip]
const LETTERS: [(char, &str); 103] = [
    ('!', "0008 0c"), ('"', "0003 3033"), ('#', "202c 606c 0484 0888"),
    ('$', "72502002042656787a5c2c0a 303c"), ('%', "800c 102031322313020110 69798a8b7c6c5b5a69"),
    ('&', "8c131120405153080a2c4c78"), ('\'', "0003"), ('(', "30030b3e"), (')', "00333b0e"),
    ('*', "3036 0165 6105"), ('+', "3339 0666"), (',', "1b1c0e"), ('-', "0747"), ('.', "0c"), ('/', "600c"),
    ('0', "2040626a4c2c0a0220"), ('1', "12303c"), ('2', "02204062640c6c"), ('3', "02204062644626 46686a4c2c0a"),
    ('4', "4c400969"), ('5', "60100545676a4c2c0a"), ('6', "5030040a2c4c6a68462608"), ('7', "00602c"),
    ('8', "204062644626040220 46686a4c2c0a0826"), ('9', "1c3c686240200204264664"),
    (':', "05 0c"), (';', "15 1b1c0e"), ('<', "62076c"), ('=', "0565 0969"), ('>', "02670c"),
    ('?', "02204062633638 3c"), ('@', "7c2c0a02207092987968644435384968"),
    ('A', "0c408c 1979"), ('B', "000c 005072745606 56787a5c0c"), ('C', "725020020a2c5c7a"), ('D', "000c4c79734000"),
    ('E', "60000c6c 0656"), ('F', "60000c 0656"), ('G', "725020020a2c5c7a7747"), ('H', "000c 707c 0676"),
    ('I', "202c 0040 0c4c"), ('J', "505a3c2c0a"), ('K', "000c 7007 347c"), ('L', "000c6c"), ('M', "0c0047808c"),
    ('N', "0c007c70"), ('O', "2060828a6c2c0a0220"), ('P', "0c005072755707"), ('Q', "2060828a6c2c0a0220 588c"),
    ('R', "0c005072755707 377c"), ('S', "72502002042656787a5c2c0a"), ('T', "0080 404c"), ('U', "000a2c5c7a70"),
    ('V', "004c80"), ('W', "002c528ca0"), ('X', "007c 700c"), ('Y', "004680 464c"), ('Z', "00700c7c"),
    ('[', "30000e3e"), ('\\', "006c"), (']', "00303e0e"), ('^', "043064"), ('_', "0e6e"), ('`', "0022"),
    ('a', "664424060a2c4c6a 646c"), ('b', "000c 062444666a4c2c0a"), ('c', "664424060a2c4c6a"),
    ('d', "606c 664424060a2c4c6a"), ('e', "0868664424060a2c5c"), ('f', "5030222c 0444"),
    ('g', "664424060a2c4c6a 646e4g1g"), ('h', "000c 062444666c"), ('i', "040c 01"), ('j', "242e1g0g 21"),
    ('k', "000c 6409 276c"), ('l', "000b1c2c"), ('m', "040c 051434454c 455474858c"), ('n', "040c 062444666c"),
    ('o', "2444666a4c2c0a0624"), ('p', "040g 062444666a4c2c0a"), ('q', "646g 664424060a2c4c6a"), ('r', "040c 062444"),
    ('s', "65541405071858696b5c1c0b"), ('t', "212a3c5c 0454"), ('u', "040a2c4c6a 646c"), ('v', "043c64"),
    ('w', "042c456c84"), ('x', "046c 640c"), ('y', "043c 643c2e1g0g"), ('z', "04640c6c"),
    ('{', "40212507292d4e"), ('|', "000e"), ('}', "00212547292d0e"), ('~', "08264866"),
    ('°', "103041433414030110"), ('±', "3238 0565 0b6b"), ('×', "046a 640a"), ('·', "07"), ('–', "0767"), ('—', "0797"),
    ('…', "0c 4c 8c"), ('→', "07a7 74a77a"), ('σ', "2444666a4c2c0a0624 2484"),
];

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_printable_ascii_letter_has_lines_of_its_own() {
        for letter in ('!'..='~').chain("°±×σ…→".chars()) {
            assert_eq!(LETTERS.iter().filter(|(known, _)| *known == letter).count(), 1, "{letter}");
            let (lines, width) = glyph(letter);
            assert!(lines.iter().flatten().all(|[x, y]| (0.0..=12.0).contains(x) && (0.0..=16.0).contains(y)));
            assert!(!lines.is_empty() && (0.0..=10.0).contains(&width), "{letter}");
        }
    }

    #[test]
    fn every_line_is_pairs_of_base_36_digits() {
        for (letter, strokes) in LETTERS {
            for line in strokes.split(' ') {
                let is_pairs = line.len() >= 2 && line.len() % 2 == 0 && line.chars().all(|digit| digit.is_digit(36));
                assert!(is_pairs, "{letter}: {line}");
            }
        }
    }

    #[test]
    fn all_digits_are_equally_wide() {
        assert!(('0'..='9').all(|digit| (glyph(digit).1 - DIGIT_UNITS).abs() < 1e-9));
    }
}
