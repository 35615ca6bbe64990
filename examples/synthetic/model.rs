//! The map as a model: named faces with a class or a label texture, offsets from the scene's origin, z up.

use super::world::{Block, Paint, World};
use resurvey_schema::{ClassId, ClassTable};

/// Four corners and their texture coordinates (v = 0 at the bottom).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Quad {
    /// Corners in order; two triangles 0-1-2 and 0-2-3.
    pub corners: [[f64; 3]; 4],
    /// Texture coordinates; all zero without a texture.
    pub uvs: [[f64; 2]; 4],
}

/// One object of the model; all its faces look the same.
#[derive(Clone, Debug, PartialEq)]
pub struct Part {
    /// Name; at most ten letters, as 3DS has it.
    pub name: String,
    /// Index into [`Model::materials`].
    pub material: usize,
    /// Its faces.
    pub quads: Vec<Quad>,
}

/// What faces are made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// A class name, or the name of a label texture.
    pub name: String,
    /// Colour of the class; unused with a texture.
    pub colour: [u8; 3],
    /// PNG of the label texture.
    pub texture: Option<Vec<u8>>,
}

/// The whole map.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    /// Materials, classes first used first.
    pub materials: Vec<Material>,
    /// Objects.
    pub parts: Vec<Part>,
}

impl Model {
    /// The mapped part of a world.
    pub fn new(world: &World) -> anyhow::Result<Self> {
        let mut model = Self { materials: Vec::new(), parts: Vec::new() };
        if world.ground_half_m > 0.0 {
            let half = world.ground_half_m;
            let corners = [[-half, -half], [half, -half], [half, half], [-half, half]].map(|[x, y]| [x, y, 0.0]);
            let material = model.class_material(super::world::class::OTHERS);
            let quads = vec![Quad { corners, uvs: [[0.0; 2]; 4] }];
            model.parts.push(Part { name: "ground".to_owned(), material, quads });
        }
        for block in world.blocks.iter().filter(|block| block.mapped) {
            model.add_block(world, block)?;
        }
        Ok(model)
    }

    /// Number of triangles.
    pub fn triangles(&self) -> usize {
        self.parts.iter().map(|part| 2 * part.quads.len()).sum()
    }

    fn add_block(&mut self, world: &World, block: &Block) -> anyhow::Result<()> {
        let material = match block.walls {
            Paint::Class(class) => self.class_material(class),
            Paint::Strip(texture) => {
                let labels = &world.textures[texture];
                let png = super::label_png::encode(&labels.labels, labels.width)?;
                self.materials.push(Material { name: format!("T{texture}"), colour: [255; 3], texture: Some(png) });
                self.materials.len() - 1
            }
        };
        let corners = block.corners();
        let quads = (0..4).map(|wall| {
            let ([ax, ay], [bx, by]) = (corners[wall], corners[(wall + 1) % 4]);
            let (low, high) = (block.bottom, block.top);
            let (start, end) = (block.strip_start(wall), block.strip_start(wall + 1));
            Quad {
                corners: [[ax, ay, low], [bx, by, low], [bx, by, high], [ax, ay, high]],
                uvs: [[start, 0.0], [end, 0.0], [end, 1.0], [start, 1.0]],
            }
        });
        self.parts.push(Part { name: block.name.clone(), material, quads: quads.collect() });
        let lid = |height: f64| Quad { corners: corners.map(|[x, y]| [x, y, height]), uvs: [[0.0; 2]; 4] };
        let material = self.class_material(block.lid);
        let is_room = block.name == "walls";
        let name = if is_room { "ceiling".to_owned() } else { format!("{}_top", block.name) };
        self.parts.push(Part { name, material, quads: vec![lid(block.top)] });
        if is_room {
            self.parts.push(Part { name: "floor".to_owned(), material, quads: vec![lid(block.bottom)] });
        }
        Ok(())
    }

    fn class_material(&mut self, class: u8) -> usize {
        let table = ClassTable::default();
        let (name, colour) =
            table.get(ClassId(class)).map_or(("void".to_owned(), [255; 3]), |class| (class.name.clone(), class.colour));
        if let Some(found) = self.materials.iter().position(|material| material.name == name) {
            return found;
        }
        self.materials.push(Material { name, colour, texture: None });
        self.materials.len() - 1
    }
}
