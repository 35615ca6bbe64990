//! `truth.json`: the true pose of a capture and what really changed.

use resurvey_schema::changes::Op;
use resurvey_schema::{GridPoint, Pose};
use serde::{Deserialize, Serialize};
use serde_json::{Map, Value};
use std::path::{Path, PathBuf};

/// Below this shift of the walls a map has no error, metres.
const NO_SHIFT_M: f64 = 1e-9;

/// What really was, as far as scoring needs it; other keys of the file are for readers.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Truth {
    /// The true pose.
    pub pose: Pose,
    /// Name of the map's directory under `maps`.
    pub scene: String,
    /// What the capture is about, such as `banner` or `none`.
    #[serde(default)]
    pub kind: String,
    /// What changed since the map was made.
    #[serde(default)]
    pub changes: Vec<TrueChange>,
    /// How good labels, prior and map are; empty when ideal.
    #[serde(default)]
    noise: Option<Map<String, Value>>,
    /// Pixels that the changes would cover if nothing stood before them.
    #[serde(default)]
    change_px: Option<u64>,
    /// Those of them that the photo shows.
    #[serde(default)]
    change_visible_px: Option<u64>,
}

/// One change that really happened.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct TrueChange {
    /// Modify stands for walls that changed their class, which no descriptor can say.
    pub op: Op,
    /// Class of the descriptor; `None` for walls.
    #[serde(default)]
    pub class: Option<String>,
    /// Class that walls changed to.
    #[serde(default)]
    pub to: Option<String>,
    /// Centre of a rectangle, ground contact of an object.
    #[serde(default)]
    pub position: Option<GridPoint>,
    /// Corners of a rectangle.
    #[serde(default)]
    pub corners: Option<[GridPoint; 4]>,
    /// What the map knew in its place, or where it was before.
    #[serde(default)]
    pub replaces: Option<Replaced>,
}

/// A descriptor of the map that a true change stands for.
#[derive(Clone, Debug, PartialEq, Deserialize)]
pub struct Replaced {
    /// Its class.
    pub class: String,
    /// Centre of a rectangle, ground contact of an object.
    #[serde(default)]
    position: Option<GridPoint>,
    /// Corners of a rectangle.
    #[serde(default)]
    corners: Option<[GridPoint; 4]>,
}

impl Replaced {
    /// Its position, or the mean of its corners; a truth that was read has one of them.
    pub fn place(&self) -> Option<GridPoint> {
        let mean = |corners: &[GridPoint; 4], pick: fn(&GridPoint) -> f64| corners.iter().map(pick).sum::<f64>() / 4.0;
        self.position.or_else(|| {
            let corners = self.corners.as_ref()?;
            Some(GridPoint::new(
                mean(corners, |corner| corner.easting_m),
                mean(corners, |corner| corner.northing_m),
                mean(corners, |corner| corner.height_m),
            ))
        })
    }
}

/// How far a capture is from ideal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "lowercase")]
pub enum NoiseLevel {
    /// Labels without an error.
    Ideal,
    /// Labels with errors, a map without.
    Light,
    /// Labels with errors, and walls that stand elsewhere than in the map.
    Field,
}

impl NoiseLevel {
    /// All of them, best first.
    pub const ALL: [Self; 3] = [Self::Ideal, Self::Light, Self::Field];

    /// Its name in tables and documents.
    pub fn name(self) -> &'static str {
        match self {
            Self::Ideal => "ideal",
            Self::Light => "light",
            Self::Field => "field",
        }
    }
}

/// Why a file is no truth.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum TruthError {
    /// The file could not be read.
    #[error("{}: {source}", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Not JSON, or not of the form that is documented.
    #[error("{}: {reason}", path.display())]
    Form {
        /// The file.
        path: PathBuf,
        /// What was expected and found, with line and column.
        reason: String,
    },
}

impl Truth {
    /// Reads `path`.
    pub fn read(path: &Path) -> Result<Self, TruthError> {
        let text = std::fs::read(path).map_err(|source| TruthError::Io { path: path.to_owned(), source })?;
        Self::parse(&text).map_err(|reason| TruthError::Form { path: path.to_owned(), reason })
    }

    fn parse(text: &[u8]) -> Result<Self, String> {
        let truth: Self = serde_json::from_slice(text).map_err(|error| error.to_string())?;
        let is_plain = !truth.scene.is_empty() && !truth.scene.contains(['/', '\\']) && truth.scene != "..";
        if !is_plain {
            return Err(format!("scene is {:?}; expected the name of a directory under maps", truth.scene));
        }
        for (index, change) in truth.changes.iter().enumerate() {
            if change.op != Op::Modify && (change.class.is_none() || change.position.is_none()) {
                return Err(format!("changes[{index}]: expected a class and a position"));
            }
            if change.replaces.as_ref().is_some_and(|replaced| replaced.place().is_none()) {
                return Err(format!("changes[{index}].replaces: expected a position or corners"));
            }
        }
        Ok(truth)
    }

    /// How far the capture is from ideal.
    pub fn noise(&self) -> NoiseLevel {
        let noise = self.noise.as_ref().filter(|noise| !noise.is_empty());
        let shift_m = |noise: &Map<String, Value>| noise.get("shift").and_then(Value::as_f64).unwrap_or(0.0);
        match noise {
            None => NoiseLevel::Ideal,
            Some(noise) if shift_m(noise).abs() > NO_SHIFT_M => NoiseLevel::Field,
            Some(_) => NoiseLevel::Light,
        }
    }

    /// Share of the changed pixels that nothing hides, 0–1; 1 where none changed.
    pub fn visible_share(&self) -> f64 {
        match (self.change_visible_px, self.change_px) {
            (visible, Some(all)) if all > 0 => visible.unwrap_or(0) as f64 / all as f64,
            _ => 1.0,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const POSE: &str = r#""pose":{"easting":835548.0,"northing":817800.0,"height":6.1,"yaw_deg":222.9,"pitch_deg":3.8,"roll_deg":-0.5}"#;

    fn parse(rest: &str) -> Result<Truth, String> {
        Truth::parse(format!("{{{POSE},{rest}}}").as_bytes())
    }

    #[test]
    fn the_noise_level_follows_from_what_was_disturbed() {
        let level = |noise: &str| parse(&format!(r#""scene":"street"{noise}"#)).unwrap().noise();
        assert_eq!(level(""), NoiseLevel::Ideal);
        assert_eq!(level(r#","noise":{}"#), NoiseLevel::Ideal);
        assert_eq!(level(r#","noise":null"#), NoiseLevel::Ideal);
        assert_eq!(level(r#","noise":{"jitter":2.0,"blobs":0.01}"#), NoiseLevel::Light);
        assert_eq!(level(r#","noise":{"jitter":4.0,"shift":0.25}"#), NoiseLevel::Field);
    }

    #[test]
    fn a_change_behind_a_tree_is_visible_in_part() {
        let share = |px: &str| parse(&format!(r#""scene":"street"{px}"#)).unwrap().visible_share();
        assert!((share(r#","change_px":200,"change_visible_px":150"#) - 0.75).abs() < 1e-12);
        assert!((share(r#","change_px":0,"change_visible_px":0"#) - 1.0).abs() < 1e-12);
        assert!((share("") - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_truth_without_pose_scene_or_place_of_a_change_is_refused_by_name() {
        let without_pose = Truth::parse(br#"{"scene":"street"}"#).unwrap_err();
        assert!(without_pose.contains("missing field `pose`"), "{without_pose}");
        assert!(parse(r#""kind":"none""#).unwrap_err().contains("missing field `scene`"));
        assert!(parse(r#""scene":"../street""#).unwrap_err().contains("name of a directory"));
        let adrift = parse(r#""scene":"street","changes":[{"op":"add","class":"banner"}]"#).unwrap_err();
        assert_eq!(adrift, "changes[0]: expected a class and a position");
        let nowhere = r#""scene":"street","changes":[{"op":"add","class":"chair","position":[1,2,3],"replaces":{"class":"chair"}}]"#;
        assert_eq!(parse(nowhere).unwrap_err(), "changes[0].replaces: expected a position or corners");
        assert!(parse(r#""scene":"street","changes":[{"op":"paint"}]"#).is_err());
        assert!(Truth::parse(b"").is_err() && Truth::parse(b"[]").is_err());
    }
}
