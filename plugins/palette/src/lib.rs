//! Segmenter by colour: each pixel is the class whose colour is nearest in CIELAB.
//!
//! It reads renderings and pictures that are drawn in the class colours, whatever a lossy compression or a downscale did
//! to them. It is the yardstick that a network has to beat, and no segmenter for photographs: no wall of a street is pure
//! blue because the class `stone` is.
#![forbid(unsafe_code)]

pub mod lab;
pub mod majority;

use lab::{Lab, delta_e};
use resurvey_plugin::schema::{ClassId, ClassTable};
use resurvey_plugin::{Error, Host, ImageRef, Plugin, Segmenter};
use serde::Deserialize;
use std::collections::HashMap;
use std::sync::Mutex;

resurvey_plugin::export_segmenter!(Palette);

/// Colours that are remembered: a photograph has more than a drawing, and need not fill the memory.
const MOST_REMEMBERED: usize = 1 << 16;

/// The segmenter.
pub struct Palette {
    settings: Settings,
}

/// What a user can set.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Settings {
    /// Largest colour difference to a class (ΔE*ab, CIE 1976); a pixel further from all of them is void.
    pub max_delta_e: f64,
    /// Radius of the square in which the majority decides, pixels; 0 leaves every pixel as it is.
    pub majority_radius_px: u32,
}

impl Plugin for Palette {
    const NAME: &'static str = "palette";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "The nearest class colour: for pictures drawn in class colours, not for photographs";
    const SETTINGS: &'static str = r#"{
  "$schema": "https://json-schema.org/draft/2020-12/schema",
  "type": "object",
  "additionalProperties": false,
  "properties": {
    "max_delta_e": { "type": "number", "minimum": 0, "maximum": 400, "default": 15,
      "description": "largest colour difference to a class (CIE 1976); a pixel further from all of them is void" },
    "majority_radius_px": { "type": "integer", "minimum": 0, "maximum": 20, "default": 0,
      "description": "the most frequent class within this many pixels decides; 0 is off" }
  }
}"#;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Segmenter for Palette {
    fn segment(&mut self, host: &dyn Host, photo: ImageRef<'_, [u8; 3]>) -> Result<Vec<u8>, Error> {
        let palette = Colours::new(host.classes(), self.settings.max_delta_e);
        let rows: Vec<Mutex<Vec<u8>>> = (0..photo.height()).map(|_| Mutex::default()).collect();
        host.parallel_for(rows.len(), &|row| {
            if host.cancelled() {
                return;
            }
            let labels = palette.row(photo.row(row as u32));
            if let Ok(mut place) = rows[row].lock() {
                *place = labels;
            }
        })?;
        if host.cancelled() {
            return Err(Error("cancelled".to_owned()));
        }
        let labels: Vec<u8> = rows.into_iter().flat_map(|row| row.into_inner().unwrap_or_default()).collect();
        let size = (photo.width() as usize, photo.height() as usize);
        majority::filtered(labels, size, self.settings.majority_radius_px as usize, &|| host.cancelled())
            .ok_or_else(|| Error("cancelled".to_owned()))
    }
}

/// The colours of the classes, by rising index.
struct Colours {
    classes: Vec<(u8, Lab)>,
    most: f64,
}

impl Colours {
    fn new(classes: &ClassTable, most: f64) -> Self {
        Self { classes: classes.iter().map(|class| (class.index.0, Lab::of_srgb(class.colour))).collect(), most }
    }

    fn row(&self, colours: &[[u8; 3]]) -> Vec<u8> {
        let mut known = HashMap::new();
        let label = |colour: &[u8; 3]| match known.get(colour) {
            Some(label) => *label,
            None => {
                let label = self.nearest(*colour);
                if known.len() < MOST_REMEMBERED {
                    known.insert(*colour, label);
                }
                label
            }
        };
        colours.iter().map(label).collect()
    }

    /// The class whose colour is nearest, the lower index of equals.
    fn nearest(&self, colour: [u8; 3]) -> u8 {
        let lab = Lab::of_srgb(colour);
        let near = self.classes.iter().map(|(class, of_class)| (*class, delta_e(lab, *of_class)));
        let nearest = near.min_by(|a, b| a.1.total_cmp(&b.1));
        nearest.filter(|(_, distance)| *distance <= self.most).map_or(ClassId::VOID.0, |(class, _)| class)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn nearest(colour: [u8; 3], most: f64) -> u8 {
        Colours::new(&ClassTable::default(), most).nearest(colour)
    }

    #[test]
    fn every_class_colour_is_its_own_class_and_grey_is_none() {
        for class in ClassTable::default().iter() {
            assert_eq!(nearest(class.colour, 0.0), class.index.0);
        }
        assert_eq!(nearest([128; 3], 15.0), ClassId::VOID.0);
    }

    #[test]
    fn by_default_no_colour_is_within_reach_of_two_classes() {
        let (table, most) = (ClassTable::default(), 15.0);
        for a in table.iter() {
            for b in table.iter().filter(|b| b.index != a.index) {
                assert!(delta_e(Lab::of_srgb(a.colour), Lab::of_srgb(b.colour)) > 2.0 * most, "{} {}", a.name, b.name);
            }
        }
        let defaults: serde_json::Value = serde_json::from_str(Palette::SETTINGS).unwrap();
        assert_eq!(defaults["properties"]["max_delta_e"]["default"], 15);
    }
}
