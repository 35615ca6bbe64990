//! What each material of a model is made of: a class, or a label texture.

use super::class_map::{class_named, known_names};
use super::model::{Material, Model, Texture};
use super::neighbours::Neighbours;
use super::{ClassMap, ImportError, LabelTexture, Surface};
use crate::image::{LabelImage, LabelReading, read_labels};
use resurvey_schema::{ClassId, ClassTable};
use std::collections::{BTreeMap, BTreeSet};

/// What decides the class of a material.
pub(super) struct Classifying<'a> {
    pub classes: &'a ClassTable,
    pub class_map: &'a ClassMap,
    pub reading: LabelReading,
    pub neighbours: &'a Neighbours,
}

impl Classifying<'_> {
    /// The surface of every material that a face has; `None` for the others. In this order: the class map's entry for
    /// the name; the class of the same name; the texture; the class map's default. Names and textures without an
    /// answer are one error that lists them all.
    pub fn surfaces(&self, model: &Model) -> Result<Vec<Option<Surface>>, ImportError> {
        let used: BTreeSet<usize> =
            model.parts.iter().flat_map(|part| part.triangle_materials.iter().copied()).collect();
        let mut surfaces = vec![None; model.materials.len()];
        let mut textured = Vec::new();
        let mut unmapped = BTreeSet::new();
        for index in used {
            let Material { name, texture } = &model.materials[index];
            match (self.class_by_name(name), texture, self.class_map.default_class()) {
                (Some(class), ..) => surfaces[index] = Some(Surface::Class(class)),
                (None, Some(texture), _) => textured.push((index, texture)),
                (None, None, Some(class)) => surfaces[index] = Some(Surface::Class(class)),
                (None, None, None) => {
                    unmapped.insert(name.clone());
                }
            }
        }
        if !unmapped.is_empty() {
            let names = unmapped.into_iter().collect();
            return Err(ImportError::UnmappedNames { names, known: known_names(self.classes) });
        }
        self.read_textures(model, &textured, &mut surfaces)?;
        Ok(surfaces)
    }

    fn class_by_name(&self, name: &str) -> Option<ClassId> {
        self.class_map.class_of(name).or_else(|| class_named(name, self.classes))
    }

    fn read_textures(
        &self,
        model: &Model,
        textured: &[(usize, &Texture)],
        surfaces: &mut [Option<Surface>],
    ) -> Result<(), ImportError> {
        let mut problems = Vec::new();
        let mut images: BTreeMap<usize, Option<LabelImage>> = BTreeMap::new();
        for &(index, texture) in textured {
            let material = &model.materials[index].name;
            let image = match &texture.image {
                Ok(image) => *image,
                Err(reason) => {
                    problems.push(format!("{reason} (material {material:?})"));
                    continue;
                }
            };
            let name = &model.images[image].name;
            let labels = images.entry(image).or_insert_with(|| match self.labels(model, image) {
                Ok(labels) => Some(labels),
                Err(reason) => {
                    problems.push(format!("{name:?} (material {material:?}): {reason}"));
                    None
                }
            });
            surfaces[index] = labels.clone().map(|labels| {
                let (wrap_u, wrap_v) = (texture.wrap_u, texture.wrap_v);
                Surface::Texture(LabelTexture { name: name.clone(), labels, wrap_u, wrap_v })
            });
        }
        if problems.is_empty() { Ok(()) } else { Err(ImportError::Textures { problems }) }
    }

    fn labels(&self, model: &Model, image: usize) -> Result<LabelImage, String> {
        let image = &model.images[image];
        let read = |bytes: &[u8]| read_labels(bytes, self.classes, &self.reading).map_err(|error| error.to_string());
        match &image.bytes {
            Some(bytes) => read(bytes),
            None => read(&self.neighbours.read(&image.name)?),
        }
    }
}
