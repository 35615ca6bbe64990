//! The maps of the cases, which exist as 3DS and as GLB: both must become the same objects.

use super::*;

struct Map {
    three_ds: Imported,
    glb: Imported,
    triangles: usize,
}

/// Both files of a map, imported with nothing but the origin of its `map.json`.
fn map(scene: &str) -> Option<Map> {
    let folder = shared(&format!("cases/maps/{scene}"))?;
    let json: serde_json::Value = serde_json::from_slice(&std::fs::read(folder.join("map.json")).unwrap()).unwrap();
    let place: [f64; 3] = serde_json::from_value(json["origin"].clone()).unwrap();
    let options = origin(place[0], place[1], place[2]);
    let open = |suffix: &str| import_model(&folder.join(format!("{scene}.{suffix}")), &options, &ClassTable::default());
    let triangles = json["triangles"].as_u64().unwrap() as usize;
    Some(Map { three_ds: open("3ds").unwrap(), glb: open("glb").unwrap(), triangles })
}

#[test]
fn a_map_is_the_same_from_3ds_and_from_glb() {
    for (scene, triangles) in [("street", 212), ("library", 180), ("kowloon", 1126)] {
        let Some(Map { three_ds, glb, triangles: stated }) = map(scene) else { return };
        assert_eq!(stated, triangles);
        for report in [&three_ds.report, &glb.report] {
            assert_eq!((report.triangles, report.degenerate_faces, report.empty_objects), (triangles, 0, 0), "{scene}");
            assert!(report.warnings.is_empty(), "{scene}: {:?}", report.warnings);
        }
        assert_eq!(three_ds.objects.len(), glb.objects.len());
        let mut classes = std::collections::BTreeSet::new();
        let (mut samples, mut different) = (0, 0);
        for (a, b) in three_ds.objects.iter().zip(&glb.objects) {
            assert_eq!(
                (&a.name, a.mesh.origin, a.mesh.triangles.len()),
                (&b.name, b.mesh.origin, b.mesh.triangles.len())
            );
            for index in 0..a.mesh.triangles.len() {
                let apart = corners(&a.mesh, index)
                    .iter()
                    .flatten()
                    .zip(corners(&b.mesh, index).iter().flatten())
                    .map(|(a, b)| (a - b).abs())
                    .fold(0.0, f64::max);
                assert!(apart < 1e-3, "{scene}, {}, face {index}: {apart} m", a.name);
                // 200 points a face, none on an edge.
                for step in 0..200u32 {
                    let (s, t) = (f64::from(step % 20) / 20.0 + 0.013, f64::from(step / 20) / 10.0 + 0.017);
                    let weights = if s + t < 1.0 { [s, t, 1.0 - s - t] } else { [1.0 - s, 1.0 - t, s + t - 1.0] };
                    let class = class_at(&a.mesh, index, weights);
                    samples += 1;
                    different += usize::from(class != class_at(&b.mesh, index, weights));
                    classes.insert(class);
                }
            }
        }
        // Texture coordinates differ in their last bit: a sample on a texel's border may fall to either side.
        assert!(different * 10_000 <= samples, "{scene}: {different} of {samples} samples differ");
        assert!(classes.contains(&STONE) && classes.contains(&GLASS), "{scene}: {classes:?}");
    }
}

#[test]
fn the_street_stands_upright_at_its_origin() {
    let Some(Map { glb, .. }) = map("street") else { return };
    // From the file's own accessor limits: the ground is ±400 m, building b0 is x −150…−127.98, y 0…37.31, z 9…38.36.
    let (low, high) = glb.objects.iter().find(|object| object.name == "ground").unwrap().mesh.bounds();
    assert_eq!((low, high), (GridPoint::new(835_200.0, 817_400.0, 4.5), GridPoint::new(836_000.0, 818_200.0, 4.5)));
    let (low, high) = glb.objects.iter().find(|object| object.name == "b0").unwrap().mesh.bounds();
    for (found, expected) in
        [(low.easting_m, 835_450.0), (low.height_m, 4.5), (high.northing_m, 817_791.0), (high.height_m, 41.806)]
    {
        assert!((found - expected).abs() < 1e-3, "{found} for {expected}");
    }
}

#[test]
fn an_import_is_the_same_every_time() {
    let (Some(first), Some(second)) = (map("kowloon"), map("kowloon")) else { return };
    let bytes = |imported: &Imported| -> Vec<Vec<u8>> {
        imported.objects.iter().map(|object| encode_mesh(&object.mesh)).collect()
    };
    assert_eq!(bytes(&first.three_ds), bytes(&second.three_ds));
    assert_eq!(first.glb, second.glb);
}
