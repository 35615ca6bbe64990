//! Regions of the map as the command line names them.

use crate::args::Region;
use crate::console::Console;
use crate::failure::{Failure, MAP};
use geo::{Contains, Coord, Distance, Euclidean, Intersects, LineString, Point, Polygon};
use geojson::{GeoJson, Value as Geometry};
use resurvey_core::crs::{Crs, CrsError};
use resurvey_core::version::{BoxMm, FeatureState};
use resurvey_schema::{Descriptor, GridPoint, Wgs84};
use serde_json::{Value, json};
use std::path::Path;

/// Heights of a region that names none, metres: below the deepest cavern, above the highest mast.
const HEIGHTS_M: [f64; 2] = [-10_000.0, 10_000.0];

/// The box of `--bbox` and `--height`; `None` without either.
pub fn bbox(region: &Region, crs: Crs) -> Result<Option<BoxMm>, Failure> {
    let heights = checked_heights(region)?;
    let Some([west, south, east, north]) = region.bbox else {
        let everywhere = [-BoxMm::LIMIT_M, BoxMm::LIMIT_M].map(|metres| GridPoint::new(metres, metres, 0.0));
        return region.height.map(|_| around(&everywhere, heights)).transpose();
    };
    for (low, high, axis) in [(west, east, "E0,E1"), (south, north, "N0,N1")] {
        if low > high {
            return Err(Failure::usage(format!(
                "--bbox {axis}: {low} is above {high}; expected E0,N0,E1,N1 with E0 <= E1 and N0 <= N1"
            )));
        }
    }
    let corners = if region.wgs84 {
        let corners = [(south, west), (south, east), (north, west), (north, east)];
        let order = "--bbox with --wgs84 is longitude,latitude,longitude,latitude";
        let point = |(lat, lon): &(f64, f64)| {
            grid_point(crs, *lat, *lon).map_err(|error| Failure::usage(format!("{error}; {order}")))
        };
        corners.iter().map(point).collect::<Result<Vec<_>, _>>()?
    } else {
        vec![GridPoint::new(west, south, 0.0), GridPoint::new(east, north, 0.0)]
    };
    around(&corners, heights).map(Some)
}

/// Heights of the region, low first.
pub fn checked_heights(region: &Region) -> Result<[f64; 2], Failure> {
    let [low, high] = region.height.unwrap_or(HEIGHTS_M);
    if low > high {
        return Err(Failure::usage(format!("--height: {low} is above {high}; expected H0,H1 with H0 <= H1")));
    }
    Ok([low, high])
}

/// The box around points in plan between two heights.
pub fn around(points: &[GridPoint], [low, high]: [f64; 2]) -> Result<BoxMm, Failure> {
    let at = |height_m: f64| points.iter().map(move |point| GridPoint { height_m, ..*point });
    Ok(BoxMm::around(at(low).chain(at(high)))?)
}

/// The grid point on the ground at a latitude and longitude, degrees.
pub fn grid_point(crs: Crs, latitude_deg: f64, longitude_deg: f64) -> Result<GridPoint, Failure> {
    Ok(crs.grid_from_latitude_longitude(latitude_deg, longitude_deg, 0.0)?)
}

/// WGS84 position of a grid point; `None` outside the area of use of the map's system.
pub fn wgs84(crs: Crs, point: GridPoint) -> Result<Option<Wgs84>, Failure> {
    match crs.wgs84_from_grid(point) {
        Ok(position) => Ok(Some(position)),
        Err(CrsError::GridOutside { .. }) => Ok(None),
        Err(error) => Err(Failure::new(MAP, error)),
    }
}

/// The GeoJSON geometry of a state in WGS84: a closed ring for a rectangle, a point for an object on the ground, the box
/// in plan for an object of the model; `None` where a position is outside the area of use of the map's system.
pub fn geojson(crs: Crs, state: &FeatureState) -> Result<Option<Value>, Failure> {
    let position = |point: GridPoint| -> Result<Option<[f64; 3]>, Failure> {
        let to_array = |found: Wgs84| [found.longitude_deg, found.latitude_deg, found.ellipsoidal_height_m];
        Ok(wgs84(crs, point)?.map(to_array))
    };
    let ring = |corners: &[GridPoint]| -> Result<Option<Value>, Failure> {
        let closed = corners.iter().chain(corners.first());
        let ring = closed.map(|corner| position(*corner)).collect::<Result<Option<Vec<_>>, _>>()?;
        Ok(ring.map(|ring| json!({ "type": "Polygon", "coordinates": [ring] })))
    };
    match state {
        FeatureState::Descriptor(Descriptor::Material(material)) => ring(&material.corners),
        FeatureState::Descriptor(Descriptor::Dynamic(dynamic)) => {
            let place = position(dynamic.position)?;
            Ok(place.map(|place| json!({ "type": "Point", "coordinates": place })))
        }
        FeatureState::Object { bounds, .. } => {
            let [low, high] = bounds.corners();
            let (west, south, east, north) = (low.easting_m, low.northing_m, high.easting_m, high.northing_m);
            let corners = [(west, south), (east, south), (east, north), (west, north)];
            ring(&corners.map(|(e, n)| GridPoint::new(e, n, low.height_m)))
        }
    }
}

/// Says how many of the features that were printed have no position in degrees.
pub fn tell_unplaced(count: usize, crs: Crs, console: &mut Console<'_>) {
    if count > 0 {
        console.message(&format!(
            "warning: {count} features have no position in degrees: they lie outside the area of use of {crs}"
        ));
    }
}

/// A shape in plan that features are asked against after their boxes.
pub enum Shape {
    /// A polygon with holes, grid metres.
    Polygon(Polygon<f64>),
    /// A circle, grid metres.
    Circle {
        /// Its centre.
        centre: GridPoint,
        /// Its radius, metres.
        radius_m: f64,
    },
}

impl Shape {
    /// The polygon in a GeoJSON file: a geometry, a feature, or a collection with one feature.
    pub fn read_polygon(path: &Path, crs: Crs, is_wgs84: bool) -> Result<Self, Failure> {
        let place = path.display();
        let text = std::fs::read_to_string(path).map_err(|error| Failure::input(format!("{place}: {error}")))?;
        let document: GeoJson = text.parse().map_err(|error| {
            Failure::input(format!("{place}: expected one GeoJSON polygon, found something else: {error}"))
        })?;
        let rings = match geometry(document) {
            Ok(Geometry::Polygon(rings)) if !rings.is_empty() => rings,
            other => {
                let found =
                    other.map_or_else(|found| found, |geometry| format!("a {} without rings", geometry.type_name()));
                return Err(Failure::input(format!("{place}: expected one GeoJSON polygon, found {found}")));
            }
        };
        let mut lines = Vec::new();
        for ring in rings {
            // RFC 7946, 3.1.6.
            if ring.len() < 4 || ring.first() != ring.last() {
                let found = ring.len();
                let expected = "expected rings of four positions or more of which the last is the first";
                return Err(Failure::input(format!("{place}: {expected}, found {found} positions")));
            }
            let coordinates = ring.iter().map(|position| match position.as_slice() {
                [x, y, ..] if is_wgs84 => {
                    let point = grid_point(crs, *y, *x).map_err(|error| {
                        Failure::input(format!("{place}: {error}; positions are longitude, latitude"))
                    });
                    point.map(|point| Coord { x: point.easting_m, y: point.northing_m })
                }
                [x, y, ..] => Ok(Coord { x: *x, y: *y }),
                other => {
                    Err(Failure::input(format!("{place}: expected positions of two numbers, found {}", other.len())))
                }
            });
            lines.push(LineString(coordinates.collect::<Result<Vec<_>, _>>()?));
        }
        let outer = lines.remove(0);
        let polygon = Self::Polygon(Polygon::new(outer, lines));
        around(&polygon.outline(), [0.0, 0.0]).map_err(|error| Failure::input(format!("{place}: {error}")))?;
        Ok(polygon)
    }

    /// Points around it in plan.
    pub fn outline(&self) -> Vec<GridPoint> {
        match self {
            Self::Polygon(polygon) => {
                polygon.exterior().coords().map(|point| GridPoint::new(point.x, point.y, 0.0)).collect()
            }
            Self::Circle { centre, radius_m } => [-radius_m, *radius_m]
                .iter()
                .map(|reach| GridPoint::new(centre.easting_m + reach, centre.northing_m + reach, 0.0))
                .collect(),
        }
    }

    /// Whether the point lies in it, in plan.
    pub fn contains(&self, point: &GridPoint) -> bool {
        match self {
            Self::Polygon(polygon) => polygon.contains(&in_plan(point)),
            Self::Circle { centre, radius_m } => centre.plan_distance_m(point) <= *radius_m,
        }
    }

    /// Whether a descriptor belongs to it: its ground contact, or any part of its rectangle, lies in it in plan.
    pub fn holds(&self, descriptor: &Descriptor) -> bool {
        let Descriptor::Material(material) = descriptor else { return self.contains(&descriptor.anchor()) };
        let corners: LineString<f64> =
            material.corners.iter().map(in_plan).chain([in_plan(&material.corners[0])]).collect();
        // On a wall it is a line in plan, and has no inside.
        let footprint = Polygon::new(corners, Vec::new());
        match self {
            Self::Polygon(polygon) => polygon.intersects(footprint.exterior()) || polygon.intersects(&footprint),
            Self::Circle { centre, radius_m } => {
                let centre = Point(in_plan(centre));
                footprint.contains(&centre) || Euclidean.distance(&centre, footprint.exterior()) <= *radius_m
            }
        }
    }
}

fn in_plan(point: &GridPoint) -> Coord<f64> {
    Coord { x: point.easting_m, y: point.northing_m }
}

/// The one polygon in a document, or what is there instead.
fn geometry(document: GeoJson) -> Result<Geometry, String> {
    let of = |geometry: Option<geojson::Geometry>| match geometry.map(|geometry| geometry.value) {
        Some(polygon @ Geometry::Polygon(_)) => Ok(polygon),
        Some(other) => Err(format!("a {}", other.type_name())),
        None => Err("a feature without a geometry".to_owned()),
    };
    match document {
        GeoJson::Geometry(geometry) => of(Some(geometry)),
        GeoJson::Feature(feature) => of(feature.geometry),
        GeoJson::FeatureCollection(mut collection) => match collection.features.len() {
            1 => of(collection.features.remove(0).geometry),
            count => Err(format!("a collection of {count} features")),
        },
    }
}
