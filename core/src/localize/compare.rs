//! Comparing many views and panoramas with one photo, at the renderer's speed: what the services of the same names do.

use super::sweep::{ClassPlanes, PanoramaPhoto};
use crate::camera::{Camera, camera_from_world};
use crate::image::LabelImage;
use crate::metrics::{ComparedPhoto, ViewPlanes};
use crate::render::panorama::{Panorama, PanoramaGrid};
use crate::render::{Renderer, Scene, view};
use rayon::prelude::*;
use resurvey_schema::service::{ClassCounts, CompareRequest, PanoramaRequest};
use resurvey_schema::{ClassId, GridPoint, Pose};
use std::sync::{Mutex, PoisonError};

/// Tangents of elevation between which a panorama lies: from −39° to 63°, what a phone held upright in a street sees.
const TANGENTS: [f64; 2] = [-0.8, 2.0];
/// 128 rows: 1.25° at the horizon.
const WORDS: usize = 2;

/// Poses that a thread compares one after the other: neighbours show much the same.
const TOGETHER: usize = 9;
/// Positions that a thread compares one after the other, likewise.
const POSITIONS_TOGETHER: usize = 32;

/// The photo at one stride, ready to be compared with views.
pub struct ViewPhoto {
    camera: Camera,
    photo: ComparedPhoto,
    classes: usize,
    /// Comparers that no thread uses now: they know what showed last.
    spare: Mutex<Vec<Comparer>>,
}

/// What one thread needs to compare views.
pub struct Comparer {
    renderer: Renderer,
    planes: ViewPlanes,
}

impl ViewPhoto {
    /// The photo as `request` wants it compared.
    pub fn new(photo: &LabelImage, camera: &Camera, classes: usize, request: &CompareRequest) -> Self {
        let labels = every(photo, request.stride);
        let tolerance_px = request.boundary_tolerance_px / f64::from(request.stride);
        let CompareRequest { ignored_in_photo, ignored_in_view, .. } = request;
        let photo = ComparedPhoto::new(&labels, classes, tolerance_px, ignored_in_photo, ignored_in_view);
        Self { camera: camera.subsampled(request.stride), photo, classes, spare: Mutex::default() }
    }

    /// Fills `counts[pose][class]`, or some of them once `cancelled` says so.
    pub fn compare(
        &self,
        scene: &Scene,
        poses: &[Pose],
        counts: &mut [ClassCounts],
        cancelled: &(dyn Fn() -> bool + Sync),
    ) {
        let per_pose = poses.par_chunks(TOGETHER).zip(counts.par_chunks_mut((TOGETHER * self.classes).max(1)));
        per_pose.filter(|_| !cancelled()).for_each(|(poses, counts)| {
            self.with_comparer(|comparer| {
                for (pose, counts) in poses.iter().zip(counts.chunks_mut(self.classes.max(1))) {
                    self.compare_one(comparer, scene, pose, counts);
                }
            });
        });
    }

    /// Length of the counts of a pose.
    pub fn classes(&self) -> usize {
        self.classes
    }

    /// Lends what a thread needs for [`compare_one`](Self::compare_one).
    pub fn with_comparer<T>(&self, work: impl FnOnce(&mut Comparer) -> T) -> T {
        let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
        let mut comparer = spare.unwrap_or_else(|| Comparer { renderer: Renderer::new(), planes: self.photo.planes() });
        let done = work(&mut comparer);
        self.spare.lock().unwrap_or_else(PoisonError::into_inner).push(comparer);
        done
    }

    /// Fills the counts of one pose, class by class; fastest when poses that follow each other show much the same.
    pub fn compare_one(&self, comparer: &mut Comparer, scene: &Scene, pose: &Pose, counts: &mut [ClassCounts]) {
        let Comparer { renderer, planes } = comparer;
        match self.camera.pinhole() {
            Some(pinhole) => renderer.render_rows(scene, &pinhole, pose, |v, classes| planes.set_row(v, classes)),
            None => {
                let seen = view(scene, &self.camera, pose).labels;
                let mut row = vec![ClassId::VOID.0; (seen.width() as usize).next_multiple_of(64)];
                for v in 0..seen.height() {
                    row[..seen.width() as usize].copy_from_slice(seen.row(v));
                    planes.set_row(v as usize, &row);
                }
            }
        }
        self.photo.count(planes, counts);
    }
}

/// Every `stride`-th pixel along both axes, starting half a stride in.
pub fn every(image: &LabelImage, stride: u32) -> LabelImage {
    let picked = |length: u32| (stride / 2..length).step_by(stride as usize);
    let values: Vec<u8> =
        picked(image.height()).flat_map(|v| picked(image.width()).map(move |u| image.at(u, v))).collect();
    let (width, height) = (picked(image.width()).count() as u32, picked(image.height()).count() as u32);
    LabelImage::from_values(width, height, values).expect("one value per picked column and row")
}

/// The photo on a panorama grid, ready to be compared with positions.
pub struct PositionPhoto {
    grid: PanoramaGrid,
    photo: PanoramaPhoto,
    request: PanoramaRequest,
    classes: usize,
    /// Column of the first heading.
    first: i64,
    /// Columns that take part, as flags and as indices.
    wanted: Vec<bool>,
    columns: Vec<usize>,
    /// What no thread uses now: panoramas know what showed last.
    spare: Mutex<Vec<(Panorama, ClassPlanes)>>,
}

/// A position and where its counts go.
type Position<'a> = (GridPoint, &'a mut [ClassCounts]);

impl PositionPhoto {
    /// The photo as `request` wants it compared.
    pub fn new(photo: &LabelImage, camera: &Camera, classes: usize, request: &PanoramaRequest) -> Self {
        let grid = PanoramaGrid::new(request.columns, WORDS, TANGENTS[0], TANGENTS[1]);
        let north = Pose {
            position: GridPoint::new(0.0, 0.0, 0.0),
            yaw_rad: 0.0,
            pitch_rad: request.pitch_rad,
            roll_rad: request.roll_rad,
        };
        let camera_from_map = camera_from_world(&north);
        let class_at = |column: usize, row: usize| {
            let [u, v] = camera.project(camera_from_map * grid.direction(column, row))?;
            let inside = u >= 0.0 && v >= 0.0 && u < f64::from(photo.width()) && v < f64::from(photo.height());
            inside.then(|| photo.at(u as u32, v as u32))
        };
        let photo = PanoramaPhoto::new(&grid, classes, &request.ignored_in_photo, class_at);
        let column_rad = std::f64::consts::TAU / f64::from(request.columns);
        let first = (request.first_yaw_rad / column_rad).round() as i64;
        let wanted = photo.wanted(first, request.yaw_step_columns, request.yaw_count);
        let columns = (0..wanted.len()).filter(|&column| wanted[column]).collect();
        Self { grid, photo, request: *request, classes, first, wanted, columns, spare: Mutex::default() }
    }

    /// Fills `counts[position][heading][class]`, or some of them once `cancelled` says so; fastest when positions come in
    /// rows of the same northing.
    pub fn compare(
        &self,
        scene: &Scene,
        positions: &[GridPoint],
        counts: &mut [ClassCounts],
        cancelled: &(dyn Fn() -> bool + Sync),
    ) {
        let per_position = (self.request.yaw_count as usize * self.classes).max(1);
        let mut work: Vec<Position> = positions.iter().copied().zip(counts.chunks_mut(per_position)).collect();
        // Every other row backwards, so that each position is next to the one before.
        let rows = work.chunk_by_mut(|a, b| a.0.northing_m.to_bits() == b.0.northing_m.to_bits());
        rows.skip(1).step_by(2).for_each(<[Position]>::reverse);
        work.par_chunks_mut(POSITIONS_TOGETHER).filter(|_| !cancelled()).for_each(|positions| {
            let spare = self.spare.lock().unwrap_or_else(PoisonError::into_inner).pop();
            let (mut panorama, mut planes) = spare.unwrap_or_else(|| {
                (Panorama::new(&self.grid, &self.wanted), ClassPlanes::new(&self.grid, self.classes))
            });
            for (position, counts) in positions {
                self.compare_one((&mut panorama, &mut planes), scene, *position, counts);
            }
            self.spare.lock().unwrap_or_else(PoisonError::into_inner).push((panorama, planes));
        });
    }

    fn compare_one(
        &self,
        (panorama, planes): (&mut Panorama, &mut ClassPlanes),
        scene: &Scene,
        position: GridPoint,
        counts: &mut [ClassCounts],
    ) {
        panorama.draw(scene, scene.offset(position));
        let classes = |column: usize, classes: &mut [u8]| panorama.classes(scene, column, classes);
        planes.fill(&self.columns, &self.request.ignored_in_view, classes);
        self.photo.counts(planes, self.first, self.request.yaw_step_columns, counts);
    }
}
