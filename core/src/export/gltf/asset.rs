//! A glTF document in the making: JSON and the one binary buffer it points into.

use super::super::ExportError;
use gltf_json::accessor::{ComponentType, GenericComponentType, Type};
use gltf_json::buffer::{Target, View};
use gltf_json::validation::Checked::Valid;
use gltf_json::validation::USize64;
use gltf_json::{Accessor, Index, Root, Value};

/// Every view starts at a multiple of this: what `EXT_structural_metadata` asks for covers all other needs.
const ALIGNMENT: usize = 8;

/// JSON and buffer, growing together.
#[derive(Debug, Default)]
pub(super) struct Asset {
    pub(super) root: Root,
    pub(super) bytes: Vec<u8>,
}

impl Asset {
    /// Appends `data` as a view of its own.
    pub(super) fn push_view(&mut self, data: &[u8], target: Option<Target>) -> Index<View> {
        self.bytes.resize(self.bytes.len().next_multiple_of(ALIGNMENT), 0);
        let view = View {
            buffer: Index::new(0),
            byte_length: USize64::from(data.len()),
            byte_offset: Some(USize64::from(self.bytes.len())),
            byte_stride: None,
            name: None,
            target: target.map(Valid),
            extensions: None,
            extras: None,
        };
        self.bytes.extend_from_slice(data);
        self.root.push(view)
    }

    /// Vertex attribute of `N` floats.
    pub(super) fn push_vectors<const N: usize>(&mut self, vectors: &[[f32; N]]) -> Index<Accessor> {
        let form = match N {
            2 => Type::Vec2,
            3 => Type::Vec3,
            _ => Type::Scalar,
        };
        let view = self.push_view(&little_endian(vectors.as_flattened().iter().map(|v| v.to_le_bytes())), ARRAY);
        self.push_accessor(view, vectors.len(), ComponentType::F32, form)
    }

    /// Positions, with their bounds.
    pub(super) fn push_positions(&mut self, positions: &[[f32; 3]]) -> Index<Accessor> {
        let index = self.push_vectors(positions);
        let bound = |pick: fn(f32, f32) -> f32| -> Option<Value> {
            let bound = positions.iter().copied().reduce(|a, b| std::array::from_fn(|axis| pick(a[axis], b[axis])));
            bound.map(|bound| Value::from(bound.map(f64::from).to_vec()))
        };
        let (min, max) = (bound(f32::min), bound(f32::max));
        if let Some(accessor) = self.root.accessors.get_mut(index.value()) {
            (accessor.min, accessor.max) = (min, max);
        }
        index
    }

    /// Triangle corners, in 16 bits where they fit. The largest value of a type is reserved by glTF.
    pub(super) fn push_triangles(&mut self, triangles: &[[u32; 3]], vertices: usize) -> Index<Accessor> {
        let corners = triangles.as_flattened();
        let (data, component) = if vertices < usize::from(u16::MAX) {
            // `vertices` bounds every corner, so nothing is cut off.
            (little_endian(corners.iter().map(|&corner| (corner as u16).to_le_bytes())), ComponentType::U16)
        } else {
            (little_endian(corners.iter().map(|corner| corner.to_le_bytes())), ComponentType::U32)
        };
        let view = self.push_view(&data, Some(Target::ElementArrayBuffer));
        self.push_accessor(view, corners.len(), component, Type::Scalar)
    }

    fn push_accessor(
        &mut self,
        view: Index<View>,
        count: usize,
        component: ComponentType,
        form: Type,
    ) -> Index<Accessor> {
        self.root.push(Accessor {
            buffer_view: Some(view),
            byte_offset: None,
            count: USize64::from(count),
            component_type: Valid(GenericComponentType(component)),
            extensions: None,
            extras: None,
            type_: Valid(form),
            min: None,
            max: None,
            name: None,
            normalized: false,
            sparse: None,
        })
    }

    /// JSON and buffer; the buffer's uri is `None` inside a GLB.
    pub(super) fn finish(mut self, uri: Option<&str>) -> Result<(Vec<u8>, Vec<u8>), ExportError> {
        if !self.bytes.is_empty() {
            self.root.push(gltf_json::Buffer {
                byte_length: USize64::from(self.bytes.len()),
                name: None,
                uri: uri.map(str::to_owned),
                extensions: None,
                extras: None,
            });
        }
        Ok((self.root.to_vec()?, self.bytes))
    }
}

const ARRAY: Option<Target> = Some(Target::ArrayBuffer);

fn little_endian<const N: usize>(values: impl Iterator<Item = [u8; N]>) -> Vec<u8> {
    values.flatten().collect()
}
