//! The metallic-roughness model, by the names of glTF 2.0 and its extensions.

use serde::{Deserialize, Serialize};

use super::{Rgb, TextureId};

/// A surface of glTF's metallic-roughness model (glTF 2.0, section 3.9 and appendix B), on both sides. A texture multiplies the number beside it.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct MetallicRoughness {
    /// Each component in [0, 1].
    pub base_color: Rgb,
    /// Of the base colour.
    pub base_color_texture: Option<TextureId>,
    /// How much of it is a metal, in [0, 1].
    pub metallic: f32,
    /// Perceptual, in [0, 1].
    pub roughness: f32,
    /// Roughness in green, metal in blue.
    pub metallic_roughness_texture: Option<TextureId>,
    /// Bumps.
    pub normal: Option<Bumps>,
    /// Radiance, each component at least 0.
    pub emissive: Rgb,
    /// Of the radiance.
    pub emissive_texture: Option<TextureId>,
    /// Index of refraction of what is no metal, from 1 on (`KHR_materials_ior`).
    pub ior: f32,
    /// Strength of the reflection of what is no metal, in [0, 1] (`KHR_materials_specular`).
    pub specular: f32,
    /// Its colour straight on, each component at least 0.
    pub specular_color: Rgb,
    /// The share of light that is refracted into what is no metal, in [0, 1] (`KHR_materials_transmission`).
    pub transmission: f32,
    /// What the surface encloses (`KHR_materials_volume`); `None`: its walls are thin.
    pub volume: Option<Absorption>,
    /// The share of the surface that is coated, in [0, 1] (`KHR_materials_clearcoat`).
    pub clearcoat: f32,
    /// Perceptual roughness of the coat, in [0, 1].
    pub clearcoat_roughness: f32,
    /// Bumps of the coat, which otherwise has none.
    pub clearcoat_normal: Option<Bumps>,
    /// Colour of fibres on top, each component in [0, 1] (`KHR_materials_sheen`).
    pub sheen_color: Rgb,
    /// Their perceptual roughness, in [0, 1].
    pub sheen_roughness: f32,
    /// How much reflections are stretched, in [0, 1] (`KHR_materials_anisotropy`).
    pub anisotropy: f32,
    /// Along which direction: radians counter-clockwise from that of u.
    pub anisotropy_rotation: f32,
}

/// A normal map.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Bumps {
    /// Directions in the frame of u, of what is up on the image, and of the normal, from [-1, 1] as linear colours in [0, 1].
    pub texture: TextureId,
    /// Multiplies the first two; finite.
    pub scale: f32,
}

/// An inside that absorbs light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Absorption {
    /// What is left of white light after the distance, each component in [0, 1].
    pub color: Rgb,
    /// Above 0, may be infinite.
    pub distance: f32,
}

impl Default for MetallicRoughness {
    /// What glTF takes where it says nothing else.
    fn default() -> Self {
        Self {
            base_color: [1.0; 3],
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal: None,
            emissive: [0.0; 3],
            emissive_texture: None,
            ior: 1.5,
            specular: 1.0,
            specular_color: [1.0; 3],
            transmission: 0.0,
            volume: None,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            clearcoat_normal: None,
            sheen_color: [0.0; 3],
            sheen_roughness: 0.0,
            anisotropy: 0.0,
            anisotropy_rotation: 0.0,
        }
    }
}

impl MetallicRoughness {
    /// All textures that it names.
    pub fn textures_mut(&mut self) -> impl Iterator<Item = &mut TextureId> {
        let colors = [&mut self.base_color_texture, &mut self.metallic_roughness_texture, &mut self.emissive_texture];
        let bumps = [&mut self.normal, &mut self.clearcoat_normal];
        colors.into_iter().flatten().chain(bumps.into_iter().flatten().map(|bumps| &mut bumps.texture))
    }

    /// Says what of it is out of its range, if anything is.
    pub fn fault(&self) -> Option<&'static str> {
        let unit = |numbers: &[f32]| numbers.iter().all(|x| (0.0..=1.0).contains(x));
        let positive = |numbers: &[f32]| numbers.iter().all(|x| x.is_finite() && *x >= 0.0);
        let Self { metallic, roughness, specular, transmission, clearcoat, clearcoat_roughness, sheen_roughness, anisotropy, .. } = *self;
        let finite = |bumps: &Option<Bumps>| bumps.as_ref().is_none_or(|bumps| bumps.scale.is_finite());
        let absorbs = |volume: &Absorption| unit(&volume.color) && volume.distance > 0.0;
        let holds = [
            (unit(&self.base_color) && unit(&self.sheen_color), "its base and sheen colours must lie in 0 to 1"),
            (positive(&self.emissive) && positive(&self.specular_color), "its colours must be finite and not negative"),
            (unit(&[roughness, clearcoat_roughness, sheen_roughness]), "its roughness must lie in 0 to 1"),
            (unit(&[metallic, specular, transmission, clearcoat, anisotropy]), "its shares must lie in 0 to 1"),
            (self.ior >= 1.0 && self.ior.is_finite(), "its index of refraction must be at least 1"),
            (finite(&self.normal) && finite(&self.clearcoat_normal), "the scale of its bumps must be finite"),
            (self.anisotropy_rotation.is_finite(), "the rotation of its anisotropy must be finite"),
            (self.volume.as_ref().is_none_or(absorbs), "its attenuation must have a colour in 0 to 1 and a distance above 0"),
        ];
        holds.into_iter().find(|(holds, _)| !holds).map(|(_, fault)| fault)
    }
}
