//! Numbers and names as people read them.

/// A number with as many digits as say something: four that count, at most three behind the point.
pub fn number(value: f64) -> String {
    if !value.is_finite() || value.abs() > 1e12 {
        return "beyond measure".to_owned();
    }
    let whole_digits = value.abs().max(1.0).log10().floor() as i32 + 1;
    let decimals = (4 - whole_digits).clamp(0, 3) as usize;
    let text = format!("{value:.decimals$}");
    let text = if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.') } else { &text };
    minus(text)
}

/// A number with its unit; a ratio and a count have none.
pub fn with_unit(value: f64, unit: &str) -> String {
    match unit {
        "ratio" | "count" | "" => number(value),
        "deg" => format!("{}°", number(value)),
        unit => format!("{} {unit}", number(value)),
    }
}

/// A coordinate, to the centimetre, with thin spaces between thousands.
pub fn coordinate(value: f64) -> String {
    let text = format!("{value:.2}");
    let (whole, decimals) = text.split_once('.').unwrap_or((&text, "00"));
    let (sign, digits) = whole.strip_prefix('-').map_or(("", whole), |digits| ("−", digits));
    let mut grouped = String::new();
    for (index, digit) in digits.chars().enumerate() {
        if index > 0 && (digits.len() - index).is_multiple_of(3) {
            grouped.push('\u{202f}');
        }
        grouped.push(digit);
    }
    format!("{sign}{grouped}.{decimals}")
}

/// A difference with its sign, to `decimals`.
pub fn signed(value: f64, decimals: usize) -> String {
    minus(&format!("{value:+.decimals$}"))
}

/// A count with its noun.
pub fn counted(count: usize, one: &str, several: &str) -> String {
    match count {
        0 => format!("no {several}"),
        1 => format!("1 {one}"),
        count => format!("{count} {several}"),
    }
}

fn minus(text: &str) -> String {
    text.replacen('-', "−", 1)
}

/// What a requirement asks for, in a sentence; `None` for one that this program does not know.
pub fn requirement(name: &str) -> Option<&'static str> {
    Some(match name {
        "captured-entirely" => "the whole of it must be in the photo, hidden by nothing nearer",
        "within-range" => "all of it must be near enough to be measured",
        "uncertain" => "its place must be known well enough",
        "coplanar" => "it must be flat",
        "rectangle" => "it must be a rectangle and fill it",
        "ground-contact" => "the ground it stands on must be in the map",
        "size" => "it must be as large as its class is",
        "predefined-size" => "its class must have a size",
        "class" => "its class must be one that is mapped",
        "already-on-map" => "the map has it already, where it is",
        "nothing-to-remove" => "the map must have one of its class within reach",
        "on-a-descriptor" => "the map must have a descriptor there",
        "removed-once" => "one descriptor can be removed once",
        _ => return None,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_keep_the_digits_that_count() {
        let cases =
            [(0.85, "0.85"), (12.345_6, "12.35"), (1234.5, "1234"), (0.000_4, "0"), (-2.5, "−2.5"), (50.0, "50")];
        for (value, text) in cases {
            assert_eq!(number(value), text);
        }
        assert_eq!(number(f64::MAX), "beyond measure");
        assert_eq!(with_unit(1.5, "deg"), "1.5°");
        assert_eq!(with_unit(0.25, "m"), "0.25 m");
    }

    #[test]
    fn coordinates_are_grouped_by_thousands() {
        assert_eq!(coordinate(835_680.126), "835\u{202f}680.13");
        assert_eq!(coordinate(-12.3), "−12.30");
        assert_eq!(coordinate(4.2), "4.20");
    }
}
