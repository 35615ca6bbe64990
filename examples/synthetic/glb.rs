//! A model as binary glTF 2.0 with its textures inside: y up, v = 0 in the top row.

use super::model::{Model, Part};
use serde_json::{Value, json};

/// The bytes of the `.glb` file.
pub fn encode(model: &Model) -> Vec<u8> {
    let mut binary = Binary::default();
    let meshes: Vec<Value> = model.parts.iter().map(|part| mesh(&mut binary, model, part)).collect();
    let mut images = Vec::new();
    let materials: Vec<Value> = model
        .materials
        .iter()
        .map(|material| match &material.texture {
            Some(png) => {
                images.push(json!({"bufferView": binary.view(png, None), "mimeType": "image/png"}));
                let index = images.len() - 1;
                json!({"name": material.name, "doubleSided": true,
                    "pbrMetallicRoughness": {"baseColorTexture": {"index": index}}})
            }
            None => {
                let [r, g, b] = material.colour.map(|value| f64::from(value) / 255.0);
                json!({"name": material.name, "doubleSided": true,
                    "pbrMetallicRoughness": {"baseColorFactor": [r, g, b, 1.0]}})
            }
        })
        .collect();
    let textures: Vec<Value> = (0..images.len()).map(|index| json!({"source": index, "sampler": 0})).collect();
    let nodes: Vec<Value> =
        model.parts.iter().enumerate().map(|(mesh, part)| json!({"name": part.name, "mesh": mesh})).collect();
    let mut document = json!({
        "asset": {"version": "2.0", "generator": "resurvey example"},
        "scene": 0,
        "scenes": [{"nodes": (0..nodes.len()).collect::<Vec<_>>()}],
        "nodes": nodes,
        "meshes": meshes,
        "materials": materials,
        "accessors": binary.accessors,
        "bufferViews": binary.views,
        "buffers": [{"byteLength": binary.bytes.len()}],
    });
    if !images.is_empty() {
        document["images"] = Value::Array(images);
        document["textures"] = Value::Array(textures);
        // Nearest texel: labels are never blended.
        document["samplers"] = json!([{"magFilter": 9728, "minFilter": 9728}]);
    }
    container(document.to_string().into_bytes(), binary.bytes)
}

/// The one buffer and what points into it.
#[derive(Default)]
struct Binary {
    bytes: Vec<u8>,
    views: Vec<Value>,
    accessors: Vec<Value>,
}

impl Binary {
    fn view(&mut self, bytes: &[u8], target: Option<u32>) -> usize {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let mut view = json!({"buffer": 0, "byteOffset": self.bytes.len(), "byteLength": bytes.len()});
        if let Some(target) = target {
            view["target"] = json!(target);
        }
        self.bytes.extend(bytes);
        self.views.push(view);
        self.views.len() - 1
    }

    fn floats<const N: usize>(&mut self, values: &[[f32; N]]) -> usize {
        let bytes: Vec<u8> = values.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(34962));
        let bound = |pick: fn(f32, f32) -> f32, from: f32| {
            let fold = |axis: usize| values.iter().map(|value| value[axis]).fold(from, pick);
            (0..N).map(fold).collect::<Vec<f32>>()
        };
        self.accessors.push(json!({"bufferView": view, "componentType": 5126, "count": values.len(),
            "type": format!("VEC{N}"), "min": bound(f32::min, f32::MAX), "max": bound(f32::max, f32::MIN)}));
        self.accessors.len() - 1
    }

    fn indices(&mut self, values: &[u32]) -> usize {
        let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
        let view = self.view(&bytes, Some(34963));
        self.accessors
            .push(json!({"bufferView": view, "componentType": 5125, "count": values.len(), "type": "SCALAR"}));
        self.accessors.len() - 1
    }
}

fn mesh(binary: &mut Binary, model: &Model, part: &Part) -> Value {
    let corners = part.quads.iter().flat_map(|quad| quad.corners);
    let positions: Vec<[f32; 3]> = corners.map(|[x, y, z]| [x as f32, z as f32, -y as f32]).collect();
    let indices: Vec<u32> =
        (0..part.quads.len() as u32).flat_map(|quad| [0, 1, 2, 0, 2, 3].map(|corner| 4 * quad + corner)).collect();
    let mut attributes = json!({"POSITION": binary.floats(&positions)});
    if model.materials[part.material].texture.is_some() {
        let uvs: Vec<[f32; 2]> =
            part.quads.iter().flat_map(|quad| quad.uvs).map(|[u, v]| [u as f32, (1.0 - v) as f32]).collect();
        attributes["TEXCOORD_0"] = json!(binary.floats(&uvs));
    }
    json!({"name": part.name, "primitives": [
        {"attributes": attributes, "indices": binary.indices(&indices), "material": part.material}]})
}

/// Header, JSON chunk padded with spaces, binary chunk padded with zeros.
fn container(mut text: Vec<u8>, mut binary: Vec<u8>) -> Vec<u8> {
    text.resize(text.len().next_multiple_of(4), b' ');
    binary.resize(binary.len().next_multiple_of(4), 0);
    let mut bytes = b"glTF".to_vec();
    bytes.extend(2_u32.to_le_bytes());
    bytes.extend((text.len() as u32 + binary.len() as u32 + 28).to_le_bytes());
    for (kind, part) in [(b"JSON", text), (b"BIN\0", binary)] {
        bytes.extend((part.len() as u32).to_le_bytes());
        bytes.extend(kind);
        bytes.extend(part);
    }
    bytes
}
