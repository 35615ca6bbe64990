//! Files of the repository, and Rust text with comments, strings or tests blanked out. Line numbers never move.

use std::fs;
use std::path::{Path, PathBuf};

/// One text file.
#[derive(Clone, Debug, PartialEq)]
pub struct Source {
    /// Path from the repository's root, with `/`.
    pub path: String,
    /// Its text.
    pub text: String,
}

impl Source {
    /// A file made up for a self-test.
    pub fn sample(path: &str, text: &str) -> Self {
        Self { path: path.to_owned(), text: text.to_owned() }
    }

    /// Whether it is Rust.
    pub fn is_rust(&self) -> bool {
        self.path.ends_with(".rs")
    }

    /// Whether all of it is test code.
    pub fn is_test(&self) -> bool {
        let in_tests = self.path.starts_with("tests/") || self.path.contains("/tests/");
        in_tests || self.path.ends_with("/tests.rs") || self.path.ends_with("_tests.rs")
    }

    /// Whether its path begins with one of `places`.
    pub fn is_in(&self, places: &[&str]) -> bool {
        places.iter().any(|place| self.path.starts_with(place))
    }
}

/// The repository's root.
pub fn root() -> PathBuf {
    PathBuf::from(env!("CARGO_MANIFEST_DIR"))
}

/// Every text file of the repository but build outputs, by path.
pub fn all() -> Vec<Source> {
    let mut found = Vec::new();
    collect(&root(), "", &mut found);
    found.sort_by(|a, b| a.path.cmp(&b.path));
    found
}

fn collect(directory: &Path, prefix: &str, found: &mut Vec<Source>) {
    const SKIPPED: [&str; 5] = [".git", "target", "out", "node_modules", "Cargo.lock"];
    for entry in fs::read_dir(directory).expect("a readable directory") {
        let entry = entry.expect("a readable entry");
        let name = entry.file_name().to_string_lossy().into_owned();
        let path = format!("{prefix}{name}");
        if SKIPPED.contains(&name.as_str()) {
            continue;
        }
        if entry.path().is_dir() {
            collect(&entry.path(), &format!("{path}/"), found);
        } else if let Ok(text) = fs::read_to_string(entry.path()) {
            found.push(Source { path, text });
        }
    }
}

/// What is blanked.
#[derive(Clone, Copy, PartialEq)]
enum Kind {
    Code,
    Comment,
    Text,
}

/// The text without comments.
pub fn without_comments(text: &str) -> String {
    blank(text, |kind| kind == Kind::Comment)
}

/// The text without comments and without what stands in string and character literals.
pub fn code(text: &str) -> String {
    blank(text, |kind| kind != Kind::Code)
}

/// Blanks everything under `#[cfg(test)]`; the ranges are found in the code alone.
pub fn without_tests(text: &str) -> String {
    let code = code(text);
    let mut bytes = text.as_bytes().to_vec();
    let mut from = 0;
    while let Some(start) = code[from..].find("#[cfg(test)]").map(|at| from + at) {
        let end = item_end(&code, start + "#[cfg(test)]".len());
        for byte in &mut bytes[start..end] {
            if *byte != b'\n' {
                *byte = b' ';
            }
        }
        from = end;
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// One past the item that begins at `start`: its `;` or its closing brace.
fn item_end(code: &str, start: usize) -> usize {
    let mut depth = 0_u32;
    for (at, byte) in code.bytes().enumerate().skip(start) {
        match byte {
            b';' if depth == 0 => return at + 1,
            b'{' => depth += 1,
            b'}' if depth <= 1 => return at + 1,
            b'}' => depth -= 1,
            _ => {}
        }
    }
    code.len()
}

fn blank(text: &str, is_blanked: fn(Kind) -> bool) -> String {
    let mut out = Vec::with_capacity(text.len());
    let bytes = text.as_bytes();
    let mut at = 0;
    while at < bytes.len() {
        let (kind, end) = token(bytes, at);
        for &byte in &bytes[at..end] {
            out.push(if is_blanked(kind) && byte != b'\n' { b' ' } else { byte });
        }
        at = end;
    }
    String::from_utf8_lossy(&out).into_owned()
}

/// Kind and end of the comment, literal or single byte that begins at `at`.
fn token(bytes: &[u8], at: usize) -> (Kind, usize) {
    let rest = &bytes[at..];
    let starts_word = at == 0 || !(bytes[at - 1].is_ascii_alphanumeric() || bytes[at - 1] == b'_');
    match rest {
        [b'/', b'/', ..] => (Kind::Comment, find(bytes, at, b"\n").unwrap_or(bytes.len())),
        [b'/', b'*', ..] => (Kind::Comment, block_comment_end(bytes, at)),
        [b'"', ..] => (Kind::Text, string_end(bytes, at + 1)),
        [b'\'', b'\\', _, ..] => (Kind::Text, find(bytes, at + 3, b"'").map_or(bytes.len(), |end| end + 1)),
        [b'\'', ..] => {
            // A character is as many bytes as its first one says; a lifetime has no quote after it.
            let width = match rest.get(1) {
                Some(0xf0..) => 4,
                Some(0xe0..) => 3,
                Some(0xc0..) => 2,
                _ => 1,
            };
            if rest.get(1 + width) == Some(&b'\'') { (Kind::Text, at + width + 2) } else { (Kind::Code, at + 1) }
        }
        [b'r', b'"' | b'#', ..] if starts_word => raw_string(bytes, at, at + 1),
        [b'b', b'r', b'"' | b'#', ..] if starts_word => raw_string(bytes, at, at + 2),
        _ => (Kind::Code, at + 1),
    }
}

fn find(bytes: &[u8], from: usize, what: &[u8]) -> Option<usize> {
    bytes.get(from..)?.windows(what.len()).position(|window| window == what).map(|at| from + at)
}

fn block_comment_end(bytes: &[u8], start: usize) -> usize {
    let (mut depth, mut at) = (0_u32, start);
    while at + 1 < bytes.len() {
        match &bytes[at..at + 2] {
            b"/*" => (depth, at) = (depth + 1, at + 2),
            b"*/" if depth == 1 => return at + 2,
            b"*/" => (depth, at) = (depth - 1, at + 2),
            _ => at += 1,
        }
    }
    bytes.len()
}

fn string_end(bytes: &[u8], mut at: usize) -> usize {
    while at < bytes.len() {
        match bytes[at] {
            b'\\' => at += 2,
            b'"' => return at + 1,
            _ => at += 1,
        }
    }
    bytes.len()
}

fn raw_string(bytes: &[u8], start: usize, mut at: usize) -> (Kind, usize) {
    let hashes = bytes[at..].iter().take_while(|&&byte| byte == b'#').count();
    at += hashes;
    if bytes.get(at) != Some(&b'"') {
        return (Kind::Code, start + 1);
    }
    let close: Vec<u8> = std::iter::once(b'"').chain(std::iter::repeat_n(b'#', hashes)).collect();
    (Kind::Text, find(bytes, at + 1, &close).map_or(bytes.len(), |end| end + close.len()))
}

/// Line numbers (from 1) at which `word` stands between non-word characters.
pub fn lines_with_word(text: &str, word: &str) -> Vec<usize> {
    let is_word = |byte: Option<&u8>| byte.is_some_and(|byte| byte.is_ascii_alphanumeric() || *byte == b'_');
    let holds = |line: &str| {
        let bytes = line.as_bytes();
        line.match_indices(word).any(|(at, _)| {
            let before = at.checked_sub(1).and_then(|before| bytes.get(before));
            let ends_open = !is_word(word.as_bytes().last());
            !is_word(before) && (ends_open || !is_word(bytes.get(at + word.len())))
        })
    };
    text.lines().enumerate().filter(|(_, line)| holds(line)).map(|(index, _)| index + 1).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn comments_and_literals_are_told_from_code() {
        let text = "let a = \"unsafe // no\"; // unsafe\nlet c = '\"'; /* unsafe /* x */ */ unsafe fn f<'a>() {}\n";
        assert_eq!(lines_with_word(&code(text), "unsafe"), [2]);
        assert!(without_comments(text).contains("unsafe // no") && !without_comments(text).contains("/*"));
    }

    #[test]
    fn raw_strings_hide_their_quotes() {
        let text = "let a = r#\"one \" two\"#; let b = 1;";
        assert_eq!(code(text).split_whitespace().collect::<Vec<_>>().join(" "), "let a = ; let b = 1;");
    }

    #[test]
    fn modules_of_tests_are_blanked_and_what_follows_stays() {
        let text =
            "fn a() {}\n#[cfg(test)]\nmod tests { fn b() { \"}\"; } }\nfn c() {}\n#[cfg(test)]\nmod x;\nfn d() {}\n";
        let left = without_tests(text);
        assert!(!left.contains("fn b") && left.contains("fn c") && !left.contains("mod x") && left.contains("fn d"));
        assert_eq!(left.lines().count(), text.lines().count());
    }

    #[test]
    fn a_word_is_not_found_inside_another() {
        assert_eq!(lines_with_word("unsafe_code\nunsafe {", "unsafe"), [2]);
        assert_eq!(lines_with_word("eprintln!(x)\nprintln!(x)", "println!"), [2]);
    }
}
