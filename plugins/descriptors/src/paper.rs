//! The paper's own estimation (Lee & Hsu, §3.9, Alg. 1–3), errata aside, so that its results can be reproduced: support
//! points as corners, the depth at the corner pixels, the triple product, the whole image's border, the lowest pixel.

use crate::contact::ground_contact;
use crate::outline::Outline;
use crate::plane::Plane;
use crate::rectangle;
use crate::requirement::{Stop, Unmet, at_most};
use crate::sight::Sight;
use crate::window::rays;
use nalgebra::{Vector2, Vector3};
use resurvey_plugin::schema::{ChangeRegion, DynamicDescriptor, MaterialDescriptor};

/// Limit of the triple product of a quadrilateral's edges, m³. The paper says "≅ 0"; it grows with the cube of the size.
const TRIPLE_PRODUCT_LIMIT_M3: f64 = 0.1;

/// Alg. 1: the corners of `region` as the view has them. `border_pixels` are those of *all* regions.
pub fn material(
    sight: &Sight<'_>,
    region: &ChangeRegion,
    outline: &Outline,
    border_pixels: usize,
) -> Result<MaterialDescriptor, Stop> {
    at_most("captured-entirely", border_pixels as f64, 0.0, "px")?;
    let limit_m = sight.settings.max_range_m;
    let sky = Unmet { requirement: "within-range", measured: f64::MAX, limit: limit_m, unit: "m" };
    let point = |towards: [i64; 2]| {
        let furthest = outline.pixels().max_by_key(|[u, v]| towards[0] * i64::from(*u) + towards[1] * i64::from(*v));
        furthest.and_then(|[u, v]| sight.point(i64::from(u), i64::from(v))).ok_or(sky)
    };
    let corners = [point([-1, 1])?, point([1, 1])?, point([1, -1])?, point([-1, -1])?];
    let range_m = corners.iter().map(Vector3::norm).fold(0.0, f64::max);
    at_most("within-range", range_m, limit_m, "m")?;
    let [a, b, c, d] = corners;
    let triple_m3 = (b - a).cross(&(c - a)).dot(&(d - a)).abs();
    at_most("coplanar", triple_m3, TRIPLE_PRODUCT_LIMIT_M3, "m3")?;
    let no_plane = Unmet { requirement: "coplanar", measured: 0.0, limit: 3.0, unit: "points" };
    let normal = (c - a).cross(&(d - b)).try_normalize(1e-9).ok_or(no_plane)?;
    let plane = Plane::new(corners.iter().sum::<Vector3<f64>>() / 4.0, normal).ok_or(no_plane)?;
    let flat = rectangle::in_order(corners.map(|corner| plane.coordinates(&corner)));
    let settings = sight.settings;
    at_most("rectangle", rectangle::side_difference(&flat), settings.max_side_difference, "ratio")?;
    at_most("rectangle", rectangle::angle_difference_deg(&flat), settings.max_angle_difference_deg, "deg")?;
    let corners = flat.map(|corner: Vector2<f64>| sight.to_grid(&plane.at(&corner)));
    Ok(MaterialDescriptor { class: region.class_after, corners, normal: plane.normal.into(), sigma: None })
}

/// Eq. 16: the centroid's column and the lowest row, cast to the ground.
pub fn dynamic(
    sight: &Sight<'_>,
    region: &ChangeRegion,
    outline: &Outline,
    border_pixels: usize,
) -> Result<DynamicDescriptor, Stop> {
    at_most("captured-entirely", border_pixels as f64, 0.0, "px")?;
    let no_size = Unmet { requirement: "predefined-size", measured: 0.0, limit: 1.0, unit: "sizes" };
    let size_m = sight.host.classes().get(region.class_after).and_then(|class| class.size_m).ok_or(no_size)?;
    let (sum, count) = outline.pixels().fold((0.0, 0.0), |(sum, count), [u, _]| (sum + f64::from(u), count + 1.0));
    let foot_px = [sum / f64::max(count, 1.0) + 0.5, f64::from(outline.bounds.bottom) - 0.5];
    let contact = ground_contact(sight, &rays(sight.host, sight.pose(), &[foot_px])?[0])?;
    at_most("within-range", contact.norm(), sight.settings.max_range_m, "m")?;
    let position = sight.to_grid(&contact);
    Ok(DynamicDescriptor { class: region.class_after, position, size_m, yaw_rad: None, sigma: None })
}
