//! Where a receiver was at a time, from its NMEA 0183 log.

use super::fix::{Fix, GNSS_HEIGHT_SIGMA_M, Heading, SensedDatum, SensedHeight, believed_sigma_m};
use super::nmea_sentence::{Gga, Gst, Line, Position, Sentence, Skip, read_line};
use jiff::Timestamp;
use jiff::civil::Date;
use jiff::tz::TimeZone;

/// Furthest that a fix may be from the time that is asked for, and apart from its neighbour to interpolate, seconds.
pub const NMEA_REACH_S: f64 = 2.0;

/// 1σ in plan per unit of HDOP, metres: what code ranges are good to on a phone.
const SIGMA_PER_HDOP_M: f64 = 5.0;
/// What the geoid of an unknown receiver may be off, metres, 1σ: HKPD is itself 1.2 m below mean sea level.
const GEOID_SIGMA_M: f64 = 2.5;
const DAY_S: f64 = 86_400.0;

/// How many sentences of a log were read, and why others were not. Sound sentences of other kinds count nowhere.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct SentenceCounts {
    /// GGA, RMC, GST, HDT and HDM that were read.
    pub used: usize,
    /// Lines with a wrong checksum.
    pub bad_checksum: usize,
    /// Lines that are cut, not ASCII, or have a value that cannot be.
    pub malformed: usize,
    /// Sentences without a fix or value.
    pub empty: usize,
}

impl SentenceCounts {
    /// Lines that were passed over.
    pub fn skipped(&self) -> usize {
        self.bad_checksum + self.malformed + self.empty
    }
}

/// Why a log says nothing about a time.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum NmeaError {
    /// No fix at all.
    #[error(
        "expected GGA or RMC sentences with a fix, found none: {} sentences were read, {} lines skipped ({} with a bad \
         checksum, {} malformed, {} without a fix)",
        counts.used, counts.skipped(), counts.bad_checksum, counts.malformed, counts.empty
    )]
    NoFix {
        /// What there is.
        counts: SentenceCounts,
    },
    /// No fix near the time.
    #[error("expected a fix within {NMEA_REACH_S} s of {time}, the nearest is at {nearest}, {distance_s:.1} s away")]
    TooFar {
        /// The time that was asked for.
        time: Timestamp,
        /// The nearest fix.
        nearest: Timestamp,
        /// Between the two, seconds.
        distance_s: f64,
    },
}

/// A log: what was said at each time, in the order of the lines.
#[derive(Clone, Debug)]
pub struct NmeaLog {
    epochs: Vec<Epoch>,
    counts: SentenceCounts,
}

#[derive(Clone, Copy, Debug)]
struct Epoch {
    time_of_day_s: f64,
    date: Option<Date>,
    gga: Option<Gga>,
    rmc: Option<Position>,
    gst: Option<Gst>,
    heading: Option<Heading>,
}

impl Epoch {
    fn at(time_of_day_s: f64) -> Self {
        Self { time_of_day_s, date: None, gga: None, rmc: None, gst: None, heading: None }
    }

    fn fix(&self) -> Option<Fix> {
        let position = self.gga.map(|gga| gga.position).or(self.rmc)?;
        let by_hdop = || self.gga.and_then(|gga| gga.hdop).map(|hdop| hdop * SIGMA_PER_HDOP_M);
        let stated_m = self.gst.map(|gst| gst.plan_m).or_else(by_hdop);
        Some(Fix {
            latitude_deg: position.latitude_deg,
            longitude_deg: position.longitude_deg,
            position_sigma_m: stated_m.map(believed_sigma_m),
            height: self.gga.and_then(|gga| self.height(&gga)),
            heading: None,
            taken_at: None,
        })
    }

    fn height(&self, gga: &Gga) -> Option<SensedHeight> {
        let altitude_m = gga.altitude_m?;
        // Without carrier phases a receiver states the sigma of an open sky, whatever stands around it.
        let stated_m = self.gst.and_then(|gst| gst.height_m).filter(|_| gga.is_rtk);
        let sigma_m = stated_m.map_or(GNSS_HEIGHT_SIGMA_M, believed_height_sigma_m);
        Some(match gga.separation_m {
            Some(separation_m) => {
                SensedHeight { height_m: altitude_m + separation_m, datum: SensedDatum::Ellipsoid, sigma_m }
            }
            None => SensedHeight {
                height_m: altitude_m,
                datum: SensedDatum::SeaLevel,
                sigma_m: sigma_m.hypot(GEOID_SIGMA_M),
            },
        })
    }
}

/// Never better than a hand that holds a phone.
fn believed_height_sigma_m(stated_m: f64) -> f64 {
    stated_m.clamp(0.1, 1000.0)
}

impl NmeaLog {
    /// Reads a log. Lines that cannot be read are counted, never fatal.
    pub fn parse(text: &[u8]) -> Self {
        let (mut epochs, mut counts): (Vec<Epoch>, _) = (Vec::new(), SentenceCounts::default());
        // A heading before the first time belongs to that time.
        let mut early = None;
        for line in text.split(|byte| *byte == b'\n') {
            match read_line(line) {
                Line::Other => continue,
                Line::Skipped(Skip::Checksum) => counts.bad_checksum += 1,
                Line::Skipped(Skip::Malformed) => counts.malformed += 1,
                Line::Skipped(Skip::Empty) => counts.empty += 1,
                Line::Sentence(sentence) => {
                    counts.used += 1;
                    take(sentence, &mut epochs, &mut early);
                }
            }
        }
        Self { epochs, counts }
    }

    /// How many sentences were read and skipped.
    pub fn counts(&self) -> SentenceCounts {
        self.counts
    }

    /// Where the receiver was at `time`: between two fixes at most [`NMEA_REACH_S`] apart, else the nearest one within
    /// as much. A log without dates is taken to be of the day of `time`.
    pub fn fix_at(&self, time: Timestamp) -> Result<Fix, NmeaError> {
        let at_s = time.as_nanosecond() as f64 / 1e9;
        let times_s = self.times_s(at_s);
        let fixes = self.track(&times_s, Epoch::fix);
        let Some(near) = near(&fixes, at_s) else { return Err(NmeaError::NoFix { counts: self.counts }) };
        let mut fix = match near {
            Near::One(fix) => fix,
            Near::Between(a, b, part) => between(&a, &b, part),
            Near::TooFar(nearest_s) => {
                let nearest = Timestamp::from_microsecond((nearest_s * 1e6) as i64).unwrap_or(time);
                return Err(NmeaError::TooFar { time, nearest, distance_s: (nearest_s - at_s).abs() });
            }
        };
        fix.taken_at = Some(time);
        fix.heading = heading_near(&self.track(&times_s, |epoch| epoch.heading), at_s);
        Ok(fix)
    }

    /// What the epochs say of one thing, in the order of time.
    fn track<T>(&self, times_s: &[f64], said: impl Fn(&Epoch) -> Option<T>) -> Vec<(f64, T)> {
        let epochs = self.epochs.iter().zip(times_s);
        let mut track: Vec<(f64, T)> = epochs.filter_map(|(epoch, at)| Some((*at, said(epoch)?))).collect();
        track.sort_by(|a, b| a.0.total_cmp(&b.0));
        track
    }

    /// Time of every epoch, seconds since 1970. An epoch without a date is on the day of the one before it, or a day
    /// off where the clock jumps by more than half a day.
    fn times_s(&self, at_s: f64) -> Vec<f64> {
        let anchors: Vec<Option<f64>> = self.epochs.iter().map(|epoch| epoch.date.and_then(midnight_s)).collect();
        let mut days_s = Vec::with_capacity(self.epochs.len());
        let mut previous: Option<(f64, f64)> = None;
        for (epoch, anchor) in self.epochs.iter().zip(&anchors) {
            let carried = previous.map_or(0.0, |(day_s, of_day_s)| day_s + rollover_s(of_day_s, epoch.time_of_day_s));
            let day_s = anchor.unwrap_or(carried);
            previous = Some((day_s, epoch.time_of_day_s));
            days_s.push(day_s);
        }
        // What comes before the first date has been carried from zero: shift it to meet that date.
        let first = anchors.iter().position(Option::is_some);
        let shift_s = match first {
            Some(0) => 0.0,
            Some(first) => {
                let [before, after] = [&self.epochs[first - 1], &self.epochs[first]];
                days_s[first] - rollover_s(before.time_of_day_s, after.time_of_day_s) - days_s[first - 1]
            }
            None => self.nearest_day_s(&days_s, at_s),
        };
        let undated = first.unwrap_or(self.epochs.len());
        for day_s in &mut days_s[..undated] {
            *day_s += shift_s;
        }
        self.epochs.iter().zip(days_s).map(|(epoch, day_s)| day_s + epoch.time_of_day_s).collect()
    }

    /// The day to begin a log without dates on, so that it comes as near to the time as it can.
    fn nearest_day_s(&self, days_s: &[f64], at_s: f64) -> f64 {
        let day_s = |epoch: &Epoch, day_s: &f64| ((at_s - day_s - epoch.time_of_day_s) / DAY_S).round() * DAY_S;
        let miss_s = |epoch: &Epoch, day: &f64| (at_s - day - epoch.time_of_day_s - day_s(epoch, day)).abs();
        let nearest = self.epochs.iter().zip(days_s).min_by(|a, b| miss_s(a.0, a.1).total_cmp(&miss_s(b.0, b.1)));
        nearest.map_or(0.0, |(epoch, day)| day_s(epoch, day))
    }
}

/// Puts a sentence into the epoch of its time, which is the last one or a new one.
fn take(sentence: Sentence, epochs: &mut Vec<Epoch>, early: &mut Option<Heading>) {
    let time_of_day_s = match &sentence {
        Sentence::Gga { time_of_day_s, .. }
        | Sentence::Rmc { time_of_day_s, .. }
        | Sentence::Gst { time_of_day_s, .. } => *time_of_day_s,
        Sentence::Heading(heading) => {
            match epochs.last_mut() {
                Some(epoch) => epoch.heading = Some(*heading),
                None => *early = Some(*heading),
            }
            return;
        }
    };
    if epochs.last().is_none_or(|last| (last.time_of_day_s - time_of_day_s).abs() > 1e-3) {
        epochs.push(Epoch { heading: early.take(), ..Epoch::at(time_of_day_s) });
    }
    let Some(epoch) = epochs.last_mut() else { return };
    match sentence {
        Sentence::Gga { gga, .. } => epoch.gga = Some(gga),
        Sentence::Rmc { position, date, .. } => (epoch.rmc, epoch.date) = (Some(position), date.or(epoch.date)),
        Sentence::Gst { gst, .. } => epoch.gst = Some(gst),
        Sentence::Heading(_) => {}
    }
}

/// Seconds from the day of one time of day to that of the next in the log.
fn rollover_s(before_s: f64, after_s: f64) -> f64 {
    if after_s < before_s - DAY_S / 2.0 {
        DAY_S
    } else if after_s > before_s + DAY_S / 2.0 {
        -DAY_S
    } else {
        0.0
    }
}

/// Midnight UTC at the beginning of a day, seconds since 1970.
fn midnight_s(date: Date) -> Option<f64> {
    let midnight = date.to_zoned(TimeZone::UTC).ok()?;
    Some(midnight.timestamp().as_second() as f64)
}

enum Near<T> {
    One(T),
    /// Two, and how far the time is from the first to the second, 0 to 1.
    Between(T, T, f64),
    TooFar(f64),
}

/// What is said about a time; `said` is in the order of time.
fn near<T: Copy>(said: &[(f64, T)], at_s: f64) -> Option<Near<T>> {
    let after = said.partition_point(|(time_s, _)| *time_s < at_s);
    let (before, after) = (after.checked_sub(1).and_then(|index| said.get(index)), said.get(after));
    if let (Some((from_s, a)), Some((to_s, b))) = (before, after) {
        let apart_s = to_s - from_s;
        if apart_s > 0.0 && apart_s <= NMEA_REACH_S {
            return Some(Near::Between(*a, *b, (at_s - from_s) / apart_s));
        }
    }
    let distance_s = |(time_s, _): &&(f64, T)| (time_s - at_s).abs();
    let nearest = before.into_iter().chain(after).min_by(|a, b| distance_s(a).total_cmp(&distance_s(b)))?;
    let is_near = distance_s(&nearest) <= NMEA_REACH_S;
    Some(if is_near { Near::One(nearest.1) } else { Near::TooFar(nearest.0) })
}

fn between(a: &Fix, b: &Fix, part: f64) -> Fix {
    let mix = |a: f64, b: f64| a + (b - a) * part;
    let nearer = if part < 0.5 { a } else { b };
    // The short way, also over the antimeridian.
    let east_deg = (b.longitude_deg - a.longitude_deg + 180.0).rem_euclid(360.0) - 180.0;
    let height = match (a.height, b.height) {
        (Some(a), Some(b)) if a.datum == b.datum => Some(SensedHeight {
            height_m: mix(a.height_m, b.height_m),
            datum: a.datum,
            sigma_m: a.sigma_m.max(b.sigma_m),
        }),
        _ => nearer.height.or(a.height).or(b.height),
    };
    Fix {
        latitude_deg: mix(a.latitude_deg, b.latitude_deg),
        longitude_deg: (a.longitude_deg + east_deg * part + 180.0).rem_euclid(360.0) - 180.0,
        position_sigma_m: a.position_sigma_m.into_iter().chain(b.position_sigma_m).reduce(f64::max),
        height,
        ..*nearer
    }
}

fn heading_near(headings: &[(f64, Heading)], at_s: f64) -> Option<Heading> {
    match near(headings, at_s)? {
        Near::One(heading) => Some(heading),
        Near::Between(a, b, part) if a.north == b.north => {
            let turn_deg = (b.heading_deg - a.heading_deg + 180.0).rem_euclid(360.0) - 180.0;
            Some(Heading { heading_deg: (a.heading_deg + turn_deg * part).rem_euclid(360.0), north: a.north })
        }
        Near::Between(a, b, part) => Some(if part < 0.5 { a } else { b }),
        Near::TooFar(_) => None,
    }
}
