//! A segmenter: which class is each pixel of a photo? This one takes the class whose colour is nearest, which reads
//! pictures in class colours and no photographs: put a network in its place.
#![forbid(unsafe_code)]

use resurvey_plugin::schema::{ClassId, ClassTable};
use resurvey_plugin::{Error, Host, ImageRef, Plugin, Segmenter};

resurvey_plugin::export_segmenter!(MySegmenter);

/// The class with the nearest colour. Its fields are the settings, which the host checks and completes from
/// [`Plugin::SETTINGS`].
#[derive(serde::Deserialize)]
pub struct MySegmenter {
    reach: u32,
}

impl Plugin for MySegmenter {
    const NAME: &'static str = "my-plugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "The class with the nearest colour, for pictures in class colours";
    // A string with "format": "file" names a file that the plugin reads, such as the weights of a network: the host
    // records its SHA-256.
    const SETTINGS: &'static str = r#"{
        "type": "object", "additionalProperties": false,
        "properties": {
            "reach": {"type": "integer", "default": 60, "minimum": 0, "maximum": 765,
                      "description": "largest difference of a colour from that of its class, sum over red, green and blue"}
        }
    }"#;
    type Settings = Self;

    fn create(settings: Self) -> Result<Self, Error> {
        Ok(settings)
    }
}

impl Segmenter for MySegmenter {
    /// Row by row: the index of a class of `host.classes()`, or 255.
    fn segment(&mut self, host: &dyn Host, photo: ImageRef<'_, [u8; 3]>) -> Result<Vec<u8>, Error> {
        let mut labels = Vec::with_capacity(photo.width() as usize * photo.height() as usize);
        for row in photo.rows() {
            // Within 200 ms of a cancel; a network looks before its forward pass.
            if host.cancelled() {
                return Err("cancelled".into());
            }
            labels.extend(row.iter().map(|colour| nearest(host.classes(), *colour, self.reach)));
        }
        Ok(labels)
    }
}

/// The class whose colour is nearest, the lower index of equals; void when none is within `reach`.
fn nearest(classes: &ClassTable, colour: [u8; 3], reach: u32) -> u8 {
    let off = |other: [u8; 3]| colour.iter().zip(other).map(|(a, b)| u32::from(a.abs_diff(b))).sum::<u32>();
    let near = classes.iter().map(|class| (off(class.colour), class.index)).filter(|(off, _)| *off <= reach);
    near.min().map_or(ClassId::VOID.0, |(_, class)| class.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::schema::{GridPoint, Pose};
    use resurvey_plugin::toy::{ToyCamera, ToyHost, ToyScene, create};

    fn world() -> ToyHost {
        ToyHost::new(ToyScene::corner(), ToyCamera::intrinsics(32, 24, 120.0))
    }

    fn pose() -> Pose {
        Pose { position: GridPoint::new(0.0, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.1, roll_rad: 0.0 }
    }

    fn segment(host: &ToyHost, picture: &[[u8; 3]]) -> Result<Vec<u8>, Error> {
        let photo = ImageRef::new(picture, 32, picture.len() as u32 / 32, 32).unwrap();
        create::<MySegmenter>("{}")?.segment(&host.placeless(), photo)
    }

    #[test]
    fn a_picture_in_class_colours_becomes_its_labels_also_when_it_is_a_little_off() {
        let (labels, picture) = (world().labels(&pose()), world().picture(&pose()));
        assert_eq!(segment(&world(), &picture).unwrap(), labels);
        let off: Vec<[u8; 3]> = picture.iter().map(|colour| colour.map(|value| value.saturating_add(15))).collect();
        assert_eq!(segment(&world(), &off).unwrap(), labels);
    }

    #[test]
    fn a_colour_of_no_class_is_void() {
        assert_eq!(segment(&world(), &[[128; 3]; 32]).unwrap(), [255; 32]);
    }

    #[test]
    fn a_part_of_the_labels_is_no_answer_after_a_cancel() {
        let mut cancelled = world();
        cancelled.is_cancelled = true;
        assert!(segment(&cancelled, &world().picture(&pose())).is_err());
    }
}
