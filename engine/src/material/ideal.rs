//! What ray casting and Whitted's ray tracing make of materials: surfaces are diffuse, mirrors or clear.

use glam::DVec3;

use super::rgb;
use crate::description::{Fresnel, Material};

/// The nearest of three ideal surfaces.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Ideal {
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

impl Ideal {
    /// Metals become mirrors of what they reflect straight on, plastic and glTF's model become their base, and what only shines is black.
    pub fn of(material: &Material) -> Self {
        match material {
            Material::Diffuse { reflectance, texture }
            | Material::RoughDiffuse { reflectance, texture, .. }
            | Material::Plastic { reflectance, texture, .. } => Self::Diffuse { reflectance: rgb(*reflectance), texture: *texture },
            Material::MetallicRoughness(model) => Self::Diffuse { reflectance: rgb(model.base_color), texture: model.base_color_texture },
            Material::Mirror { reflectance } => Self::Mirror { reflectance: rgb(*reflectance) },
            Material::Metal { fresnel, .. } => Self::Mirror { reflectance: straight_on(fresnel) },
            Material::Glass { ior, reflectance, transmittance, .. } => {
                Self::Glass { ior: *ior, reflectance: rgb(*reflectance), transmittance: rgb(*transmittance) }
            }
            Material::Emitter { .. } => Self::Diffuse { reflectance: DVec3::ZERO, texture: None },
            Material::Boundary { .. } => Self::Glass { ior: 1.0, reflectance: DVec3::ONE, transmittance: DVec3::ONE },
        }
    }

    /// Texture of the reflectance, where there is one.
    #[inline]
    pub fn texture(&self) -> Option<u32> {
        match self {
            Self::Diffuse { texture, .. } => *texture,
            Self::Mirror { .. } | Self::Glass { .. } => None,
        }
    }
}

/// Reflectance at normal incidence: `((eta - 1)^2 + k^2) / ((eta + 1)^2 + k^2)` for a complex index.
fn straight_on(fresnel: &Fresnel) -> DVec3 {
    match fresnel {
        Fresnel::Index { eta, k } => {
            let (eta, k) = (rgb(*eta), rgb(*k));
            let (below, above) = (eta - 1.0, eta + 1.0);
            (below * below + k * k) / (above * above + k * k)
        }
        Fresnel::Schlick(color) | Fresnel::Constant(color) => rgb(*color),
    }
}
