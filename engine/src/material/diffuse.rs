//! Lambert's reflection: the same radiance in all directions.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{
    Scattered,
    local::{cosine_density, cosine_hemisphere, same_side},
};

/// An ideal diffuse surface, seen alike from both sides (pbrt-v4 9.2).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Diffuse {
    /// Albedo, each component in [0, 1].
    pub reflectance: DVec3,
}

impl Diffuse {
    /// See [`super::Bsdf::evaluate`].
    #[inline(always)]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        if !same_side(wo, wi) {
            return (DVec3::ZERO, 0.0);
        }
        (self.reflectance * (FRAC_1_PI * wi.z.abs()), cosine_density(wi))
    }

    /// See [`super::Bsdf::sample`].
    #[inline(always)]
    pub fn sample(&self, wo: DVec3, u: DVec2) -> Option<Scattered> {
        let up = cosine_hemisphere(u);
        let wi = DVec3::new(up.x, up.y, up.z.copysign(wo.z));
        same_side(wo, wi).then(|| Scattered::reflected(wi, self.reflectance, cosine_density(wi)))
    }
}
