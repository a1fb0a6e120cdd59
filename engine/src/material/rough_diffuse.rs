//! Rough diffuse reflection: Oren and Nayar's, with the light that the surface scatters more than once ("EON: A Practical Energy-Preserving Rough
//! Diffuse BRDF", Portsmouth, Kutz and Hill, JCGT 14(1), 2025).

use std::f64::consts::{FRAC_1_PI, PI};

use glam::{DVec2, DVec3};

use super::{
    Scattered,
    local::{cosine_density, cosine_hemisphere, same_side},
};
use crate::math::acos;

/// `1/2 - 2 / (3 pi)`, of the paper's equation for Fujii's form of the qualitative model.
const FUJII_A: f64 = 0.5 - 2.0 / (3.0 * PI);
/// `2/3 - 28 / (15 pi)`, of its average albedo.
const FUJII_B: f64 = 2.0 / 3.0 - 28.0 / (15.0 * PI);

/// A rough diffuse surface, seen alike from both sides.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RoughDiffuse {
    /// Albedo of the facets, each component in [0, 1].
    reflectance: DVec3,
    /// In [0, 1]; 0 is Lambertian.
    roughness: f64,
    /// `A_F` of the paper: `1 / (1 + (1/2 - 2 / (3 pi)) r)`.
    scale: f64,
    /// The colour of light that is scattered more than once, over what its shares at both directions are normalised by.
    repeated: DVec3,
}

impl RoughDiffuse {
    /// A surface of facets of the given albedo, each component in [0, 1]; `roughness` in [0, 1].
    #[inline]
    pub fn new(reflectance: DVec3, roughness: f64) -> Self {
        let roughness = roughness.clamp(0.0, 1.0);
        let scale = 1.0 / (1.0 + FUJII_A * roughness);
        let average = scale * (1.0 + FUJII_B * roughness);
        let missing = 1.0 - average;
        let color = reflectance * reflectance * average / (DVec3::ONE - reflectance * missing);
        // A Lambertian surface misses nothing, and no light is scattered twice.
        let repeated = if missing > 1e-12 { color / missing } else { DVec3::ZERO };
        Self { reflectance, roughness, scale, repeated }
    }

    /// See [`super::Bsdf::evaluate`].
    #[inline]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        if !same_side(wo, wi) {
            return (DVec3::ZERO, 0.0);
        }
        let (cos_o, cos_i) = (wo.z.abs(), wi.z.abs());
        let aligned = wo.x * wi.x + wo.y * wi.y;
        // s / t of the paper; the product of the tangents' cosine with the smaller sine ratio, and without division where negative.
        let stretched = if aligned > 0.0 { aligned / cos_o.max(cos_i) } else { aligned };
        let once = self.scale * (1.0 + self.roughness * stretched);
        let again = (1.0 - self.albedo(cos_o)) * (1.0 - self.albedo(cos_i));
        let value = self.reflectance * once + self.repeated * again;
        (value * (FRAC_1_PI * cos_i), cosine_density(wi))
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, wo: DVec3, u: DVec2) -> Option<Scattered> {
        let up = cosine_hemisphere(u);
        let wi = DVec3::new(up.x, up.y, up.z.copysign(wo.z));
        let (value, pdf) = self.evaluate(wo, wi);
        (pdf > 0.0).then(|| Scattered::reflected(wi, value / pdf, pdf))
    }

    /// What white facets reflect once of light at the given cosine: the paper's exact form, `A_F (1 + r G / pi)` with
    /// `G = sin (theta - sin cos) + 2/3 ((sin / cos) (1 - sin^3) - sin)`.
    #[inline]
    fn albedo(&self, cos: f64) -> f64 {
        let cos = cos.min(1.0);
        let sin2 = 1.0 - cos * cos;
        let sin = sin2.sqrt();
        // (1 - sin^3) / cos without cancellation: 1 - sin = cos^2 / (1 + sin).
        let ratio = cos * (1.0 + sin + sin2) / (1.0 + sin);
        let g = sin * (acos(cos) - sin * cos) + 2.0 / 3.0 * (sin * ratio - sin);
        self.scale * (1.0 + self.roughness * FRAC_1_PI * g)
    }
}
