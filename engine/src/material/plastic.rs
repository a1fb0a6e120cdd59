//! Plastic: a clear coat, smooth or rough, over a Lambertian base.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{
    Scattered,
    energy::{DielectricAlbedo, fresnel},
    local::{cosine_density, cosine_hemisphere, half_vector, same_side, upright},
    microfacet::Ggx,
};

/// A dielectric coat over a Lambertian base, seen alike from both sides.
///
/// What the coat does not reflect reaches the base. The base and the inside of the coat reflect it to and fro, and what gets out is spread as
/// `1 - E` tells, with the coat's albedo `E`, which keeps the model reciprocal ("A Microfacet Based Coupled Specular-Matte BRDF Model with
/// Importance Sampling", Kelemen and Szirmay-Kalos, 2001).
#[derive(Clone, Copy, Debug)]
pub struct Plastic<'a> {
    albedo: &'a DielectricAlbedo,
    specular: DVec3,
    /// The base's BRDF but for the shares of both directions.
    base: DVec3,
    /// What the base reflects of the light that the coat lets pass.
    diffuse: f64,
    /// `None`: smooth.
    rough: Option<Ggx>,
}

impl<'a> Plastic<'a> {
    /// A base of the given albedo under a coat whose index, at least 1, is the table's; `alpha` is the coat's roughness along x and y. The coat's
    /// reflection is multiplied by `specular`, which is 1 in nature.
    #[inline]
    pub fn new(reflectance: DVec3, specular: DVec3, alpha: [f64; 2], albedo: &'a DielectricAlbedo) -> Self {
        let rough = Ggx::new(alpha[0], alpha[1]);
        let passed = rough.map_or(albedo.transmitted()[0], |ggx| 1.0 - albedo.reflected_average(&ggx));
        // What the coat lets out of diffuse light from below, by reciprocity.
        let out = (passed / (albedo.eta() * albedo.eta())).clamp(0.0, 1.0);
        let color = reflectance * out / (DVec3::ONE - reflectance * (1.0 - out)).max(DVec3::splat(f64::MIN_POSITIVE));
        let base = if passed > 0.0 { color * (FRAC_1_PI / passed) } else { DVec3::ZERO };
        Self { albedo, specular, base, diffuse: color.max_element(), rough }
    }

    /// See [`super::Bsdf::evaluate`].
    #[inline]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        if !same_side(wo, wi) {
            return (DVec3::ZERO, 0.0);
        }
        let (wo, wi) = upright(wo, wi);
        let reflected = self.reflected(wo);
        let p = self.coat_probability(reflected);
        let base = self.base * ((1.0 - reflected) * (1.0 - self.reflected(wi)) * wi.z);
        let base_pdf = (1.0 - p) * cosine_density(wi);
        match (&self.rough, half_vector(wo, wi)) {
            (Some(ggx), Some(m)) => {
                let (value, pdf) = ggx.reflection(wo, wi, m);
                (base + self.specular * (value * fresnel(wo.dot(m), self.albedo.eta())), base_pdf + p * pdf)
            }
            _ => (base, base_pdf),
        }
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        if wo.z == 0.0 {
            return None;
        }
        let (up, _) = upright(wo, wo);
        let reflected = self.reflected(up);
        let p = self.coat_probability(reflected);
        let wi = match &self.rough {
            _ if pick >= p => cosine_hemisphere(u),
            Some(ggx) => {
                let m = ggx.sample_visible(up, u);
                m * (2.0 * up.dot(m)) - up
            }
            None => return Some(Scattered::mirrored(wo, self.specular * (reflected / p), p)),
        };
        if wi.z <= 0.0 {
            return None;
        }
        let wi = DVec3::new(wi.x, wi.y, wi.z.copysign(wo.z));
        let (value, pdf) = self.evaluate(wo, wi);
        (pdf > 0.0).then(|| Scattered::reflected(wi, value / pdf, pdf))
    }

    /// What the coat reflects of light from a direction.
    #[inline(always)]
    fn reflected(&self, w: DVec3) -> f64 {
        match &self.rough {
            Some(ggx) => self.albedo.reflected(ggx, w),
            None => fresnel(w.z, self.albedo.eta()),
        }
    }

    /// Probability with which a reflection by the coat is chosen.
    #[inline(always)]
    fn coat_probability(&self, reflected: f64) -> f64 {
        let (coat, base) = (reflected * self.specular.max_element(), (1.0 - reflected) * self.diffuse);
        if coat + base > 0.0 { coat / (coat + base) } else { 0.0 }
    }
}
