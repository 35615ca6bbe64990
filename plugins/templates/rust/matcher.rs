//! A matcher: how well does one view of the map fit the photo? The host makes the candidate poses, renders and searches.
#![forbid(unsafe_code)]

use resurvey_plugin::{Error, ImageRef, Plugin, Scorer, View};

resurvey_plugin::export_scorer!(MyMatcher);

/// Share of the pixels whose class is the same in photo and view.
pub struct MyMatcher {
    settings: Settings,
}

/// The settings, checked and completed by the host from [`Plugin::SETTINGS`].
#[derive(serde::Deserialize)]
pub struct Settings {
    void: u8,
}

impl Plugin for MyMatcher {
    const NAME: &'static str = "my-plugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Share of the pixels whose class is the same in photo and view";
    const SETTINGS: &'static str = r#"{
        "type": "object", "additionalProperties": false,
        "properties": {
            "void": {"type": "integer", "default": 255, "minimum": 0, "maximum": 255,
                     "description": "class of the photo that is not compared"}
        }
    }"#;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Scorer for MyMatcher {
    /// From 0 to 1, higher is better; photo and view have one size.
    fn score(&mut self, photo: ImageRef<'_, u8>, view: &View<'_>) -> Result<f64, Error> {
        let (mut same, mut compared) = (0_u32, 0_u32);
        for v in 0..photo.height() {
            for (&in_photo, &in_view) in photo.row(v).iter().zip(view.labels.row(v)) {
                let counts = in_photo != self.settings.void;
                compared += u32::from(counts);
                same += u32::from(counts && in_photo == in_view);
            }
        }
        match compared {
            0 => Err(Error("expected labels in the photo, found only void".into())),
            _ => Ok(f64::from(same) / f64::from(compared)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::schema::{ClassId, GridPoint, Pose};
    use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene};
    use resurvey_plugin::{Host, ViewImages};

    const STONE: ClassId = ClassId(0);
    const GLASS: ClassId = ClassId(1);
    const OTHERS: ClassId = ClassId(8);

    /// A stone wall 12 m ahead with a window in it.
    fn world() -> ToyHost {
        let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
        scene.add_wall([-20.0, 12.0], [20.0, 12.0], [0.0, 15.0], Paint::Plain(STONE));
        scene.add_wall([-2.0, 11.9], [1.0, 11.9], [3.0, 5.0], Paint::Plain(GLASS));
        ToyHost::new(scene, ToyCamera::intrinsics(160, 120, 100.0))
    }

    fn pose(easting_m: f64) -> Pose {
        Pose { position: GridPoint::new(easting_m, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 }
    }

    fn score(photo: &[u8], view: &ViewImages) -> Result<f64, Error> {
        let settings = serde_json::from_str(r#"{"void": 255}"#).unwrap();
        let (width, height) = (view.width, view.height);
        fn image<T: Copy>(data: &[T], width: u32, height: u32) -> ImageRef<'_, T> {
            ImageRef::new(data, width, height, width as usize).unwrap()
        }
        let lent = View {
            origin: view.origin,
            labels: image(&view.labels, width, height),
            range_m: image(&view.range_m, width, height),
            points: image(&view.points, width, height),
            features: image(&view.features, width, height),
            feature_table: &[],
        };
        MyMatcher::create(settings)?.score(image(photo, width, height), &lent)
    }

    #[test]
    fn the_true_pose_scores_best() {
        let world = world();
        let photo = world.labels(&pose(0.0));
        let views = world.render(1, true, &[pose(0.0), pose(0.5), pose(1.0)]).unwrap();
        let scores: Vec<f64> = views.iter().map(|view| score(&photo, view).unwrap()).collect();
        assert!((scores[0] - 1.0).abs() < 1e-12 && scores[0] > scores[1] && scores[1] > scores[2], "{scores:?}");
    }

    #[test]
    fn a_photo_without_labels_has_no_answer() {
        let view = &world().render(1, true, &[pose(0.0)]).unwrap()[0];
        assert!(score(&[255; 160 * 120], view).is_err());
    }
}
