//! The part of a map's version around a capture, ready to be seen: with and without its descriptors.

use crate::mesh::Object;
use crate::render::Scene;
use resurvey_schema::{ClassTable, Descriptor, GridPoint};

/// A version of the map around a place.
pub struct World {
    classes: ClassTable,
    descriptors: Vec<(u64, Descriptor)>,
    scene: Scene,
    base: Scene,
}

impl World {
    /// The world of `objects` and `descriptors` (with their feature ids) around `origin`.
    pub fn new(
        origin: GridPoint,
        objects: &[(u64, &Object)],
        descriptors: Vec<(u64, Descriptor)>,
        classes: ClassTable,
    ) -> Self {
        Self {
            scene: Scene::new(origin, objects, &descriptors, &classes),
            base: Scene::new(origin, objects, &[], &classes),
            classes,
            descriptors,
        }
    }

    /// The map's class table.
    pub fn classes(&self) -> &ClassTable {
        &self.classes
    }

    /// Descriptors with their feature ids, by rising id.
    pub fn descriptors(&self) -> &[(u64, Descriptor)] {
        &self.descriptors
    }

    /// The map with or without its descriptors.
    pub fn scene(&self, with_descriptors: bool) -> &Scene {
        if with_descriptors { &self.scene } else { &self.base }
    }
}
