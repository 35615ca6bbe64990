//! A made-up square kilometre: terraces between streets, façades of windows as class rectangles or label textures.
//! Benchmarks and tests include this file by its path.
#![allow(dead_code, reason = "every program that includes it uses its own share")]
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "fixed numbers")]

use resurvey_core::camera::Camera;
use resurvey_core::image::LabelImage;
use resurvey_core::mesh::{LabelTexture, Mesh, Object, Surface, Wrap};
use resurvey_core::render::Scene;
use resurvey_schema::{CameraModel, ClassId, ClassTable, GridPoint, Intrinsics, Pose};

/// South-west corner is 500 m south and west of it, on the ground.
pub const ORIGIN: GridPoint = GridPoint::new(836_000.0, 818_000.0, 4.5);

const HALF_M: f64 = 500.0;
/// A street, then two rows of buildings back to back.
const STREET_M: f64 = 18.0;
const DEPTH_M: f64 = 12.5;
/// Buildings of a terrace between two crossroads.
const TERRACE: usize = 5;
const CROSSROAD_M: f64 = 14.0;
const WIDTH_M: [f64; 2] = [14.0, 22.0];
const HEIGHT_M: [f64; 2] = [9.0, 90.0];
/// Share of the buildings whose façades are label textures.
const TEXTURED: f64 = 0.25;
const WALLS: [u8; 3] = [0, 2, 3];
const WINDOW: u8 = 1;
const GROUND: u8 = 8;

/// The city with about `triangles` triangles (at least 20 000) as a scene around [`ORIGIN`].
pub fn city(triangles: usize) -> Scene {
    let objects = objects(triangles);
    let with_ids: Vec<(u64, &Object)> = (1..).zip(&objects).collect();
    Scene::new(ORIGIN, &with_ids, &[], &ClassTable::default())
}

/// The objects of the city: about 2 200 buildings and the ground.
pub fn objects(triangles: usize) -> Vec<Object> {
    let mut random = Random(20_260_101);
    let lots = lots(&mut random);
    let ground = ground();
    let textured = (0..lots.len()).filter(|_| random.next() < TEXTURED).count();
    let split = (lots.len() - textured).max(1);
    let spare = triangles.saturating_sub(ground.mesh.triangles.len() + 10 * textured + 2 * split);
    let cells = (spare as f64 / split as f64 / 8.0).max(1.0);
    let texture = windows();
    let mut objects = vec![ground];
    for (index, lot) in lots.into_iter().enumerate() {
        // Textured ones are spread evenly, so that their number does not depend on the order.
        let is_textured = (index + 1) * textured / (textured + split) > index * textured / (textured + split);
        let mut building = Builder::default();
        let wall = WALLS[(random.next() * WALLS.len() as f64) as usize];
        if is_textured {
            building.walls(&lot, [1, 1], |_, _| 0);
            building.surfaces = vec![Surface::Texture(texture.clone())];
        } else {
            // Storeys are lower than windows are wide apart.
            let storeys = (cells * 1.6).sqrt().round().max(1.0);
            let columns = (cells / storeys).round().max(1.0);
            building.walls(&lot, [columns as usize, storeys as usize], |column, storey| {
                usize::from((column ^ storey) & 1 == 1 || (column & 1 == 1 && storey % 3 != 0))
            });
            building.surfaces = vec![Surface::Class(ClassId(wall)), Surface::Class(ClassId(WINDOW))];
        }
        building.surfaces.push(Surface::Class(ClassId(wall)));
        let [low, high] = lot.plan;
        let roof = [[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]];
        let surface = building.surfaces.len() - 1;
        building.quad(roof.map(|[east, north]| [east, north, lot.height_m]), [0.0; 2], surface);
        objects.push(Object { name: format!("building {index}"), mesh: building.mesh() });
    }
    objects
}

/// 960 × 720 with 120° across the diagonal.
pub fn camera() -> Camera {
    let (fx, fy, cx, cy) = (346.410_161_513_775_4, 346.410_161_513_775_4, 480.0, 360.0);
    let (width, height, model) = (960, 720, CameraModel::Pinhole);
    Camera::new(Intrinsics { model, width, height, fx, fy, cx, cy, distortion: [0.0; 5] }).expect("a valid camera")
}

/// A phone 1.6 m above the middle of a street, looking along it and up a little.
pub fn prior() -> Pose {
    let middle_m = -HALF_M + 11.0 * (STREET_M + 2.0 * DEPTH_M) + STREET_M / 2.0;
    let position = GridPoint::new(ORIGIN.easting_m + 20.0, ORIGIN.northing_m + middle_m, ORIGIN.height_m + 1.6);
    Pose { position, yaw_rad: 75_f64.to_radians(), pitch_rad: 0.15, roll_rad: 0.01 }
}

/// Where a building stands.
struct Lot {
    plan: [[f64; 2]; 2],
    height_m: f64,
}

fn lots(random: &mut Random) -> Vec<Lot> {
    let mut lots = Vec::new();
    let mut south = -HALF_M + STREET_M;
    while south + 2.0 * DEPTH_M < HALF_M {
        for row in 0..2 {
            let south = south + DEPTH_M * f64::from(row);
            let mut west = -HALF_M + CROSSROAD_M;
            for place in 1.. {
                let east = west + random.between(WIDTH_M[0], WIDTH_M[1]);
                if east > HALF_M {
                    break;
                }
                let height_m = HEIGHT_M[0] + (HEIGHT_M[1] - HEIGHT_M[0]) * random.next().powi(2);
                lots.push(Lot { plan: [[west, south], [east, south + DEPTH_M]], height_m });
                west = east + if place % TERRACE == 0 { CROSSROAD_M } else { 0.0 };
            }
        }
        south += 2.0 * DEPTH_M + STREET_M;
    }
    lots
}

/// Squares of 50 m.
fn ground() -> Object {
    const SQUARES: i32 = 20;
    let side_m = 2.0 * HALF_M / f64::from(SQUARES);
    let mut builder = Builder { surfaces: vec![Surface::Class(ClassId(GROUND))], ..Builder::default() };
    for (column, row) in (0..SQUARES).flat_map(|row| (0..SQUARES).map(move |column| (column, row))) {
        let (east, north) = (f64::from(column) * side_m - HALF_M, f64::from(row) * side_m - HALF_M);
        let corners = [[0.0, 0.0], [side_m, 0.0], [side_m, side_m], [0.0, side_m]];
        builder.quad(corners.map(|[e, n]| [east + e, north + n, 0.0]), [0.0; 2], 0);
    }
    Object { name: "ground".into(), mesh: builder.mesh() }
}

/// Four windows a side in stone.
fn windows() -> LabelTexture {
    let texel = |index: u32| if (index / 32) % 8 < 5 && (index % 32) % 8 < 4 { WINDOW } else { 0 };
    let labels = LabelImage::from_values(32, 32, (0..1024).map(texel).collect()).expect("1024 texels");
    LabelTexture { name: "windows".into(), labels, wrap_u: Wrap::Repeat, wrap_v: Wrap::Repeat }
}

#[derive(Default)]
struct Builder {
    vertices: Vec<[f32; 3]>,
    uvs: Vec<[f32; 2]>,
    triangles: Vec<[u32; 3]>,
    triangle_surfaces: Vec<u16>,
    surfaces: Vec<Surface>,
}

impl Builder {
    /// Four walls of `columns × storeys` rectangles each.
    fn walls(&mut self, lot: &Lot, [columns, storeys]: [usize; 2], surface: impl Fn(usize, usize) -> usize) {
        let [[west, south], [east, north]] = lot.plan;
        let plan = [[west, south], [east, south], [east, north], [west, north]];
        let share = |index: usize, of: usize| index as f64 / of as f64;
        for (from, to) in (0..4).map(|side| (plan[side], plan[(side + 1) % 4])) {
            // Neighbouring rectangles have the very same corners, and walls those of the lot.
            let at = |column: usize, storey: usize| {
                let along = share(column, columns);
                let [e, n] =
                    [0, 1].map(
                        |axis| if column == columns { to[axis] } else { from[axis] + along * (to[axis] - from[axis]) },
                    );
                [e, n, lot.height_m * share(storey, storeys)]
            };
            for (column, storey) in (0..storeys).flat_map(|s| (0..columns).map(move |c| (c, s))) {
                let corners =
                    [at(column, storey), at(column + 1, storey), at(column + 1, storey + 1), at(column, storey + 1)];
                let repeats = [((to[0] - from[0]).abs() + (to[1] - from[1]).abs()) / 12.0, lot.height_m / 12.0];
                self.quad(corners, repeats.map(f64::round).map(|count| count.max(1.0)), surface(column, storey));
            }
        }
    }

    /// Corners anticlockwise from bottom left; the texture repeats as often as given.
    fn quad(&mut self, corners: [[f64; 3]; 4], [u, v]: [f64; 2], surface: usize) {
        let first = self.vertices.len() as u32;
        self.vertices.extend(corners.map(|corner| corner.map(|value| value as f32)));
        let (u, v) = (u as f32, v as f32);
        self.uvs.extend([[0.0, v], [u, v], [u, 0.0], [0.0, 0.0]]);
        self.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
        self.triangle_surfaces.extend([surface as u16; 2]);
    }

    fn mesh(self) -> Mesh {
        let Self { vertices, uvs, triangles, triangle_surfaces, surfaces } = self;
        Mesh { origin: ORIGIN, vertices, uvs, triangles, triangle_surfaces, surfaces }
    }
}

/// Numbers 0…1 from a seed (Steele, Lea & Flood 2014, SplitMix64).
pub struct Random(pub u64);

impl Random {
    /// The next number, below 1.
    pub fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((mixed ^ (mixed >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
    }

    /// The next number of a range.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.next()
    }
}
