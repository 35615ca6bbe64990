//! The services with a hand on the cancel button, and with buildings wherever a trial wants them.

use super::super::input::ViewImages;
use super::super::services::{ServiceError, Services};
use resurvey_schema::service::{ClassCounts, CompareRequest, Level, PanoramaRequest, RayHit};
use resurvey_schema::{ClassTable, Descriptor, GridPoint, Pose, Wgs84};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::time::{Duration, Instant};

/// Services that count how often they are used.
pub(super) struct Watched<'a> {
    inner: &'a dyn Services,
    used: AtomicUsize,
    cancel_after: Option<usize>,
    cancelled_at: OnceLock<Instant>,
    free: Option<(GridPoint, f64)>,
}

impl<'a> Watched<'a> {
    pub(super) fn new(inner: &'a dyn Services) -> Self {
        Self { inner, used: AtomicUsize::new(0), cancel_after: None, cancelled_at: OnceLock::new(), free: None }
    }

    /// Everything further than `radius_m` from `centre` lies inside a building: a search that asks is short.
    pub(super) fn around(inner: &'a dyn Services, centre: GridPoint, radius_m: f64) -> Self {
        Self { free: Some((centre, radius_m)), ..Self::new(inner) }
    }

    /// Cancelled from the beginning, or once `uses` services were used.
    pub(super) fn cancelled_after(inner: &'a dyn Services, uses: usize) -> Self {
        let watched = Self { cancel_after: Some(uses), ..Self::new(inner) };
        watched.look();
        watched
    }

    /// How often services were used.
    pub(super) fn used(&self) -> usize {
        self.used.load(Ordering::Relaxed)
    }

    /// How long ago the call was cancelled; `None` when it was not.
    pub(super) fn since_cancel(&self) -> Option<Duration> {
        self.cancelled_at.get().map(Instant::elapsed)
    }

    fn look(&self) {
        if self.cancel_after.is_some_and(|uses| self.used() >= uses) {
            self.cancelled_at.get_or_init(Instant::now);
        }
    }

    fn using(&self) -> &'a dyn Services {
        self.used.fetch_add(1, Ordering::Relaxed);
        self.look();
        self.inner
    }
}

impl Services for Watched<'_> {
    fn classes(&self) -> &ClassTable {
        self.inner.classes()
    }

    fn render(
        &self,
        stride: u32,
        with_descriptors: bool,
        poses: &[Pose],
        receive: &mut dyn FnMut(&ViewImages<'_>),
    ) -> Result<(), ServiceError> {
        self.using().render(stride, with_descriptors, poses, receive)
    }

    fn compare_views(
        &self,
        request: &CompareRequest,
        poses: &[Pose],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        self.using().compare_views(request, poses, counts)
    }

    fn compare_panoramas(
        &self,
        request: &PanoramaRequest,
        positions: &[GridPoint],
        counts: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        self.using().compare_panoramas(request, positions, counts)
    }

    fn inside_solid(&self, positions: &[GridPoint]) -> Result<Vec<bool>, ServiceError> {
        let mut inside = self.using().inside_solid(positions)?;
        if let Some((centre, radius_m)) = self.free {
            let is_far = positions.iter().map(|position| position.plan_distance_m(&centre) > radius_m);
            inside.iter_mut().zip(is_far).for_each(|(inside, is_far)| *inside |= is_far);
        }
        Ok(inside)
    }

    fn pixel_rays(&self, pose: &Pose, pixels: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, ServiceError> {
        self.using().pixel_rays(pose, pixels)
    }

    fn project(&self, pose: &Pose, points: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, ServiceError> {
        self.using().project(pose, points)
    }

    fn cast_rays(
        &self,
        origin: GridPoint,
        directions: &[[f64; 3]],
        limit_m: f64,
        with_descriptors: bool,
    ) -> Result<Vec<Option<RayHit>>, ServiceError> {
        self.using().cast_rays(origin, directions, limit_m, with_descriptors)
    }

    fn descriptors_near(&self, point: GridPoint, radius_m: f64) -> Result<Vec<(u64, Descriptor)>, ServiceError> {
        self.using().descriptors_near(point, radius_m)
    }

    fn ground_height(&self, point: GridPoint) -> Result<Option<f64>, ServiceError> {
        self.using().ground_height(point)
    }

    fn grid_from_wgs84(&self, position: Wgs84) -> Result<GridPoint, ServiceError> {
        self.using().grid_from_wgs84(position)
    }

    fn wgs84_from_grid(&self, point: GridPoint) -> Result<Wgs84, ServiceError> {
        self.using().wgs84_from_grid(point)
    }

    fn parallel_for(&self, count: usize, task: &(dyn Fn(usize) + Sync)) -> Result<(), ServiceError> {
        self.using().parallel_for(count, task)
    }

    fn log(&self, level: Level, text: &str) {
        self.inner.log(level, text);
    }

    fn progress(&self, fraction: f64) {
        self.inner.progress(fraction);
    }

    fn cancelled(&self) -> bool {
        self.since_cancel().is_some() || self.inner.cancelled()
    }
}
