//! Standard output, which never stops the work: what could not be written is said when the work is done.

use std::io::{self, ErrorKind, Write};

/// A stream that remembers its first failure; what is written after that is dropped.
pub struct Output<'a> {
    out: &'a mut dyn Write,
    failed: Option<io::Error>,
}

impl<'a> Output<'a> {
    /// Of `out`.
    pub fn new(out: &'a mut dyn Write) -> Self {
        Self { out, failed: None }
    }

    /// Writes what is still held back, and gives what failed. A reader that went away is no failure: it has what it wanted.
    pub fn finish(mut self) -> io::Result<()> {
        self.flush()?;
        self.failed.filter(|error| error.kind() != ErrorKind::BrokenPipe).map_or(Ok(()), Err)
    }

    /// What was done, unless the stream failed now or before.
    fn attempt<T>(&mut self, work: impl Fn(&mut dyn Write) -> io::Result<T>, dropped: T) -> io::Result<T> {
        if self.failed.is_some() {
            return Ok(dropped);
        }
        match work(self.out) {
            Err(error) if error.kind() != ErrorKind::Interrupted => {
                self.failed = Some(error);
                Ok(dropped)
            }
            other => other,
        }
    }
}

impl Write for Output<'_> {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        self.attempt(|out| out.write(bytes), bytes.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        self.attempt(|out| out.flush(), ())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A stream that takes some bytes and then fails.
    struct Limited {
        left: usize,
        how: ErrorKind,
    }

    impl Write for Limited {
        fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
            let taken = bytes.len().min(self.left);
            self.left -= taken;
            if taken == 0 { Err(self.how.into()) } else { Ok(taken) }
        }

        fn flush(&mut self) -> io::Result<()> {
            Ok(())
        }
    }

    #[test]
    fn a_stream_that_fails_is_written_to_the_end_and_tells_its_first_failure() {
        let told = |how| {
            let mut out = Limited { left: 3, how };
            let mut output = Output::new(&mut out);
            for _ in 0..3 {
                output.write_all(b"two").unwrap();
            }
            output.finish().map_err(|error| error.kind())
        };
        assert_eq!(told(ErrorKind::StorageFull), Err(ErrorKind::StorageFull));
        assert_eq!(told(ErrorKind::BrokenPipe), Ok(()));
    }
}
