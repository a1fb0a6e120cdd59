//! glTF's metallic-roughness model.

use mlua::Value;
use tessera_engine::description::{Absorption, Bumps, ColorSpace, Material, MetallicRoughness, Rgb, Texture, TextureId};

use super::{
    Form, Function,
    material::{BRIGHTEST, COAT, make, texture, texture_or},
};
use crate::job::keys::{FINITE, Field, Keys, POSITIVE, Range, UNIT};

pub const FUNCTIONS: &[Function] = &[Function {
    path: "metallic_roughness",
    form: Form::Table,
    keys: &[
        "base_color",
        "metallic",
        "roughness",
        "metallic_roughness",
        "normal",
        "normal_scale",
        "emissive",
        "ior",
        "specular",
        "specular_color",
        "transmission",
        "volume",
        "attenuation_color",
        "attenuation_distance",
        "clearcoat",
        "clearcoat_roughness",
        "clearcoat_normal",
        "clearcoat_normal_scale",
        "sheen_color",
        "sheen_roughness",
        "anisotropy",
        "anisotropy_rotation",
        "name",
    ],
    make: metallic_roughness,
}];

/// A normal map is no stronger than this.
const SCALE: Range = Range { lowest: -1e6, highest: 1e6, open: false, words: "a number from -1e6 to 1e6" };

fn metallic_roughness(keys: &Keys) -> mlua::Result<Value> {
    let mut textures = Vec::new();
    let usual = MetallicRoughness::default();
    let unit = |key, usual: f32| Ok::<_, mlua::Error>(keys.or(key, usual.into(), |field| field.number(UNIT))? as f32);
    let (base_color, base_color_texture) = color(keys, "base_color", usual.base_color, 1.0, &mut textures)?;
    let (emissive, emissive_texture) = color(keys, "emissive", usual.emissive, BRIGHTEST, &mut textures)?;
    let model = MetallicRoughness {
        base_color,
        base_color_texture,
        metallic: unit("metallic", usual.metallic)?,
        roughness: unit("roughness", usual.roughness)?,
        metallic_roughness_texture: numbers(keys, "metallic_roughness", &mut textures)?,
        normal: bumps(keys, "normal", "normal_scale", &mut textures)?,
        emissive,
        emissive_texture,
        ior: keys.or("ior", usual.ior.into(), |field| field.number(COAT))? as f32,
        specular: unit("specular", usual.specular)?,
        specular_color: keys.or("specular_color", usual.specular_color, |field| field.color(BRIGHTEST))?,
        transmission: unit("transmission", usual.transmission)?,
        volume: volume(keys)?,
        clearcoat: unit("clearcoat", usual.clearcoat)?,
        clearcoat_roughness: unit("clearcoat_roughness", usual.clearcoat_roughness)?,
        clearcoat_normal: bumps(keys, "clearcoat_normal", "clearcoat_normal_scale", &mut textures)?,
        sheen_color: keys.or("sheen_color", usual.sheen_color, |field| field.color(1.0))?,
        sheen_roughness: unit("sheen_roughness", usual.sheen_roughness)?,
        anisotropy: unit("anisotropy", usual.anisotropy)?,
        anisotropy_rotation: keys.or("anisotropy_rotation", 0.0, |field| field.number(FINITE))?.rem_euclid(360.0).to_radians() as f32,
    };
    make(keys, Material::MetallicRoughness(Box::new(model)), textures)
}

/// A colour, and the number of a texture that multiplies it.
fn color(keys: &Keys, key: &'static str, usual: Rgb, highest: f64, textures: &mut Vec<Texture>) -> mlua::Result<(Rgb, Option<TextureId>)> {
    let (color, texture) = keys.or(key, (usual, None), |field| texture_or(field, |field| field.color(highest)))?;
    Ok((color, texture.map(|texture| put(texture, textures))))
}

/// The number of a texture that tells no colours.
fn numbers(keys: &Keys, key: &'static str, textures: &mut Vec<Texture>) -> mlua::Result<Option<TextureId>> {
    keys.optional(key)?.map(|field| Ok(put(linear(&field)?, textures))).transpose()
}

fn bumps(keys: &Keys, key: &'static str, scale: &'static str, textures: &mut Vec<Texture>) -> mlua::Result<Option<Bumps>> {
    let map = numbers(keys, key, textures)?;
    if map.is_none() && keys.optional(scale)?.is_some() {
        return Err(keys.fault(format!("`{scale}` goes with `{key}`")).into());
    }
    let scale = keys.or(scale, 1.0, |field| field.number(SCALE))? as f32;
    Ok(map.map(|texture| Bumps { texture, scale }))
}

fn linear(field: &Field) -> mlua::Result<Texture> {
    let texture = texture(field, "a texture (tessera.image, with color_space = \"linear\")")?;
    match texture {
        Texture::Image { color_space: ColorSpace::Srgb, .. } => {
            Err(field.fault("holds numbers, not colours").with_help("tessera.image { ..., color_space = \"linear\" }").into())
        }
        texture => Ok(texture),
    }
}

fn put(texture: Texture, textures: &mut Vec<Texture>) -> TextureId {
    textures.push(texture);
    textures.len() as TextureId - 1
}

fn volume(keys: &Keys) -> mlua::Result<Option<Absorption>> {
    let is_thick = keys.or("volume", false, |field| field.boolean())?;
    if !is_thick {
        return match (keys.optional("attenuation_color")?, keys.optional("attenuation_distance")?) {
            (None, None) => Ok(None),
            _ => Err(keys.fault("`attenuation_color` and `attenuation_distance` go with `volume = true`").into()),
        };
    }
    let color = keys.or("attenuation_color", [1.0; 3], |field| field.color(1.0))?;
    let distance = keys.or("attenuation_distance", f64::INFINITY, |field| field.number(POSITIVE))?;
    Ok(Some(Absorption { color, distance: (distance as f32).max(f32::MIN_POSITIVE) }))
}
