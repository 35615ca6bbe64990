//! The heat map of a search: the score at each candidate position, seen from above (Lee & Hsu, Table III).

mod canvas;
mod cells;
mod colours;
mod font;
mod key;
mod markers;
mod plan;
mod scale;
#[cfg(test)]
mod tests;
mod text;

use crate::image::{ImageError, write_rgb_png};
use canvas::{Area, Canvas};
use cells::Cells;
use plan::Plan;
use resurvey_schema::Pose;
use scale::ScoreScale;

/// Farthest coordinate that is drawn, metres: beyond any projected system.
const COORDINATE_LIMIT_M: f64 = 1e8;

/// Size of the picture, pixels.
const SIZE_PX: (u32, u32) = (920, 736);

/// Where the plan is in the picture, pixels.
const PLAN_PX: Area = Area { left: 24, top: 64, right: 640, bottom: 680 };

/// What a heat map shows.
#[derive(Clone, Copy, Debug)]
pub struct HeatMap<'a> {
    /// Easting, northing, metres, and score, 0–1, per candidate position of a grid along east and north. Its spacing is
    /// found from the positions; where a position is left out (in a building, beyond the radius) the plan is grey.
    pub heat: &'a [[f64; 3]],
    /// Where the phone said that it was.
    pub prior: Pose,
    /// Where the search found it to be.
    pub estimate: Pose,
    /// Where it was, if known.
    pub truth: Option<Pose>,
    /// Covariance of the estimate over easting, northing (m²) and yaw (rad²).
    pub covariance: [[f64; 3]; 3],
    /// Score of the estimate, 0–1: refined, it can be above every score of the heat.
    pub score: f64,
    /// One line above the plan; what does not fit is left out.
    pub title: &'a str,
}

/// Why a heat map could not be drawn.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum HeatMapError {
    /// A candidate position that is no place, or has no score.
    #[error(
        "expected finite easting and northing within ±{COORDINATE_LIMIT_M:.0} m and a finite score, \
         found {found:?} at index {index} of the heat"
    )]
    Position {
        /// Which entry of the heat.
        index: usize,
        /// What it holds.
        found: [f64; 3],
    },
    /// A pose that is no place, or has no heading.
    #[error(
        "expected finite easting and northing within ±{COORDINATE_LIMIT_M:.0} m and a finite heading, \
         found {easting_m} m, {northing_m} m, {yaw_rad} rad in the {which} pose"
    )]
    Pose {
        /// `prior`, `estimated` or `true`.
        which: &'static str,
        /// Its easting, metres.
        easting_m: f64,
        /// Its northing, metres.
        northing_m: f64,
        /// Its heading, radians.
        yaw_rad: f64,
    },
    /// The picture could not be written.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// A heat map as PNG, 920 × 736 pixels, north up. Same input, same bytes.
///
/// Colours run from the least to the greatest score. A covariance that is not
/// positive has no ellipse; a pose far off the candidates is shown as an arrow at the edge of the plan.
pub fn heat_map(input: &HeatMap<'_>) -> Result<Vec<u8>, HeatMapError> {
    check(input)?;
    let cells = Cells::new(input.heat);
    let scale = ScoreScale::new(cells.scores());
    let plan = Plan::new(PLAN_PX, &cells, input);
    let mut canvas = Canvas::new(SIZE_PX.0, SIZE_PX.1, colours::PAPER);
    plan.draw_cells(&mut canvas, &cells, &scale);
    canvas.clip_to(PLAN_PX);
    markers::draw_all(&mut canvas, &plan, input);
    canvas.clip_to_all();
    key::draw(&mut canvas, &key::Key { input, cells: &cells, scale: &scale, plan: &plan });
    Ok(write_rgb_png(canvas.picture())?)
}

fn check(input: &HeatMap<'_>) -> Result<(), HeatMapError> {
    let is_place = |easting_m: f64, northing_m: f64| {
        easting_m.abs() <= COORDINATE_LIMIT_M && northing_m.abs() <= COORDINATE_LIMIT_M
    };
    let bad = input.heat.iter().position(|[east, north, score]| !is_place(*east, *north) || !score.is_finite());
    if let Some(index) = bad {
        return Err(HeatMapError::Position { index, found: input.heat[index] });
    }
    let poses = [("prior", Some(&input.prior)), ("estimated", Some(&input.estimate)), ("true", input.truth.as_ref())];
    for (which, pose) in poses {
        let Some(Pose { position, yaw_rad, .. }) = pose else { continue };
        let (easting_m, northing_m) = (position.easting_m, position.northing_m);
        if !is_place(easting_m, northing_m) || !yaw_rad.is_finite() {
            return Err(HeatMapError::Pose { which, easting_m, northing_m, yaw_rad: *yaw_rad });
        }
    }
    Ok(())
}
