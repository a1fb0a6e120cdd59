//! Materials, compiled: how a surface scatters and emits light, and where it is cut away.

mod bsdf;
mod conductor;
pub mod dielectric;
mod diffuse;
mod energy;
mod gloss;
mod ideal;
mod local;
mod medium;
mod metallic_roughness;
pub mod metals;
mod microfacet;
mod mirror;
mod plastic;
mod recipe;
mod refractive;
mod rough_diffuse;
mod sheen;
mod table;
#[cfg(test)]
mod tests;

use glam::DVec3;

pub use self::{
    bsdf::{Bsdf, Scattered},
    ideal::Ideal,
    medium::{Medium, Travel},
    recipe::{Glass, Recipe},
};

use crate::{
    assets::ModelMaterial,
    description::{self, Rgb},
};

/// A compiled material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// What simple models of light make of it.
    pub ideal: Ideal,
    /// How the surface scatters light.
    pub recipe: Recipe,
    /// What it gives off by itself.
    pub emission: Option<Emission>,
    /// The surface is absent where its alpha (`base_alpha` times the texture's) is below this (glTF's alpha mode `MASK`).
    pub alpha_cutoff: Option<f32>,
    /// Alpha of the material, in [0, 1].
    pub base_alpha: f32,
    /// Whether the surface is there when seen from behind (glTF's `doubleSided`).
    pub double_sided: bool,
    /// Whether the vertex colours of a mesh multiply the reflectance (glTF's `COLOR_0`).
    pub color_from_vertices: bool,
}

/// What a surface gives off by itself, the same in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance.
    pub radiance: DVec3,
    /// Index of a compiled texture that multiplies it.
    pub texture: Option<u32>,
    /// Whether it shines on the side that the normal does not point to, too.
    pub two_sided: bool,
}

impl Material {
    /// Prepares a material of the description; texture indices stay what they are.
    pub fn compile(material: &description::Material) -> Self {
        let emission = match material {
            description::Material::Emitter { radiance, texture, two_sided } if radiance.iter().any(|x| *x > 0.0) => {
                Some(Emission { radiance: rgb(*radiance), texture: *texture, two_sided: *two_sided })
            }
            _ => None,
        };
        let (ideal, recipe) = (Ideal::of(material), Recipe::of(material));
        Self { ideal, recipe, emission, alpha_cutoff: None, base_alpha: 1.0, double_sided: true, color_from_vertices: false }
    }

    /// Prepares a material of a model file whose textures begin at index `first_texture` of the scene's.
    pub fn from_model(material: &ModelMaterial, first_texture: u32) -> Self {
        let [r, g, b, alpha] = material.base_color;
        let texture = material.texture.and_then(|index| u32::try_from(index).ok()).map(|index| first_texture + index);
        let reflectance = rgb([r, g, b]);
        Self {
            ideal: Ideal::Diffuse { reflectance, texture },
            recipe: Recipe::Diffuse { reflectance, texture },
            emission: None,
            alpha_cutoff: material.alpha_cutoff,
            base_alpha: alpha,
            double_sided: material.double_sided,
            color_from_vertices: true,
        }
    }

    /// Whether it asks for texture coordinates.
    #[inline]
    pub fn is_textured(&self) -> bool {
        self.ideal.texture().is_some() || self.emission.is_some_and(|emission| emission.texture.is_some())
    }

    /// Texture of the reflectance, where there is one.
    #[inline]
    pub fn texture(&self) -> Option<u32> {
        self.ideal.texture()
    }

    /// Whether what goes through the surface is not dimmed, but for what it reflects.
    pub fn passes_all_light(&self) -> bool {
        matches!(self.ideal, Ideal::Glass { transmittance: DVec3::ONE, .. })
    }

    /// Whether the surface may be absent somewhere, so that a hit must be asked for its alpha.
    #[inline]
    pub fn is_masked(&self) -> bool {
        self.alpha_cutoff.is_some()
    }
}

/// A colour of the description in the engine's own precision.
pub(crate) fn rgb(color: Rgb) -> DVec3 {
    DVec3::new(color[0].into(), color[1].into(), color[2].into())
}
