//! `resurvey query`.

use super::{crs_of, one_format, quoted};
use crate::args::{Query, QueryFormat};
use crate::console::Console;
use crate::document;
use crate::failure::{Failure, MISSING};
use crate::plain::plain;
use crate::region::{self, Shape};
use comfy_table::{Table, presets};
use resurvey_core::crs::Crs;
use resurvey_core::store::{History, MapFile, Snapshot};
use resurvey_core::version::{Feature, FeatureState};
use resurvey_schema::{ClassTable, Descriptor, GridPoint};
use serde_json::{Map, Value, json};

/// Descriptors and objects in a region at a version.
pub fn run(options: &Query, console: &mut Console<'_>) -> Result<u8, Failure> {
    let format = one_format(options.format, [QueryFormat::Json, QueryFormat::Geojson], QueryFormat::Table, console)?;
    let map = MapFile::open_read_only(&options.map)?;
    let snapshot = map.snapshot(map.resolve(&options.at)?)?;
    let crs = crs_of(&map)?;
    check_classes(&options.class, snapshot.classes())?;
    let features = features(options, &snapshot, crs)?;
    let answer = Answer { features: &features, classes: snapshot.classes(), crs, is_wgs84: options.region.wgs84 };
    answer.tell_unplaced(format, console)?;
    match format {
        QueryFormat::Table => answer.table(console)?,
        QueryFormat::Json => {
            let features = features.iter().map(|feature| answer.fields(feature)).collect::<Result<Vec<_>, _>>()?;
            console.document(&json!({ "version": snapshot.version().0, "features": features }))?;
        }
        QueryFormat::Geojson => {
            let features = features.iter().map(|feature| answer.geojson(feature)).collect::<Result<Vec<_>, _>>()?;
            console.document(&json!({ "type": "FeatureCollection", "features": features }))?;
        }
        QueryFormat::Csv => answer.csv(console)?,
    }
    Ok(0)
}

fn check_classes(names: &[String], classes: &ClassTable) -> Result<(), Failure> {
    for name in names {
        if classes.by_name(name).is_none() {
            let known: Vec<&str> = classes.iter().map(|class| class.name.as_str()).collect();
            let text = format!("no class {name:?} in the map; it has {}", known.join(", "));
            return Err(Failure::new(MISSING, anyhow::anyhow!(text)));
        }
    }
    Ok(())
}

fn features(options: &Query, snapshot: &Snapshot<'_>, crs: Crs) -> Result<Vec<Feature>, Failure> {
    let shape = match (&options.polygon, options.near, options.radius) {
        (Some(path), _, _) => Some(Shape::read_polygon(path, crs, options.region.wgs84)?),
        (None, Some([latitude, longitude]), Some(radius_m)) => {
            if !(radius_m.is_finite() && radius_m >= 0.0) {
                return Err(Failure::usage(format!("--radius {radius_m}: expected metres, 0 or more")));
            }
            Some(Shape::Circle { centre: region::grid_point(crs, latitude, longitude)?, radius_m })
        }
        _ => None,
    };
    let bounds = match &shape {
        Some(shape) => Some(region::around(&shape.outline(), region::checked_heights(&options.region)?)?),
        None => region::bbox(&options.region, crs)?,
    };
    let found = match options.observed_at {
        Some(time) => snapshot.features_observed(time, bounds.as_ref())?,
        None => snapshot.features(bounds.as_ref())?,
    };
    let wanted = |feature: &Feature| {
        let class = feature.state.class().map(|class| snapshot.classes().name(class));
        let of_class = options.class.is_empty()
            || options.class.iter().any(|name| class.is_some_and(|class| class.eq_ignore_ascii_case(name)));
        let inside = match (&shape, &feature.state) {
            (None, _) => true,
            (Some(shape), FeatureState::Descriptor(descriptor)) => shape.holds(descriptor),
            // An object is in a shape when the middle of its box is.
            (Some(shape), FeatureState::Object { .. }) => shape.contains(&middle(&feature.state)),
        };
        of_class && inside
    };
    Ok(found.into_iter().filter(wanted).collect())
}

fn middle(state: &FeatureState) -> GridPoint {
    match state {
        FeatureState::Descriptor(descriptor) => descriptor.anchor(),
        FeatureState::Object { bounds, .. } => {
            let [low, high] = bounds.corners();
            GridPoint::new(
                (low.easting_m + high.easting_m) / 2.0,
                (low.northing_m + high.northing_m) / 2.0,
                (low.height_m + high.height_m) / 2.0,
            )
        }
    }
}

struct Answer<'a> {
    features: &'a [Feature],
    classes: &'a ClassTable,
    crs: Crs,
    is_wgs84: bool,
}

impl Answer<'_> {
    fn class<'b>(&'b self, feature: &'b Feature) -> &'b str {
        match &feature.state {
            FeatureState::Descriptor(descriptor) => self.classes.name(descriptor.class()),
            FeatureState::Object { name, .. } => name,
        }
    }

    /// `x, y, height` of a point: grid metres, or longitude, latitude and ellipsoidal height, which a point outside the
    /// system does not have.
    fn coordinates(&self, point: GridPoint) -> Result<Option<[f64; 3]>, Failure> {
        if !self.is_wgs84 {
            return Ok(Some(point.into()));
        }
        let position = region::wgs84(self.crs, point)?;
        Ok(position.map(|found| [found.longitude_deg, found.latitude_deg, found.ellipsoidal_height_m]))
    }

    fn fields(&self, feature: &Feature) -> Result<Map<String, Value>, Failure> {
        let mut fields = document::feature(feature, self.classes)?;
        if self.is_wgs84 {
            let position = region::wgs84(self.crs, middle(&feature.state))?;
            fields.insert("latitude".to_owned(), json!(position.map(|found| found.latitude_deg)));
            fields.insert("longitude".to_owned(), json!(position.map(|found| found.longitude_deg)));
            fields.insert("ellipsoidal_height".to_owned(), json!(position.map(|found| found.ellipsoidal_height_m)));
            fields.insert("wgs84".to_owned(), json!(region::geojson(self.crs, &feature.state)?));
        }
        Ok(fields)
    }

    /// Says how many features have no place where degrees are asked for.
    fn tell_unplaced(&self, format: QueryFormat, console: &mut Console<'_>) -> Result<(), Failure> {
        if format == QueryFormat::Geojson || self.is_wgs84 {
            let mut count = 0;
            for feature in self.features {
                count += usize::from(region::geojson(self.crs, &feature.state)?.is_none());
            }
            region::tell_unplaced(count, self.crs, console);
        }
        Ok(())
    }

    fn table(&self, console: &mut Console<'_>) -> Result<(), Failure> {
        let mut table = Table::new();
        let [x, y, h] = if self.is_wgs84 { ["longitude", "latitude", "ellipsoidal m"] } else { ["E m", "N m", "H m"] };
        table.load_preset(presets::NOTHING).set_header([
            "fid",
            "kind",
            "class or name",
            x,
            y,
            h,
            "size m",
            "from",
            "to",
        ]);
        for feature in self.features {
            let digits = if self.is_wgs84 { 8 } else { 2 };
            let place = self.coordinates(middle(&feature.state))?;
            let cell =
                |axis: usize, digits: usize| place.map_or("-".to_owned(), |place| format!("{:.digits$}", place[axis]));
            table.add_row([
                feature.fid.to_string(),
                feature.state.kind_name().to_owned(),
                plain(self.class(feature)).into_owned(),
                cell(0, digits),
                cell(1, digits),
                cell(2, 2),
                size(&feature.state, self.classes),
                feature.from.to_string(),
                feature.to.map_or_else(|| "-".to_owned(), |version| version.to_string()),
            ]);
        }
        console.line(table.trim_fmt())?;
        console.message(&format!("{} features", self.features.len()));
        Ok(())
    }

    fn csv(&self, console: &mut Console<'_>) -> Result<(), Failure> {
        let [x, y, h] = if self.is_wgs84 {
            ["longitude", "latitude", "ellipsoidal_height"]
        } else {
            ["easting", "northing", "height"]
        };
        console.line(format_args!("fid,kind,class,name,{x},{y},{h},width_m,height_m,area_m2,sigma_m,from,to"))?;
        for feature in self.features {
            let place = self.coordinates(middle(&feature.state))?;
            let [east, north, height] =
                [0, 1, 2].map(|axis| place.map_or_else(String::new, |place| place[axis].to_string()));
            let fields = document::feature(feature, self.classes)?;
            let cell =
                |key: &str| fields.get(key).filter(|value| !value.is_null()).map_or_else(String::new, Value::to_string);
            let text = |key: &str| quoted(fields.get(key).and_then(Value::as_str).unwrap_or_default());
            console.line(format_args!(
                "{},{},{},{},{east},{north},{height},{},{},{},{},{},{}",
                feature.fid,
                feature.state.kind_name(),
                text("class"),
                text("name"),
                cell("width_m"),
                cell("height_m"),
                cell("area_m2"),
                cell("sigma_m"),
                cell("from"),
                cell("to"),
            ))?;
        }
        Ok(())
    }

    /// A GeoJSON feature in WGS84.
    fn geojson(&self, feature: &Feature) -> Result<Value, Failure> {
        let geometry = region::geojson(self.crs, &feature.state)?;
        let properties = document::feature(feature, self.classes)?;
        Ok(json!({ "type": "Feature", "id": feature.fid.0, "geometry": geometry, "properties": properties }))
    }
}

fn size(state: &FeatureState, classes: &ClassTable) -> String {
    match state {
        FeatureState::Descriptor(Descriptor::Dynamic(dynamic)) => {
            let [along, across, up] = dynamic.size_m;
            format!("{along:.2} x {across:.2} x {up:.2}")
        }
        FeatureState::Descriptor(descriptor) => {
            let file = resurvey_core::version::descriptor_to_file(descriptor, classes);
            format!("{:.2} x {:.2}", file.width_m.unwrap_or_default(), file.height_m.unwrap_or_default())
        }
        FeatureState::Object { bounds, .. } => {
            let [low, high] = bounds.corners();
            let (e, n, h) =
                (high.easting_m - low.easting_m, high.northing_m - low.northing_m, high.height_m - low.height_m);
            format!("{e:.1} x {n:.1} x {h:.1}")
        }
    }
}
