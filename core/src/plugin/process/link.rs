//! The host's end of the wire to one process.

use super::child::Child;
use super::lending::Lending;
use super::wire::{Silence, Wire};
use crate::plugin::error::PluginError;
use resurvey_schema::wire::{Invalid, ToHost, ToPlugin, WireLocalization};
use std::time::{Duration, Instant};

/// Time that a plugin has from a cancel to its return; the header asks for 200 ms.
const CANCEL_LIMIT: Duration = Duration::from_secs(2);
/// A call with all that the host does in it may take so many times the limit of the plugin's own time.
const WITH_SERVICES: u32 = 10;

/// A live process and what the host knows of it.
#[derive(Debug)]
pub(super) struct Link {
    pub(super) lending: Lending,
    wire: Wire,
    child: Child,
    about: About,
    is_dead: bool,
}

/// Whom to name, and what is allowed.
#[derive(Clone, Debug)]
pub(super) struct About {
    pub(super) plugin: String,
    pub(super) call_limit: Duration,
}

/// One call of the host, while it lasts.
pub(super) struct Turn<'a> {
    call: &'static str,
    started: Instant,
    /// What the plugin took of it.
    own: Duration,
    /// `scored` of the memory when the clock was last set back.
    scored: u32,
    /// How often the plugin may yet set it back.
    set_backs: usize,
    cancelled: &'a dyn Fn() -> bool,
    cancelled_at: Option<Instant>,
}

impl<'a> Turn<'a> {
    pub(super) fn new(call: &'static str, cancelled: &'a dyn Fn() -> bool) -> Self {
        let (started, own) = (Instant::now(), Duration::ZERO);
        Self { call, started, own, scored: 0, set_backs: 0, cancelled, cancelled_at: None }
    }

    /// Scoring so many views: the limits are those of one.
    pub(super) fn scoring(views: usize, cancelled: &'a dyn Fn() -> bool) -> Self {
        Self { set_backs: views, ..Self::new("score", cancelled) }
    }

    /// A call that nobody cancels.
    pub(super) fn steady(call: &'static str) -> Self {
        Self::new(call, &|| false)
    }
}

/// What the host says to a message that does not end the call.
pub(super) enum Handled {
    /// This.
    Reply(Box<ToPlugin>),
    /// Nothing: the message asks for nothing.
    Noted,
    /// The message has no place in this call.
    OutOfTurn,
}

impl Link {
    pub(super) fn new(child: Child, wire: Wire, lending: Lending, about: About) -> Self {
        Self { lending, wire, child, about, is_dead: false }
    }

    /// Whether the process was ended.
    pub(super) fn is_dead(&self) -> bool {
        self.is_dead
    }

    /// Says the first line of a call, or the answer to a request.
    pub(super) fn send(&mut self, message: &ToPlugin, turn: &Turn<'_>) -> Result<(), PluginError> {
        let (started, limit) = (Instant::now(), self.about.call_limit);
        match self.wire.send(message, || started.elapsed() < limit) {
            Ok(()) => Ok(()),
            Err(Silence::Waiting) => Err(self.timed_out(turn.call)),
            Err(_) => Err(self.crashed(turn.call)),
        }
    }

    /// The next message.
    pub(super) fn next(&mut self, turn: &mut Turn<'_>) -> Result<ToHost, PluginError> {
        let (mut seen, mut has_left) = (Instant::now(), false);
        loop {
            let heard = self.wire.receive();
            turn.own += seen.elapsed();
            seen = Instant::now();
            match heard {
                // Who has the wire from the process, such as one that it has started, keeps it open after its end; what
                // the process itself said before is heard by now.
                Err(Silence::Waiting) if has_left => return Err(self.crashed(turn.call)),
                Ok(_) | Err(Silence::Waiting) => self.check_limits(turn)?,
                Err(Silence::Ended) => return Err(self.crashed(turn.call)),
                Err(Silence::Garbage { found, reason }) => {
                    return Err(self.garbled(turn.call, &format!("a message ({reason})"), &found));
                }
            }
            if let Ok(message) = heard {
                return Ok(message);
            }
            has_left = self.child.has_left();
        }
    }

    /// Hears the plugin out until its call is done; `handle` does what it asks for.
    pub(super) fn conclude(
        &mut self,
        mut turn: Turn<'_>,
        mut handle: impl FnMut(&mut Lending, &ToHost) -> Handled,
    ) -> Result<Option<Box<WireLocalization>>, PluginError> {
        let (plugin, call) = (self.about.plugin.clone(), turn.call);
        loop {
            let message = self.next(&mut turn)?;
            match message {
                // What is done after a cancel may be done by half.
                ToHost::Done { .. } | ToHost::Failed { .. } if (turn.cancelled)() => {
                    return Err(PluginError::Cancelled { plugin, call });
                }
                ToHost::Done { localization } => return Ok(localization),
                ToHost::Cancelled {} => return Err(PluginError::Cancelled { plugin, call }),
                ToHost::Failed { text } => return Err(PluginError::Failed { plugin, call, text }),
                ToHost::Panicked { text } => {
                    self.end();
                    return Err(PluginError::Panicked { plugin, call, text });
                }
                ToHost::Invalid(Invalid { field, value, expected }) => {
                    return Err(PluginError::InvalidOutput { plugin, call, field, value, expected });
                }
                ToHost::Hello(_) | ToHost::Refused(_) => return Err(self.out_of_turn(call, &message)),
                request => match handle(&mut self.lending, &request) {
                    Handled::Reply(reply) => self.send(&reply, &turn)?,
                    Handled::Noted => {}
                    Handled::OutOfTurn => return Err(self.out_of_turn(call, &request)),
                },
            }
        }
    }

    /// Ends the process of a plugin that takes too long, or does not hear that it is to end.
    fn check_limits(&mut self, turn: &mut Turn<'_>) -> Result<(), PluginError> {
        let scored = self.lending.memory.scored();
        if scored != turn.scored && turn.set_backs > 0 {
            turn.set_backs -= 1;
            turn.scored = scored;
            turn.own = Duration::ZERO;
            turn.started = Instant::now();
        }
        if turn.cancelled_at.is_none() && (turn.cancelled)() {
            self.lending.memory.set_cancelled(true);
            turn.cancelled_at = Some(Instant::now());
        }
        if turn.cancelled_at.is_some_and(|at| at.elapsed() > CANCEL_LIMIT) {
            self.end();
            return Err(PluginError::Cancelled { plugin: self.about.plugin.clone(), call: turn.call });
        }
        let limit = self.about.call_limit;
        if turn.own > limit || turn.started.elapsed() > limit.saturating_mul(WITH_SERVICES) {
            return Err(self.timed_out(turn.call));
        }
        Ok(())
    }

    fn end(&mut self) {
        self.is_dead = true;
        self.child.end();
    }

    fn timed_out(&mut self, call: &'static str) -> PluginError {
        self.end();
        let limit_s = self.about.call_limit.as_secs_f64();
        PluginError::TimedOut { plugin: self.about.plugin.clone(), call, limit_s }
    }

    fn crashed(&mut self, call: &'static str) -> PluginError {
        self.is_dead = true;
        PluginError::Crashed { plugin: self.about.plugin.clone(), call, how: self.child.autopsy() }
    }

    fn garbled(&mut self, call: &'static str, expected: &str, found: &str) -> PluginError {
        self.end();
        let found = format!("{found}{}", self.child.last_words());
        PluginError::Garbled { plugin: self.about.plugin.clone(), call, expected: expected.to_owned(), found }
    }

    /// A message that does not belong here.
    pub(super) fn out_of_turn(&mut self, call: &'static str, message: &ToHost) -> PluginError {
        let text = serde_json::to_string(message).unwrap_or_default();
        let beginning: String = text.chars().take(80).collect();
        self.garbled(call, "a message that belongs to this call", &beginning)
    }
}
