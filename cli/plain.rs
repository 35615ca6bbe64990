//! Text of others on a terminal: what could break a line, or steer the terminal, is written as an escape.

use std::borrow::Cow;

/// `text` on one line.
pub fn plain(text: &str) -> Cow<'_, str> {
    escaped(text, steers)
}

/// `text` on the lines that it has.
pub fn plain_lines(text: &str) -> Cow<'_, str> {
    escaped(text, |character| character != '\n' && steers(character))
}

fn escaped(text: &str, is_escaped: impl Fn(char) -> bool) -> Cow<'_, str> {
    if !text.contains(&is_escaped) {
        return Cow::Borrowed(text);
    }
    let mut plain = String::with_capacity(text.len() + 8);
    for character in text.chars() {
        if is_escaped(character) {
            plain.extend(character.escape_default());
        } else {
            plain.push(character);
        }
    }
    Cow::Owned(plain)
}

/// Control characters, line and paragraph separators, and what turns the direction of writing around.
fn steers(character: char) -> bool {
    character.is_control() || matches!(character, '\u{2028}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_steers_a_terminal_is_written_as_an_escape() {
        assert_eq!(plain("a\nb\tc\u{1b}[31m\u{9b}2J\u{202e}"), "a\\nb\\tc\\u{1b}[31m\\u{9b}2J\\u{202e}");
        assert_eq!(plain_lines("a\nb\r"), "a\nb\\r");
        assert!(matches!(plain("Straße 3, 街"), Cow::Borrowed("Straße 3, 街")));
    }
}
