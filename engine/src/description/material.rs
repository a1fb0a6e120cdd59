//! Materials.

use serde::{Deserialize, Serialize};

use super::{Rgb, TextureId};

/// How a surface answers to light.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Material {
    /// Lambertian reflection, on both sides.
    Diffuse {
        /// Albedo, each component in [0, 1], multiplied by `texture` where there is one.
        reflectance: Rgb,
        /// Texture of the albedo.
        texture: Option<TextureId>,
    },
    /// Perfect specular reflection, on both sides.
    Mirror {
        /// The share of light that is reflected, at every angle.
        reflectance: Rgb,
    },
    /// A smooth dielectric: reflects and refracts by Fresnel's equations. The normal points out of the denser side.
    Glass {
        /// Index of refraction of the inside, relative to the outside; above 0.
        ior: f64,
        /// Multiplies what is reflected.
        reflectance: Rgb,
        /// Multiplies what is refracted.
        transmittance: Rgb,
    },
}
