//! Any projected EPSG code ⇄ WGS84 through PROJ. PROJ's Rust interface is 2D: heights pass through unchanged.
//!
//! A conversion object of PROJ may not change threads, so each thread makes its own, once for each code.

use super::{Crs, CrsError, GridPoint, Wgs84};
use proj::{Area, Proj};
use serde_json::Value;
use std::cell::RefCell;
use std::collections::BTreeMap;
use std::rc::Rc;

/// How far outside its registered area of use a system is still trusted.
const MARGIN_DEG: f64 = 1.0;

/// WGS84 in the order longitude, latitude.
const LONGITUDE_LATITUDE: &str = "OGC:CRS84";

thread_local! {
    static CONVERSIONS: RefCell<BTreeMap<u32, Rc<Conversion>>> = const { RefCell::new(BTreeMap::new()) };
}

/// Both directions between one system and WGS84.
struct Conversion {
    crs: Crs,
    wgs84_from_grid: Proj,
    grid_from_wgs84: Proj,
    northing_first: bool,
    area: Option<Area>,
}

/// WGS84 position of a grid point of EPSG `code`; the height is copied.
pub(super) fn wgs84_from_grid(code: u32, point: GridPoint) -> Result<Wgs84, CrsError> {
    let conversion = conversion(code)?;
    let at = conversion.ordered(point.easting_m, point.northing_m);
    let (longitude_deg, latitude_deg) = conversion.convert(&conversion.wgs84_from_grid, at)?;
    if conversion.covers(latitude_deg, longitude_deg) {
        Ok(Wgs84 { latitude_deg, longitude_deg, ellipsoidal_height_m: point.height_m })
    } else {
        Err(conversion.crs.grid_outside(point, conversion.area_of_use()))
    }
}

/// Grid point of EPSG `code` at a WGS84 position; the height is copied.
pub(super) fn grid_from_wgs84(code: u32, position: Wgs84) -> Result<GridPoint, CrsError> {
    let conversion = conversion(code)?;
    if !conversion.covers(position.latitude_deg, position.longitude_deg) {
        return Err(conversion.crs.wgs84_outside(position, conversion.area_of_use()));
    }
    let (first, second) =
        conversion.convert(&conversion.grid_from_wgs84, (position.longitude_deg, position.latitude_deg))?;
    let (easting_m, northing_m) = conversion.ordered(first, second);
    Ok(GridPoint::new(easting_m, northing_m, position.ellipsoidal_height_m))
}

fn conversion(code: u32) -> Result<Rc<Conversion>, CrsError> {
    if let Some(known) = CONVERSIONS.with_borrow(|conversions| conversions.get(&code).cloned()) {
        return Ok(known);
    }
    let made = Rc::new(Conversion::new(code)?);
    CONVERSIONS.with_borrow_mut(|conversions| conversions.insert(code, Rc::clone(&made)));
    Ok(made)
}

impl Conversion {
    /// Asks PROJ for its operations by code, but never for a "ballpark" one, which drops the datum shift.
    fn new(code: u32) -> Result<Self, CrsError> {
        let crs = Crs::Epsg(code);
        let unusable = |found: String| CrsError::NotProjected { crs, found };
        let system = Proj::new(&crs.to_string()).map_err(|reason| unusable(reason.to_string()))?;
        let description = system.to_projjson(None, None, None).map_err(|reason| unusable(reason.to_string()))?;
        let northing_first = northing_first(&description).map_err(unusable)?;
        let wgs84 = Proj::new(LONGITUDE_LATITUDE).map_err(|reason| unusable(reason.to_string()))?;
        let between =
            |from: &Proj, to: &Proj| {
                from.create_crs_to_crs_from_pj(to, None, Some(vec!["ALLOW_BALLPARK=NO"]))
                    .map_err(|reason| CrsError::Proj { crs, at: [f64::NAN; 2], reason: reason.to_string() })
            };
        Ok(Self {
            crs,
            wgs84_from_grid: between(&system, &wgs84)?,
            grid_from_wgs84: between(&wgs84, &system)?,
            northing_first,
            area: system.area_of_use().ok().and_then(|(area, _)| area),
        })
    }

    /// Easting, northing in the order of the register, and back.
    fn ordered(&self, first: f64, second: f64) -> (f64, f64) {
        if self.northing_first { (second, first) } else { (first, second) }
    }

    fn convert(&self, operation: &Proj, at: (f64, f64)) -> Result<(f64, f64), CrsError> {
        let failed = |reason: String| CrsError::Proj { crs: self.crs, at: [at.0, at.1], reason };
        let (x, y) = operation.convert(at).map_err(|reason| failed(reason.to_string()))?;
        if x.is_finite() && y.is_finite() { Ok((x, y)) } else { Err(failed("no finite result".to_owned())) }
    }

    fn covers(&self, latitude_deg: f64, longitude_deg: f64) -> bool {
        let Some(area) = self.area else { return latitude_deg.abs() <= 90.0 && longitude_deg.abs() <= 180.0 };
        let width_deg = (area.east - area.west).rem_euclid(360.0);
        let from_west_deg = (longitude_deg - area.west + MARGIN_DEG).rem_euclid(360.0);
        (area.south - MARGIN_DEG..=area.north + MARGIN_DEG).contains(&latitude_deg)
            && latitude_deg.abs() <= 90.0
            && longitude_deg.abs() <= 180.0
            && from_west_deg <= width_deg + 2.0 * MARGIN_DEG
    }

    fn area_of_use(&self) -> String {
        match self.area {
            Some(Area { south, north, west, east }) => {
                format!("latitude {south} to {north}, longitude {west} to {east} (and {MARGIN_DEG} degree around)")
            }
            None => "latitude -90 to 90, longitude -180 to 180".to_owned(),
        }
    }
}

/// Whether the register puts the northing first; fails, saying what it found, unless the axes are east and north in
/// metres.
fn northing_first(description: &str) -> Result<bool, String> {
    let crs: Value = serde_json::from_str(description).map_err(|reason| reason.to_string())?;
    let kind = crs["type"].as_str().unwrap_or("a system without a type");
    let axes = crs["coordinate_system"]["axis"].as_array().map(Vec::as_slice).unwrap_or_default();
    let directions: Vec<_> = axes.iter().map(|axis| axis["direction"].as_str().unwrap_or("?")).collect();
    let units: Vec<_> = axes.iter().map(|axis| unit(&axis["unit"])).collect();
    match (kind, directions.as_slice(), units.as_slice()) {
        ("ProjectedCRS", ["east", "north"], ["metre", "metre"]) => Ok(false),
        ("ProjectedCRS", ["north", "east"], ["metre", "metre"]) => Ok(true),
        _ => Err(format!("{kind} with axes {} in {}", directions.join(", "), units.join(", "))),
    }
}

/// Name of a unit: a string for the common ones, an object with a name for the rest.
fn unit(unit: &Value) -> &str {
    unit.as_str().or(unit["name"].as_str()).unwrap_or("?")
}
