//! The services of a call on a photo that has no place yet: a segmenter's.

use super::input::ViewImages;
use super::services::{Listener, ServiceError, Services};
use resurvey_schema::service::{ClassCounts, CompareRequest, Level, PanoramaRequest, RayHit};
use resurvey_schema::{ClassTable, Descriptor, GridPoint, Pose, Wgs84};

/// The class table, threads and a listener; every service that needs the map or the camera is an error.
pub struct PhotoServices<'a> {
    classes: &'a ClassTable,
    listener: &'a dyn Listener,
}

impl<'a> PhotoServices<'a> {
    /// Services on a map with `classes`.
    pub fn new(classes: &'a ClassTable, listener: &'a dyn Listener) -> Self {
        Self { classes, listener }
    }
}

fn no_place<T>() -> Result<T, ServiceError> {
    Err(ServiceError("a segmenter has no map: nobody knows yet where the photo was taken".to_owned()))
}

impl Services for PhotoServices<'_> {
    fn classes(&self) -> &ClassTable {
        self.classes
    }

    fn render(&self, _: u32, _: bool, _: &[Pose], _: &mut dyn FnMut(&ViewImages<'_>)) -> Result<(), ServiceError> {
        no_place()
    }

    fn compare_views(&self, _: &CompareRequest, _: &[Pose], _: &mut [ClassCounts]) -> Result<(), ServiceError> {
        no_place()
    }

    fn compare_panoramas(
        &self,
        _: &PanoramaRequest,
        _: &[GridPoint],
        _: &mut [ClassCounts],
    ) -> Result<(), ServiceError> {
        no_place()
    }

    fn inside_solid(&self, _: &[GridPoint]) -> Result<Vec<bool>, ServiceError> {
        no_place()
    }

    fn pixel_rays(&self, _: &Pose, _: &[[f64; 2]]) -> Result<Vec<[f64; 3]>, ServiceError> {
        no_place()
    }

    fn project(&self, _: &Pose, _: &[GridPoint]) -> Result<Vec<Option<[f64; 2]>>, ServiceError> {
        no_place()
    }

    fn cast_rays(&self, _: GridPoint, _: &[[f64; 3]], _: f64, _: bool) -> Result<Vec<Option<RayHit>>, ServiceError> {
        no_place()
    }

    fn descriptors_near(&self, _: GridPoint, _: f64) -> Result<Vec<(u64, Descriptor)>, ServiceError> {
        no_place()
    }

    fn ground_height(&self, _: GridPoint) -> Result<Option<f64>, ServiceError> {
        no_place()
    }

    fn grid_from_wgs84(&self, _: Wgs84) -> Result<GridPoint, ServiceError> {
        no_place()
    }

    fn wgs84_from_grid(&self, _: GridPoint) -> Result<Wgs84, ServiceError> {
        no_place()
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
