//! Glass: a smooth or rough interface between two dielectrics, that reflects and refracts.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{
    Scattered,
    dielectric::interface,
    energy::DielectricAlbedo,
    local::{cosine_density, cosine_hemisphere, half_vector, same_side},
    microfacet::Ggx,
};

/// Relative indices nearer to 1 than this do not bend rays: neither refraction nor reflection would be seen.
const SAME_INDEX: f64 = 1e-5;

/// A dielectric interface (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007; pbrt-v4 9.5 and 9.7).
#[derive(Clone, Copy, Debug)]
pub struct Dielectric<'a> {
    eta: f64,
    reflectance: DVec3,
    transmittance: DVec3,
    /// `None`: smooth.
    rough: Option<Ggx>,
    albedo: Option<&'a DielectricAlbedo>,
}

impl<'a> Dielectric<'a> {
    /// An interface whose inside (negative z) has the index `eta` relative to its outside, above 0. Reflection and refraction are multiplied by
    /// `reflectance` and `transmittance`, which are 1 in nature. `alpha` is the roughness along x and y, in [0, 1].
    #[inline]
    pub fn new(eta: f64, reflectance: DVec3, transmittance: DVec3, alpha: [f64; 2], albedo: Option<&'a DielectricAlbedo>) -> Self {
        let rough = Ggx::new(alpha[0], alpha[1]).filter(|_| (eta - 1.0).abs() >= SAME_INDEX);
        Self { eta, reflectance, transmittance, rough, albedo }
    }

    /// See [`super::Bsdf::is_specular`].
    #[inline(always)]
    pub fn is_specular(&self) -> bool {
        self.rough.is_none()
    }

    /// See [`super::Bsdf::evaluate`].
    #[inline]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        match &self.rough {
            Some(ggx) if wo.z * wi.z != 0.0 => match self.albedo {
                Some(albedo) => self.both(ggx, &Repeated::new(self, albedo, ggx, wo), wo, wi),
                None => self.single(ggx, wo, wi),
            },
            _ => (DVec3::ZERO, 0.0),
        }
    }

    /// Light that meets one facet, and light that meets more.
    #[inline]
    fn both(&self, ggx: &Ggx, repeated: &Repeated, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        let (once, once_pdf) = self.single(ggx, wo, wi);
        let (again, again_pdf) = repeated.evaluate(ggx, wo, wi);
        (once + again, once_pdf + repeated.share * (again_pdf - once_pdf))
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        if wo.z == 0.0 {
            return None;
        }
        match &self.rough {
            Some(ggx) => match self.albedo {
                Some(albedo) => self.sample_both(ggx, &Repeated::new(self, albedo, ggx, wo), wo, pick, u),
                None => self.sample_rough(ggx, wo, pick, u),
            },
            None => self.sample_smooth(wo, pick),
        }
    }

    /// Index on the far side of the interface relative to the side of `wo`.
    #[inline(always)]
    fn relative_index(&self, wo: DVec3) -> f64 {
        if wo.z > 0.0 { self.eta } else { 1.0 / self.eta }
    }

    /// Probability with which a reflection is chosen where the share `reflected` is; `None` where nothing leaves.
    #[inline(always)]
    fn reflection_probability(&self, reflected: f64) -> Option<f64> {
        let (r, t) = (reflected * self.reflectance.max_element(), (1.0 - reflected) * self.transmittance.max_element());
        (r + t > 0.0).then(|| r / (r + t))
    }

    #[inline]
    fn sample_smooth(&self, wo: DVec3, pick: f64) -> Option<Scattered> {
        if self.eta == 1.0 {
            return Some(Scattered { wi: -wo, weight: self.transmittance, pdf: 1.0, specular: true, transmitted: true, eta2: 1.0 });
        }
        let at = interface(-wo, DVec3::Z, self.eta);
        let p = self.reflection_probability(at.reflected)?;
        if pick < p {
            return Some(Scattered::mirrored(wo, self.reflectance * (at.reflected / p), p));
        }
        let eta = self.relative_index(wo);
        let weight = self.transmittance * ((1.0 - at.reflected) / ((1.0 - p) * eta * eta));
        let wi = at.refracted.filter(|wi| wi.z * wo.z < 0.0)?;
        Some(Scattered { wi, weight, pdf: 1.0 - p, specular: true, transmitted: true, eta2: eta * eta })
    }

    #[inline]
    fn sample_rough(&self, ggx: &Ggx, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        let m = ggx.sample_visible(wo * 1f64.copysign(wo.z), u);
        let at = interface(-wo, m, self.eta);
        let p = self.reflection_probability(at.reflected)?;
        if pick < p {
            let wi = m * (2.0 * wo.dot(m)) - wo;
            let pdf = 0.25 * p * ggx.visible_density_over_cosine(wo, m);
            let weight = self.reflectance * (at.reflected / p * ggx.sample_weight(wo, wi));
            return (same_side(wo, wi) && pdf > 0.0).then(|| Scattered::reflected(wi, weight, pdf));
        }
        let wi = at.refracted.filter(|wi| wi.z * wo.z < 0.0)?;
        let eta = self.relative_index(wo);
        let pdf = (1.0 - p) * ggx.visible_density_over_cosine(wo, m) * refraction_jacobian(wo.dot(m), wi.dot(m), eta);
        let weight = self.transmittance * ((1.0 - at.reflected) / ((1.0 - p) * eta * eta) * ggx.sample_weight(wo, wi));
        (pdf > 0.0).then_some(Scattered { wi, weight, pdf, specular: false, transmitted: true, eta2: eta * eta })
    }

    #[inline]
    fn sample_both(&self, ggx: &Ggx, repeated: &Repeated, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        let share = repeated.share;
        let chosen = if pick < share {
            let up = cosine_hemisphere(u);
            let side = if pick < share * repeated.refraction { -wo.z } else { wo.z };
            let wi = DVec3::new(up.x, up.y, up.z.copysign(side));
            let transmitted = wi.z * wo.z < 0.0;
            let eta = if transmitted { self.relative_index(wo) } else { 1.0 };
            Scattered { wi, weight: DVec3::ZERO, pdf: 0.0, specular: false, transmitted, eta2: eta * eta }
        } else {
            self.sample_rough(ggx, wo, (pick - share) / (1.0 - share), u)?
        };
        let (value, pdf) = self.both(ggx, repeated, wo, chosen.wi);
        (pdf > 0.0 && chosen.wi.z != 0.0).then(|| Scattered { weight: value / pdf, pdf, ..chosen })
    }

    /// Light that meets one facet.
    #[inline]
    fn single(&self, ggx: &Ggx, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        let nothing = (DVec3::ZERO, 0.0);
        let (reflection, eta) = (same_side(wo, wi), self.relative_index(wo));
        let half = if reflection { half_vector(wo, wi) } else { half_vector(wo, wi * eta) };
        let Some(m) = half else { return nothing };
        let (along_o, along_i) = (wo.dot(m), wi.dot(m));
        // A facet is seen from the side of the surface from which it is lit.
        if along_o * wo.z <= 0.0 || along_i * wi.z <= 0.0 {
            return nothing;
        }
        let reflected = interface(-wo, m, self.eta).reflected;
        let Some(p) = self.reflection_probability(reflected) else { return nothing };
        let visible = ggx.visible_density_over_cosine(wo, m);
        // The value over the density is the weight of a sample, in which the Jacobians cancel.
        let (color, probability, jacobian) = if reflection {
            (self.reflectance * reflected, p, 0.25)
        } else {
            (self.transmittance * ((1.0 - reflected) / (eta * eta)), 1.0 - p, refraction_jacobian(along_o, along_i, eta))
        };
        (color * (visible * jacobian * ggx.sample_weight(wo, wi)), visible * jacobian * probability)
    }
}

/// Light that meets more than one facet: what single scattering lacks of light from one side, `1 - E`, spread over both sides so that it is
/// reciprocal ("Revisiting Physically Based Shading at Imageworks", Kulla and Conty, 2017).
struct Repeated<'a> {
    albedo: &'a DielectricAlbedo,
    /// Times what `wi` lacks and its cosine: the BSDF of reflection and of refraction.
    reflected: DVec3,
    refracted: DVec3,
    /// Probability of refraction in this lobe.
    refraction: f64,
    /// Probability of this lobe.
    share: f64,
}

impl<'a> Repeated<'a> {
    #[inline]
    fn new(model: &Dielectric, albedo: &'a DielectricAlbedo, ggx: &Ggx, wo: DVec3) -> Self {
        let average = albedo.missing_average(ggx);
        let refracted = albedo.refracted_again(average);
        let (here, there) = if wo.z > 0.0 { (0, 1) } else { (1, 0) };
        let missing = albedo.missing(ggx, wo).clamp(0.0, 1.0);
        let eta = model.relative_index(wo);
        let lobe = |side: usize| if average[side] > 0.0 { missing * FRAC_1_PI / average[side] } else { 0.0 };
        let (r, t) = ((1.0 - refracted[here]) * model.reflectance.max_element(), refracted[here] * model.transmittance.max_element());
        Self {
            albedo,
            reflected: model.reflectance * (lobe(here) * (1.0 - refracted[here])),
            refracted: model.transmittance * (lobe(there) * refracted[here] / (eta * eta)),
            refraction: if r + t > 0.0 { t / (r + t) } else { 0.5 },
            share: missing,
        }
    }

    #[inline]
    fn evaluate(&self, ggx: &Ggx, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        let missing = self.albedo.missing(ggx, wi) * wi.z.abs();
        if same_side(wo, wi) {
            (self.reflected * missing, (1.0 - self.refraction) * cosine_density(wi))
        } else {
            (self.refracted * missing, self.refraction * cosine_density(wi))
        }
    }
}

/// Solid angle of the half vector over that of the refracted direction, times `|wo.m|` (Walter et al. 2007, equation 17; pbrt-v4 9.36).
#[inline(always)]
fn refraction_jacobian(along_o: f64, along_i: f64, eta: f64) -> f64 {
    let sum = along_i + along_o / eta;
    (along_o * along_i).abs() / (sum * sum)
}
