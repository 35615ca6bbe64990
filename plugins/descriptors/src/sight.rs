//! What an estimator looks at during one call.

use crate::settings::Settings;
use nalgebra::Vector3;
use resurvey_plugin::schema::{ClassId, GridPoint, Pose};
use resurvey_plugin::{Comparison, Error, Host};

/// Host, photo and view, and the settings. Points are offsets from the camera, E, N, H, metres.
#[derive(Clone, Copy)]
pub struct Sight<'a> {
    /// The host.
    pub host: &'a dyn Host,
    /// Photo and view.
    pub comparison: &'a Comparison<'a>,
    /// The settings.
    pub settings: &'a Settings,
    /// The class of what rays miss, if the table has one.
    pub sky: Option<ClassId>,
}

impl<'a> Sight<'a> {
    /// What is looked at in one call; an error when photo and view differ in size.
    pub fn new(host: &'a dyn Host, comparison: &'a Comparison<'a>, settings: &'a Settings) -> Result<Self, Error> {
        let sky = host.classes().by_name("sky").map(|class| class.index);
        let view = &comparison.view;
        let [width, height] = [comparison.photo.width(), comparison.photo.height()];
        let sizes = [
            [view.labels.width(), view.labels.height()],
            [view.points.width(), view.points.height()],
            [view.features.width(), view.features.height()],
        ];
        if let Some([w, h]) = sizes.into_iter().find(|size| *size != [width, height]) {
            return Err(Error(format!("expected a view of {width}×{height} pixels as the photo has, found {w}×{h}")));
        }
        Ok(Self { host, comparison, settings, sky })
    }

    /// Columns and rows.
    pub fn size(&self) -> [u32; 2] {
        [self.comparison.photo.width(), self.comparison.photo.height()]
    }

    /// The pose of the view.
    pub fn pose(&self) -> &Pose {
        &self.comparison.estimate.pose
    }

    /// Class of the photo; `None` outside the image.
    pub fn photo(&self, u: i64, v: i64) -> Option<ClassId> {
        self.pixel(u, v).map(|[u, v]| ClassId(self.comparison.photo.at(u, v)))
    }

    /// Class of the view; `None` outside the image.
    pub fn view(&self, u: i64, v: i64) -> Option<ClassId> {
        self.pixel(u, v).map(|[u, v]| ClassId(self.comparison.view.labels.at(u, v)))
    }

    /// The point that the view shows; `None` outside the image and where the ray hits nothing.
    pub fn point(&self, u: i64, v: i64) -> Option<Vector3<f64>> {
        let [u, v] = self.pixel(u, v)?;
        let offset = Vector3::from(self.comparison.view.points.at(u, v)).map(f64::from);
        let point = offset + self.from_camera(self.comparison.view.origin);
        point.iter().all(|x| x.is_finite()).then_some(point)
    }

    /// Offset of `point` from the camera.
    pub fn from_camera(&self, point: GridPoint) -> Vector3<f64> {
        Vector3::from(<[f64; 3]>::from(point)) - Vector3::from(<[f64; 3]>::from(self.pose().position))
    }

    /// Grid position of an offset from the camera.
    pub fn to_grid(&self, offset: &Vector3<f64>) -> GridPoint {
        GridPoint::from(<[f64; 3]>::from(Vector3::from(<[f64; 3]>::from(self.pose().position)) + offset))
    }

    fn pixel(&self, u: i64, v: i64) -> Option<[u32; 2]> {
        let [width, height] = self.size();
        let inside = (0..i64::from(width)).contains(&u) && (0..i64::from(height)).contains(&v);
        inside.then_some([u as u32, v as u32])
    }
}
