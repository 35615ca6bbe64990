//! The two places, and photos of them cast ray by ray: geometry alone, nothing of the renderer that is judged.

use nalgebra::Vector3;
use resurvey_core::camera::{Camera, world_from_camera};
use resurvey_core::image::LabelImage;
use resurvey_core::mesh::{Mesh, Object, Surface};
use resurvey_schema::{ClassId, ClassTable, GridPoint, Pose};

/// Where the two places are; offsets below are from here: east, north, up, metres.
pub const ORIGIN: GridPoint = GridPoint::new(835_000.0, 817_000.0, 4.0);
/// Half the side of the level ground, and half the length of the wall.
const REACH_M: f64 = 300.0;
/// Top of the wall: above every photo of the experiment.
const WALL_TOP_M: f64 = 60.0;

/// An upright rectangle on the wall, or a box on the ground.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Thing {
    /// West, east, lowest and highest edge, just before the wall that many metres north.
    Banner { sides_m: [f64; 4], wall_m: f64 },
    /// Centre of its foot that many metres north; along, across, up.
    Pedestrian { north_m: f64, size_m: [f64; 3] },
}

/// The classes that the places show.
pub struct Classes {
    pub ground: ClassId,
    pub wall: ClassId,
    pub sky: ClassId,
    pub banner: ClassId,
    pub pedestrian: ClassId,
}

impl Classes {
    /// Those of `table`, void where it lacks one.
    pub fn of(table: &ClassTable) -> Self {
        let named = |name: &str| table.by_name(name).map_or(ClassId::VOID, |class| class.index);
        Self {
            ground: named("others"),
            wall: named("stone"),
            sky: named("sky"),
            banner: named("banner"),
            pedestrian: named("pedestrian"),
        }
    }
}

/// The place as the map has it, without the thing.
pub fn objects(thing: &Thing, classes: &Classes) -> Vec<Object> {
    let side = REACH_M as f32;
    let ground = [[-side, -side, 0.0], [side, -side, 0.0], [side, side, 0.0], [-side, side, 0.0]];
    let mut objects = vec![quad("ground", ground, classes.ground)];
    if let Thing::Banner { wall_m, .. } = thing {
        let (north, top) = (*wall_m as f32, WALL_TOP_M as f32);
        let wall = [[-side, north, 0.0], [side, north, 0.0], [side, north, top], [-side, north, top]];
        objects.push(quad("wall", wall, classes.wall));
    }
    objects
}

fn quad(name: &str, corners: [[f32; 3]; 4], class: ClassId) -> Object {
    let mesh = Mesh {
        origin: ORIGIN,
        vertices: corners.to_vec(),
        uvs: Vec::new(),
        triangles: vec![[0, 1, 2], [0, 2, 3]],
        triangle_surfaces: vec![0, 0],
        surfaces: vec![Surface::Class(class)],
    };
    Object { name: name.to_owned(), mesh }
}

/// The photo that `camera` takes of the place with the thing from `pose`.
pub fn photo(thing: &Thing, classes: &Classes, camera: &Camera, pose: &Pose) -> LabelImage {
    let from = Vector3::new(
        pose.position.easting_m - ORIGIN.easting_m,
        pose.position.northing_m - ORIGIN.northing_m,
        pose.position.height_m - ORIGIN.height_m,
    );
    let turn = world_from_camera(pose);
    let mut labels = LabelImage::filled(camera.width(), camera.height(), ClassId::VOID.0);
    for v in 0..camera.height() {
        for u in 0..camera.width() {
            if let Some(ray) = camera.ray(f64::from(u) + 0.5, f64::from(v) + 0.5) {
                labels.set(u, v, class_along(thing, classes, from, turn * ray).0);
            }
        }
    }
    labels
}

/// The class that a ray meets first.
fn class_along(thing: &Thing, classes: &Classes, from: Vector3<f64>, ray: Vector3<f64>) -> ClassId {
    let ground_m = if ray.z < 0.0 { -from.z / ray.z } else { f64::INFINITY };
    match thing {
        Thing::Banner { sides_m: [west, east, low, high], wall_m } => {
            let distance_m = if ray.y > 0.0 { (wall_m - from.y) / ray.y } else { f64::INFINITY };
            let at = from + ray * distance_m;
            match () {
                () if ground_m < distance_m => classes.ground,
                () if !distance_m.is_finite() || at.z > WALL_TOP_M => classes.sky,
                () if (*west..*east).contains(&at.x) && (*low..*high).contains(&at.z) => classes.banner,
                () => classes.wall,
            }
        }
        Thing::Pedestrian { north_m, size_m: [along, across, up] } => {
            let low = Vector3::new(-across / 2.0, north_m - along / 2.0, 0.0);
            let high = Vector3::new(across / 2.0, north_m + along / 2.0, *up);
            match meets_box(from, ray, low, high) {
                Some(distance_m) if distance_m <= ground_m => classes.pedestrian,
                _ if ground_m.is_finite() => classes.ground,
                _ => classes.sky,
            }
        }
    }
}

/// How far along `ray` the box begins.
fn meets_box(from: Vector3<f64>, ray: Vector3<f64>, low: Vector3<f64>, high: Vector3<f64>) -> Option<f64> {
    let (mut enter, mut leave) = (0.0_f64, f64::INFINITY);
    for axis in 0..3 {
        let (a, b) = ((low[axis] - from[axis]) / ray[axis], (high[axis] - from[axis]) / ray[axis]);
        enter = enter.max(a.min(b));
        leave = leave.min(a.max(b));
    }
    (enter < leave).then_some(enter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_what_geometry_says() {
        let classes = Classes::of(&ClassTable::default());
        let banner = Thing::Banner { sides_m: [-3.0, 3.0, 5.0, 9.0], wall_m: 20.0 };
        let person = Thing::Pedestrian { north_m: 6.0, size_m: [0.5, 0.5, 1.7] };
        let eye = Vector3::new(0.0, 0.0, 1.6);
        let seen = |thing: &Thing, to: [f64; 3]| class_along(thing, &classes, eye, Vector3::from(to) - eye);
        assert_eq!(seen(&banner, [0.0, 20.0, 7.0]), classes.banner);
        assert_eq!(seen(&banner, [3.01, 20.0, 7.0]), classes.wall);
        assert_eq!(seen(&banner, [0.0, 10.0, 0.0]), classes.ground);
        assert_eq!(seen(&banner, [0.0, -10.0, 5.0]), classes.sky);
        assert_eq!(seen(&person, [0.0, 5.75, 0.01]), classes.pedestrian);
        assert_eq!(seen(&person, [0.0, 5.75, 1.71]), classes.sky);
        assert_eq!(seen(&person, [0.0, 5.5, 0.0]), classes.ground);
        assert_eq!(seen(&person, [0.26, 5.75, 1.0]), classes.ground);
    }
}
