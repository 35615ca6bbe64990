//! A capture: the labels of a phone photo, its camera, and the phone's rough pose (Lee & Hsu, §3.2–3.3, Eq. 1–4).

mod error;
mod load;
mod pose_file;
mod prior;

pub use error::CaptureError;
pub use load::Capture;
pub use pose_file::read_pose;
pub use prior::prior_from_file;
