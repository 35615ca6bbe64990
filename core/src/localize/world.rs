//! The part of a map's version around a capture, ready to be seen: with and without its descriptors.

use crate::mesh::Object;
use crate::render::{RayCaster, Scene, Solids};
use resurvey_schema::{ClassTable, Descriptor, GridPoint};
use std::sync::OnceLock;

/// A version of the map around a place. Rays and buildings are prepared when first asked for.
pub struct World {
    classes: ClassTable,
    descriptors: Vec<(u64, Descriptor)>,
    scene: Scene,
    base: Scene,
    rays: OnceLock<RayCaster>,
    base_rays: OnceLock<RayCaster>,
    solids: OnceLock<Solids>,
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
            rays: OnceLock::new(),
            base_rays: OnceLock::new(),
            solids: OnceLock::new(),
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

    /// Rays into the map with or without its descriptors.
    pub fn rays(&self, with_descriptors: bool) -> &RayCaster {
        let (rays, scene) = if with_descriptors { (&self.rays, &self.scene) } else { (&self.base_rays, &self.base) };
        rays.get_or_init(|| RayCaster::new(scene))
    }

    /// What is inside a building.
    pub fn solids(&self) -> &Solids {
        self.solids.get_or_init(|| Solids::new(&self.base))
    }
}
