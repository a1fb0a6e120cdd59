//! A scattering distribution at one point, of any model.

use glam::{DVec2, DVec3};

use super::{
    conductor::Conductor, diffuse::Diffuse, metallic_roughness::MetallicRoughness, mirror::Mirror, plastic::Plastic,
    refractive::Dielectric, rough_diffuse::RoughDiffuse,
};

/// A direction that a BSDF has chosen.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Scattered {
    /// Unit direction towards the light, in the local frame.
    pub wi: DVec3,
    /// The BSDF times |cos wi| over the density, from 0 on; radiance that arrives from `wi` times this is an estimate of what leaves along `wo`.
    pub weight: DVec3,
    /// Density by solid angle, above 0, as told by [`Bsdf::evaluate`]; for a specular direction the probability with which it was chosen.
    pub pdf: f64,
    /// Whether the direction is the only one its lobe can give.
    pub specular: bool,
    /// Whether the direction lies on the other side of the surface.
    pub transmitted: bool,
    /// The squared index of refraction on the side of `wi` relative to the side of `wo`; 1 for reflection. The weight of a refracted ray is
    /// smaller by this, which Russian roulette should not see (pbrt-v4 14.2.1).
    pub eta2: f64,
}

impl Scattered {
    /// A direction on the side of the viewer, of a lobe that is not specular.
    #[inline(always)]
    pub fn reflected(wi: DVec3, weight: DVec3, pdf: f64) -> Self {
        Self { wi, weight, pdf, specular: false, transmitted: false, eta2: 1.0 }
    }

    /// The mirror direction of `wo`.
    #[inline(always)]
    pub fn mirrored(wo: DVec3, weight: DVec3, probability: f64) -> Self {
        let wi = DVec3::new(-wo.x, -wo.y, wo.z);
        Self { wi, weight, pdf: probability, specular: true, transmitted: false, eta2: 1.0 }
    }
}

/// How the surface scatters at one point: parameters of a model, with every texture looked up.
///
/// Directions are unit vectors in the local frame, whose z is the shading normal on the outward side; either may lie on either side. Radiance is
/// transported: refraction into a denser side compresses it (pbrt-v4 9.5.2).
#[derive(Clone, Copy, Debug)]
pub enum Bsdf<'a> {
    /// Lambert's reflection.
    Diffuse(Diffuse),
    /// Rough diffuse reflection.
    RoughDiffuse(RoughDiffuse),
    /// A perfect mirror.
    Mirror(Mirror),
    /// A metal.
    Conductor(Conductor<'a>),
    /// Glass, smooth or rough.
    Dielectric(Dielectric<'a>),
    /// A clear coat over a diffuse base.
    Plastic(Plastic<'a>),
    /// The model of glTF.
    MetallicRoughness(&'a MetallicRoughness<'a>),
}

impl Bsdf<'_> {
    /// The BSDF times |cos wi|, and the density by solid angle with which [`Self::sample`] chooses `wi`; both without specular lobes.
    #[inline]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        match self {
            Self::Diffuse(model) => model.evaluate(wo, wi),
            Self::RoughDiffuse(model) => model.evaluate(wo, wi),
            Self::Mirror(_) => (DVec3::ZERO, 0.0),
            Self::Conductor(model) => model.evaluate(wo, wi),
            Self::Dielectric(model) => model.evaluate(wo, wi),
            Self::Plastic(model) => model.evaluate(wo, wi),
            Self::MetallicRoughness(model) => model.evaluate(wo, wi),
        }
    }

    /// A direction for the light that leaves along `wo`; `pick` and `u` lie in [0, 1). `None` where the light is lost, and where `wo` grazes.
    #[inline]
    pub fn sample(&self, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        match self {
            Self::Diffuse(model) => model.sample(wo, u),
            Self::RoughDiffuse(model) => model.sample(wo, u),
            Self::Mirror(model) => model.sample(wo),
            Self::Conductor(model) => model.sample(wo, pick, u),
            Self::Dielectric(model) => model.sample(wo, pick, u),
            Self::Plastic(model) => model.sample(wo, pick, u),
            Self::MetallicRoughness(model) => model.sample(wo, pick, u),
        }
    }

    /// Whether [`Self::sample`] makes use of `pick`.
    #[inline]
    pub fn has_lobes(&self) -> bool {
        !matches!(self, Self::Diffuse(_) | Self::RoughDiffuse(_) | Self::Mirror(_))
    }

    /// Whether all lobes are specular, so that there is no use in choosing points on lights.
    #[inline]
    pub fn is_specular(&self) -> bool {
        match self {
            Self::Diffuse(_) | Self::RoughDiffuse(_) | Self::Plastic(_) => false,
            Self::Mirror(_) => true,
            Self::Conductor(model) => model.is_specular(),
            Self::Dielectric(model) => model.is_specular(),
            Self::MetallicRoughness(model) => model.is_specular(),
        }
    }
}
