//! Extensions of materials (Khronos, glTF extension registry), each as its own text has it.

use gltf::json::{Index, material::Material, texture::Info, texture::Texture as TextureEntry};
use serde::Deserialize;
use serde_json::{Map, Value};

use super::{AssetError, Want, finite, textures::Wanted};
use crate::{
    assets::{
        ModelMaterial,
        files::Context,
        material::{Anisotropy, Clearcoat, NormalMap, Sheen, Specular, Transmission, Volume},
        mesh::fraction,
    },
    description::ColorSpace::{self, Linear, Srgb},
};

/// The largest index of refraction; what is beyond it looks the same.
const MAX_IOR: f32 = 1e4;

/// Reads the extensions of a material into it, and returns the strength of its emission.
pub(super) fn read(entry: &Material, material: &mut ModelMaterial, want: Want<'_>) -> Result<f32, AssetError> {
    let Some(extensions) = &entry.extensions else { return Ok(1.0) };
    let others = &extensions.others;
    material.unlit = others.contains_key("KHR_materials_unlit");
    if let Some(ior) = extension(others, "KHR_materials_ior", |entry: IorEntry| entry.ior())? {
        material.ior = ior;
    }
    if let Some(specular) = extension(others, "KHR_materials_specular", |entry: SpecularEntry| entry.specular(want))? {
        material.specular = specular;
    }
    material.transmission = extension(others, "KHR_materials_transmission", |entry: TransmissionEntry| entry.transmission(want))?.flatten();
    material.volume = extension(others, "KHR_materials_volume", |entry: VolumeEntry| entry.volume(want))?.flatten();
    material.clearcoat = extension(others, "KHR_materials_clearcoat", |entry: ClearcoatEntry| entry.clearcoat(want))?.flatten();
    material.sheen = extension(others, "KHR_materials_sheen", |entry: SheenEntry| entry.sheen(want))?.flatten();
    material.anisotropy = extension(others, "KHR_materials_anisotropy", |entry: AnisotropyEntry| entry.anisotropy(want))?.flatten();
    Ok(extension(others, "KHR_materials_emissive_strength", |entry: StrengthEntry| entry.strength())?.unwrap_or(1.0))
}

/// What one extension says, if it is there.
fn extension<'v, E: Deserialize<'v>, T>(
    others: &'v Map<String, Value>,
    name: &str,
    read: impl FnOnce(E) -> Result<T, AssetError>,
) -> Result<Option<T>, AssetError> {
    let Some(value) = others.get(name) else { return Ok(None) };
    let entry = E::deserialize(value).map_err(|error| AssetError::new(error.to_string()));
    entry.and_then(read).map(Some).context(|| name.to_owned())
}

fn texture(info: Option<&Info>, space: ColorSpace, want: Want<'_>) -> Result<Option<usize>, AssetError> {
    info.map(|info| want(Wanted::of(info, space)?)).transpose()
}

fn not_negative(value: f32, what: &str) -> Result<f32, AssetError> {
    finite(value, what).map(|value| value.max(0.0))
}

#[derive(Deserialize)]
#[serde(default)]
struct IorEntry {
    ior: f32,
}

impl Default for IorEntry {
    fn default() -> Self {
        Self { ior: 1.5 }
    }
}

impl IorEntry {
    fn ior(self) -> Result<f32, AssetError> {
        let ior = finite(self.ior, "ior")?;
        Ok(if ior == 0.0 { 0.0 } else { ior.clamp(1.0, MAX_IOR) })
    }
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct StrengthEntry {
    emissive_strength: f32,
}

impl Default for StrengthEntry {
    fn default() -> Self {
        Self { emissive_strength: 1.0 }
    }
}

impl StrengthEntry {
    fn strength(self) -> Result<f32, AssetError> {
        not_negative(self.emissive_strength, "emissiveStrength")
    }
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SpecularEntry {
    specular_factor: f32,
    specular_texture: Option<Info>,
    specular_color_factor: [f32; 3],
    specular_color_texture: Option<Info>,
}

impl Default for SpecularEntry {
    fn default() -> Self {
        Self { specular_factor: 1.0, specular_texture: None, specular_color_factor: [1.0; 3], specular_color_texture: None }
    }
}

impl SpecularEntry {
    /// Alpha is linear in every image; decoded as colours are, one image serves both textures.
    fn specular(self, want: Want<'_>) -> Result<Specular, AssetError> {
        let factor = fraction(self.specular_factor);
        if factor == 0.0 {
            return Ok(Specular { factor, ..Specular::default() });
        }
        let [r, g, b] = self.specular_color_factor;
        let what = "specularColorFactor";
        Ok(Specular {
            factor,
            texture: texture(self.specular_texture.as_ref(), Srgb, want)?,
            color: [not_negative(r, what)?, not_negative(g, what)?, not_negative(b, what)?],
            color_texture: texture(self.specular_color_texture.as_ref(), Srgb, want)?,
        })
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct TransmissionEntry {
    transmission_factor: f32,
    transmission_texture: Option<Info>,
}

impl TransmissionEntry {
    fn transmission(self, want: Want<'_>) -> Result<Option<Transmission>, AssetError> {
        let factor = fraction(self.transmission_factor);
        if factor == 0.0 {
            return Ok(None);
        }
        Ok(Some(Transmission { factor, texture: texture(self.transmission_texture.as_ref(), Linear, want)? }))
    }
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct VolumeEntry {
    thickness_factor: f32,
    thickness_texture: Option<Info>,
    attenuation_distance: f32,
    attenuation_color: [f32; 3],
}

impl Default for VolumeEntry {
    fn default() -> Self {
        Self { thickness_factor: 0.0, thickness_texture: None, attenuation_distance: f32::INFINITY, attenuation_color: [1.0; 3] }
    }
}

impl VolumeEntry {
    fn volume(self, want: Want<'_>) -> Result<Option<Volume>, AssetError> {
        let thickness = not_negative(self.thickness_factor, "thicknessFactor")?;
        if thickness == 0.0 {
            return Ok(None);
        }
        if self.attenuation_distance.is_nan() || self.attenuation_distance <= 0.0 {
            return Err(AssetError::new("its attenuationDistance must be above 0"));
        }
        Ok(Some(Volume {
            thickness,
            thickness_texture: texture(self.thickness_texture.as_ref(), Linear, want)?,
            attenuation_distance: self.attenuation_distance,
            attenuation_color: self.attenuation_color.map(fraction),
        }))
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct ClearcoatEntry {
    clearcoat_factor: f32,
    clearcoat_texture: Option<Info>,
    clearcoat_roughness_factor: f32,
    clearcoat_roughness_texture: Option<Info>,
    clearcoat_normal_texture: Option<NormalEntry>,
}

/// A reference to a normal map.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct NormalEntry {
    index: Index<TextureEntry>,
    #[serde(default)]
    tex_coord: u32,
    #[serde(default)]
    scale: Option<f32>,
    #[serde(default)]
    extensions: Map<String, Value>,
}

impl ClearcoatEntry {
    fn clearcoat(self, want: Want<'_>) -> Result<Option<Clearcoat>, AssetError> {
        let factor = fraction(self.clearcoat_factor);
        if factor == 0.0 {
            return Ok(None);
        }
        let (roughness, mut roughness_texture) = (fraction(self.clearcoat_roughness_factor), None);
        if roughness > 0.0 {
            roughness_texture = texture(self.clearcoat_roughness_texture.as_ref(), Linear, want)?;
        }
        let coat_texture = texture(self.clearcoat_texture.as_ref(), Linear, want)?;
        let normal = self.clearcoat_normal_texture.map(|map| {
            let texture = want(Wanted::linear(map.index, map.tex_coord, Some(&map.extensions))?)?;
            Ok(NormalMap { texture, scale: finite(map.scale.unwrap_or(1.0), "scale")? })
        });
        Ok(Some(Clearcoat { factor, texture: coat_texture, roughness, roughness_texture, normal: normal.transpose()? }))
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct SheenEntry {
    sheen_color_factor: [f32; 3],
    sheen_color_texture: Option<Info>,
    sheen_roughness_factor: f32,
    sheen_roughness_texture: Option<Info>,
}

impl SheenEntry {
    /// As for [`SpecularEntry`], one image serves colour and alpha.
    fn sheen(self, want: Want<'_>) -> Result<Option<Sheen>, AssetError> {
        let color = self.sheen_color_factor.map(fraction);
        if color == [0.0; 3] {
            return Ok(None);
        }
        Ok(Some(Sheen {
            color,
            color_texture: texture(self.sheen_color_texture.as_ref(), Srgb, want)?,
            roughness: fraction(self.sheen_roughness_factor),
            roughness_texture: texture(self.sheen_roughness_texture.as_ref(), Srgb, want)?,
        }))
    }
}

#[derive(Default, Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct AnisotropyEntry {
    anisotropy_strength: f32,
    anisotropy_rotation: f32,
    anisotropy_texture: Option<Info>,
}

impl AnisotropyEntry {
    fn anisotropy(self, want: Want<'_>) -> Result<Option<Anisotropy>, AssetError> {
        let strength = fraction(self.anisotropy_strength);
        if strength == 0.0 {
            return Ok(None);
        }
        let rotation = finite(self.anisotropy_rotation, "anisotropyRotation")?;
        Ok(Some(Anisotropy { strength, rotation, texture: texture(self.anisotropy_texture.as_ref(), Linear, want)? }))
    }
}
