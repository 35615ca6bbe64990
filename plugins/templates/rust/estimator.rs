//! A descriptor estimator: what does each region mean for the map? This one measures rectangles on upright walls, and says
//! of everything else which requirement it missed, and by what.
#![forbid(unsafe_code)]

use resurvey_plugin::schema::{
    ChangeRegion, ClassKind, Descriptor, GridPoint, MaterialDescriptor, Proposal, Rejection, Uncertainty,
};
use resurvey_plugin::{Comparison, Error, Estimator, Host, Plugin};

resurvey_plugin::export_estimator!(MyEstimator);

/// Rectangles on upright walls.
pub struct MyEstimator {
    settings: Settings,
}

/// The settings, checked and completed by the host from [`Plugin::SETTINGS`].
#[derive(serde::Deserialize)]
pub struct Settings {
    plane_m: f64,
    range_m: f64,
}

impl Plugin for MyEstimator {
    const NAME: &'static str = "my-plugin";
    const VERSION: &'static str = env!("CARGO_PKG_VERSION");
    const SUMMARY: &'static str = "Measures rectangles on upright walls";
    const SETTINGS: &'static str = r#"{
        "type": "object", "additionalProperties": false,
        "properties": {
            "plane_m": {"type": "number", "default": 0.2, "minimum": 0, "maximum": 10,
                        "description": "largest distance of a point of the region from its plane, metres"},
            "range_m": {"type": "number", "default": 50, "minimum": 1, "maximum": 1000,
                        "description": "largest distance from the camera, metres"}
        }
    }"#;
    type Settings = Settings;

    fn create(settings: Settings) -> Result<Self, Error> {
        Ok(Self { settings })
    }
}

impl Estimator for MyEstimator {
    fn estimate(
        &mut self,
        host: &dyn Host,
        comparison: &Comparison<'_>,
        regions: &[ChangeRegion],
    ) -> Result<Vec<Proposal>, Error> {
        let mut proposals = Vec::new();
        for (index, region) in regions.iter().enumerate() {
            // Within 200 ms of a cancel: a part of the proposals must not be taken for all of them.
            if host.cancelled() {
                return Err("cancelled".into());
            }
            proposals.push(self.meaning(host, comparison, index as u32, region));
        }
        Ok(proposals)
    }
}

impl MyEstimator {
    fn meaning(&self, host: &dyn Host, comparison: &Comparison<'_>, index: u32, region: &ChangeRegion) -> Proposal {
        let reject = |missed: Missed| Proposal::Reject {
            region: index,
            rejection: Rejection {
                class_before: region.class_before,
                class_after: region.class_after,
                pixels: region.pixels,
                requirement: missed.requirement.into(),
                measured: missed.measured,
                limit: missed.limit,
                unit: missed.unit.into(),
            },
        };
        let surface = match Surface::of(comparison, region) {
            Ok(surface) => surface,
            Err(missed) => return reject(missed),
        };
        if let Some(near) = gone(comparison, region) {
            return Proposal::Remove { region: index, class: region.class_before, near, sigma_m: 0.5 };
        }
        if host.classes().kind(region.class_after) != ClassKind::Material {
            return reject(Missed { requirement: "material-class", measured: 0.0, limit: 1.0, unit: "material" });
        }
        match self.rectangle(comparison, region, &surface) {
            Ok(descriptor) => Proposal::Place { region: index, descriptor: Descriptor::Material(descriptor) },
            Err(missed) => reject(missed),
        }
    }

    fn rectangle(
        &self,
        comparison: &Comparison<'_>,
        region: &ChangeRegion,
        surface: &Surface,
    ) -> Result<MaterialDescriptor, Missed> {
        let bounds = region.bounds;
        let edges_px = [
            bounds.left,
            bounds.top,
            comparison.photo.width() - bounds.right,
            comparison.photo.height() - bounds.bottom,
        ];
        let edge_px = f64::from(edges_px.into_iter().min().unwrap_or(0));
        require("captured-entirely", edge_px >= 1.0, edge_px, 1.0, "px")?;
        require("within-range", surface.range_m <= self.settings.range_m, surface.range_m, self.settings.range_m, "m")?;
        let off_m =
            surface.points.iter().map(|p| dot(surface.normal, sub(*p, surface.points[0])).abs()).fold(0.0, f64::max);
        require("coplanar", off_m <= self.settings.plane_m, off_m, self.settings.plane_m, "m")?;
        let lean_deg = surface.normal[2].abs().min(1.0).asin().to_degrees();
        require("upright", lean_deg <= 10.0, lean_deg, 10.0, "deg")?;

        let wall = OnWall::of(surface, comparison);
        let [width_m, height_m] = wall.size_m;
        let off = if width_m * height_m > 0.0 { (wall.area_m2 / (width_m * height_m) - 1.0).abs() } else { 1.0 };
        require("rectangle", off <= 0.15, off, 0.15, "ratio")?;
        let covariance = comparison.estimate.covariance;
        let pixel_m = (wall.area_m2 / surface.points.len() as f64).sqrt();
        let sigma = Uncertainty {
            position_m: (covariance[0][0] + covariance[1][1] + pixel_m * pixel_m).sqrt(),
            size_m: Some(pixel_m),
            area_m2: None,
        };
        Ok(MaterialDescriptor {
            class: region.class_after,
            corners: wall.corners(comparison.view.origin),
            normal: wall.normal,
            sigma: Some(sigma),
        })
    }
}

/// The points of a region on an upright wall, as the rectangle with their moments.
struct OnWall {
    normal: [f64; 3],
    /// To the right as seen from outside.
    along: [f64; 3],
    /// Of the wall from the view's origin, along the normal.
    distance_m: f64,
    /// Along and up.
    centre_m: [f64; 2],
    size_m: [f64; 2],
    area_m2: f64,
}

impl OnWall {
    fn of(surface: &Surface, comparison: &Comparison<'_>) -> Self {
        let [east, north, _] = surface.normal;
        let length = east.hypot(north);
        let (normal, along) = ([east / length, north / length, 0.0], [-north / length, east / length, 0.0]);
        let pose = comparison.estimate.pose;
        let (sin_p, cos_p) = pose.pitch_rad.sin_cos();
        let forward = [pose.yaw_rad.sin() * cos_p, pose.yaw_rad.cos() * cos_p, sin_p];
        let camera = sub(pose.position.into(), comparison.view.origin.into());
        // How much of the wall a pixel covers: depth³ over focal lengths and distance of the wall.
        let wall_m = dot(sub(surface.points[0], camera), normal).abs().max(1e-9);
        let scale = comparison.camera.fx * comparison.camera.fy * wall_m;
        let weigh =
            |point: &[f64; 3]| (dot(sub(*point, camera), forward).powi(3) / scale, [dot(*point, along), point[2]]);
        let weighted: Vec<(f64, [f64; 2])> = surface.points.iter().map(weigh).collect();
        let area_m2: f64 = weighted.iter().map(|(area, _)| area).sum();
        let mean = |value: &dyn Fn(&[f64; 2]) -> f64| {
            weighted.iter().map(|(area, at)| area * value(at)).sum::<f64>() / area_m2
        };
        let centre_m = [mean(&|at| at[0]), mean(&|at| at[1])];
        // A rectangle of width w has the variance w²/12: exact to a fraction of a pixel, where the outermost are not.
        let size_m = [0, 1].map(|axis| (12.0 * mean(&|at| (at[axis] - centre_m[axis]).powi(2))).sqrt());
        Self { normal, along, distance_m: dot(surface.points[0], normal), centre_m, size_m, area_m2 }
    }

    fn corners(&self, origin: GridPoint) -> [GridPoint; 4] {
        [[-0.5, -0.5], [0.5, -0.5], [0.5, 0.5], [-0.5, 0.5]].map(|[right, up]| {
            let along_m = self.centre_m[0] + right * self.size_m[0];
            GridPoint::new(
                origin.easting_m + along_m * self.along[0] + self.distance_m * self.normal[0],
                origin.northing_m + along_m * self.along[1] + self.distance_m * self.normal[1],
                origin.height_m + self.centre_m[1] + up * self.size_m[1],
            )
        })
    }
}

/// A requirement that is not met.
struct Missed {
    requirement: &'static str,
    measured: f64,
    limit: f64,
    unit: &'static str,
}

fn require(
    requirement: &'static str,
    is_met: bool,
    measured: f64,
    limit: f64,
    unit: &'static str,
) -> Result<(), Missed> {
    if is_met { Ok(()) } else { Err(Missed { requirement, measured, limit, unit }) }
}

/// The surface of the map behind a region.
struct Surface {
    /// Offsets from the view's origin, metres.
    points: Vec<[f64; 3]>,
    /// Unit, towards the camera.
    normal: [f64; 3],
    range_m: f64,
}

impl Surface {
    fn of(comparison: &Comparison<'_>, region: &ChangeRegion) -> Result<Self, Missed> {
        let at = |u: u32, v: u32| comparison.view.points.at(u, v).map(f64::from);
        let pixels: Vec<[u32; 2]> = pixels(region).filter(|[u, v]| at(*u, *v)[0].is_finite()).collect();
        let share = pixels.len() as f64 / f64::from(region.pixels.max(1));
        require("on-a-surface", share >= 0.9, share, 0.9, "ratio")?;
        // Twice the area of each square of four pixels as a vector: the sum points along the normal.
        let mut area = [0.0; 3];
        for &[u, v] in &pixels {
            if u + 1 < comparison.photo.width() && v + 1 < comparison.photo.height() {
                let part = cross(sub(at(u, v + 1), at(u, v)), sub(at(u + 1, v), at(u, v)));
                if part.iter().all(|x| x.is_finite()) && is_inside(region, u + 1, v) && is_inside(region, u, v + 1) {
                    area = [area[0] + part[0], area[1] + part[1], area[2] + part[2]];
                }
            }
        }
        let size = dot(area, area).sqrt();
        require("two-dimensional", size > 0.0, size, 0.0, "m2")?;
        let normal = area.map(|x| x / size);
        let points: Vec<[f64; 3]> = pixels.iter().map(|[u, v]| at(*u, *v)).collect();
        let origin: [f64; 3] = comparison.view.origin.into();
        let camera = sub(comparison.estimate.pose.position.into(), origin);
        let sum = points.iter().fold([0.0; 3], |sum, p| [sum[0] + p[0], sum[1] + p[1], sum[2] + p[2]]);
        let back = sub(camera, sum.map(|x| x / points.len() as f64));
        let range_m = dot(back, back).sqrt();
        let normal = if dot(normal, back) < 0.0 { normal.map(|x| -x) } else { normal };
        Ok(Self { points, normal, range_m })
    }
}

/// Where the descriptor stood that the view shows in most of the region.
fn gone(comparison: &Comparison<'_>, region: &ChangeRegion) -> Option<GridPoint> {
    let (mut sum, mut count) = ([0.0; 3], 0_u32);
    for [u, v] in pixels(region) {
        let feature = comparison.view.features.at(u, v) as usize;
        let shown = feature.checked_sub(1).and_then(|index| comparison.view.feature_table.get(index));
        if shown.is_some_and(|shown| shown.class == region.class_before) {
            let point = comparison.view.points.at(u, v).map(f64::from);
            sum = [sum[0] + point[0], sum[1] + point[1], sum[2] + point[2]];
            count += 1;
        }
    }
    let mean = sum.map(|x| x / f64::from(count.max(1)));
    let origin = comparison.view.origin;
    let near = GridPoint::new(origin.easting_m + mean[0], origin.northing_m + mean[1], origin.height_m + mean[2]);
    (2 * count > region.pixels).then_some(near)
}

fn is_inside(region: &ChangeRegion, u: u32, v: u32) -> bool {
    let bounds = region.bounds;
    (bounds.left..bounds.right).contains(&u)
        && (bounds.top..bounds.bottom).contains(&v)
        && region.mask[((v - bounds.top) * bounds.width() + u - bounds.left) as usize] == 1
}

fn pixels(region: &ChangeRegion) -> impl Iterator<Item = [u32; 2]> + '_ {
    let bounds = region.bounds;
    (bounds.top..bounds.bottom)
        .flat_map(move |v| (bounds.left..bounds.right).map(move |u| [u, v]))
        .zip(&region.mask)
        .filter_map(|(pixel, inside)| (*inside == 1).then_some(pixel))
}

fn sub(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

#[cfg(test)]
mod tests {
    use super::*;
    use resurvey_plugin::PoseEstimate;
    use resurvey_plugin::schema::{ClassId, PixelBox, Pose};
    use resurvey_plugin::toy::{Paint, ToyCamera, ToyHost, ToyScene, create};

    const STONE: ClassId = ClassId(0);
    const BANNER: ClassId = ClassId(3);
    const OTHERS: ClassId = ClassId(8);

    /// A banner of 4 m × 1 m on a stone wall 10 m ahead.
    fn banner() -> MaterialDescriptor {
        let corner = |easting_m, height_m| GridPoint::new(easting_m, 10.0, height_m);
        let corners = [corner(-2.0, 2.6), corner(2.0, 2.6), corner(2.0, 3.6), corner(-2.0, 3.6)];
        MaterialDescriptor { class: BANNER, corners, normal: [0.0, -1.0, 0.0], sigma: None }
    }

    fn map() -> ToyHost {
        let mut scene = ToyScene { ground: Some((0.0, OTHERS)), ..ToyScene::default() };
        scene.add_wall([-20.0, 10.0], [20.0, 10.0], [0.0, 15.0], Paint::Plain(STONE));
        ToyHost::new(scene, ToyCamera::intrinsics(640, 480, 90.0))
    }

    fn estimate(map: &ToyHost, photo: &ToyHost, before: ClassId, after: ClassId) -> Result<Vec<Proposal>, Error> {
        // Obliquely: a wall turned away must not come out shorter.
        let pose = Pose { position: GridPoint::new(2.0, 0.0, 1.6), yaw_rad: -0.2, pitch_rad: 0.1, roll_rad: 0.0 };
        let estimate =
            PoseEstimate { pose, covariance: [[0.0; 3]; 3], height_sigma_m: 0.0, tilt_sigma_rad: 0.0, alignment: None };
        let capture = map.capture(photo.labels(&pose), estimate);
        let comparison = capture.comparison();
        let mask: Vec<u8> = (0..480)
            .flat_map(|v| comparison.photo.row(v).iter().zip(comparison.view.labels.row(v)))
            .map(|(photo, view)| u8::from(photo != view))
            .collect();
        let region = ChangeRegion {
            class_before: before,
            class_after: after,
            bounds: PixelBox { left: 0, top: 0, right: 640, bottom: 480 },
            pixels: mask.iter().map(|inside| u32::from(*inside)).sum(),
            mask,
        };
        create::<MyEstimator>("{}")?.estimate(map, &comparison, &[tight(&region)])
    }

    /// The same region in tight bounds.
    fn tight(region: &ChangeRegion) -> ChangeRegion {
        let inside: Vec<[u32; 2]> = pixels(region).collect();
        let least = |axis: usize| inside.iter().map(|pixel| pixel[axis]).min().unwrap();
        let most = |axis: usize| inside.iter().map(|pixel| pixel[axis]).max().unwrap();
        let bounds = PixelBox { left: least(0), top: least(1), right: most(0) + 1, bottom: most(1) + 1 };
        let rows = (bounds.top..bounds.bottom).flat_map(|v| (bounds.left..bounds.right).map(move |u| (u, v)));
        let mask = rows.map(|(u, v)| u8::from(is_inside(region, u, v))).collect();
        ChangeRegion { bounds, mask, ..region.clone() }
    }

    #[test]
    fn a_banner_of_four_metres_by_one_is_measured_within_two_per_cent() {
        let mut photo = map();
        photo.scene.add_descriptor(Descriptor::Material(banner()));
        let proposals = estimate(&map(), &photo, STONE, BANNER).unwrap();
        let [Proposal::Place { descriptor: Descriptor::Material(found), .. }] = &proposals[..] else {
            panic!("expected one to place, found {proposals:?}")
        };
        let [a, b, _, d] = found.corners;
        assert!((a.plan_distance_m(&b) / 4.0 - 1.0).abs() < 0.01, "width {}", a.plan_distance_m(&b));
        assert!((d.height_m - a.height_m - 1.0).abs() < 0.01, "height {}", d.height_m - a.height_m);
        assert!(a.plan_distance_m(&banner().corners[0]) < 0.05 && found.normal[1] < -0.999);
    }

    #[test]
    fn a_banner_that_is_gone_is_removed_where_it_hung() {
        let mut map_with_it = map();
        map_with_it.scene.add_descriptor(Descriptor::Material(banner()));
        let proposals = estimate(&map_with_it, &map(), BANNER, STONE).unwrap();
        let [Proposal::Remove { class, near, .. }] = &proposals[..] else {
            panic!("expected one to remove, found {proposals:?}")
        };
        assert_eq!(*class, BANNER);
        assert!(near.plan_distance_m(&banner().centre()) < 0.2, "{near:?}");
    }

    #[test]
    fn a_part_of_the_proposals_is_no_answer_after_a_cancel() {
        let mut photo = map();
        photo.scene.add_descriptor(Descriptor::Material(banner()));
        let mut cancelled = map();
        cancelled.is_cancelled = true;
        assert!(estimate(&cancelled, &photo, STONE, BANNER).is_err());
    }
}
