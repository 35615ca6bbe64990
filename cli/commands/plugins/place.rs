//! The toy place of `plugins check`: five buildings and a banner, as the real host renders them.

use resurvey_core::camera::Camera;
use resurvey_core::capture::Capture;
use resurvey_core::crs::Crs;
use resurvey_core::image::{LabelImage, Raster};
use resurvey_core::localize::{SceneServices, Silent, World};
use resurvey_core::mesh::{LabelTexture, Mesh, Object, Surface, Wrap};
use resurvey_core::plugin::examine::{Place, Side, Stage};
use resurvey_core::render::view;
use resurvey_core::version::Digest;
use resurvey_schema::service::Prior;
use resurvey_schema::{CameraModel, ClassId, ClassTable, Descriptor, GridPoint, Intrinsics, MaterialDescriptor, Pose};

const STONE: ClassId = ClassId(0);
const GLASS: ClassId = ClassId(1);
const METAL: ClassId = ClassId(2);
const BANNER: ClassId = ClassId(3);
const OTHERS: ClassId = ClassId(8);

/// South-west of the first building, on the ground; of the size of real positions, so that precision counts.
const ORIGIN: GridPoint = GridPoint::new(836_000.0, 818_000.0, 4.0);
/// Field of view along a row, degrees: 1 m on a wall 15 m away is 21 pixels of 640.
const FIELD_DEG: f64 = 90.0;
/// Eye height, metres.
const EYE_M: f64 = 1.6;
/// South-west corner, size in plan and height of each building, metres; all stand on the ground.
const BUILDINGS: [[f64; 5]; 5] = [
    [-14.0, 15.0, 20.0, 10.0, 14.0],
    [8.0, 18.0, 10.0, 10.0, 22.0],
    [-26.0, 6.0, 10.0, 14.0, 9.0],
    [-6.0, 40.0, 6.0, 6.0, 40.0],
    [12.0, 4.0, 4.0, 6.0, 6.0],
];
/// West end, height of the lower edge, width and height of the banner on the first building, metres.
const BANNER_M: [f64; 4] = [-6.0, 3.0, 4.0, 2.0];

/// The street with and without its banner.
pub struct Street {
    with: World,
    without: World,
    banner: MaterialDescriptor,
}

impl Street {
    /// Builds it.
    pub fn new() -> Self {
        let ground = Object { name: "ground".to_owned(), mesh: ground() };
        let buildings =
            (0..BUILDINGS.len()).map(|index| Object { name: format!("building {index}"), mesh: building(index) });
        let objects: Vec<Object> = std::iter::once(ground).chain(buildings).collect();
        let with_ids: Vec<(u64, &Object)> = (1..).zip(&objects).collect();
        let banner = banner();
        let fid = with_ids.len() as u64 + 1;
        let world = |descriptors| World::new(ORIGIN, &with_ids, descriptors, ClassTable::default());
        Self { with: world(vec![(fid, Descriptor::Material(banner.clone()))]), without: world(Vec::new()), banner }
    }
}

impl Stage for Street {
    fn show(&self, width: u32, height: u32, act: &mut dyn FnMut(&Place<'_>)) -> Result<(), String> {
        let camera = Camera::new(intrinsics(width, height)).map_err(|error| error.to_string())?;
        let pose = pose([0.0, 0.0, 3.0]);
        let prior = Prior {
            pose: self::pose([2.5, -1.5, 7.0]),
            position_sigma_m: 5.0,
            height_sigma_m: 0.5,
            yaw_sigma_rad: 5_f64.to_radians(),
            tilt_sigma_rad: 1_f64.to_radians(),
        };
        let capture = |world: &World| Capture {
            labels: view(world.scene(true), &camera, &pose).labels,
            label_bytes: Vec::new(),
            camera,
            prior,
            taken_at: None,
            digest: Digest::of(&[]),
        };
        let (banner, no_banner) = (capture(&self.with), capture(&self.without));
        let services = |world, capture| SceneServices::new(world, capture, Crs::Hk1980, &Silent);
        let (same, came) = (services(&self.with, &banner), services(&self.without, &banner));
        let went = services(&self.with, &no_banner);
        let void = Capture { labels: Raster::filled(width, height, ClassId::VOID.0), ..banner.clone() };
        let blank = services(&self.with, &void);
        act(&Place {
            camera: camera.intrinsics(),
            pose,
            elsewhere: &[[6.0, -4.0, 12.0], [-8.0, 2.0, -20.0], [0.0, -10.0, 40.0]].map(self::pose),
            prior,
            same: Side { services: &same, photo: &banner.labels },
            came: Side { services: &came, photo: &banner.labels },
            went: Side { services: &went, photo: &no_banner.labels },
            blank: Side { services: &blank, photo: &void.labels },
            banner: &self.banner,
        });
        Ok(())
    }
}

fn intrinsics(width: u32, height: u32) -> Intrinsics {
    let focal = f64::from(width.max(height)) / 2.0 / (FIELD_DEG / 2.0).to_radians().tan();
    Intrinsics {
        model: CameraModel::Pinhole,
        width,
        height,
        fx: focal,
        fy: focal,
        cx: f64::from(width) / 2.0,
        cy: f64::from(height) / 2.0,
        distortion: [0.0; 5],
    }
}

/// Metres east and north of the origin, and heading in degrees.
fn pose([east_m, north_m, yaw_deg]: [f64; 3]) -> Pose {
    Pose {
        position: at([east_m, north_m, EYE_M]),
        yaw_rad: yaw_deg.to_radians(),
        pitch_rad: 5_f64.to_radians(),
        roll_rad: 0.0,
    }
}

fn at([east_m, north_m, up_m]: [f64; 3]) -> GridPoint {
    GridPoint::new(ORIGIN.easting_m + east_m, ORIGIN.northing_m + north_m, ORIGIN.height_m + up_m)
}

fn banner() -> MaterialDescriptor {
    let [west_m, low_m, width_m, height_m] = BANNER_M;
    let north_m = BUILDINGS[0][1];
    let corner = |right: f64, up: f64| at([west_m + right * width_m, north_m, low_m + up * height_m]);
    let corners = [corner(0.0, 0.0), corner(1.0, 0.0), corner(1.0, 1.0), corner(0.0, 1.0)];
    MaterialDescriptor { class: BANNER, corners, normal: [0.0, -1.0, 0.0], sigma: None }
}

fn ground() -> Mesh {
    let reach_m = 200.0;
    let mut mesh = empty(vec![Surface::Class(OTHERS)]);
    let corners = [[-reach_m, -reach_m], [reach_m, -reach_m], [reach_m, reach_m], [-reach_m, reach_m]];
    add_face(&mut mesh, corners.map(|[east_m, north_m]| [east_m, north_m, 0.0]), 0);
    mesh
}

/// A block with windows in the upper part of its walls, each building with a pattern of its own.
fn building(index: usize) -> Mesh {
    let [west, south, along, deep, high] = BUILDINGS[index];
    let (east, north) = (west + along, south + deep);
    let wall = |length_m: f64| {
        let (columns, rows) = ((length_m as u32).max(1), (high as u32).max(1));
        let labels = windows(columns, rows, index);
        Surface::Texture(LabelTexture { name: String::new(), labels, wrap_u: Wrap::Clamp, wrap_v: Wrap::Clamp })
    };
    let mut mesh = empty(vec![wall(along), wall(deep), Surface::Class(STONE)]);
    let plan = [[west, south], [east, south], [east, north], [west, north]];
    for side in 0..4 {
        let ([a, b], [c, d]) = (plan[side], plan[(side + 1) % 4]);
        add_face(&mut mesh, [[a, b, 0.0], [c, d, 0.0], [c, d, high], [a, b, high]], (side % 2) as u16);
    }
    add_face(&mut mesh, plan.map(|[east_m, north_m]| [east_m, north_m, high]), 2);
    mesh
}

/// Texels of a metre, top row first: windows of glass and metal in every second row, plain stone below 6 m, where the
/// banner hangs, and a door.
fn windows(columns: u32, rows: u32, seed: usize) -> LabelImage {
    let mut labels = Raster::filled(columns, rows, STONE.0);
    for v in 0..rows {
        for u in 0..columns {
            let number = u * 7 + v * 3 + 5 * seed as u32;
            let up = rows - v;
            if up > 6 && v % 2 == 1 && !number.is_multiple_of(3) {
                labels.set(u, v, if number.is_multiple_of(5) { METAL.0 } else { GLASS.0 });
            } else if up <= 2 && u == columns - 2 {
                labels.set(u, v, METAL.0);
            }
        }
    }
    labels
}

fn empty(surfaces: Vec<Surface>) -> Mesh {
    Mesh {
        origin: ORIGIN,
        vertices: Vec::new(),
        uvs: Vec::new(),
        triangles: Vec::new(),
        triangle_surfaces: Vec::new(),
        surfaces,
    }
}

/// Adds a quadrilateral: bottom-left, bottom-right, top-right, top-left, metres from the origin.
fn add_face(mesh: &mut Mesh, corners: [[f64; 3]; 4], surface: u16) {
    let first = mesh.vertices.len() as u32;
    mesh.vertices.extend(corners.map(|corner| corner.map(|metres| metres as f32)));
    mesh.uvs.extend([[0.0, 1.0], [1.0, 1.0], [1.0, 0.0], [0.0, 0.0]]);
    mesh.triangles.extend([[first, first + 1, first + 2], [first, first + 2, first + 3]]);
    mesh.triangle_surfaces.extend([surface; 2]);
}
