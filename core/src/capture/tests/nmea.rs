//! Where a receiver was at a time.

use crate::capture::{NmeaError, NmeaLog, SensedDatum, SentenceCounts};
use jiff::Timestamp;
use proptest::prelude::*;
use std::path::PathBuf;

/// The sentence with its checksum.
fn signed(body: &str) -> String {
    format!("${body}*{:02X}\r\n", body.bytes().fold(0, |sum, byte| sum ^ byte))
}

/// A fix at `hhmmss` with these minutes of latitude past 22° and the altitude.
fn gga(time: &str, minutes: f64, altitude_m: f64) -> String {
    signed(&format!("GPGGA,{time},22{minutes:08.5},N,11410.28770,E,1,09,1.4,{altitude_m:.1},M,-2.6,M,,"))
}

fn rmc(time: &str, date: &str) -> String {
    signed(&format!("GNRMC,{time},A,2218.00000,N,11410.28770,E,0.5,88.0,{date},,,A"))
}

fn time(text: &str) -> Timestamp {
    text.parse().unwrap()
}

/// Two fixes a second apart, one minute of latitude each.
fn two_seconds() -> String {
    rmc("022800.00", "010626")
        + &gga("022800.00", 18.0, 30.0)
        + &rmc("022801.00", "010626")
        + &gga("022801.00", 19.0, 31.0)
}

#[test]
fn between_two_fixes_the_position_is_interpolated() {
    let log = NmeaLog::parse(two_seconds().as_bytes());
    let fix = log.fix_at(time("2026-06-01T10:28:00.25+08:00")).unwrap();
    // Seconds since 1970 are good to 0.2 µs: a millimetre here.
    assert!((fix.latitude_deg - (22.0 + 18.25 / 60.0)).abs() < 1e-8, "{fix:?}");
    assert!((fix.longitude_deg - (114.0 + 10.2877 / 60.0)).abs() < 1e-9);
    // Altitude 30.25 m with the geoid 2.6 m below the ellipsoid.
    let height = fix.height.unwrap();
    assert!((height.height_m - 27.65).abs() < 1e-6 && height.datum == SensedDatum::Ellipsoid, "{height:?}");
    // HDOP 1.4, 5 m each.
    assert!((fix.position_sigma_m.unwrap() - 7.0).abs() < 1e-9);
    assert_eq!(fix.heading, None, "the course over ground is no heading");
    assert_eq!(log.counts(), SentenceCounts { used: 4, ..SentenceCounts::default() });
}

#[test]
fn outside_two_fixes_the_nearest_counts_for_two_seconds() {
    let log = NmeaLog::parse(two_seconds().as_bytes());
    for (at, minutes) in
        [("2026-06-01T02:27:58.5Z", 18.0), ("2026-06-01T02:28:02.5Z", 19.0), ("2026-06-01T02:28:01Z", 19.0)]
    {
        let fix = log.fix_at(time(at)).unwrap();
        assert!((fix.latitude_deg - (22.0 + minutes / 60.0)).abs() < 1e-9, "{at}: {fix:?}");
    }
    let message = log.fix_at(time("2026-06-01T02:28:11.5Z")).unwrap_err().to_string();
    assert!(message.contains("nearest is at 2026-06-01T02:28:01Z, 10.5 s away"), "{message}");
    // Further apart than 2 s there is nothing between them.
    let sparse = rmc("022800", "010626") + &gga("022800", 18.0, 30.0) + &gga("022805", 19.0, 30.0);
    let fix = NmeaLog::parse(sparse.as_bytes()).fix_at(time("2026-06-01T02:28:01.5Z")).unwrap();
    assert!((fix.latitude_deg - 22.3).abs() < 1e-9);
    assert!(matches!(
        NmeaLog::parse(sparse.as_bytes()).fix_at(time("2026-06-01T02:28:02.5Z")),
        Err(NmeaError::TooFar { .. })
    ));
}

#[test]
fn a_log_over_midnight_keeps_its_days_apart() {
    let dated = rmc("235959", "310526") + &gga("235959", 18.0, 30.0) + &gga("000000", 19.0, 30.0);
    let late = gga("235959", 18.0, 30.0) + &gga("000000", 19.0, 30.0) + &rmc("000001", "010626");
    let undated = gga("235959", 18.0, 30.0) + &gga("000000", 19.0, 30.0);
    for log in [dated, late, undated] {
        let fix = NmeaLog::parse(log.as_bytes()).fix_at(time("2026-05-31T23:59:59.5Z")).unwrap();
        assert!((fix.latitude_deg - (22.0 + 18.5 / 60.0)).abs() < 1e-9, "{log}: {fix:?}");
        let fix = NmeaLog::parse(log.as_bytes()).fix_at(time("2026-06-01T00:00:00Z")).unwrap();
        assert!((fix.latitude_deg - (22.0 + 19.0 / 60.0)).abs() < 1e-9, "{log}: {fix:?}");
    }
}

#[test]
fn a_log_with_a_date_is_of_that_day_alone() {
    let log = NmeaLog::parse(two_seconds().as_bytes());
    let message = log.fix_at(time("2026-06-02T02:28:00Z")).unwrap_err().to_string();
    assert!(message.contains("2026-06-01T02:28:01Z, 86399.0 s away"), "{message}");
}

#[test]
fn what_is_damaged_is_skipped_and_counted() {
    let good = two_seconds();
    let noise = "no sentence\n$GPGGA,02280\n\u{e9}$GPHDT,1,T*00\n".to_owned()
        + &good.replacen("2218", "2219", 1)
        + &signed("GPGGA,022759,,,,,0,00,99.9,,,,,,")
        + &good;
    let log = NmeaLog::parse(noise.as_bytes());
    let expected = SentenceCounts { used: 7, bad_checksum: 2, malformed: 2, empty: 1 };
    assert_eq!(log.counts(), expected);
    assert_eq!(log.counts().skipped(), 5);
    assert!(log.fix_at(time("2026-06-01T02:28:00Z")).is_ok());
    let message = NmeaLog::parse(b"$GPGGA,1").fix_at(time("2026-06-01T02:28:00Z")).unwrap_err().to_string();
    assert!(message.contains("0 sentences were read, 1 lines skipped"), "{message}");
}

#[test]
fn a_true_heading_is_turned_the_short_way() {
    let log = rmc("022800", "010626")
        + &gga("022800", 18.0, 30.0)
        + &signed("GNHDT,359.0,T")
        + &gga("022801", 19.0, 30.0)
        + &signed("GNHDT,3.0,T");
    let fix = NmeaLog::parse(log.as_bytes()).fix_at(time("2026-06-01T02:28:00.5Z")).unwrap();
    assert!((fix.heading.unwrap().heading_deg - 1.0).abs() < 1e-9, "{fix:?}");
}

#[test]
fn a_stated_error_wins_over_dilution_but_never_falls_below_three_metres() {
    let gst = |sigma: &str| signed(&format!("GPGST,022800,3.2,,,,{sigma},4.0"));
    let at = time("2026-06-01T02:28:00Z");
    let sigma = |log: String| NmeaLog::parse(log.as_bytes()).fix_at(at).unwrap();
    let fix = sigma(rmc("022800", "010626") + &gga("022800", 18.0, 30.0) + &gst("9.5,6.0"));
    assert_eq!(fix.position_sigma_m, Some(9.5));
    assert!(fix.height.unwrap().sigma_m > 10.0, "a code fix in a street is worse than it says");
    let fix = sigma(rmc("022800", "010626") + &gga("022800", 18.0, 30.0) + &gst("0.5,0.6"));
    assert_eq!(fix.position_sigma_m, Some(3.0));
    let rtk = gga("022800", 18.0, 30.0);
    let rtk = signed(&rtk[1..rtk.len() - 5].replace(",E,1,", ",E,4,"));
    let fix = sigma(rmc("022800", "010626") + &rtk + &signed("GPGST,022800,0.2,,,,0.01,0.01,0.02"));
    assert!(fix.height.unwrap().sigma_m <= 0.1, "{fix:?}");
}

#[test]
fn without_a_separation_the_altitude_is_above_sea_level() {
    let log = signed("GPGGA,022800,2218.0,N,11410.3,E,4,09,1.4,30.0,M,,,,");
    let height = NmeaLog::parse(log.as_bytes()).fix_at(time("2026-06-01T02:28:00Z")).unwrap().height.unwrap();
    assert_eq!((height.height_m, height.datum), (30.0, SensedDatum::SeaLevel));
}

#[test]
fn a_real_receivers_log_says_where_it_was() {
    let shared = std::env::var_os("RESURVEY_SHARED")
        .map_or_else(|| PathBuf::from(concat!(env!("CARGO_MANIFEST_DIR"), "/../../shared")), PathBuf::from);
    let Ok(text) = std::fs::read(shared.join("data/nmea/ublox-f9k.nmea")) else {
        eprintln!("SKIPPED: no {}/data/nmea/ublox-f9k.nmea", shared.display());
        return;
    };
    let log = NmeaLog::parse(&text);
    // Seven GGA and seven RMC, none damaged.
    assert_eq!(log.counts(), SentenceCounts { used: 14, ..SentenceCounts::default() });
    let fix = log.fix_at(time("2020-02-07T02:14:18.5Z")).unwrap();
    assert!((fix.latitude_deg - 37.426_393_667).abs() < 1e-7, "{fix:?}");
    assert!((fix.longitude_deg + 122.093_652_5).abs() < 1e-7);
    // 4.4 m above a geoid 30 m below the ellipsoid.
    assert!((fix.height.unwrap().height_m + 25.6).abs() < 1e-9);
}

proptest! {
    #[test]
    fn no_log_is_too_strange(
        noise in prop::collection::vec(any::<u8>(), 0..300),
        changes in prop::collection::vec((any::<prop::sample::Index>(), any::<u8>()), 0..20),
        times in prop::collection::vec(0_u32..240_000, 0..12),
        at in -2_000_000_000_i64..4_000_000_000,
    ) {
        let at = Timestamp::from_second(at).unwrap();
        let _ = NmeaLog::parse(&noise).fix_at(at);
        let mut text: Vec<u8> = times.iter().flat_map(|time| gga(&format!("{time:06}"), 18.0, 3.0).into_bytes()).collect();
        text.extend(two_seconds().into_bytes());
        for (at, value) in changes {
            let at = at.index(text.len());
            text[at] = value;
        }
        if let Ok(fix) = NmeaLog::parse(&text).fix_at(at) {
            prop_assert!(fix.latitude_deg.abs() <= 90.0 && fix.longitude_deg.abs() <= 180.0);
        }
    }

    #[test]
    fn the_day_of_a_log_without_dates_is_that_of_the_question(second in 0_i64..86_400, day in 0_i64..20_000) {
        let clock = format!("{:02}{:02}{:02}", second / 3600, second / 60 % 60, second % 60);
        let at = Timestamp::from_second(day * 86_400 + second).unwrap();
        let log = NmeaLog::parse(gga(&clock, 18.0, 3.0).as_bytes());
        prop_assert!(log.fix_at(at).is_ok());
    }
}
