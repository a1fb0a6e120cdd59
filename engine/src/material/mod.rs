//! Materials, compiled: how a surface scatters light, and where it is cut away.

pub mod dielectric;

use glam::DVec3;

use crate::assets::ModelMaterial;
use crate::description;

/// A compiled material.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Material {
    /// How the surface scatters light.
    pub bsdf: Bsdf,
    /// The surface is absent where its alpha (`base_alpha` times the texture's) is below this (glTF's alpha mode `MASK`).
    pub alpha_cutoff: Option<f32>,
    /// Alpha of the material, in [0, 1].
    pub base_alpha: f32,
    /// Whether the surface is there when seen from behind (glTF's `doubleSided`).
    pub double_sided: bool,
    /// Whether the vertex colours of a mesh multiply the reflectance (glTF's `COLOR_0`).
    pub color_from_vertices: bool,
}

/// A bidirectional scattering distribution function.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Bsdf {
    /// Lambertian reflection, on both sides.
    Diffuse {
        /// Albedo, multiplied by `texture` where there is one.
        reflectance: DVec3,
        /// Index of the compiled texture.
        texture: Option<u32>,
    },
    /// Perfect specular reflection, on both sides.
    Mirror {
        /// The share of light that is reflected.
        reflectance: DVec3,
    },
    /// A smooth dielectric.
    Glass {
        /// Index of refraction of the inside, relative to the outside.
        ior: f64,
        /// Multiplies what is reflected.
        reflectance: DVec3,
        /// Multiplies what is refracted.
        transmittance: DVec3,
    },
}

impl Material {
    /// Prepares a material of the description; texture indices stay what they are.
    pub fn compile(material: &description::Material) -> Self {
        let bsdf = match material {
            description::Material::Diffuse { reflectance, texture } => Bsdf::Diffuse { reflectance: rgb(*reflectance), texture: *texture },
            description::Material::Mirror { reflectance } => Bsdf::Mirror { reflectance: rgb(*reflectance) },
            description::Material::Glass { ior, reflectance, transmittance } => {
                Bsdf::Glass { ior: *ior, reflectance: rgb(*reflectance), transmittance: rgb(*transmittance) }
            }
        };
        Self { bsdf, alpha_cutoff: None, base_alpha: 1.0, double_sided: true, color_from_vertices: false }
    }

    /// Prepares a material of a model file whose textures begin at index `first_texture` of the scene's.
    pub fn from_model(material: &ModelMaterial, first_texture: u32) -> Self {
        let [r, g, b, alpha] = material.base_color;
        let texture = material.texture.and_then(|index| u32::try_from(index).ok()).map(|index| first_texture + index);
        Self {
            bsdf: Bsdf::Diffuse { reflectance: rgb([r, g, b]), texture },
            alpha_cutoff: material.alpha_cutoff,
            base_alpha: alpha,
            double_sided: material.double_sided,
            color_from_vertices: true,
        }
    }

    /// Texture of the reflectance, where there is one.
    #[inline]
    pub fn texture(&self) -> Option<u32> {
        match self.bsdf {
            Bsdf::Diffuse { texture, .. } => texture,
            Bsdf::Mirror { .. } | Bsdf::Glass { .. } => None,
        }
    }

    /// Whether what goes through the surface is not dimmed, but for what it reflects.
    pub fn passes_all_light(&self) -> bool {
        matches!(self.bsdf, Bsdf::Glass { transmittance: DVec3::ONE, .. })
    }

    /// Whether the surface may be absent somewhere, so that a hit must be asked for its alpha.
    #[inline]
    pub fn is_masked(&self) -> bool {
        self.alpha_cutoff.is_some()
    }
}

fn rgb(color: description::Rgb) -> DVec3 {
    DVec3::new(color[0].into(), color[1].into(), color[2].into())
}
