//! Materials.

use serde::{Deserialize, Serialize};

use super::{Medium, MetallicRoughness, Rgb, TextureId};

/// How a surface answers to light.
///
/// Roughness is perceptual, as in glTF: a microfacet distribution has `alpha = roughness^2`. A roughness of 0 is smooth.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Material {
    /// Lambertian reflection, on both sides.
    Diffuse {
        /// Albedo, each component in [0, 1], multiplied by `texture` where there is one.
        reflectance: Rgb,
        /// Texture of the albedo.
        texture: Option<TextureId>,
    },
    /// Rough diffuse reflection, on both sides: the energy-preserving form of Oren and Nayar's.
    RoughDiffuse {
        /// Albedo of the smooth surface, each component in [0, 1], multiplied by `texture` where there is one.
        reflectance: Rgb,
        /// Texture of the albedo.
        texture: Option<TextureId>,
        /// In [0, 1]; 0 is Lambertian.
        roughness: f64,
    },
    /// Perfect specular reflection, on both sides.
    Mirror {
        /// The share of light that is reflected, at every angle.
        reflectance: Rgb,
    },
    /// A metal, on both sides.
    Metal {
        /// What it reflects.
        fresnel: Fresnel,
        /// Along the tangent and across it, each in [0, 1].
        roughness: [f64; 2],
        /// Whether light that the microfacets reflect to each other is kept; without it, rough metals lose energy.
        multiple_scattering: bool,
    },
    /// A dielectric: reflects and refracts by Fresnel's equations. The normal points out of the denser side.
    Glass {
        /// Index of refraction of the inside, relative to vacuum; above 0.
        ior: f64,
        /// Multiplies what is reflected.
        reflectance: Rgb,
        /// Multiplies what is refracted.
        transmittance: Rgb,
        /// In [0, 1].
        roughness: f64,
        /// As for metals.
        multiple_scattering: bool,
        /// What fills the inside, for `path`.
        interior: Option<Medium>,
        /// Where several of these overlap, the one of highest priority is there.
        priority: u8,
    },
    /// A clear coat over a Lambertian base, on both sides.
    Plastic {
        /// Albedo of the base, each component in [0, 1], multiplied by `texture` where there is one.
        reflectance: Rgb,
        /// Texture of the albedo.
        texture: Option<TextureId>,
        /// Index of refraction of the coat, at least 1.
        ior: f64,
        /// Of the coat, in [0, 1].
        roughness: f64,
    },
    /// Shines and reflects nothing.
    Emitter {
        /// Radiance, the same in all directions: a surface that fills a pixel shows this number.
        radiance: Rgb,
        /// Texture that it is multiplied by.
        texture: Option<TextureId>,
        /// Whether it shines on the side that the normal does not point to, too.
        two_sided: bool,
    },
    /// The boundary of a medium, by itself invisible.
    Boundary {
        /// What fills the inside.
        interior: Medium,
    },
    /// As surfaces of glTF files.
    MetallicRoughness(Box<MetallicRoughness>),
}

impl Material {
    /// All textures that it names.
    pub fn textures_mut(&mut self) -> impl Iterator<Item = &mut TextureId> {
        let (one, several) = match self {
            Self::Diffuse { texture, .. }
            | Self::RoughDiffuse { texture, .. }
            | Self::Plastic { texture, .. }
            | Self::Emitter { texture, .. } => (texture.as_mut(), None),
            Self::MetallicRoughness(model) => (None, Some(model.textures_mut())),
            Self::Mirror { .. } | Self::Metal { .. } | Self::Glass { .. } | Self::Boundary { .. } => (None, None),
        };
        one.into_iter().chain(several.into_iter().flatten())
    }

    /// Smooth glass in empty space, with nothing inside.
    pub fn smooth_glass(ior: f64, transmittance: Rgb) -> Self {
        Self::Glass { ior, reflectance: [1.0; 3], transmittance, roughness: 0.0, multiple_scattering: true, interior: None, priority: 0 }
    }
}

/// What a smooth metal reflects at each angle.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Fresnel {
    /// Fresnel's equations for a complex index of refraction, `eta + i k`, against vacuum, for red, green and blue.
    Index {
        /// Real part, above 0.
        eta: Rgb,
        /// Imaginary part, the absorption.
        k: Rgb,
    },
    /// Schlick's approximation, from this colour straight on to white at grazing angles.
    Schlick(Rgb),
    /// The same at all angles.
    Constant(Rgb),
}
