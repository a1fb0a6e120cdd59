//! Metals: reflection by microfacets, or by a smooth surface, under Fresnel's equations or simpler laws.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{
    Scattered,
    energy::Albedo,
    local::{cosine_density, cosine_hemisphere, half_vector, same_side, upright},
    microfacet::Ggx,
};

/// The share of light that a smooth metal reflects at each angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fresnel {
    /// The same at all angles.
    Constant(DVec3),
    /// From this colour straight on to white at grazing angles: "An Inexpensive BRDF Model for Physically-based Rendering" (Schlick, 1994).
    Schlick(DVec3),
    /// Fresnel's equations for unpolarised light and a complex index of refraction `eta + i k` relative to the outside.
    Index {
        /// Real part for red, green and blue, above 0.
        eta: DVec3,
        /// Imaginary part, the absorption.
        k: DVec3,
        /// Mean reflectance over the cosine-weighted hemisphere, told by [`Fresnel::index`].
        average: DVec3,
    },
}

impl Fresnel {
    /// Fresnel's equations; costs a quadrature, so do it once a material.
    pub fn index(eta: DVec3, k: DVec3) -> Self {
        const STEPS: u32 = 256;
        let at = |step: u32| {
            // Midpoints in the cosine, weighted by it.
            let cos = (f64::from(step) + 0.5) / f64::from(STEPS);
            complex(eta, k, cos) * (2.0 * cos / f64::from(STEPS))
        };
        Self::Index { eta, k, average: (0..STEPS).map(at).sum() }
    }

    /// Reflectance at the given cosine of incidence, in [0, 1].
    #[inline(always)]
    pub fn at(&self, cos: f64) -> DVec3 {
        match *self {
            Self::Constant(color) => color,
            Self::Schlick(f0) => f0 + (DVec3::ONE - f0) * schlick_weight(cos),
            Self::Index { eta, k, .. } => complex(eta, k, cos),
        }
    }

    /// Mean reflectance over the cosine-weighted hemisphere; for Schlick's `2 int (1 - cos)^5 cos dcos` is 1 / 21.
    #[inline]
    pub fn average(&self) -> DVec3 {
        match *self {
            Self::Constant(color) => color,
            Self::Schlick(f0) => f0 + (DVec3::ONE - f0) / 21.0,
            Self::Index { average, .. } => average,
        }
    }
}

/// `(1 - cos)^5`.
#[inline(always)]
pub fn schlick_weight(cos: f64) -> f64 {
    let c = (1.0 - cos).clamp(0.0, 1.0);
    let c2 = c * c;
    c2 * c2 * c
}

#[inline(always)]
fn complex(eta: DVec3, k: DVec3, cos: f64) -> DVec3 {
    DVec3::new(complex_scalar(eta.x, k.x, cos), complex_scalar(eta.y, k.y, cos), complex_scalar(eta.z, k.z, cos))
}

/// Fresnel's equations for unpolarised light on a conductor (Born and Wolf, "Principles of Optics", 14.2; pbrt-v4 9.3.6), over real numbers:
/// with `a^2 - b^2 = eta^2 - k^2 - sin^2` and `a b = eta k`, the waves are reflected by
/// `R_s = ((a - cos)^2 + b^2) / ((a + cos)^2 + b^2)` and `R_p = R_s ((a - sin tan)^2 + b^2) / ((a + sin tan)^2 + b^2)`.
#[inline(always)]
fn complex_scalar(eta: f64, k: f64, cos: f64) -> f64 {
    let cos2 = (cos * cos).min(1.0);
    let sin2 = 1.0 - cos2;
    let difference = eta * eta - k * k - sin2;
    let product = 2.0 * eta * k;
    let sum = (difference * difference + product * product).sqrt();
    let a = (0.5 * (sum + difference)).max(0.0).sqrt();
    let twice = 2.0 * a * cos;
    let perpendicular = share(sum + cos2, twice);
    let parallel = perpendicular * share(cos2 * sum + sin2 * sin2, twice * sin2);
    0.5 * (perpendicular + parallel)
}

/// `(a - b) / (a + b)` for `a >= b >= 0`, and 1 where both vanish.
#[inline(always)]
fn share(a: f64, b: f64) -> f64 {
    if a + b > 0.0 { ((a - b) / (a + b)).max(0.0) } else { 1.0 }
}

/// A metal, seen alike from both sides.
#[derive(Clone, Copy, Debug)]
pub struct Conductor<'a> {
    fresnel: Fresnel,
    /// `None`: smooth.
    rough: Option<Ggx>,
    /// Present where light is kept that facets reflect to each other.
    albedo: Option<&'a Albedo>,
}

impl<'a> Conductor<'a> {
    /// A metal of the given roughness `alpha` along x and y, in [0, 1]. With a table of its microfacets' albedo, light that they reflect to each
    /// other is kept; without, it is lost.
    #[inline]
    pub fn new(fresnel: Fresnel, alpha: [f64; 2], albedo: Option<&'a Albedo>) -> Self {
        Self { fresnel, rough: Ggx::new(alpha[0], alpha[1]), albedo }
    }

    /// See [`super::Bsdf::is_specular`].
    #[inline(always)]
    pub fn is_specular(&self) -> bool {
        self.rough.is_none()
    }

    /// See [`super::Bsdf::evaluate`].
    #[inline]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        let Some(ggx) = self.rough.filter(|_| same_side(wo, wi)) else { return (DVec3::ZERO, 0.0) };
        let (wo, wi) = upright(wo, wi);
        let Some(m) = half_vector(wo, wi) else { return (DVec3::ZERO, 0.0) };
        let (value, pdf) = ggx.reflection(wo, wi, m);
        let once = self.fresnel.at(wo.dot(m)) * value;
        match self.albedo {
            None => (once, pdf),
            Some(albedo) => {
                let lobe = Repeated::new(&ggx, albedo, self.fresnel.average(), wo);
                (once + lobe.value(wi), pdf + lobe.share * (cosine_density(wi) - pdf))
            }
        }
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        if wo.z == 0.0 {
            return None;
        }
        let Some(ggx) = self.rough else {
            return Some(Scattered::mirrored(wo, self.fresnel.at(wo.z.abs()), 1.0));
        };
        let (up, _) = upright(wo, wo);
        let repeated = self.albedo.is_some_and(|albedo| pick < Repeated::new(&ggx, albedo, self.fresnel.average(), up).share);
        let m = if repeated { DVec3::Z } else { ggx.sample_visible(up, u) };
        let wi = if repeated { cosine_hemisphere(u) } else { m * (2.0 * up.dot(m)) - up };
        if wi.z <= 0.0 {
            return None;
        }
        let turned = DVec3::new(wi.x, wi.y, wi.z.copysign(wo.z));
        if self.albedo.is_none() {
            let (_, pdf) = ggx.reflection(up, wi, m);
            let weight = self.fresnel.at(up.dot(m)) * ggx.sample_weight(up, wi);
            return (pdf > 0.0).then(|| Scattered::reflected(turned, weight, pdf));
        }
        let (value, pdf) = self.evaluate(wo, turned);
        (pdf > 0.0).then(|| Scattered::reflected(turned, value / pdf, pdf))
    }
}

/// Light that facets reflect more than once ("Revisiting Physically Based Shading at Imageworks", Kulla and Conty, 2017): what single reflections
/// of white facets lack, `1 - E`, spread so that it is reciprocal, and coloured by the series of reflections.
struct Repeated<'a> {
    ggx: &'a Ggx,
    albedo: &'a Albedo,
    /// The BRDF but for the share that `wi` lacks.
    scale: DVec3,
    /// Probability with which this lobe is chosen.
    share: f64,
}

impl<'a> Repeated<'a> {
    #[inline]
    fn new(ggx: &'a Ggx, albedo: &'a Albedo, fresnel: DVec3, wo: DVec3) -> Self {
        let (missing, average) = (albedo.missing(ggx, wo), albedo.missing_average(ggx));
        let color = fresnel * fresnel * (1.0 - average) / (DVec3::ONE - fresnel * average);
        let scale = if average > 0.0 { color * (missing * FRAC_1_PI / average) } else { DVec3::ZERO };
        // White facets would reflect `1 - missing` once, and what is missing more often.
        Self { ggx, albedo, scale, share: missing.clamp(0.0, 1.0) }
    }

    /// The BRDF times the cosine.
    #[inline]
    fn value(&self, wi: DVec3) -> DVec3 {
        self.scale * (self.albedo.missing(self.ggx, wi) * wi.z)
    }
}
