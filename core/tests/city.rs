//! The made-up city that the benchmarks use is what they say it is.

#[path = "support/city.rs"]
mod city;

use resurvey_core::render::{RayCaster, SolidMask, view};
use resurvey_schema::GridPoint;

#[test]
fn the_city_has_the_triangles_asked_for_and_streets_that_see_far() {
    for triangles in [20_000, 200_000] {
        let scene = city::city(triangles);
        let (built, buildings) = (scene.positions().len(), scene.objects().len() - 1);
        println!("{built} triangles, {buildings} buildings");
        assert!((built as f64 / triangles as f64 - 1.0).abs() < 0.15, "{built} triangles, asked for {triangles}");
        assert!((2000..2400).contains(&buildings), "{buildings} buildings");
    }
    let scene = city::city(200_000);
    let prior = city::prior();
    let ahead = RayCaster::new(&scene).cast(prior.position, [1.0, 0.0, 0.0], 1000.0);
    assert!(ahead.is_none_or(|hit| hit.range_m > 100.0), "the street is seen for 100 m: {ahead:?}");
    let solids = SolidMask::at_height(&scene, prior.position.height_m);
    assert!(!solids.contains(prior.position), "the prior stands in the street");
    let disc = (-40..=40).flat_map(|north| (-40..=40).map(move |east| (f64::from(east), f64::from(north))));
    let disc: Vec<(f64, f64)> = disc.filter(|(east, north)| east.hypot(*north) <= 40.0).collect();
    let inside = disc.iter().filter(|(east_m, north_m)| {
        let GridPoint { easting_m, northing_m, height_m } = prior.position;
        solids.contains(GridPoint::new(easting_m + east_m, northing_m + north_m, height_m))
    });
    let share = inside.count() as f64 / disc.len() as f64;
    println!("{share:.2} of {} positions are inside buildings", disc.len());
    assert!((0.35..0.65).contains(&share), "{share}");
    let seen = view(&scene, &city::camera(), &prior).labels;
    let classes = (0..9_u8).filter(|class| seen.values().contains(class)).count();
    assert!(classes >= 5, "{classes} classes are in the view");
}
