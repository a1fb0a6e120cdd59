//! The microfacet distribution GGX of Trowbridge and Reitz, anisotropic, with Smith's masking and shadowing (pbrt-v4 9.6).

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use crate::sampling::sin_cos_of_turn;

/// Below this alpha a lobe is specular.
///
/// All but `alpha^2 / (alpha^2 + tan^2)` of the facets of GGX tilt by less than the given angle: here all but 1e-4 of them by less than 0.06
/// degrees, and masking takes less than 1e-5 of the light down to cosines of 0.005, so nothing visible changes at this step.
pub const SMOOTH_ALPHA: f64 = 1e-5;

/// A rough surface of facets.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Ggx {
    alpha: DVec2,
}

impl Ggx {
    /// Slopes' roughness along x and y, each clamped to [`SMOOTH_ALPHA`]..1; `None` where both are below: the surface is smooth.
    #[inline]
    pub fn new(alpha_x: f64, alpha_y: f64) -> Option<Self> {
        let rough = alpha_x >= SMOOTH_ALPHA || alpha_y >= SMOOTH_ALPHA;
        rough.then(|| Self { alpha: DVec2::new(alpha_x.clamp(SMOOTH_ALPHA, 1.0), alpha_y.clamp(SMOOTH_ALPHA, 1.0)) })
    }

    /// As [`Self::new`], but never smooth: for tables.
    pub fn clamped(alpha: [f64; 2]) -> Self {
        Self { alpha: DVec2::from_array(alpha.map(|alpha| alpha.clamp(SMOOTH_ALPHA, 1.0))) }
    }

    /// Roughness along x and y.
    #[inline(always)]
    pub fn alpha(&self) -> DVec2 {
        self.alpha
    }

    /// The share of the area that facets of normal `m` take, by solid angle; 0 for normals below the surface (pbrt-v4 9.16).
    #[inline(always)]
    pub fn density(&self, m: DVec3) -> f64 {
        let (x, y) = (m.x / self.alpha.x, m.y / self.alpha.y);
        let e = x * x + y * y + m.z * m.z;
        if m.z > 0.0 { FRAC_1_PI / (self.alpha.x * self.alpha.y * e * e) } else { 0.0 }
    }

    /// Length of a direction in the space in which the surface is a hemisphere: `|cos| (1 + 2 Lambda)` of pbrt-v4 9.22, above 0 at any angle.
    #[inline(always)]
    fn stretch(&self, w: DVec3) -> f64 {
        let (x, y) = (w.x * self.alpha.x, w.y * self.alpha.y);
        (x * x + y * y + w.z * w.z).sqrt()
    }

    /// Smith's masking of one direction, in [0, 1] (pbrt-v4 9.20).
    #[inline]
    pub fn masking(&self, w: DVec3) -> f64 {
        let cos = w.z.abs();
        2.0 * cos / (cos + self.stretch(w))
    }

    /// What a sample by visible normals weighs but for Fresnel's factor: `G(o, i) / G1(o)`, in [0, 1]; `o` or `i` must not graze.
    #[inline(always)]
    pub fn sample_weight(&self, o: DVec3, i: DVec3) -> f64 {
        let (cos_o, cos_i, stretch_o) = (o.z.abs(), i.z.abs(), self.stretch(o));
        cos_i * (cos_o + stretch_o) / (cos_o * self.stretch(i) + cos_i * stretch_o)
    }

    /// Density of the normals that are visible from `o`, by solid angle of the normal, over `o.m` (pbrt-v4 9.25).
    #[inline(always)]
    pub fn visible_density_over_cosine(&self, o: DVec3, m: DVec3) -> f64 {
        2.0 * self.density(m) / (o.z.abs() + self.stretch(o))
    }

    /// A normal that is visible from `o`, which must not point below the surface.
    #[inline]
    pub fn sample_visible(&self, o: DVec3, u: DVec2) -> DVec3 {
        self.sample_visible_at(o, u.y, sin_cos_of_turn(u.x))
    }

    /// As [`Self::sample_visible`], with the sine and cosine of the turn: a spherical cap in the space in which the surface is a hemisphere holds
    /// the half vectors of what that hemisphere reflects ("Sampling Visible GGX Normals with Spherical Caps", Dupuy and Benyoub, 2023).
    #[inline(always)]
    pub fn sample_visible_at(&self, o: DVec3, u: f64, (sin, cos): (f64, f64)) -> DVec3 {
        let o = DVec3::new(o.x * self.alpha.x, o.y * self.alpha.y, o.z) * (1.0 / self.stretch(o));
        let z = (1.0 - u) * (1.0 + o.z) - o.z;
        let radius = (1.0 - z * z).max(0.0).sqrt();
        let half = DVec3::new(radius * cos + o.x, radius * sin + o.y, z + o.z);
        let m = DVec3::new(half.x * self.alpha.x, half.y * self.alpha.y, half.z.max(0.0));
        let squared = m.length_squared();
        if squared > 0.0 { m * (1.0 / squared.sqrt()) } else { DVec3::Z }
    }

    /// The factor of a reflection that knows nothing of Fresnel, times the cosine of `i`: `D G / (4 cos_o)`; with the density by solid angle with
    /// which a mirror at a visible normal sends `o` to `i`. Both are 0 unless both directions lie on the outward side.
    #[inline(always)]
    pub fn reflection(&self, o: DVec3, i: DVec3, m: DVec3) -> (f64, f64) {
        let density = self.density(m);
        let (cos_o, cos_i, stretch_o) = (o.z, i.z, self.stretch(o));
        let value = 0.5 * density * cos_i / (cos_o * self.stretch(i) + cos_i * stretch_o);
        (value, 0.5 * density / (cos_o + stretch_o))
    }
}
