//! A change detector: in which regions do photo and view differ?
#![forbid(unsafe_code)]

use resurvey_plugin::schema::{ChangeRegion, ClassId, PixelBox};
use resurvey_plugin::{Comparison, Detector, Error, Host, Plugin};

resurvey_plugin::export_detector!(MyDetector);

/// Connected regions in which photo and view have two other classes.
pub struct MyDetector {
    settings: Settings,
}

/// The settings, checked and completed by the host from [`Plugin::SETTINGS`].
#[derive(serde::Deserialize)]
pub struct Settings {
    least_px: u32,
}

impl Plugin for MyDetector {
    const NAME: &'static str = "my-plugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Connected regions in which photo and view differ";
    const SETTINGS: &'static str = r#"{
        "type": "object", "additionalProperties": false,
        "properties": {
            "least_px": {"type": "integer", "default": 100, "minimum": 1, "maximum": 1000000,
                         "description": "smallest region, pixels"}
        }
    }"#;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Detector for MyDetector {
    fn detect(&mut self, host: &dyn Host, comparison: &Comparison<'_>) -> Result<Vec<ChangeRegion>, Error> {
        let mut difference = Difference::new(comparison);
        let mut regions = Vec::new();
        for v in 0..difference.height {
            // Within 200 ms of a cancel: a part of the regions must not be taken for all of them.
            if host.cancelled() {
                return Err("cancelled".into());
            }
            for u in 0..difference.width {
                if let Some(pair) = difference.pairs[difference.index(u, v)] {
                    let pixels = difference.take([u, v], pair);
                    if pixels.len() as u32 >= self.settings.least_px {
                        regions.push(region(&pixels, pair));
                    }
                }
            }
        }
        Ok(regions)
    }
}

/// The class in the view and that in the photo.
type Pair = (u8, u8);

/// Where photo and view differ.
struct Difference {
    width: u32,
    height: u32,
    pairs: Vec<Option<Pair>>,
}

impl Difference {
    fn new(comparison: &Comparison<'_>) -> Self {
        let (photo, view) = (comparison.photo, comparison.view.labels);
        let pair =
            |(&after, &before): (&u8, &u8)| (after != ClassId::VOID.0 && after != before).then_some((before, after));
        let pairs = (0..photo.height()).flat_map(|v| photo.row(v).iter().zip(view.row(v)).map(pair)).collect();
        Self { width: photo.width(), height: photo.height(), pairs }
    }

    fn index(&self, u: u32, v: u32) -> usize {
        v as usize * self.width as usize + u as usize
    }

    /// The pixels of `pair` that hang together with `start`, which are no difference afterwards.
    fn take(&mut self, start: [u32; 2], pair: Pair) -> Vec<[u32; 2]> {
        let (mut pixels, mut open) = (Vec::new(), vec![start]);
        while let Some([u, v]) = open.pop() {
            let index = self.index(u, v);
            if self.pairs[index] != Some(pair) {
                continue;
            }
            self.pairs[index] = None;
            pixels.push([u, v]);
            let beside = [
                (u.checked_sub(1), Some(v)),
                (Some(u), v.checked_sub(1)),
                (Some(u + 1), Some(v)),
                (Some(u), Some(v + 1)),
            ];
            open.extend(beside.into_iter().filter_map(|(u, v)| match (u, v) {
                (Some(u), Some(v)) if u < self.width && v < self.height => Some([u, v]),
                _ => None,
            }));
        }
        pixels
    }
}

fn region(pixels: &[[u32; 2]], (before, after): Pair) -> ChangeRegion {
    let least = |axis: usize| pixels.iter().map(|pixel| pixel[axis]).min().unwrap_or(0);
    let most = |axis: usize| pixels.iter().map(|pixel| pixel[axis]).max().unwrap_or(0);
    let bounds = PixelBox { left: least(0), top: least(1), right: most(0) + 1, bottom: most(1) + 1 };
    let mut mask = vec![0; bounds.width() as usize * bounds.height() as usize];
    for [u, v] in pixels {
        mask[((v - bounds.top) * bounds.width() + u - bounds.left) as usize] = 1;
    }
    let (class_before, class_after) = (ClassId(before), ClassId(after));
    ChangeRegion { class_before, class_after, bounds, mask, pixels: pixels.len() as u32 }
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::PoseEstimate;
    use resurvey_plugin::schema::{GridPoint, Pose};
    use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene, create};

    const STONE: ClassId = ClassId(0);
    const BANNER: ClassId = ClassId(3);
    const OTHERS: ClassId = ClassId(8);

    /// A stone wall 10 m ahead, through a camera with a focal length of 80 pixels.
    fn map() -> ToyHost {
        let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
        scene.add_wall([-20.0, 10.0], [20.0, 10.0], [0.0, 15.0], Paint::Plain(STONE));
        let mut camera = ToyCamera::intrinsics(160, 120, 100.0);
        (camera.fx, camera.fy) = (80.0, 80.0);
        ToyHost::new(scene, camera)
    }

    fn detect(map: &ToyHost, photo: &ToyHost) -> Result<Vec<ChangeRegion>, Error> {
        let pose = Pose { position: GridPoint::new(0.0, 0.0, 1.6), yaw_rad: 0.0, pitch_rad: 0.0, roll_rad: 0.0 };
        let estimate =
            PoseEstimate { pose, covariance: [[0.0; 3]; 3], height_sigma_m: 0.0, tilt_sigma_rad: 0.0, alignment: None };
        let capture = map.capture(photo.labels(&pose), estimate);
        create::<MyDetector>(r#"{"least_px": 20}"#)?.detect(map, &capture.comparison())
    }

    #[test]
    fn equal_images_give_no_region() {
        assert_eq!(detect(&map(), &map()), Ok(vec![]));
    }

    #[test]
    fn a_banner_on_the_wall_is_one_region_where_the_pinhole_puts_it() {
        let mut photo = map();
        photo.scene.add_wall([-2.0, 9.999], [2.0, 9.999], [2.6, 3.6], Paint::Plain(BANNER));
        let regions = detect(&map(), &photo).unwrap();
        let [region] = &regions[..] else { panic!("expected one region, found {regions:?}") };
        assert_eq!((region.class_before, region.class_after), (STONE, BANNER));
        // 80 px · (±2, −1…−2 m) / 10 m from the principal point at (80, 60).
        assert_eq!(region.bounds, PixelBox { left: 64, top: 44, right: 96, bottom: 52 });
        assert_eq!(region.pixels, 32 * 8);
    }

    #[test]
    fn a_part_of_the_regions_is_no_answer_after_a_cancel() {
        let mut cancelled = map();
        cancelled.is_cancelled = true;
        assert!(detect(&cancelled, &map()).is_err());
    }
}
