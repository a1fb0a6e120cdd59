//! A glossy reflection of glTF: facets or a smooth surface, under Schlick's approximation of Fresnel's equations.

use glam::{DVec2, DVec3};

use super::{Scattered, conductor::schlick_weight, energy::Albedo, local::half_vector, microfacet::Ggx};

/// Facets, or a smooth surface, under Schlick's approximation of Fresnel's equations.
#[derive(Clone, Copy, Debug)]
pub struct Gloss {
    f0: DVec3,
    f90: f64,
    /// `None`: smooth.
    pub rough: Option<Ggx>,
}

impl Gloss {
    /// Reflectance straight on and at grazing angles, each in [0, 1], and roughness along x and y.
    #[inline]
    pub fn new(f0: DVec3, f90: f64, alpha: [f64; 2]) -> Self {
        Self { f0, f90, rough: Ggx::new(alpha[0], alpha[1]) }
    }

    #[inline(always)]
    fn fresnel(&self, cos: f64) -> DVec3 {
        self.f0 + (DVec3::splat(self.f90) - self.f0) * schlick_weight(cos)
    }

    /// The greatest component of the albedo, from that of white facets and their part of grazing angles.
    #[inline(always)]
    pub fn mix(&self, white: f64, five: f64) -> f64 {
        let f0 = self.f0.max_element();
        f0 * white + (self.f90 - f0) * five
    }

    /// The greatest component of what is reflected of light from `w`, and what white facets do not reflect at once.
    #[inline]
    pub fn albedo(&self, table: &Albedo, w: DVec3) -> [f64; 2] {
        let [missing, five] = match &self.rough {
            Some(ggx) => table.schlick(ggx, w),
            None => [0.0, schlick_weight(w.z.abs())],
        };
        [self.mix(1.0 - missing, five), missing]
    }

    /// Of two directions on the same side, the BRDF times the cosine, with what is made of Fresnel's factor, and the density.
    #[inline]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3, color: impl Fn(DVec3) -> DVec3) -> (DVec3, f64) {
        let side = 1f64.copysign(wo.z);
        let (o, i) = (DVec3::new(wo.x, wo.y, wo.z * side), DVec3::new(wi.x, wi.y, wi.z * side));
        let (Some(ggx), Some(m)) = (&self.rough, half_vector(o, i)) else { return (DVec3::ZERO, 0.0) };
        let (value, pdf) = ggx.reflection(o, i, m);
        (color(self.fresnel(o.dot(m))) * value, pdf)
    }

    /// A direction on the side of `wo`; weight and density of one that is not specular are left to the caller.
    #[inline]
    pub fn sample(&self, wo: DVec3, u: DVec2, color: impl Fn(DVec3) -> DVec3) -> Option<Scattered> {
        let side = 1f64.copysign(wo.z);
        let Some(ggx) = &self.rough else {
            return Some(Scattered::mirrored(wo, color(self.fresnel(wo.z.abs())), 1.0));
        };
        let o = DVec3::new(wo.x, wo.y, wo.z * side);
        let m = ggx.sample_visible(o, u);
        let i = m * (2.0 * o.dot(m)) - o;
        (i.z > 0.0).then(|| Scattered::reflected(DVec3::new(i.x, i.y, i.z * side), DVec3::ZERO, 0.0))
    }
}
