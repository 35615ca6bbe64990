//! A change detector of one's own in some forty lines: it reports banners only, whatever they hang on. It runs here on a
//! toy world of the SDK; the same type, exported as the plugin guide says, runs in `resurvey update --detector`.
//!
//! `cargo run --release --example 04_write_a_detector`

use resurvey_plugin::schema::{ChangeRegion, ClassId, GridPoint, PixelBox, Pose};
use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene};
use resurvey_plugin::{Comparison, Detector, Error, Host, Plugin, PoseEstimate};
use serde::Deserialize;

/// Reports the pixels where the photo has a banner and the map has none, as one region.
struct BannerWatch {
    settings: BannerSettings,
}

/// Settings, checked and completed by the host from [`Plugin::SETTINGS`].
#[derive(Deserialize)]
struct BannerSettings {
    least_px: u32,
}

impl Plugin for BannerWatch {
    const NAME: &'static str = "banner-watch";
    const VERSION: &'static str = "0.1.0";
    const SUMMARY: &'static str = "Reports banners that the map does not have";
    const SETTINGS: &'static str = r#"{"type": "object", "properties":
        {"least_px": {"type": "integer", "minimum": 1, "default": 200, "description": "smallest region, pixels"}}}"#;
    type Settings = BannerSettings;

    fn create(settings: BannerSettings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Detector for BannerWatch {
    fn detect(&mut self, host: &dyn Host, comparison: &Comparison<'_>) -> Result<Vec<ChangeRegion>, Error> {
        let banner = host.classes().by_name("banner").ok_or("expected a map with a class banner, found none")?;
        let (photo, view) = (comparison.photo, comparison.view.labels);
        let is_new = |u: u32, v: u32| photo.at(u, v) == banner.index.0 && view.at(u, v) != banner.index.0;
        let pixels: Vec<[u32; 2]> = (0..photo.height())
            .flat_map(|v| (0..photo.width()).map(move |u| [u, v]))
            .filter(|&[u, v]| is_new(u, v))
            .collect();
        let (Some(&[first_u, first_v]), true) = (pixels.first(), pixels.len() as u32 >= self.settings.least_px) else {
            return Ok(Vec::new());
        };
        let fold = |axis: usize, pick: fn(u32, u32) -> u32, from| pixels.iter().map(|p| p[axis]).fold(from, pick);
        let bounds = PixelBox {
            left: fold(0, u32::min, first_u),
            top: fold(1, u32::min, first_v),
            right: fold(0, u32::max, first_u) + 1,
            bottom: fold(1, u32::max, first_v) + 1,
        };
        let inside = (bounds.top..bounds.bottom).flat_map(|v| (bounds.left..bounds.right).map(move |u| [u, v]));
        Ok(vec![ChangeRegion {
            class_before: ClassId(view.at(first_u, first_v)),
            class_after: banner.index,
            bounds,
            mask: inside.map(|[u, v]| u8::from(is_new(u, v))).collect(),
            pixels: pixels.len() as u32,
        }])
    }
}

fn main() -> anyhow::Result<()> {
    const STONE: ClassId = ClassId(0);
    const BANNER: ClassId = ClassId(3);
    const OTHERS: ClassId = ClassId(8);
    let wall = |scene: &mut ToyScene| scene.add_wall([-20.0, 12.0], [20.0, 12.0], [0.0, 15.0], Paint::Plain(STONE));
    let mut surveyed = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
    wall(&mut surveyed);
    let mut real = surveyed.clone();
    real.add_wall([-2.0, 11.96], [2.0, 11.96], [4.0, 6.0], Paint::Plain(BANNER));

    let camera = ToyCamera::intrinsics(960, 720, 120.0);
    let pose = Pose { position: GridPoint::new(0.0, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.1, roll_rad: 0.0 };
    let estimate =
        PoseEstimate { pose, covariance: [[0.0; 3]; 3], height_sigma_m: 0.0, tilt_sigma_rad: 0.0, alignment: None };
    let host = ToyHost::new(surveyed, camera);
    let photo = ToyHost::new(real, camera).labels(&pose);
    let capture = host.capture(photo, estimate);

    let settings = serde_json::from_str(r#"{"least_px": 200}"#)?;
    let mut detector = BannerWatch::create(settings)?;
    for region in detector.detect(&host, &capture.comparison())? {
        let PixelBox { left, top, right, bottom } = region.bounds;
        let name = |class| host.classes().name(class).to_owned();
        let (before, after) = (name(region.class_before), name(region.class_after));
        println!("{before} became {after}: {} px in columns {left}–{right}, rows {top}–{bottom}", region.pixels);
    }
    Ok(())
}
