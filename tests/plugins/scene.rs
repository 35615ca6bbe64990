//! A scene whose every answer is known: a wall at northing 10 m, the ground at 4 m, one chair.

use resurvey_core::image::{LabelImage, Raster};
use resurvey_core::plugin::{ComparisonInput, PhotoInput, ServiceError, Services, ViewImages, class_slots};
use resurvey_schema::service::{
    ClassCounts, CompareRequest, Level, PanoramaRequest, PoseEstimate, Prior, RayHit, ViewFeature,
};
use resurvey_schema::{
    CameraModel, ClassId, ClassTable, Descriptor, DynamicDescriptor, GridPoint, Intrinsics, Pose, Uncertainty, Wgs84,
};
use std::sync::Mutex;
use std::sync::atomic::{AtomicBool, Ordering};

pub const WIDTH: u32 = 4;
pub const HEIGHT: u32 = 3;
pub const GROUND_M: f64 = 4.0;
pub const POSE: Pose =
    Pose { position: GridPoint::new(836_694.05, 819_069.8, 5.5), yaw_rad: 0.5, pitch_rad: 0.25, roll_rad: -0.125 };
pub const CAMERA: Intrinsics = Intrinsics {
    model: CameraModel::Brown,
    width: WIDTH,
    height: HEIGHT,
    fx: 3.0,
    fy: 3.5,
    cx: 2.0,
    cy: 1.5,
    distortion: [0.1, 0.2, 0.3, 0.4, 0.5],
};
pub const PRIOR: Prior =
    Prior { pose: POSE, position_sigma_m: 10.0, height_sigma_m: 0.5, yaw_sigma_rad: 0.3, tilt_sigma_rad: 0.02 };
pub const ESTIMATE: PoseEstimate = PoseEstimate {
    pose: POSE,
    covariance: [[1.0, 0.5, 0.25], [0.5, 2.0, 0.125], [0.25, 0.125, 3.0]],
    height_sigma_m: 0.75,
    tilt_sigma_rad: 0.01,
};
pub const FEATURES: [ViewFeature; 2] =
    [ViewFeature { fid: 7, class: ClassId(3) }, ViewFeature { fid: u64::MAX, class: ClassId(5) }];

/// The rasters of one capture.
pub struct Rasters {
    pub photo: LabelImage,
    pub labels: LabelImage,
    pub range_m: Raster<f32>,
    pub points: Raster<[f32; 3]>,
    pub features: Raster<u32>,
}

impl Rasters {
    pub fn new() -> Self {
        let pixels = WIDTH * HEIGHT;
        let raster = |first: u8| Raster::from_values(WIDTH, HEIGHT, (first..first + pixels as u8).collect()).unwrap();
        let points = (0..pixels).map(|index| [index as f32, 0.5, -1.0]).collect();
        Self {
            photo: raster(0),
            labels: raster(100),
            range_m: Raster::from_values(WIDTH, HEIGHT, (0..pixels).map(|index| index as f32).collect()).unwrap(),
            points: Raster::from_values(WIDTH, HEIGHT, points).unwrap(),
            features: Raster::from_values(WIDTH, HEIGHT, (0..pixels).map(|index| index % 3).collect()).unwrap(),
        }
    }

    pub fn view(&self) -> ViewImages<'_> {
        ViewImages {
            origin: POSE.position,
            labels: &self.labels,
            range_m: &self.range_m,
            points: &self.points,
            features: &self.features,
            feature_table: &FEATURES,
        }
    }

    pub fn comparison(&self) -> ComparisonInput<'_> {
        ComparisonInput { photo: &self.photo, view: self.view(), camera: &CAMERA, estimate: &ESTIMATE }
    }

    pub fn photo(&self) -> PhotoInput<'_> {
        PhotoInput { labels: &self.photo, camera: &CAMERA, prior: &PRIOR }
    }
}

/// The services.
pub struct Scene {
    pub classes: ClassTable,
    pub rasters: Rasters,
    pub cancelled: AtomicBool,
    pub heard: Mutex<Vec<String>>,
}

impl Scene {
    pub fn new() -> Self {
        Self {
            classes: ClassTable::default(),
            rasters: Rasters::new(),
            cancelled: AtomicBool::new(false),
            heard: Mutex::default(),
        }
    }
}

pub fn chair() -> Descriptor {
    Descriptor::Dynamic(DynamicDescriptor {
        class: ClassId(5),
        position: GridPoint::new(1.0, 2.0, 3.0),
        size_m: [0.5, 0.5, 0.9],
        yaw_rad: Some(1.25),
        sigma: Some(Uncertainty { position_m: 0.25, size_m: None, area_m2: None }),
    })
}

impl Services for Scene {
    fn classes(&self) -> &ClassTable {
        &self.classes
    }

    fn render(
        &self,
        stride: u32,
        with_descriptors: bool,
        poses: &[Pose],
        receive: &mut dyn FnMut(&ViewImages<'_>),
    ) -> Result<(), ServiceError> {
        if stride != 1 || !with_descriptors {
            return Err(ServiceError(format!("asked for stride {stride}, descriptors {with_descriptors}")));
        }
        for pose in poses {
            receive(&ViewImages { origin: pose.position, ..self.rasters.view() });
        }
        Ok(())
    }

    fn compare_views(
        &self,
        request: &CompareRequest,
        poses: &[Pose],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        assert_eq!(counts.len(), poses.len() * class_slots(&self.classes));
        for (index, counts) in counts.iter_mut().enumerate() {
            counts.photo = index as u32;
            counts.view = request.stride;
            counts.both = u32::from(request.ignored_in_photo.contains(ClassId(200)));
            counts.photo_boundary = u32::from(request.ignored_in_view.contains(ClassId(200)));
            counts.view_boundary_matched = request.boundary_tolerance_px as u32;
        }
        Ok(())
    }

    fn compare_panoramas(
        &self,
        request: &PanoramaRequest,
        positions: &[GridPoint],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        assert_eq!(counts.len(), positions.len() * request.yaw_count as usize * class_slots(&self.classes));
        for (index, counts) in counts.iter_mut().enumerate() {
            counts.photo = index as u32;
            counts.view = request.columns + request.yaw_step_columns;
            counts.both = (request.first_yaw_rad + request.pitch_rad + request.roll_rad) as u32;
        }
        Ok(())
    }

    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, ServiceError> {
        Ok(positions.iter().map(|point| point.northing_m > 10.0).collect())
    }

    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, ServiceError> {
        Ok(pixels.iter().map(|[u, v]| [*u, *v, pose.yaw_rad]).collect())
    }

    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, ServiceError> {
        let one =
            |point: &GridPoint| (point.northing_m > 0.0).then_some([point.easting_m + pose.yaw_rad, point.height_m]);
        Ok(points.iter().map(one).collect())
    }

    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, ServiceError> {
        let hit = |direction: &[f64; 3]| {
            let range_m = (10.0 - origin.northing_m) / direction[1];
            (range_m > 0.0 && range_m < limit_m).then(|| RayHit {
                point: GridPoint::new(origin.easting_m, 10.0, origin.height_m),
                range_m,
                normal: [0.0, -1.0, 0.0],
                class: ClassId(1),
                fid: with_descriptors.then_some(9),
            })
        };
        Ok(directions.iter().map(hit).collect())
    }

    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, ServiceError> {
        let near = chair().anchor().plan_distance_m(&point) <= radius_m;
        Ok(if near { vec![(42, chair())] } else { Vec::new() })
    }

    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, ServiceError> {
        Ok((point.height_m >= GROUND_M).then_some(GROUND_M))
    }

    fn grid_from_wgs84(&self, position: Wgs84) -> Result<GridPoint, ServiceError> {
        if position.latitude_deg > 23.0 {
            return Err(ServiceError(format!("latitude {} is outside of Hong Kong", position.latitude_deg)));
        }
        Ok(GridPoint::new(position.longitude_deg, position.latitude_deg, position.ellipsoidal_height_m))
    }

    fn wgs84_from_grid(&self, point: GridPoint) -> Result<Wgs84, ServiceError> {
        let (latitude_deg, longitude_deg) = (point.northing_m, point.easting_m);
        Ok(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m: point.height_m })
    }

    fn log(&self, level: Level, text: &str) {
        self.heard.lock().unwrap().push(format!("{level:?}: {text}"));
    }

    fn progress(&self, fraction: f64) {
        self.heard.lock().unwrap().push(format!("{fraction}"));
    }

    fn cancelled(&self) -> bool {
        self.cancelled.load(Ordering::Relaxed)
    }
}
