//! What the services of a scene can be asked. Every number here is finite already; these bounds are so wide that nobody
//! who means it meets them, and keep a bug of a plugin from becoming an overflow or endless work of the host.

use crate::camera::Camera;
use crate::plugin::{LARGEST_RAD, ServiceError};
use crate::version::BoxMm;
use resurvey_schema::service::{CompareRequest, PanoramaRequest};
use resurvey_schema::{GridPoint, Pose};

/// The widest boundary tolerance, pixels of the compared image: wider ones need an image in memory for each pixel, and
/// all boundaries match.
const WIDEST_PX: f64 = 100.0;
/// Columns of a panorama.
const COLUMNS: std::ops::RangeInclusive<u32> = 4..=7200;

type Checked = Result<(), ServiceError>;

fn within(what: &str, unit: &str, limit: f64, values: impl IntoIterator<Item = f64>) -> Checked {
    // A number that is none is not within either.
    match values.into_iter().find(|value| value.abs().partial_cmp(&limit).is_none_or(std::cmp::Ordering::is_gt)) {
        None => Ok(()),
        Some(value) => Err(ServiceError(format!("{what}: expected at most {limit} {unit} from zero, found {value}"))),
    }
}

pub(super) fn points(points: &[GridPoint]) -> Checked {
    within("position", "m", BoxMm::LIMIT_M, points.iter().flat_map(|point| <[f64; 3]>::from(*point)))
}

pub(super) fn poses(poses: &[Pose]) -> Checked {
    within("position", "m", BoxMm::LIMIT_M, poses.iter().flat_map(|pose| <[f64; 3]>::from(pose.position)))?;
    angles(poses.iter().flat_map(|pose| [pose.yaw_rad, pose.pitch_rad, pose.roll_rad]))
}

fn angles(values: impl IntoIterator<Item = f64>) -> Checked {
    within("angle", "rad", LARGEST_RAD, values)
}

pub(super) fn stride(stride: u32, camera: &Camera) -> Checked {
    let longest = camera.width().min(camera.height());
    if (1..=longest).contains(&stride) {
        return Ok(());
    }
    Err(ServiceError(format!("stride is {stride}; expected 1 to {longest}")))
}

pub(super) fn comparison(request: &CompareRequest, camera: &Camera) -> Checked {
    stride(request.stride, camera)?;
    let (widest_px, found_px) = (WIDEST_PX * f64::from(request.stride), request.boundary_tolerance_px);
    if (0.0..=widest_px).contains(&found_px) {
        return Ok(());
    }
    let at = format!("boundary tolerance is {found_px} px at stride {}", request.stride);
    Err(ServiceError(format!("{at}; expected 0 to {widest_px}")))
}

pub(super) fn panorama(request: &PanoramaRequest) -> Checked {
    angles([request.pitch_rad, request.roll_rad, request.first_yaw_rad])?;
    let PanoramaRequest { columns, yaw_count, .. } = *request;
    if !COLUMNS.contains(&columns) {
        let (least, most) = COLUMNS.into_inner();
        return Err(ServiceError(format!("columns is {columns}; expected {least} to {most}")));
    }
    if yaw_count > columns {
        return Err(ServiceError(format!("yaw_count is {yaw_count}; expected at most one a column, {columns}")));
    }
    Ok(())
}
