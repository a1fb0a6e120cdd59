//! From a material and a point of its surface to the BSDF there.

use std::sync::Arc;

use glam::DVec3;

use super::{
    Bsdf, Material,
    conductor::{Conductor, Fresnel},
    diffuse::Diffuse,
    energy::{Albedo, DielectricAlbedo},
    microfacet::SMOOTH_ALPHA,
    mirror::Mirror,
    refractive::Dielectric,
    rgb,
};
use crate::{
    description::{self, Material as Description},
    scene::Surface,
    texture::Texture,
};

/// How a material's surface scatters light, but for what textures say.
#[derive(Clone, Debug, PartialEq)]
pub enum Recipe {
    /// Not at all.
    Nothing,
    /// It lets all light pass: the border of a medium.
    Boundary,
    /// As Lambert's law says.
    Diffuse {
        /// Albedo, multiplied by `texture` where there is one.
        reflectance: DVec3,
        /// Index of the compiled texture.
        texture: Option<u32>,
    },
    /// As a mirror.
    Mirror(Mirror),
    /// As a metal.
    Metal {
        /// What its facets reflect.
        fresnel: Fresnel,
        /// Roughness of the microfacets along the tangent and across it.
        alpha: [f64; 2],
        /// What facets reflect once, where the rest is kept.
        albedo: Option<Arc<Albedo>>,
    },
    /// As a dielectric.
    Glass {
        /// Index of refraction of the inside, relative to the outside.
        eta: f64,
        /// Multiplies what is reflected.
        reflectance: DVec3,
        /// Multiplies what is refracted.
        transmittance: DVec3,
        /// Roughness of the microfacets.
        alpha: f64,
        /// What facets reflect and refract once, where the rest is kept.
        albedo: Option<Arc<DielectricAlbedo>>,
    },
}

impl Recipe {
    /// Of a material of the description.
    pub fn of(material: &Description) -> Self {
        match material {
            Description::Diffuse { reflectance, texture } => Self::Diffuse { reflectance: rgb(*reflectance), texture: *texture },
            Description::Mirror { reflectance } => Self::Mirror(Mirror { reflectance: rgb(*reflectance) }),
            Description::Metal { fresnel, roughness, multiple_scattering } => {
                let alpha = roughness.map(|roughness| roughness * roughness);
                let rough = alpha.iter().any(|alpha| *alpha > SMOOTH_ALPHA);
                let albedo = (*multiple_scattering && rough).then(|| Arc::new(Albedo::fixed(alpha)));
                Self::Metal { fresnel: compiled(fresnel), alpha, albedo }
            }
            Description::Glass { ior, reflectance, transmittance, roughness, multiple_scattering, .. } => {
                let alpha = roughness * roughness;
                let albedo = (*multiple_scattering && alpha > SMOOTH_ALPHA).then(|| Arc::new(DielectricAlbedo::fixed(*ior, [alpha; 2])));
                Self::Glass { eta: *ior, reflectance: rgb(*reflectance), transmittance: rgb(*transmittance), alpha, albedo }
            }
            Description::RoughDiffuse { reflectance, texture, .. } | Description::Plastic { reflectance, texture, .. } => {
                Self::Diffuse { reflectance: rgb(*reflectance), texture: *texture }
            }
            Description::Emitter { .. } => Self::Nothing,
            Description::Boundary { .. } => Self::Boundary,
        }
    }

    /// The BSDF at a point; `None` if light is not scattered there.
    #[inline(always)]
    pub fn bsdf(&self, material: &Material, textures: &[Texture], surface: &Surface) -> Option<Bsdf<'_>> {
        Some(match self {
            Self::Nothing | Self::Boundary => return None,
            Self::Diffuse { reflectance, texture } => {
                Bsdf::Diffuse(Diffuse { reflectance: colored(*reflectance, *texture, material, textures, surface) })
            }
            Self::Mirror(mirror) => Bsdf::Mirror(*mirror),
            Self::Metal { fresnel, alpha, albedo } => Bsdf::Conductor(Conductor::new(*fresnel, *alpha, albedo.as_deref())),
            Self::Glass { eta, reflectance, transmittance, alpha, albedo } => {
                Bsdf::Dielectric(Dielectric::new(*eta, *reflectance, *transmittance, [*alpha; 2], albedo.as_deref()))
            }
        })
    }
}

/// A colour, multiplied by a texture and by vertex colours, where there are such.
#[inline(always)]
fn colored(color: DVec3, texture: Option<u32>, material: &Material, textures: &[Texture], surface: &Surface) -> DVec3 {
    let mut color = color;
    if let Some(texture) = texture {
        let [r, g, b, _] = textures[texture as usize].at(surface.uvs());
        color *= rgb([r, g, b]);
    }
    if material.color_from_vertices {
        let [r, g, b, _] = surface.color;
        color *= rgb([r, g, b]);
    }
    color
}

fn compiled(fresnel: &description::Fresnel) -> Fresnel {
    match fresnel {
        description::Fresnel::Index { eta, k } => Fresnel::index(rgb(*eta), rgb(*k)),
        description::Fresnel::Schlick(color) => Fresnel::Schlick(rgb(*color)),
        description::Fresnel::Constant(color) => Fresnel::Constant(rgb(*color)),
    }
}
