//! Scoring many views in another process: while it scores one batch, the host fills the next.

use super::apart::{Apart, no_memory};
use super::lending::{first, view_bytes};
use super::link::{Handled, Link, Turn};
use crate::image::LabelImage;
use crate::plugin::check;
use crate::plugin::error::PluginError;
use crate::plugin::input::ViewImages;
use crate::plugin::kinds::MakeView;
use crate::plugin::lend;
use resurvey_schema::service::ViewFeature;
use resurvey_schema::wire::{Array, Dtype, ScoreCall, ToPlugin, WireViews};

/// Bytes of the views of one batch: few enough to stay in the cache of a core, so many that a message costs little.
const BATCH_BYTES: usize = 2 << 20;
/// Views of a batch at most.
const MOST_VIEWS: usize = 64;
/// Batches that are filled or scored at a time.
const HALVES: usize = 2;

impl Apart {
    /// Scores of `count` views against `photo`, in order.
    pub(in super::super) fn scores(
        &mut self,
        photo: &LabelImage,
        count: usize,
        view: &mut MakeView<'_>,
        cancelled: &dyn Fn() -> bool,
    ) -> Result<Vec<f64>, PluginError> {
        let plugin = self.name();
        self.with_link(|link| {
            let mut run = Run::new(link, (&plugin, cancelled), photo)?;
            let outcome = run.all(count, view);
            if outcome.is_err() {
                run.settle();
            }
            outcome.map(|()| run.scores)
        })
    }
}

/// Batches in flight.
struct Run<'a> {
    link: &'a mut Link,
    plugin: &'a str,
    cancelled: &'a dyn Fn() -> bool,
    size: (u32, u32),
    photo: Array,
    /// Where the batches begin in the memory.
    mark: usize,
    places: Option<Places>,
    /// The half that is being filled, and how many views it has.
    half: usize,
    filled: usize,
    /// Views that were sent and not yet answered, of each half.
    sent: [usize; HALVES],
    scores: Vec<f64>,
}

/// Memory for the batches of one table of features.
struct Places {
    halves: [(WireViews, Array); HALVES],
    capacity: usize,
    table: Vec<ViewFeature>,
}

impl<'a> Run<'a> {
    fn new(
        link: &'a mut Link,
        (plugin, cancelled): (&'a str, &'a dyn Fn() -> bool),
        photo: &LabelImage,
    ) -> Result<Self, PluginError> {
        link.lending.start();
        let size = (photo.width(), photo.height());
        let photo = link.lending.raster(photo).map_err(|error| no_memory(plugin, &error))?;
        let mark = link.lending.mark();
        let (places, sent) = (None, [0; HALVES]);
        let scores = Vec::new();
        Ok(Self { link, plugin, cancelled, size, photo, mark, places, half: 0, filled: 0, sent, scores })
    }

    /// Takes one view; `left` are to come with it.
    fn add(&mut self, view: &ViewImages<'_>, left: usize) -> Result<(), PluginError> {
        if let Some(text) = lend::view_conflict(self.size, view) {
            return Err(PluginError::InvalidInput { plugin: self.plugin.to_owned(), text });
        }
        if self.places.as_ref().is_none_or(|places| places.table != view.feature_table) {
            self.submit()?;
            self.drain()?;
            self.places = Some(self.make_places(view.feature_table, left)?);
        }
        let Some(places) = &self.places else { return Ok(()) };
        let (capacity, views) = (places.capacity, &places.halves[self.half].0);
        self.link.lending.put_view(views, self.filled, view);
        self.filled += 1;
        if self.filled == capacity {
            self.submit()?;
            // The next view goes to the other half: its scores have to be read before.
            self.collect(self.half)?;
        }
        Ok(())
    }

    /// Scores every view.
    fn all(&mut self, count: usize, view: &mut MakeView<'_>) -> Result<(), PluginError> {
        for index in 0..count {
            let mut outcome = Ok(());
            view(index, &mut |images| outcome = self.add(images, count - index));
            outcome?;
        }
        self.submit()?;
        self.drain()
    }

    /// Hears out what was sent before an error, so that the next call does not take it for its own.
    fn settle(&mut self) {
        for half in [self.half, (self.half + 1) % HALVES] {
            let count = std::mem::take(&mut self.sent[half]);
            if count > 0 && !self.link.is_dead() {
                let _ = self.link.conclude(Turn::scoring(count, self.cancelled), |_, _| Handled::OutOfTurn);
            }
        }
    }

    fn make_places(&mut self, table: &[ViewFeature], left: usize) -> Result<Places, PluginError> {
        let lending = &mut self.link.lending;
        lending.back_to(self.mark);
        let capacity = (BATCH_BYTES / view_bytes(self.size)).clamp(1, MOST_VIEWS).min(left);
        let mut half = || -> std::io::Result<(WireViews, Array)> {
            Ok((lending.reserve_views(capacity, self.size, table)?, lending.reserve(Dtype::F64, &[capacity])?))
        };
        let halves = half().and_then(|one| Ok([one, half()?])).map_err(|error| no_memory(self.plugin, &error))?;
        Ok(Places { halves, capacity, table: table.to_vec() })
    }

    /// Sends the half that is being filled and turns to the other.
    fn submit(&mut self) -> Result<(), PluginError> {
        let Some(places) = self.places.as_ref().filter(|_| self.filled > 0) else { return Ok(()) };
        let (views, scores) = &places.halves[self.half];
        // A plugin that leaves its place alone has not answered.
        self.link.lending.memory.write(scores.offset, &vec![f64::NAN; self.filled]);
        let call = ScoreCall {
            memory: self.link.lending.memory.bytes(),
            photo: self.photo.clone(),
            views: first(views, self.filled),
            scores: Array { shape: vec![self.filled], ..scores.clone() },
        };
        self.link.send(&ToPlugin::Score(call), &Turn::steady("score"))?;
        self.sent[self.half] = std::mem::take(&mut self.filled);
        self.half = (self.half + 1) % HALVES;
        Ok(())
    }

    /// Waits for the answer to a half that was sent.
    fn collect(&mut self, half: usize) -> Result<(), PluginError> {
        let count = std::mem::take(&mut self.sent[half]);
        let Some(places) = self.places.as_ref().filter(|_| count > 0) else { return Ok(()) };
        self.link.conclude(Turn::scoring(count, self.cancelled), |_, _| Handled::OutOfTurn)?;
        let mut scores = vec![f64::NAN; count];
        self.link.lending.memory.read_into(places.halves[half].1.offset, &mut scores);
        for score in &scores {
            check::ratio("score", *score).map_err(|check::Violation { field, value, expected }| {
                PluginError::InvalidOutput { plugin: self.plugin.to_owned(), call: "score", field, value, expected }
            })?;
        }
        self.scores.extend(scores);
        Ok(())
    }

    /// Waits for all that was sent, the older first.
    fn drain(&mut self) -> Result<(), PluginError> {
        self.collect(self.half)?;
        self.collect((self.half + 1) % HALVES)
    }
}
