//! The node tree of a glTF file: which mesh lies where.

use super::ImportError;
use super::gltf_buffers::damaged;
use super::gltf_schema::{Node, Root};
use nalgebra::{Matrix4, Quaternion, RowVector4, Translation3, UnitQuaternion, Vector3};

/// A mesh in its place.
pub(super) struct Placed {
    pub node: usize,
    pub mesh: usize,
    pub file_from_node: Matrix4<f64>,
}

/// The meshes of the default scene, else the first scene, else of all roots; depth first, in the order of the file.
pub(super) fn placed_meshes(root: &Root) -> Result<Vec<Placed>, ImportError> {
    let mut placed = Vec::new();
    let mut is_reached = vec![false; root.nodes.len()];
    let mut waiting: Vec<(usize, Matrix4<f64>)> =
        roots(root)?.into_iter().rev().map(|index| (index, Matrix4::identity())).collect();
    while let Some((index, file_from_parent)) = waiting.pop() {
        let at = || format!("nodes[{index}]");
        let node = root.nodes.get(index).ok_or_else(|| damaged(at(), "there is no such node"))?;
        if std::mem::replace(&mut is_reached[index], true) {
            return Err(damaged(at(), "the node has two parents or is its own ancestor"));
        }
        let file_from_node = file_from_parent * parent_from_node(node).map_err(|reason| damaged(at(), reason))?;
        if let Some(mesh) = node.mesh {
            placed.push(Placed { node: index, mesh, file_from_node });
        }
        waiting.extend(node.children.iter().rev().map(|&child| (child, file_from_node)));
    }
    Ok(placed)
}

fn roots(root: &Root) -> Result<Vec<usize>, ImportError> {
    if !root.scenes.is_empty() {
        let scene = root.scene.unwrap_or(0);
        let missing = || damaged("scene", format!("there is no scene {scene}"));
        return Ok(root.scenes.get(scene).ok_or_else(missing)?.nodes.clone());
    }
    let mut is_child = vec![false; root.nodes.len()];
    for &child in root.nodes.iter().flat_map(|node| &node.children) {
        if let Some(flag) = is_child.get_mut(child) {
            *flag = true;
        }
    }
    Ok((0..root.nodes.len()).filter(|&index| !is_child[index]).collect())
}

fn parent_from_node(node: &Node) -> Result<Matrix4<f64>, &'static str> {
    if let Some(matrix) = node.matrix {
        let matrix = Matrix4::from_column_slice(&matrix);
        let last_row = matrix.row(3) - RowVector4::new(0.0, 0.0, 0.0, 1.0);
        let is_affine = last_row.iter().all(|value| value.abs() < 1e-6);
        return if is_affine { Ok(matrix) } else { Err("expected a matrix with the last row 0, 0, 0, 1") };
    }
    let [x, y, z, w] = node.rotation.unwrap_or([0.0, 0.0, 0.0, 1.0]);
    let rotation = UnitQuaternion::try_new(Quaternion::new(w, x, y, z), 1e-9);
    let rotation = rotation.ok_or("expected a rotation of length 1")?.to_homogeneous();
    let translation = Translation3::from(node.translation.unwrap_or_default()).to_homogeneous();
    let scale = Matrix4::new_nonuniform_scaling(&Vector3::from(node.scale.unwrap_or([1.0; 3])));
    Ok(translation * rotation * scale)
}
