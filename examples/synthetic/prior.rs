//! The phone's rough pose.

use super::noise::NoiseLevel;
use super::random::Random;
use super::scene::Scene;
use super::world::Offset;

/// Errors of the prior, added to the true pose.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PriorError {
    /// East, north, up, metres.
    pub offset_m: Offset,
    /// Heading, degrees.
    pub yaw_deg: f64,
    /// Pitch and roll, degrees.
    pub tilt_deg: [f64; 2],
}

/// Greatest error in plan, metres: the search looks 40 m around the prior.
const REACH_M: f64 = 35.0;
/// 1σ and greatest error of the heading, degrees: the search looks 40° to both sides.
const YAW_SIGMA_DEG: f64 = 20.0;
const YAW_REACH_DEG: f64 = 35.0;

impl PriorError {
    /// Drawn from the scene's and the noise's sigmas.
    pub fn draw(scene: &Scene, noise: &NoiseLevel, random: &mut Random) -> Self {
        let plan = loop {
            let plan = [0, 1].map(|_| scene.prior_sigma_m * random.normal());
            if plan[0].hypot(plan[1]) < REACH_M {
                break plan;
            }
        };
        let yaw_deg = loop {
            let yaw_deg = YAW_SIGMA_DEG * random.normal();
            if yaw_deg.abs() < YAW_REACH_DEG {
                break yaw_deg;
            }
        };
        let up = noise.height_m * random.normal();
        let tilt_deg = [0, 1].map(|_| noise.tilt_deg * random.normal());
        Self { offset_m: [plan[0], plan[1], up], yaw_deg, tilt_deg }
    }
}

/// 1σ of the heading that a capture states, degrees.
pub fn stated_yaw_sigma_deg() -> f64 {
    YAW_SIGMA_DEG
}
