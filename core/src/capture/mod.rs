//! A capture: the labels of a phone photo, its camera, and the phone's rough pose (Lee & Hsu, §3.2–3.3, Eq. 1–4). The
//! pose may come from `capture.json`, from a receiver's NMEA log or from the photo's EXIF.

mod declination;
mod error;
mod exif;
mod fix;
mod ground;
mod load;
mod nmea;
mod nmea_sentence;
mod photo;
mod pose_file;
mod prior;
mod report;
mod rough;
#[cfg(test)]
mod tests;

pub use declination::declination_deg;
pub use error::CaptureError;
pub use exif::{ExifError, read_exif};
pub use fix::{Fix, Heading, North, SensedDatum, SensedHeight};
pub use load::Capture;
pub use nmea::{NMEA_REACH_S, NmeaError, NmeaLog, SentenceCounts};
pub use photo::{CapturePhoto, LabelledPhoto};
pub use pose_file::{GivenPose, read_given_pose, read_pose};
pub use report::{PriorOrigin, PriorReport};
pub use rough::{PriorSource, RoughCapture};
