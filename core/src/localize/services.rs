//! The services of the host on a world and a capture.

use super::World;
use super::arguments;
use super::compare::{PositionPhoto, ViewPhoto};
use crate::camera::{camera_from_world, world_from_camera};
use crate::capture::Capture;
use crate::crs::Crs;
use crate::plugin::{Listener, ServiceError, Services, ViewImages, class_slots};
use crate::render::{RayCaster, SolidMask, view};
use nalgebra::Vector3;
use resurvey_schema::service::{ClassCounts, CompareRequest, Level, PanoramaRequest, RayHit};
use resurvey_schema::{ClassTable, Descriptor, GridPoint, Pose, Wgs84};
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Ways to compare, and heights of cuts, that are kept ready for the next request: a search uses a handful.
const MOST_KEPT: usize = 8;

/// Hears nothing and never cancels.
pub struct Silent;

impl Listener for Silent {
    fn log(&self, _level: Level, _text: &str) {}
    fn progress(&self, _fraction: f64) {}
    fn cancelled(&self) -> bool {
        false
    }
}

/// The services that plugins call while they work on `capture` in `world`.
pub struct SceneServices<'a> {
    world: &'a World,
    capture: &'a Capture,
    crs: Crs,
    listener: &'a dyn Listener,
    view_photos: Mutex<Vec<(CompareRequest, Arc<ViewPhoto>)>>,
    position_photos: Mutex<Vec<(PanoramaRequest, Arc<PositionPhoto>)>>,
    solids: Mutex<Vec<(u64, Arc<SolidMask>)>>,
    rays: OnceLock<RayCaster<'a>>,
    base_rays: OnceLock<RayCaster<'a>>,
}

impl<'a> SceneServices<'a> {
    /// Services on `world`, whose grid is `crs`, for `capture`.
    pub fn new(world: &'a World, capture: &'a Capture, crs: Crs, listener: &'a dyn Listener) -> Self {
        Self {
            world,
            capture,
            crs,
            listener,
            view_photos: Mutex::default(),
            position_photos: Mutex::default(),
            solids: Mutex::default(),
            rays: OnceLock::new(),
            base_rays: OnceLock::new(),
        }
    }

    /// The capture that the services are about.
    pub fn capture(&self) -> &'a Capture {
        self.capture
    }

    /// The world that they look into.
    pub fn world(&self) -> &'a World {
        self.world
    }

    /// Rays into the map with or without its descriptors, prepared when first asked for.
    fn rays(&self, with_descriptors: bool) -> &RayCaster<'a> {
        let rays = if with_descriptors { &self.rays } else { &self.base_rays };
        rays.get_or_init(|| RayCaster::new(self.world.scene(with_descriptors)))
    }

    fn classes_count(&self) -> usize {
        class_slots(self.world.classes())
    }

    /// A service that takes long ends with the call that it is for.
    fn not_cancelled(&self) -> Result<(), ServiceError> {
        if self.cancelled() { Err(ServiceError("the call was cancelled".to_owned())) } else { Ok(()) }
    }
}

/// What was prepared for `request`, made now unless it is one of the last few: a plugin may ask in ever new ways.
fn prepared<R: Copy + PartialEq, P>(
    kept: &Mutex<Vec<(R, Arc<P>)>>,
    request: &R,
    prepare: impl FnOnce() -> P,
) -> Arc<P> {
    let mut kept = kept.lock().unwrap_or_else(PoisonError::into_inner);
    let known = kept.iter().position(|(known, _)| known == request).map(|index| kept.remove(index));
    let (request, made) = known.unwrap_or_else(|| (*request, Arc::new(prepare())));
    kept.push((request, Arc::clone(&made)));
    let excess = kept.len().saturating_sub(MOST_KEPT);
    kept.drain(..excess);
    made
}

impl Services for SceneServices<'_> {
    fn classes(&self) -> &ClassTable {
        self.world.classes()
    }

    fn render(
        &self,
        stride: u32,
        with_descriptors: bool,
        poses: &[Pose],
        receive: &mut dyn FnMut(&ViewImages<'_>),
    ) -> Result<(), ServiceError> {
        arguments::stride(stride, &self.capture.camera)?;
        arguments::poses(poses)?;
        let camera = self.capture.camera.subsampled(stride);
        let scene = self.world.scene(with_descriptors);
        for pose in poses {
            self.not_cancelled()?;
            let view = view(scene, &camera, pose);
            receive(&ViewImages {
                origin: view.origin,
                labels: &view.labels,
                range_m: &view.range_m,
                points: &view.points,
                features: &view.features,
                feature_table: scene.feature_table(),
            });
        }
        Ok(())
    }

    fn compare_views(
        &self,
        request: &CompareRequest,
        poses: &[Pose],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        arguments::comparison(request, &self.capture.camera)?;
        arguments::poses(poses)?;
        let photo = prepared(&self.view_photos, request, || {
            ViewPhoto::new(&self.capture.labels, &self.capture.camera, self.classes_count(), request)
        });
        photo.compare(self.world.scene(true), poses, counts, &|| self.cancelled());
        self.not_cancelled()
    }

    fn compare_panoramas(
        &self,
        request: &PanoramaRequest,
        positions: &[GridPoint],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        arguments::panorama(request)?;
        arguments::points(positions)?;
        let photo = prepared(&self.position_photos, request, || {
            PositionPhoto::new(&self.capture.labels, &self.capture.camera, self.classes_count(), request)
        });
        photo.compare(self.world.scene(true), positions, counts, &|| self.cancelled());
        self.not_cancelled()
    }

    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, ServiceError> {
        arguments::points(positions)?;
        let height_m = |index: &usize| positions[*index].height_m;
        let mut order: Vec<usize> = (0..positions.len()).collect();
        order.sort_by(|a, b| height_m(a).total_cmp(&height_m(b)));
        let mut inside = vec![false; positions.len()];
        for level in order.chunk_by(|a, b| height_m(a).to_bits() == height_m(b).to_bits()) {
            self.not_cancelled()?;
            let cut_m = height_m(&level[0]);
            let make = || SolidMask::at_height(self.world.scene(false), cut_m);
            let solids = prepared(&self.solids, &cut_m.to_bits(), make);
            level.iter().for_each(|index| inside[*index] = solids.contains(positions[*index]));
        }
        Ok(inside)
    }

    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, ServiceError> {
        arguments::poses(&[*pose])?;
        let map_from_camera = world_from_camera(pose);
        let ray = |[u, v]: &[f64; 2]| {
            let ray = self.capture.camera.ray(*u, *v);
            ray.map(|ray| (map_from_camera * ray).into())
                .ok_or_else(|| ServiceError(format!("pixel {u:.1}, {v:.1} has no ray in this camera model")))
        };
        pixels.iter().map(ray).collect()
    }

    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, ServiceError> {
        arguments::poses(&[*pose])?;
        arguments::points(points)?;
        let camera_from_map = camera_from_world(pose);
        let eye = pose.position;
        let pixel = |point: &GridPoint| {
            let offset = Vector3::new(
                point.easting_m - eye.easting_m,
                point.northing_m - eye.northing_m,
                point.height_m - eye.height_m,
            );
            self.capture.camera.project(camera_from_map * offset)
        };
        Ok(points.iter().map(pixel).collect())
    }

    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, ServiceError> {
        arguments::points(&[origin])?;
        let scene = self.world.scene(with_descriptors);
        let rays = self.rays(with_descriptors);
        let fid = |feature: u32| {
            let index = (feature as usize).checked_sub(1)?;
            scene.feature_table().get(index).map(|feature| feature.fid)
        };
        let hit = |direction: &[f64; 3]| {
            let hit = rays.cast(origin, *direction, limit_m)?;
            let fid = fid(hit.feature);
            Some(RayHit { point: hit.point, range_m: hit.range_m, normal: hit.normal, class: hit.class, fid })
        };
        Ok(directions.iter().map(hit).collect())
    }

    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, ServiceError> {
        arguments::points(&[point])?;
        let near =
            |anchor: GridPoint| anchor.plan_distance_m(&point).hypot(anchor.height_m - point.height_m) <= radius_m;
        let found = self.world.descriptors().iter().filter(|(_, descriptor)| near(descriptor.anchor()));
        Ok(found.cloned().collect())
    }

    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, ServiceError> {
        arguments::points(&[point])?;
        Ok(self.rays(false).ground_below(point).map(|hit| hit.point.height_m))
    }

    fn grid_from_wgs84(&self, position: Wgs84) -> Result<GridPoint, ServiceError> {
        self.crs.grid_from_wgs84(position).map_err(|error| ServiceError(error.to_string()))
    }

    fn wgs84_from_grid(&self, point: GridPoint) -> Result<Wgs84, ServiceError> {
        self.crs.wgs84_from_grid(point).map_err(|error| ServiceError(error.to_string()))
    }

    fn log(&self, level: Level, text: &str) {
        self.listener.log(level, text);
    }

    fn progress(&self, fraction: f64) {
        self.listener.progress(fraction);
    }

    fn cancelled(&self) -> bool {
        self.listener.cancelled()
    }
}

#[cfg(test)]
mod tests;
