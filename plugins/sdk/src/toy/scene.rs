//! The toy world: painted rectangles, boxes made of them, a flat ground, and descriptors on top.

use super::camera::{add, between, cross, dot, norm, offset, scale};
use resurvey_schema::{ClassId, Descriptor, DynamicDescriptor, GridPoint, MaterialDescriptor};

/// How far a material descriptor stands off its wall, metres, so that it is what a ray hits first.
const STAND_OFF_M: f64 = 0.02;

/// Classes on a rectangle.
#[derive(Clone, Debug, PartialEq)]
pub enum Paint {
    /// One class all over.
    Plain(ClassId),
    /// A label texture, nearest texel, never blended.
    Texels {
        /// Texels along the bottom edge.
        columns: usize,
        /// Texels up the left edge.
        rows: usize,
        /// Classes, bottom row first, left to right.
        classes: Vec<ClassId>,
    },
}

/// A painted rectangle, two-sided.
#[derive(Clone, Debug, PartialEq)]
pub struct Rectangle {
    /// Bottom-left, bottom-right, top-right, top-left.
    pub corners: [GridPoint; 4],
    /// Its classes.
    pub paint: Paint,
    /// Feature id; `None` for the base map.
    pub fid: Option<u64>,
}

/// What stands in the toy world.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ToyScene {
    /// The base map without its ground.
    pub rectangles: Vec<Rectangle>,
    /// Height of the endless flat ground, metres, and its class.
    pub ground: Option<(f64, ClassId)>,
    /// The descriptors of the version by rising feature id.
    pub descriptors: Vec<(u64, Descriptor)>,
}

impl ToyScene {
    /// Adds a vertical wall over the plan segment `from`–`to` (seen from outside left to right), metres.
    pub fn add_wall(&mut self, from: [f64; 2], to: [f64; 2], heights_m: [f64; 2], paint: Paint) {
        let corner = |[e, n]: [f64; 2], height_m: f64| GridPoint::new(e, n, height_m);
        let [low, high] = heights_m;
        let corners = [corner(from, low), corner(to, low), corner(to, high), corner(from, high)];
        self.rectangles.push(Rectangle { corners, paint, fid: None });
    }

    /// Adds an upright box of one class: `size_m` along, across, up, standing on `position`.
    pub fn add_box(&mut self, position: GridPoint, size_m: [f64; 3], class: ClassId) {
        let object = DynamicDescriptor { class, position, size_m, yaw_rad: None, sigma: None };
        self.rectangles.extend(box_faces(&object, None));
    }

    /// Puts `descriptor` on the map under the next feature id, which it returns.
    pub fn add_descriptor(&mut self, descriptor: Descriptor) -> u64 {
        let fid = self.descriptors.last().map_or(1, |(last, _)| last + 1);
        self.descriptors.push((fid, descriptor));
        fid
    }

    pub(super) fn faces(&self, with_descriptors: bool) -> Vec<Face> {
        let placed =
            self.descriptors.iter().filter(|_| with_descriptors).flat_map(|(fid, descriptor)| match descriptor {
                Descriptor::Material(material) => vec![on_its_wall(material, *fid)],
                Descriptor::Dynamic(object) => box_faces(object, Some(*fid)),
            });
        self.rectangles.iter().cloned().chain(placed).map(Face::new).collect()
    }
}

fn on_its_wall(material: &MaterialDescriptor, fid: u64) -> Rectangle {
    let corners = material.corners.map(|corner| offset(corner, scale(material.normal, STAND_OFF_M)));
    Rectangle { corners, paint: Paint::Plain(material.class), fid: Some(fid) }
}

fn box_faces(object: &DynamicDescriptor, fid: Option<u64>) -> Vec<Rectangle> {
    let [along_m, across_m, up_m] = object.size_m;
    let (sin_y, cos_y) = object.yaw_rad.unwrap_or(0.0).sin_cos();
    let corner = |along: f64, across: f64, height_m: f64| {
        let (front, side) = (along * along_m / 2.0, across * across_m / 2.0);
        offset(object.position, [front * sin_y + side * cos_y, front * cos_y - side * sin_y, height_m])
    };
    let turn = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    let face = |corners| Rectangle { corners, paint: Paint::Plain(object.class), fid };
    let top = face(turn.map(|(a, b)| corner(a, b, up_m)));
    let sides = (0..4).map(|side| {
        let ((a, b), (c, d)) = (turn[side], turn[(side + 1) % 4]);
        face([corner(a, b, 0.0), corner(c, d, 0.0), corner(c, d, up_m), corner(a, b, up_m)])
    });
    std::iter::once(top).chain(sides).collect()
}

/// A rectangle made ready for rays.
pub(super) struct Face {
    pub(super) rectangle: Rectangle,
    along: [f64; 3],
    up: [f64; 3],
    pub(super) normal: [f64; 3],
}

/// Where a ray meets a face: how many times its direction, and the class there.
pub(super) struct Meeting {
    pub(super) times: f64,
    pub(super) class: ClassId,
}

impl Face {
    fn new(rectangle: Rectangle) -> Self {
        let [bottom_left, bottom_right, _, top_left] = rectangle.corners;
        let (along, up) = (between(bottom_left, bottom_right), between(bottom_left, top_left));
        let normal = cross(along, up);
        let normal = scale(normal, 1.0 / norm(normal).max(f64::MIN_POSITIVE));
        Self { along: scale(along, 1.0 / dot(along, along)), up: scale(up, 1.0 / dot(up, up)), normal, rectangle }
    }

    pub(super) fn meet(&self, origin: GridPoint, direction: [f64; 3]) -> Option<Meeting> {
        let to_corner = between(origin, self.rectangle.corners[0]);
        let times = dot(self.normal, to_corner) / dot(self.normal, direction);
        if !times.is_finite() || times <= 1e-9 {
            return None;
        }
        let inside = add(scale(direction, times), scale(to_corner, -1.0));
        let (s, t) = (dot(self.along, inside), dot(self.up, inside));
        if !(0.0..=1.0).contains(&s) || !(0.0..=1.0).contains(&t) {
            return None;
        }
        let class = match &self.rectangle.paint {
            Paint::Plain(class) => *class,
            Paint::Texels { columns, rows, classes } => {
                let column = ((s * *columns as f64) as usize).min(columns.saturating_sub(1));
                let row = ((t * *rows as f64) as usize).min(rows.saturating_sub(1));
                classes.get(row * columns + column).copied().unwrap_or(ClassId::VOID)
            }
        };
        Some(Meeting { times, class })
    }
}
