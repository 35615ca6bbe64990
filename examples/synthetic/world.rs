//! The things a photo can show: upright boxes, panels on walls, tree crowns and the ground. Offsets from the scene's
//! origin in metres: x east, y north, z up.

/// An offset from the scene's origin: east, north, up, metres.
pub type Offset = [f64; 3];

/// Class indices of the default table.
pub mod class {
    /// Stone.
    pub const STONE: u8 = 0;
    /// Glass.
    pub const GLASS: u8 = 1;
    /// Metal.
    pub const METAL: u8 = 2;
    /// Banner.
    pub const BANNER: u8 = 3;
    /// Pedestrian.
    pub const PEDESTRIAN: u8 = 4;
    /// Chair.
    pub const CHAIR: u8 = 5;
    /// Sky.
    pub const SKY: u8 = 6;
    /// Foliage.
    pub const FOLIAGE: u8 = 7;
    /// Ground and everything else.
    pub const OTHERS: u8 = 8;
}

/// What gives the walls of a block their class.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Paint {
    /// One class all over.
    Class(u8),
    /// A label texture wrapped once around the four walls, by index into [`World::textures`].
    Strip(usize),
}

/// A label texture, top row first.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    /// Columns.
    pub width: usize,
    /// Rows.
    pub height: usize,
    /// Class per texel.
    pub labels: Vec<u8>,
}

impl Texture {
    /// The nearest texel at `u`, `v` in 0…1; `v` = 0 is the bottom.
    pub fn at(&self, u: f64, v: f64) -> u8 {
        let column = ((u * self.width as f64) as usize).min(self.width - 1);
        let row_from_bottom = ((v * self.height as f64) as usize).min(self.height - 1);
        self.labels[(self.height - 1 - row_from_bottom) * self.width + column]
    }
}

/// An upright box. Its walls are numbered south, east, north, west before it is turned.
#[derive(Clone, Debug, PartialEq)]
pub struct Block {
    /// Name in the model.
    pub name: String,
    /// Centre in plan.
    pub centre: [f64; 2],
    /// Half its size along its own axes.
    pub half: [f64; 2],
    /// Lowest height.
    pub bottom: f64,
    /// Highest height.
    pub top: f64,
    /// Turn about the vertical, radians, counter-clockwise from above.
    pub turn_rad: f64,
    /// Class of the walls.
    pub walls: Paint,
    /// Class of top and bottom.
    pub lid: u8,
    /// Whether its west and east wall touch a neighbour and so cannot move alone.
    pub joined: [bool; 2],
    /// Whether it is part of the map (the model), not only of the photo.
    pub mapped: bool,
}

impl Block {
    /// A small object that stands at `foot` and is no part of the map.
    pub fn object(class: u8, foot: Offset, size_m: [f64; 3], turn_rad: f64) -> Self {
        Self {
            name: String::new(),
            centre: [foot[0], foot[1]],
            half: [size_m[0] / 2.0, size_m[1] / 2.0],
            bottom: foot[2],
            top: foot[2] + size_m[2],
            turn_rad,
            walls: Paint::Class(class),
            lid: class,
            joined: [true; 2],
            mapped: false,
        }
    }

    /// Turns a vector in plan from the block's axes to east and north.
    pub fn east_north_from_own(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn_rad.sin_cos();
        [x * cos - y * sin, x * sin + y * cos]
    }

    /// Turns a vector in plan from east and north to the block's axes.
    pub fn own_from_east_north(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sin, cos) = self.turn_rad.sin_cos();
        [x * cos + y * sin, y * cos - x * sin]
    }

    /// The four corners in plan, counter-clockwise from south-west.
    pub fn corners(&self) -> [[f64; 2]; 4] {
        let [x, y] = self.half;
        [[-x, -y], [x, -y], [x, y], [-x, y]].map(|own| {
            let turned = self.east_north_from_own(own);
            [self.centre[0] + turned[0], self.centre[1] + turned[1]]
        })
    }

    /// Length of wall `wall`, metres.
    pub fn wall_length_m(&self, wall: usize) -> f64 {
        2.0 * self.half[wall % 2]
    }

    /// Share of the strip around the block at which wall `wall` begins; 4 gives 1.
    pub fn strip_start(&self, wall: usize) -> f64 {
        let before: f64 = (0..wall).map(|earlier| self.wall_length_m(earlier)).sum();
        before / (4.0 * (self.half[0] + self.half[1]))
    }

    /// Outward unit normal of wall `wall`.
    pub fn normal(&self, wall: usize) -> [f64; 2] {
        self.east_north_from_own([[0.0, -1.0], [1.0, 0.0], [0.0, 1.0], [-1.0, 0.0]][wall])
    }

    /// Whether a point in plan is inside or nearer than `margin_m`.
    pub fn covers(&self, point: [f64; 2], margin_m: f64) -> bool {
        let own = self.own_from_east_north([point[0] - self.centre[0], point[1] - self.centre[1]]);
        own[0].abs() < self.half[0] + margin_m && own[1].abs() < self.half[1] + margin_m
    }
}

/// A flat rectangle of one class just off a wall.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Its class.
    pub class: u8,
    /// Bottom-left, bottom-right, top-right, top-left as seen from outside.
    pub corners: [Offset; 4],
}

/// A tree crown.
#[derive(Clone, Debug, PartialEq)]
pub struct Crown {
    /// Centre.
    pub centre: Offset,
    /// Half axes along east, north, up.
    pub half: [f64; 3],
}

/// Everything at one moment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct World {
    /// Buildings, furniture, vehicles, people.
    pub blocks: Vec<Block>,
    /// Banners that are descriptors, not part of a texture.
    pub panels: Vec<Panel>,
    /// Trees.
    pub crowns: Vec<Crown>,
    /// Label textures that blocks refer to.
    pub textures: Vec<Texture>,
    /// Half the side of the ground square at z = 0; 0 when there is none.
    pub ground_half_m: f64,
}
