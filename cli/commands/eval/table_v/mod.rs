//! `resurvey eval table-v`: what an error of the pose does to a pedestrian on level ground and to a banner on a wall (Lee &
//! Hsu, Table V), through the detector and estimator of the run.

mod experiment;
mod output;
mod photo;
mod run;

pub use run::run;
