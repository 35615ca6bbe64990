//! A model as 3DS: chunks of a two-byte id and a four-byte length, little-endian. Textures lie beside it as `NAME.PNG`.

use super::model::{Material, Model, Part};

/// The bytes of the `.3ds` file.
pub fn encode(model: &Model) -> Vec<u8> {
    let mut editor = chunk(0x3d3e, &3_u32.to_le_bytes());
    for entry in &model.materials {
        editor.extend(material(entry));
    }
    for entry in &model.parts {
        editor.extend(object(entry, &model.materials[entry.material]));
    }
    let mut main = chunk(0x0002, &3_u32.to_le_bytes());
    main.extend(chunk(0x3d3d, &editor));
    chunk(0x4d4d, &main)
}

/// File name of a material's texture.
pub fn texture_name(material: &Material) -> String {
    format!("{}.PNG", material.name)
}

fn chunk(id: u16, body: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(body.len() + 6);
    bytes.extend(id.to_le_bytes());
    bytes.extend((body.len() as u32 + 6).to_le_bytes());
    bytes.extend(body);
    bytes
}

fn text(value: &str) -> Vec<u8> {
    let mut bytes = value.as_bytes().to_vec();
    bytes.push(0);
    bytes
}

fn material(material: &Material) -> Vec<u8> {
    let mut body = chunk(0xa000, &text(&material.name));
    if material.texture.is_some() {
        body.extend(chunk(0xa200, &chunk(0xa300, &text(&texture_name(material)))));
    } else {
        body.extend(chunk(0xa020, &chunk(0x0011, &material.colour)));
    }
    chunk(0xafff, &body)
}

fn object(part: &Part, material: &Material) -> Vec<u8> {
    let count = |number: usize| (number as u16).to_le_bytes();
    let mut vertices = count(4 * part.quads.len()).to_vec();
    let mut uvs = vertices.clone();
    let mut faces = count(2 * part.quads.len()).to_vec();
    for (index, quad) in part.quads.iter().enumerate() {
        for value in quad.corners.iter().flatten() {
            vertices.extend((*value as f32).to_le_bytes());
        }
        for value in quad.uvs.iter().flatten() {
            uvs.extend((*value as f32).to_le_bytes());
        }
        for triangle in [[0, 1, 2], [0, 2, 3]] {
            faces.extend(triangle.into_iter().flat_map(|corner| count(4 * index + corner)));
            faces.extend(7_u16.to_le_bytes());
        }
    }
    let mut group = text(&material.name);
    group.extend(count(2 * part.quads.len()));
    group.extend((0..2 * part.quads.len()).flat_map(count));
    faces.extend(chunk(0x4130, &group));
    let mut mesh = chunk(0x4110, &vertices);
    if material.texture.is_some() {
        mesh.extend(chunk(0x4140, &uvs));
    }
    mesh.extend(chunk(0x4120, &faces));
    let mut body = text(&part.name);
    body.extend(chunk(0x4100, &mesh));
    chunk(0x4000, &body)
}
