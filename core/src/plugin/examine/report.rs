//! The file through which a trial's process tells what it does, so that the last line says where it ended.

use super::finding::Finding;
use std::fs::File;
use std::io::Write;
use std::time::Duration;

/// What a call is doing, written as it goes; the end of the process may come at any line.
#[derive(Debug)]
pub struct Report(File);

/// How the process of a trial ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum How {
    /// By itself, with this code.
    Exited(i32),
    /// By this signal.
    Signalled(i32),
    /// It was ended after this time.
    TimedOut(Duration),
}

/// All that is left of the process of a trial.
#[derive(Clone, Debug)]
pub struct Ended {
    /// How it ended.
    pub how: How,
    /// Its report.
    pub report: String,
    /// What it wrote to standard output; nobody should.
    pub output: String,
    /// What it wrote to standard error.
    pub messages: String,
}

impl Report {
    /// A report into `file`, which is empty.
    pub fn new(file: File) -> Self {
        Self(file)
    }

    /// Says what comes next, such as "in score".
    pub(super) fn step(&self, step: &str) {
        self.line(&["step", step]);
    }

    /// Says how it ended.
    pub(super) fn end(&self, finding: &Finding) {
        match finding {
            Finding::Passed(note) => self.line(&["passed", note]),
            Finding::Failed { problem, advice } => self.line(&["failed", problem, advice]),
            Finding::NotApplicable(why) => self.line(&["not-applicable", why]),
        }
    }

    /// The file, for whoever can no longer use more than its number.
    #[cfg(unix)]
    pub(super) fn file(&self) -> &File {
        &self.0
    }

    fn line(&self, words: &[&str]) {
        let words: Vec<String> = words.iter().map(|word| word.replace(['\n', '\r', '\t'], " ")).collect();
        // Where the report cannot be written the parent says that the process ended without one.
        let _ = (&self.0).write_all(format!("{}\n", words.join("\t")).as_bytes());
    }
}

impl Ended {
    /// What came out.
    pub fn finding(&self) -> Finding {
        let step = self.last("step").map_or("before the first call", |words| words[0]);
        if let Some([what, how]) = self.last("fault").as_deref() {
            let advice = match *how {
                "used after the call" => "copy what you need: whatever comes in is lent for the length of the call",
                "written to" => "inputs are read-only: copy before you change",
                _ => "stay inside width, height, row_bytes and the size at the start of each struct",
            };
            return Finding::failed(format!("{what} was {how} ({step})"), advice);
        }
        let verdict = self.verdict();
        match (&self.how, verdict) {
            (How::Exited(0), Some(finding)) => self.with_noise(finding),
            (_, Some(finding @ Finding::Failed { .. })) => finding,
            (how, Some(_)) => self.broken_off(how, "after the last call, when the process ended"),
            (how, None) => self.broken_off(how, step),
        }
    }

    /// A trial that went well is spoilt by what should not have been printed.
    fn with_noise(&self, finding: Finding) -> Finding {
        if matches!(finding, Finding::Failed { .. }) {
            return finding;
        }
        if let Some(line) = self.messages.lines().find(|line| line.contains("panicked")) {
            return Finding::failed(line.trim(), "a destructor has nobody to tell: make it one that cannot fail");
        }
        match self.output.lines().next() {
            None => finding,
            Some(line) => Finding::failed(
                format!("standard output has {line:?}, which belongs to the program's results"),
                "log through the services, or write to standard error",
            ),
        }
    }

    fn broken_off(&self, how: &How, step: &str) -> Finding {
        let last_words = self
            .messages
            .lines()
            .rev()
            .find(|line| !line.trim().is_empty() && !line.to_lowercase().contains("backtrace"));
        let said = last_words.map_or_else(String::new, |line| format!(": {}", line.trim()));
        match how {
            How::Exited(code) => Finding::failed(
                format!("ended the whole process with exit code {code} {step}{said}"),
                "never call exit: return a status, and write the reason into the error",
            ),
            How::Signalled(signal) => {
                let (name, advice) = signal_words(*signal);
                Finding::failed(format!("ended the whole process with signal {signal} ({name}) {step}{said}"), advice)
            }
            How::TimedOut(limit) => Finding::failed(
                format!("did not return within {} s {step}", limit.as_secs_f64()),
                "end every loop; where the work is long, look at cancelled() and give a bound",
            ),
        }
    }

    fn verdict(&self) -> Option<Finding> {
        let word = |words: &[&str], index: usize| words.get(index).copied().unwrap_or_default().to_owned();
        let passed = self.last("passed").map(|words| Finding::Passed(word(&words, 0)));
        let failed = self.last("failed").map(|words| Finding::failed(word(&words, 0), word(&words, 1)));
        failed.or(passed).or_else(|| self.last("not-applicable").map(|words| Finding::NotApplicable(word(&words, 0))))
    }

    /// The words after `key` in its last whole line.
    fn last(&self, key: &str) -> Option<Vec<&str>> {
        let whole = self.report.rfind('\n').map_or("", |end| &self.report[..end]);
        whole.lines().rev().find_map(|line| words_of(line, key))
    }
}

fn words_of<'a>(line: &'a str, key: &str) -> Option<Vec<&'a str>> {
    let mut words = line.split('\t');
    (words.next() == Some(key)).then(|| words.collect()).filter(|words: &Vec<&str>| !words.is_empty())
}

fn signal_words(signal: i32) -> (&'static str, &'static str) {
    match signal {
        4 => ("illegal instruction", "build it for this processor, without -march=native"),
        6 => ("abort", "let no exception or panic leave a function, and check what malloc gives"),
        7 | 10 => ("bus error", "stay inside width, height and row_bytes of each image"),
        8 => ("arithmetic error", "look for a division by zero"),
        9 => ("killed", "use less memory: the limit of a check is --memory-limit"),
        11 => ("segmentation fault", "stay inside the images and check pointers for null"),
        _ => ("by the system", "run it in a debugger"),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn ended(how: How, report: &str) -> Ended {
        Ended { how, report: report.to_owned(), output: String::new(), messages: String::new() }
    }

    fn problem(ended: &Ended) -> String {
        match ended.finding() {
            Finding::Failed { problem, .. } => problem,
            other => panic!("expected a failure, found {other:?}"),
        }
    }

    #[test]
    fn a_process_that_ends_without_a_verdict_failed_where_the_last_whole_line_says() {
        let report = "step\tin create\nstep\tin score\nstep\tin dest";
        assert_eq!(problem(&ended(How::Exited(0), report)), "ended the whole process with exit code 0 in score");
        let killed = Ended { messages: "one\nlast words\n".into(), ..ended(How::Signalled(6), report) };
        assert_eq!(problem(&killed), "ended the whole process with signal 6 (abort) in score: last words");
        let limit = Duration::from_millis(1500);
        assert_eq!(problem(&ended(How::TimedOut(limit), report)), "did not return within 1.5 s in score");
        assert!(problem(&ended(How::Exited(3), "")).ends_with("exit code 3 before the first call"));
    }

    #[test]
    fn a_verdict_counts_when_the_process_ends_well_and_quietly() {
        let passed = ended(How::Exited(0), "step\tin score\npassed\tscore 1\n");
        assert_eq!(passed.finding(), Finding::Passed("score 1".into()));
        let loud = Ended { output: "hello\n".into(), ..passed.clone() };
        assert!(problem(&loud).contains("standard output has \"hello\""));
        let panicked = Ended { messages: "plugin x panicked in destroy: no\n".into(), ..passed.clone() };
        assert_eq!(problem(&panicked), "plugin x panicked in destroy: no");
        let crashed = Ended { how: How::Signalled(11), ..passed };
        assert!(problem(&crashed).ends_with("after the last call, when the process ended"));
    }

    #[test]
    fn a_fault_on_lent_memory_comes_before_all_else() {
        let report = "step\tin score\nfault\tphoto\twritten to\n";
        assert_eq!(problem(&ended(How::Exited(98), report)), "photo was written to (in score)");
    }

    #[test]
    fn a_text_with_line_breaks_stays_one_line_of_the_report() {
        let file = tempfile::NamedTempFile::new().unwrap();
        let finding = Finding::failed("one\ntwo\tthree", "do\nit");
        Report::new(file.reopen().unwrap()).end(&finding);
        let report = std::fs::read_to_string(file.path()).unwrap();
        assert_eq!(ended(How::Exited(0), &report).finding(), Finding::failed("one two three", "do it"));
    }
}
