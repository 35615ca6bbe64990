//! What a plugin says during one call, as far as anyone would read it: one that logs in a loop fills nobody's memory.

use crate::plugin::services::Services;
use resurvey_schema::service::Level;

/// Lines of one call that are passed on.
const MOST_LINES: usize = 1000;
/// Bytes of these lines.
const MOST_BYTES: usize = 256 << 10;
/// Bytes of one line.
pub(super) const LONGEST_LINE: usize = 16 << 10;

/// Passes on the first lines of a call and counts the rest.
#[derive(Debug, Default)]
pub(super) struct CallLog {
    lines: usize,
    bytes: usize,
    left_out: u64,
}

impl CallLog {
    /// Takes one line.
    pub(super) fn take(&mut self, services: &dyn Services, level: Level, text: &str) {
        let text = cut(text, LONGEST_LINE);
        (self.lines, self.bytes) = (self.lines + 1, self.bytes + text.len());
        if self.lines > MOST_LINES || self.bytes > MOST_BYTES {
            self.left_out += 1;
        } else {
            services.log(level, text);
        }
    }

    /// Says how much was left out.
    pub(super) fn finish(self, services: &dyn Services) {
        if self.left_out > 0 {
            let kept = format!("a call may log {MOST_LINES} lines or {} KiB", MOST_BYTES >> 10);
            services.log(Level::Warning, &format!("{} more lines of the plugin are left out: {kept}", self.left_out));
        }
    }
}

/// The beginning of `text`, whole characters of at most `bytes` bytes.
pub(super) fn cut(text: &str, bytes: usize) -> &str {
    let end = (0..=bytes.min(text.len())).rev().find(|end| text.is_char_boundary(*end));
    &text[..end.unwrap_or(0)]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::plugin::photo_services::PhotoServices;
    use crate::plugin::services::Listener;
    use resurvey_schema::ClassTable;
    use std::sync::Mutex;

    #[derive(Default)]
    struct Heard(Mutex<Vec<String>>);

    impl Listener for Heard {
        fn log(&self, _: Level, text: &str) {
            self.0.lock().unwrap().push(text.to_owned());
        }
        fn progress(&self, _: f64) {}
        fn cancelled(&self) -> bool {
            false
        }
    }

    fn heard(lines: usize, text: &str) -> Vec<String> {
        let (heard, classes) = (Heard::default(), ClassTable::default());
        let services = PhotoServices::new(&classes, &heard);
        let mut log = CallLog::default();
        (0..lines).for_each(|_| log.take(&services, Level::Info, text));
        log.finish(&services);
        heard.0.into_inner().unwrap()
    }

    #[test]
    fn a_plugin_that_logs_in_a_loop_is_heard_up_to_a_limit_and_the_rest_is_counted() {
        assert_eq!(heard(1000, "a").len(), 1000);
        let many = heard(1_000_000, "a");
        assert_eq!(many.len(), 1001);
        let last = "999000 more lines of the plugin are left out: a call may log 1000 lines or 256 KiB";
        assert_eq!(many[1000], last);
        let long = heard(100, &"ü".repeat(1 << 20));
        assert_eq!((long.len(), long[0].len()), (17, 16 << 10));
        assert!(long[16].starts_with("84 more lines"), "{}", long[16]);
    }

    #[test]
    fn a_text_is_cut_between_characters() {
        assert_eq!((cut("aü", 2), cut("aü", 3), cut("", 3)), ("a", "aü", ""));
    }
}
