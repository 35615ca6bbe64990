//! Lines of JSON over a socket.

use resurvey_schema::wire::LONGEST_LINE;
use rustix::io::Errno;
use rustix::net::{RecvFlags, recv};
use serde::Serialize;
use serde::de::DeserializeOwned;
use std::io::{self, Read, Write};
use std::os::unix::net::UnixStream;
use std::time::{Duration, Instant};

/// A turn of waiting, after which whoever waits looks around.
const SLICE: Duration = Duration::from_millis(20);
/// How long to look for what comes at once before sleeping: to be woken takes longer than most answers.
const EAGER: Duration = Duration::from_micros(30);
/// Bytes of a bad line that a message shows.
const SHOWN: usize = 80;

/// One end of the wire.
#[derive(Debug)]
pub(super) struct Wire {
    stream: UnixStream,
    /// What was read lies from `start` to `end`.
    buffer: Vec<u8>,
    start: usize,
    end: usize,
    /// Bytes after `start` that have no line end.
    searched: usize,
    out: Vec<u8>,
    /// Bytes of the longest line that is read.
    longest: usize,
}

/// Why no message came.
#[derive(Debug)]
pub(super) enum Silence {
    /// Nothing yet.
    Waiting,
    /// The other side is gone.
    Ended,
    /// Something else came: its beginning, and what is wrong with it.
    Garbage { found: String, reason: String },
}

impl Wire {
    /// The host's end: reads and writes never block for long, and lines are no longer than a plugin's may be.
    pub(super) fn impatient(stream: UnixStream) -> io::Result<Self> {
        stream.set_read_timeout(Some(SLICE))?;
        stream.set_write_timeout(Some(SLICE))?;
        Ok(Self { longest: LONGEST_LINE, ..Self::patient(stream) })
    }

    /// A plugin's end: it waits, and takes whatever the host has to say.
    pub(super) fn patient(stream: UnixStream) -> Self {
        Self { stream, buffer: Vec::new(), start: 0, end: 0, searched: 0, out: Vec::new(), longest: usize::MAX }
    }

    /// Sends one message; `wait` says whether to go on when the other side does not read.
    pub(super) fn send(&mut self, message: &impl Serialize, mut wait: impl FnMut() -> bool) -> Result<(), Silence> {
        self.out.clear();
        serde_json::to_writer(&mut self.out, message).map_err(|_| Silence::Ended)?;
        self.out.push(b'\n');
        let mut sent = 0;
        while sent < self.out.len() {
            match self.stream.write(&self.out[sent..]) {
                Ok(0) => return Err(Silence::Ended),
                Ok(bytes) => sent += bytes,
                Err(error) if is_pause(&error) && wait() => {}
                Err(error) if is_pause(&error) => return Err(Silence::Waiting),
                Err(_) => return Err(Silence::Ended),
            }
        }
        Ok(())
    }

    /// The next message.
    pub(super) fn receive<M: DeserializeOwned>(&mut self) -> Result<M, Silence> {
        loop {
            let fresh = &self.buffer[self.start..self.end];
            if let Some(length) = fresh[self.searched..].iter().position(|byte| *byte == b'\n') {
                let line = &fresh[..self.searched + length];
                let message = serde_json::from_slice(line).map_err(|error| garbage(line, &error));
                self.start += line.len() + 1;
                self.searched = 0;
                return message;
            }
            self.searched = fresh.len();
            if fresh.len() >= self.longest {
                return Err(garbage(fresh, &format_args!("no line end in {} bytes", self.longest)));
            }
            self.fill()?;
        }
    }

    /// Reads what has come, at least one byte.
    fn fill(&mut self) -> Result<(), Silence> {
        const ROOM: usize = 4 << 10;
        self.buffer.copy_within(self.start..self.end, 0);
        (self.start, self.end) = (0, self.end - self.start);
        if self.buffer.len() < self.end + ROOM {
            self.buffer.resize(2 * (self.end + ROOM), 0);
        }
        match self.read() {
            Ok(0) if self.end > 0 => Err(garbage(&self.buffer[..self.end], &"the wire ended in the middle of a line")),
            Ok(0) => Err(Silence::Ended),
            Ok(bytes) => {
                self.end += bytes;
                Ok(())
            }
            Err(error) if is_pause(&error) => Err(Silence::Waiting),
            Err(_) => Err(Silence::Ended),
        }
    }

    fn read(&mut self) -> io::Result<usize> {
        let (began, room) = (Instant::now(), &mut self.buffer[self.end..]);
        loop {
            match recv(&self.stream, &mut *room, RecvFlags::DONTWAIT) {
                // Others that have work go first.
                Err(Errno::AGAIN) if began.elapsed() < EAGER => std::thread::yield_now(),
                Err(Errno::AGAIN) => return self.stream.read(room),
                read => return Ok(read?.1),
            }
        }
    }
}

fn is_pause(error: &io::Error) -> bool {
    use io::ErrorKind::{Interrupted, TimedOut, WouldBlock};
    matches!(error.kind(), WouldBlock | TimedOut | Interrupted)
}

fn garbage(line: &[u8], reason: &dyn std::fmt::Display) -> Silence {
    let found = shown(&line[..line.len().min(SHOWN)], line.len() > SHOWN);
    Silence::Garbage { found, reason: reason.to_string() }
}

/// Bytes of a plugin as a message may show them.
fn shown(bytes: &[u8], is_cut: bool) -> String {
    format!("{:?}{}", String::from_utf8_lossy(bytes), if is_cut { "…" } else { "" })
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::Value;

    fn pair() -> (Wire, UnixStream) {
        let (ours, theirs) = UnixStream::pair().unwrap();
        (Wire::impatient(ours).unwrap(), theirs)
    }

    #[test]
    fn lines_come_one_by_one_however_they_were_cut() {
        let (mut wire, mut other) = pair();
        other.write_all(b"{\"a\":1}\n{\"b\"").unwrap();
        assert_eq!(wire.receive::<Value>().unwrap(), serde_json::json!({"a": 1}));
        assert!(matches!(wire.receive::<Value>(), Err(Silence::Waiting)));
        other.write_all(b":2}\n").unwrap();
        assert_eq!(wire.receive::<Value>().unwrap(), serde_json::json!({"b": 2}));
        drop(other);
        assert!(matches!(wire.receive::<Value>(), Err(Silence::Ended)));
    }

    #[test]
    fn garbage_is_quoted_by_its_beginning() {
        let (mut wire, mut other) = pair();
        other.write_all(b"Loading the model \xff...\n").unwrap();
        let Err(Silence::Garbage { found, .. }) = wire.receive::<Value>() else { panic!("expected garbage") };
        assert_eq!(found, "\"Loading the model \u{fffd}...\"");
        other.write_all("x".repeat(200).as_bytes()).unwrap();
        drop(other);
        let Err(Silence::Garbage { found, reason }) = wire.receive::<Value>() else { panic!("expected garbage") };
        assert_eq!((found.len(), reason.as_str()), (80 + 2 + "…".len(), "the wire ended in the middle of a line"));
    }

    #[test]
    fn a_plugin_takes_a_line_of_the_host_however_long() {
        let (ours, theirs) = UnixStream::pair().unwrap();
        let long = "x".repeat(3 * LONGEST_LINE);
        let sent = long.clone();
        let host = std::thread::spawn(move || Wire::impatient(ours).unwrap().send(&sent, || true).unwrap());
        assert_eq!(Wire::patient(theirs).receive::<String>().unwrap(), long);
        host.join().unwrap();
    }

    #[test]
    fn a_line_without_end_is_given_up() {
        let (mut wire, mut other) = pair();
        let flood = std::thread::spawn(move || while other.write_all(&[b'x'; 4096]).is_ok() {});
        let outcome = loop {
            match wire.receive::<Value>() {
                Err(Silence::Waiting) => {}
                outcome => break outcome,
            }
        };
        assert!(matches!(outcome, Err(Silence::Garbage { .. })));
        drop(wire);
        flood.join().unwrap();
    }
}
