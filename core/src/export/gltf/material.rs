//! Materials: one per class, named and coloured by it, and one per label texture.

use super::super::{ExportError, Mark};
use super::asset::Asset;
use crate::image::write_label_png;
use crate::mesh::{LabelTexture, Wrap};
use gltf_json::extensions::material::Unlit;
use gltf_json::image::MimeType;
use gltf_json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf_json::texture::{Info, MagFilter, MinFilter, Sampler, WrappingMode};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Image, Index, Material, Texture, extensions};
use resurvey_schema::{ClassId, ClassTable};
use std::collections::BTreeMap;

/// Prefix of a label texture's material: no class can be called so, and its texels are classes.
pub(super) const LABELS_PREFIX: &str = "labels: ";

/// Materials made so far. Equal textures share one.
#[derive(Debug, Default)]
pub(super) struct Materials<'a> {
    by_class: BTreeMap<ClassId, Index<Material>>,
    by_mark: BTreeMap<Mark, Index<Material>>,
    by_texture: BTreeMap<TextureKey<'a>, Index<Material>>,
    samplers: BTreeMap<(u8, u8), Index<Sampler>>,
}

/// Everything that two label textures can differ in.
type TextureKey<'a> = (&'a str, (u8, u8), (u32, u32), &'a [u8]);

impl<'a> Materials<'a> {
    /// The material of a class: its name, its colour, lit by nothing.
    pub(super) fn of_class(
        &mut self,
        asset: &mut Asset,
        classes: &ClassTable,
        fid: u64,
        id: ClassId,
    ) -> Result<Index<Material>, ExportError> {
        let class = classes.get(id).ok_or(ExportError::UnknownClass { fid, class: id.0 })?;
        let [red, green, blue] = class.colour.map(linear_from_srgb);
        Ok(*self.by_class.entry(id).or_insert_with(|| {
            let surface =
                PbrMetallicRoughness { base_color_factor: PbrBaseColorFactor([red, green, blue, 1.0]), ..matt() };
            asset.root.push(unlit(class.name.clone(), surface))
        }))
    }

    /// The material of what became of a feature: its name, its colour, lit by nothing.
    pub(super) fn of_mark(&mut self, asset: &mut Asset, mark: Mark) -> Index<Material> {
        let [red, green, blue] = mark.colour().map(linear_from_srgb);
        *self.by_mark.entry(mark).or_insert_with(|| {
            let surface =
                PbrMetallicRoughness { base_color_factor: PbrBaseColorFactor([red, green, blue, 1.0]), ..matt() };
            asset.root.push(unlit(mark.name().to_owned(), surface))
        })
    }

    /// The material of a label texture: an indexed PNG whose index is the class, never blended.
    pub(super) fn of_texture(
        &mut self,
        asset: &mut Asset,
        classes: &ClassTable,
        texture: &'a LabelTexture,
    ) -> Result<Index<Material>, ExportError> {
        let labels = &texture.labels;
        let wraps = (code(texture.wrap_u), code(texture.wrap_v));
        let key = (texture.name.as_str(), wraps, (labels.width(), labels.height()), labels.values());
        if let Some(known) = self.by_texture.get(&key) {
            return Ok(*known);
        }
        let png = write_label_png(labels, classes)
            .map_err(|source| ExportError::Texture { name: texture.name.clone(), source })?;
        let view = asset.push_view(&png, None);
        let source = asset.root.push(Image {
            buffer_view: Some(view),
            mime_type: Some(MimeType("image/png".to_owned())),
            name: Some(texture.name.clone()),
            uri: None,
            extensions: None,
            extras: None,
        });
        let sampler = *self.samplers.entry(wraps).or_insert_with(|| asset.root.push(nearest(texture)));
        let index = asset.root.push(Texture {
            name: Some(texture.name.clone()),
            sampler: Some(sampler),
            source,
            extensions: None,
            extras: None,
        });
        let info = Info { index, tex_coord: 0, extensions: None, extras: None };
        let surface = PbrMetallicRoughness { base_color_texture: Some(info), ..matt() };
        let material = asset.root.push(unlit(format!("{LABELS_PREFIX}{}", texture.name), surface));
        self.by_texture.insert(key, material);
        Ok(material)
    }
}

fn matt() -> PbrMetallicRoughness {
    PbrMetallicRoughness {
        metallic_factor: StrengthFactor(0.0),
        roughness_factor: StrengthFactor(1.0),
        ..PbrMetallicRoughness::default()
    }
}

fn unlit(name: String, surface: PbrMetallicRoughness) -> Material {
    Material {
        name: Some(name),
        double_sided: true,
        pbr_metallic_roughness: surface,
        extensions: Some(extensions::material::Material { unlit: Some(Unlit {}), ..Default::default() }),
        ..Material::default()
    }
}

fn nearest(texture: &LabelTexture) -> Sampler {
    Sampler {
        mag_filter: Some(Valid(MagFilter::Nearest)),
        min_filter: Some(Valid(MinFilter::Nearest)),
        wrap_s: Valid(wrapping(texture.wrap_u)),
        wrap_t: Valid(wrapping(texture.wrap_v)),
        ..Sampler::default()
    }
}

fn wrapping(wrap: Wrap) -> WrappingMode {
    match wrap {
        Wrap::Repeat => WrappingMode::Repeat,
        Wrap::Clamp => WrappingMode::ClampToEdge,
        Wrap::Mirror => WrappingMode::MirroredRepeat,
    }
}

fn code(wrap: Wrap) -> u8 {
    match wrap {
        Wrap::Repeat => 0,
        Wrap::Clamp => 1,
        Wrap::Mirror => 2,
    }
}

/// Linear value of an sRGB component (IEC 61966-2-1), as `baseColorFactor` wants it.
fn linear_from_srgb(component: u8) -> f32 {
    let value = f64::from(component) / 255.0;
    let linear = if value <= 0.04045 { value / 12.92 } else { ((value + 0.055) / 1.055).powf(2.4) };
    linear as f32
}
