//! The host's services on the toy world, and captures of it.

use super::camera::{ToyCamera, add, dot, norm, offset, scale};
use super::compare;
use super::scene::{Face, ToyScene};
use crate::host::Host;
use crate::image::{Comparison, ImageRef, ViewImages};
use crate::kinds::{Error, Photo};
use resurvey_schema::service::{
    ClassCounts, CompareRequest, Level, PanoramaRequest, PoseEstimate, Prior, RayHit, ViewCounts, ViewFeature,
};
use resurvey_schema::{ClassId, ClassTable, Descriptor, GridPoint, Intrinsics, Pose, Wgs84};

/// A host whose map is a [`ToyScene`]. It has no map projection: WGS84 is an error. So are comparisons before there is a
/// photo.
#[derive(Clone, Debug)]
pub struct ToyHost {
    /// The map.
    pub scene: ToyScene,
    /// The camera of the capture.
    pub camera: Intrinsics,
    /// The class table.
    pub classes: ClassTable,
    /// Labels of the capture's photo, row-major; empty where there is none.
    pub photo_labels: Vec<u8>,
    /// What [`Host::cancelled`] says: set it to see what a plugin makes of a cancel.
    pub is_cancelled: bool,
    is_placeless: bool,
}

/// A photo and the view of a map at the pose that a matcher found, ready for a detector.
#[derive(Clone, Debug)]
pub struct ToyCapture {
    /// Labels of the photo, row-major.
    pub photo: Vec<u8>,
    view: ViewImages,
    camera: Intrinsics,
    estimate: PoseEstimate,
}

impl ToyHost {
    /// A host of `scene` with the default classes.
    pub fn new(scene: ToyScene, camera: Intrinsics) -> Self {
        let (photo_labels, is_cancelled, is_placeless) = (Vec::new(), false, false);
        Self { scene, camera, classes: ClassTable::default(), photo_labels, is_cancelled, is_placeless }
    }

    /// The host as a segmenter has it, before anybody knows where the photo was taken: every service of the map is an error.
    pub fn placeless(&self) -> Self {
        Self { is_placeless: true, ..self.clone() }
    }

    /// What a photo of this world taken at `pose` shows.
    pub fn labels(&self, pose: &Pose) -> Vec<u8> {
        self.images(pose, 1, true).labels
    }

    /// What a camera at `pose` would take in the colours of the classes, row-major: red, green, blue.
    pub fn picture(&self, pose: &Pose) -> Vec<[u8; 3]> {
        let colour = |label: &u8| self.classes.get(ClassId(*label)).map_or([0; 3], |class| class.colour);
        self.labels(pose).iter().map(colour).collect()
    }

    /// The capture that a matcher in `search` form gets; `None` until `photo_labels` fill the camera's image.
    pub fn photo(&self, prior: Prior) -> Option<Photo<'_>> {
        let Intrinsics { width, height, .. } = self.camera;
        let is_whole = !self.photo_labels.is_empty() && self.photo_labels.len() == width as usize * height as usize;
        let labels = ImageRef::new(&self.photo_labels, width, height, width as usize).filter(|_| is_whole)?;
        Some(Photo { labels, camera: self.camera, prior })
    }

    /// `photo` beside the view of this map at the pose of `estimate`.
    pub fn capture(&self, photo: Vec<u8>, estimate: PoseEstimate) -> ToyCapture {
        ToyCapture { photo, view: self.images(&estimate.pose, 1, true), camera: self.camera, estimate }
    }

    fn map(&self) -> Result<&ToyScene, Error> {
        if self.is_placeless {
            return Err("a segmenter has no map: nobody knows yet where the photo was taken".into());
        }
        Ok(&self.scene)
    }

    fn feature_table(&self) -> Vec<ViewFeature> {
        let feature = |(fid, descriptor): &(u64, Descriptor)| ViewFeature { fid: *fid, class: descriptor.class() };
        self.scene.descriptors.iter().map(feature).collect()
    }

    /// The view at `pose` beside the photo.
    fn compared(&self, request: &CompareRequest, pose: &Pose) -> Result<ViewCounts, Error> {
        if self.photo_labels.len() != self.camera.width as usize * self.camera.height as usize {
            return Err("the toy host has no photo to compare with: set photo_labels".into());
        }
        let view = self.images(pose, request.stride, true);
        let kept = |index: &usize| {
            let stride = request.stride.max(1) as usize;
            let width = self.camera.width as usize;
            (index % width).is_multiple_of(stride) && (index / width).is_multiple_of(stride)
        };
        let photo: Vec<u8> = (0..self.photo_labels.len()).filter(kept).map(|index| self.photo_labels[index]).collect();
        let slots = self.classes.iter().map(|class| usize::from(class.index.0) + 1).max().unwrap_or(0);
        Ok(compare::counts(&photo, &view.labels, view.width as usize, slots, request))
    }

    fn sky(&self) -> ClassId {
        self.classes.by_name("sky").map_or(ClassId::VOID, |class| class.index)
    }

    fn images(&self, pose: &Pose, stride: u32, with_descriptors: bool) -> ViewImages {
        let camera = ToyCamera::new(self.camera, *pose);
        let stride = stride.max(1);
        let (width, height) = (self.camera.width.div_ceil(stride), self.camera.height.div_ceil(stride));
        let size = width as usize * height as usize;
        let mut images = ViewImages {
            width,
            height,
            origin: pose.position,
            labels: vec![self.sky().0; size],
            range_m: vec![f32::INFINITY; size],
            points: vec![[f32::NAN; 3]; size],
            features: vec![0; size],
            feature_table: self.feature_table(),
        };
        let mut nearest = vec![f64::INFINITY; size];
        let mut set = |column: u32, row: u32, ray: [f64; 3], times: f64, class: ClassId, feature: u32| {
            let index = row as usize * width as usize + column as usize;
            if times < nearest[index] {
                nearest[index] = times;
                images.labels[index] = class.0;
                images.range_m[index] = (times * norm(ray)) as f32;
                images.points[index] = scale(ray, times).map(|x| x as f32);
                images.features[index] = feature;
            }
        };
        let centre = |index: u32| f64::from(index * stride) + 0.5;
        if let Some((ground_m, class)) = self.scene.ground {
            let below_m = ground_m - pose.position.height_m;
            for (row, column) in (0..height).flat_map(|row| (0..width).map(move |column| (row, column))) {
                let ray = camera.ray_at_unit_depth([centre(column), centre(row)]);
                let times = below_m / ray[2];
                if times > 1e-9 && times.is_finite() {
                    set(column, row, ray, times, class, 0);
                }
            }
        }
        for face in self.scene.faces(with_descriptors) {
            let feature = face.rectangle.fid.map_or(0, |fid| self.feature_value(fid));
            let [columns, rows] = bounds(&camera, &face, stride, [width, height]);
            for (row, column) in rows.flat_map(|row| columns.clone().map(move |column| (row, column))) {
                let ray = camera.ray_at_unit_depth([centre(column), centre(row)]);
                if let Some(meeting) = face.meet(pose.position, ray) {
                    set(column, row, ray, meeting.times, meeting.class, feature);
                }
            }
        }
        images
    }

    fn feature_value(&self, fid: u64) -> u32 {
        self.scene.descriptors.iter().position(|(own, _)| *own == fid).map_or(0, |index| index as u32 + 1)
    }

    fn cast(&self, faces: &[Face], origin: GridPoint, direction: [f64; 3]) -> Option<RayHit> {
        let length = norm(direction);
        let towards_origin = |normal: [f64; 3]| if dot(normal, direction) > 0.0 { scale(normal, -1.0) } else { normal };
        let hit = |times: f64, normal: [f64; 3], class: ClassId, fid: Option<u64>| RayHit {
            point: offset(origin, scale(direction, times)),
            range_m: times * length,
            normal: towards_origin(normal),
            class,
            fid,
        };
        let ground = self.scene.ground.and_then(|(ground_m, class)| {
            let times = (ground_m - origin.height_m) / direction[2];
            (times > 1e-9 && times.is_finite()).then(|| hit(times, [0.0, 0.0, 1.0], class, None))
        });
        faces
            .iter()
            .filter_map(|face| {
                let meeting = face.meet(origin, direction)?;
                Some(hit(meeting.times, face.normal, meeting.class, face.rectangle.fid))
            })
            .chain(ground)
            .min_by(|a, b| a.range_m.total_cmp(&b.range_m))
    }
}

/// Columns and rows that may show `face`; all when a corner is behind the camera.
fn bounds(camera: &ToyCamera, face: &Face, stride: u32, [width, height]: [u32; 2]) -> [std::ops::Range<u32>; 2] {
    let corners: Option<Vec<[f64; 2]>> = face.rectangle.corners.iter().map(|corner| camera.project(*corner)).collect();
    let Some(corners) = corners else { return [0..width, 0..height] };
    let along = |axis: usize, end: u32| {
        let low = corners.iter().map(|corner| corner[axis]).fold(f64::INFINITY, f64::min);
        let high = corners.iter().map(|corner| corner[axis]).fold(f64::NEG_INFINITY, f64::max);
        let index = |pixel: f64| (pixel / f64::from(stride)).clamp(0.0, f64::from(end)) as u32;
        index(low - 1.0)..(index(high + 1.0) + 1).min(end)
    };
    [along(0, width), along(1, height)]
}

impl ToyCapture {
    /// What the detector and the estimator get.
    pub fn comparison(&self) -> Comparison<'_> {
        let (width, height) = (self.view.width, self.view.height);
        let photo = ImageRef::new(&self.photo, width, height, width as usize);
        Comparison {
            photo: photo.expect("invariant: the photo has the size of the camera"),
            view: self.view.view(),
            camera: self.camera,
            estimate: self.estimate,
        }
    }
}

fn not_offered<T>(service: &str) -> Result<T, Error> {
    Err(Error(format!("the toy host does not offer {service}")))
}

impl Host for ToyHost {
    fn classes(&self) -> &ClassTable {
        &self.classes
    }

    fn render(&self, stride: u32, with_descriptors: bool, poses: &[Pose]) -> Result<Vec<ViewImages>, Error> {
        self.map()?;
        Ok(poses.iter().map(|pose| self.images(pose, stride, with_descriptors)).collect())
    }

    fn compare_views(&self, request: &CompareRequest, poses: &[Pose]) -> Result<Vec<ViewCounts>, Error> {
        self.map()?;
        poses.iter().map(|pose| self.compared(request, pose)).collect()
    }

    /// Compares a view at every heading: it counts pixels where the host counts cells of a panorama, and shares are alike.
    fn compare_panoramas(&self, request: &PanoramaRequest, positions: &[GridPoint]) -> Result<Vec<ClassCounts>, Error> {
        self.map()?;
        let PanoramaRequest { pitch_rad, roll_rad, ignored_in_photo, ignored_in_view, .. } = *request;
        let views = CompareRequest { stride: 1, ignored_in_photo, ignored_in_view, boundary_tolerance_px: 0.0 };
        let step_rad = std::f64::consts::TAU / f64::from(request.columns.max(1));
        let first = (request.first_yaw_rad / step_rad).round();
        let mut counts = Vec::new();
        for position in positions {
            for heading in 0..request.yaw_count {
                let column = first + f64::from(heading) * f64::from(request.yaw_step_columns);
                let pose = Pose { position: *position, yaw_rad: column * step_rad, pitch_rad, roll_rad };
                counts.extend(self.compared(&views, &pose)?);
            }
        }
        Ok(counts)
    }

    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, Error> {
        self.map()?;
        Ok(vec![false; positions.len()])
    }

    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, Error> {
        self.map()?;
        let camera = ToyCamera::new(self.camera, *pose);
        let unit = |ray: [f64; 3]| scale(ray, 1.0 / norm(ray));
        Ok(pixels.iter().map(|pixel| unit(camera.ray_at_unit_depth(*pixel))).collect())
    }

    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, Error> {
        self.map()?;
        let camera = ToyCamera::new(self.camera, *pose);
        Ok(points.iter().map(|point| camera.project(*point)).collect())
    }

    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, Error> {
        let faces = self.map()?.faces(with_descriptors);
        let within = |hit: &RayHit| hit.range_m <= limit_m;
        Ok(directions.iter().map(|direction| self.cast(&faces, origin, *direction).filter(within)).collect())
    }

    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, Error> {
        let near = |(_, descriptor): &&(u64, Descriptor)| {
            norm(add(<[f64; 3]>::from(descriptor.anchor()), scale(point.into(), -1.0))) <= radius_m
        };
        Ok(self.map()?.descriptors.iter().filter(near).cloned().collect())
    }

    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, Error> {
        let faces = self.map()?.faces(false);
        Ok(self.cast(&faces, point, [0.0, 0.0, -1.0]).map(|hit| hit.point.height_m))
    }

    fn grid_from_wgs84(&self, _: Wgs84) -> Result<GridPoint, Error> {
        not_offered("grid_from_wgs84")
    }

    fn wgs84_from_grid(&self, _: GridPoint) -> Result<Wgs84, Error> {
        not_offered("wgs84_from_grid")
    }

    fn parallel_for(&self, count: usize, task: &(dyn Fn(usize) + Sync)) -> Result<(), Error> {
        (0..count).for_each(task);
        Ok(())
    }

    fn log(&self, _: Level, _: &str) {}

    fn progress(&self, _: f64) {}

    fn cancelled(&self) -> bool {
        self.is_cancelled
    }
}
