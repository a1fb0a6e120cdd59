//! Materials: glTF's metallic-roughness model (glTF 2.0, section 3.9) and its extensions.

mod extensions;
mod textures;

use std::collections::BTreeSet;

use gltf::json::{
    Root,
    image::Image as ImageEntry,
    material::{AlphaMode as AlphaModeEntry, Material},
    validation::Checked,
};

use self::textures::{Images, Wanted};
use super::{
    AssetError,
    buffer::Buffers,
    document::{at, label},
};
use crate::{
    assets::{
        ModelMaterial,
        files::{Context, Files},
        material::{AlphaMode, NormalMap},
        mesh::fraction,
        warnings::Warnings,
    },
    description::ColorSpace,
    texture::Texture,
};

/// The file's materials, and at the end the default of meshes that name none.
#[derive(Default)]
pub(super) struct Materials {
    pub materials: Vec<ModelMaterial>,
    /// For each, the n of every `TEXCOORD_n` that its textures ask for: two at the most.
    pub sets: Vec<Vec<u32>>,
    pub textures: Vec<Texture>,
}

/// Gives every texture that a material asks for a number.
type Want<'w> = &'w mut dyn FnMut(Wanted) -> Result<usize, AssetError>;

/// Reads all materials of a file and the textures that they need.
pub(super) fn load(root: &Root, buffers: &Buffers<'_>, files: &Files<'_>, warnings: &mut Warnings) -> Result<Materials, AssetError> {
    let mut images = Images::new(root, buffers, files);
    let mut loaded = Materials::default();
    for (index, entry) in root.materials.iter().enumerate() {
        let name = entry.name.clone().unwrap_or_else(|| index.to_string());
        let context = || label("material", index, entry.name.as_deref());
        let mut sets =
            wanted(entry).context(context)?.iter().map(|wanted| wanted.set).collect::<BTreeSet<_>>().into_iter().collect::<Vec<_>>();
        if sets.len() > 2 {
            sets.truncate(2);
            warnings.object(
                "material",
                format!("{name:?}"),
                "its textures ask for more than two sets of coordinates; the first is taken for the rest",
            );
        }
        let mut want = |wanted: Wanted| {
            let second = sets.get(1) == Some(&wanted.set);
            images.texture(&wanted, second, &mut loaded.textures, warnings)
        };
        let material = read(entry, name.clone(), &mut want).context(context)?;
        warn(entry, &material, warnings);
        loaded.materials.push(material);
        loaded.sets.push(sets);
    }
    loaded.materials.push(ModelMaterial::new("default"));
    loaded.sets.push(Vec::new());
    Ok(loaded)
}

/// Images that a file's materials need.
pub(super) fn needed_images(root: &Root) -> Result<Vec<&ImageEntry>, AssetError> {
    let mut images = Vec::new();
    for (index, entry) in root.materials.iter().enumerate() {
        for wanted in wanted(entry).context(|| label("material", index, entry.name.as_deref()))? {
            images.push(at(&root.images, at(&root.textures, wanted.texture, "texture")?.source, "image")?);
        }
    }
    Ok(images)
}

/// The textures that a material asks for.
fn wanted(entry: &Material) -> Result<Vec<Wanted>, AssetError> {
    let mut all = Vec::new();
    let mut note = |wanted| {
        all.push(wanted);
        Ok(0)
    };
    read(entry, String::new(), &mut note)?;
    Ok(all)
}

/// A material, but for textures that nothing depends on because their factors are 0. Occlusion maps are for those that do not follow light.
fn read(entry: &Material, name: String, want: Want<'_>) -> Result<ModelMaterial, AssetError> {
    let pbr = &entry.pbr_metallic_roughness;
    let (metallic, roughness) = (fraction(pbr.metallic_factor.0), fraction(pbr.roughness_factor.0));
    let base_color_texture = pbr.base_color_texture.as_ref().map(|info| want(Wanted::of(info, ColorSpace::Srgb)?)).transpose();
    let surface = pbr.metallic_roughness_texture.as_ref().filter(|_| metallic > 0.0 || roughness > 0.0);
    let surface = surface.map(|info| want(Wanted::of(info, ColorSpace::Linear)?)).transpose();
    let normal = entry.normal_texture.as_ref().map(|map| {
        let others = map.extensions.as_ref().map(|extensions| &extensions.others);
        let texture = want(Wanted::linear(map.index, map.tex_coord, others)?)?;
        Ok(NormalMap { texture, scale: finite(map.scale, "scale")? })
    });
    let mut material = ModelMaterial {
        base_color: pbr.base_color_factor.0.map(fraction),
        base_color_texture: base_color_texture.context(|| "baseColorTexture".into())?,
        metallic,
        roughness,
        metallic_roughness_texture: surface.context(|| "metallicRoughnessTexture".into())?,
        normal: normal.transpose().context(|| "normalTexture".into())?,
        alpha: alpha(entry)?,
        double_sided: entry.double_sided,
        ..ModelMaterial::new(&name)
    };
    let strength = extensions::read(entry, &mut material, want)?;
    material.emission.radiance = entry.emissive_factor.0.map(|factor| fraction(factor) * strength);
    if let Some(info) = entry.emissive_texture.as_ref().filter(|_| material.emission.radiance != [0.0; 3]) {
        let texture = Wanted::of(info, ColorSpace::Srgb).and_then(want).context(|| "emissiveTexture".into())?;
        material.emission.texture = Some(texture);
    }
    Ok(material)
}

fn alpha(entry: &Material) -> Result<AlphaMode, AssetError> {
    Ok(match entry.alpha_mode {
        Checked::Valid(AlphaModeEntry::Mask) => AlphaMode::Mask(finite(entry.alpha_cutoff.map_or(0.5, |cutoff| cutoff.0), "alphaCutoff")?),
        Checked::Valid(AlphaModeEntry::Blend) => AlphaMode::Blend,
        _ => AlphaMode::Opaque,
    })
}

fn warn(entry: &Material, material: &ModelMaterial, warnings: &mut Warnings) {
    let mut warn = |wanted: bool, text: &str| {
        if wanted {
            warnings.object("material", format!("{:?}", material.name), text);
        }
    };
    warn(matches!(entry.alpha_mode, Checked::Invalid), "its alphaMode is unknown; drawn opaque");
    warn(material.unlit, "unlit surfaces are not modelled; where light is followed they shine in their base colour, on others too");
}

/// A number that has no range of its own.
fn finite(value: f32, what: &str) -> Result<f32, AssetError> {
    if value.is_finite() { Ok(value) } else { Err(AssetError::new(format!("its {what} is not finite"))) }
}
