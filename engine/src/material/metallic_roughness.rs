//! The metallic-roughness model of glTF 2.0 (appendix B) with the extensions `KHR_materials_ior`, `_specular`, `_clearcoat`, `_sheen`,
//! `_anisotropy`, `_transmission` and `_volume`.
//!
//! From the top: a clear coat, sheen, and a mixture of a metal, an opaque dielectric, and a transparent one. A layer lets pass what it does not
//! reflect, of the two directions the lesser share, as glTF does for sheen: that keeps every mixture reciprocal and without gain.

use std::f64::consts::FRAC_1_PI;

use glam::{DVec2, DVec3};

use super::{
    Scattered,
    conductor::{Conductor, Fresnel},
    energy::{Albedo, DielectricAlbedo},
    gloss::Gloss,
    local::{cosine_density, cosine_hemisphere},
    refractive::Dielectric,
    sheen::{self, SheenAlbedo},
    stretched::alphas,
};
use crate::math::orthonormal_basis;

/// Parameters at one point, with the names and ranges of glTF.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parameters {
    /// Base colour, each component in [0, 1].
    pub base_color: DVec3,
    /// In [0, 1].
    pub metallic: f64,
    /// Perceptual roughness, in [0, 1].
    pub roughness: f64,
    /// Index of refraction of the dielectric, at least 1.
    pub ior: f64,
    /// Strength of the dielectric's reflection, in [0, 1].
    pub specular: f64,
    /// Colour of the dielectric's reflection straight on, from 0 on.
    pub specular_color: DVec3,
    /// Share of the surface that is coated, in [0, 1].
    pub clearcoat: f64,
    /// Perceptual roughness of the coat, in [0, 1].
    pub clearcoat_roughness: f64,
    /// Colour of the sheen, each component in [0, 1].
    pub sheen_color: DVec3,
    /// Perceptual roughness of the sheen, in [0, 1].
    pub sheen_roughness: f64,
    /// Stretches reflections along x, in [0, 1].
    pub anisotropy: f64,
    /// Share of the light that enters the dielectric and gets through, in [0, 1].
    pub transmission: f64,
    /// Whether the surface bounds a volume, and thus refracts; otherwise it is thin, and lets light straight through.
    pub volume: bool,
}

impl Default for Parameters {
    /// The defaults of glTF, but for `metallic`, which is 0 here: a white, rough dielectric.
    fn default() -> Self {
        Self {
            base_color: DVec3::ONE,
            metallic: 0.0,
            roughness: 1.0,
            ior: 1.5,
            specular: 1.0,
            specular_color: DVec3::ONE,
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            sheen_color: DVec3::ZERO,
            sheen_roughness: 0.0,
            anisotropy: 0.0,
            transmission: 0.0,
            volume: false,
        }
    }
}

/// Tables that materials share; compute them once a scene.
#[derive(Clone, Copy, Debug)]
pub struct Tables<'a> {
    /// Of the base's facets: [`Albedo::over_roughness`], or [`Albedo::stretched`] where they are anisotropic.
    pub facets: &'a Albedo,
    /// [`Albedo::over_roughness`]; without it, there is no coat.
    pub coat: Option<&'a Albedo>,
    /// The albedo of sheen; without it, there is no sheen.
    pub sheen: Option<&'a SheenAlbedo>,
    /// Of the base's facets, for the material's index, if it bounds a volume; without it, rough glass loses some light.
    pub glass: Option<&'a DielectricAlbedo>,
}

/// The model at one point.
#[derive(Clone, Copy, Debug)]
pub struct MetallicRoughness<'a> {
    tables: Tables<'a>,
    base_color: DVec3,
    /// Weights of the metal, of the opaque dielectric, of the thin and the thick transparent one; they sum up to 1.
    mixture: [f64; 4],
    metal: Conductor<'a>,
    glass: Dielectric<'a>,
    specular: Gloss,
    coat: Gloss,
    clearcoat: f64,
    /// The coat's own axes in the local frame, if its normal is another one; its z is the normal.
    coat_axes: Option<[DVec3; 3]>,
    sheen_color: DVec3,
    sheen_roughness: f64,
    /// Whether the inside differs from the outside; else the surface looks alike from both sides.
    volume: bool,
    /// `pi (1 - E)` of the dielectric's gloss, on average; and of white facets.
    diffuse_norm: f64,
    white_norm: f64,
}

/// Lobes in the order in which they are chosen.
const COAT: usize = 0;
const SHEEN: usize = 1;
const METAL: usize = 2;
const SPECULAR: usize = 3;
const DIFFUSE: usize = 4;
const THIN: usize = 5;
const THIN_DIFFUSE: usize = 6;
const GLASS: usize = 7;
const LOBES: usize = 8;

impl<'a> MetallicRoughness<'a> {
    /// The model with the given parameters, which are clamped to their ranges. x of the local frame is the direction of anisotropy.
    #[inline]
    pub fn new(p: &Parameters, tables: Tables<'a>) -> Self {
        let unit = |x: f64| x.clamp(0.0, 1.0);
        let (metallic, transmission) = (unit(p.metallic), unit(p.transmission));
        let volume = p.volume && transmission > 0.0;
        let (opaque, through) = ((1.0 - metallic) * (1.0 - transmission), (1.0 - metallic) * transmission);
        let mixture = [metallic, opaque, if volume { 0.0 } else { through }, if volume { through } else { 0.0 }];
        let roughness = unit(p.roughness);
        let alpha = alphas(roughness, unit(p.anisotropy));
        let base_color = p.base_color.clamp(DVec3::ZERO, DVec3::ONE);
        let ior = p.ior.max(1.0);
        let straight = ((ior - 1.0) / (ior + 1.0)) * ((ior - 1.0) / (ior + 1.0));
        let specular = unit(p.specular);
        let f0 = (p.specular_color.max(DVec3::ZERO) * straight).min(DVec3::ONE) * specular;
        let specular = Gloss::new(f0, specular, alpha);
        let coat_alpha = unit(p.clearcoat_roughness) * unit(p.clearcoat_roughness);
        let coat = Gloss::new(DVec3::splat(0.04), 1.0, [coat_alpha; 2]);
        let [missing, five] = specular.rough.map_or([0.0, 1.0 / 21.0], |ggx| tables.facets.schlick_average(&ggx));
        Self {
            tables,
            base_color,
            mixture,
            metal: Conductor::new(Fresnel::Schlick(base_color), alpha, Some(tables.facets)),
            glass: Dielectric::new(ior, DVec3::ONE, base_color, alpha, tables.glass),
            specular,
            coat,
            clearcoat: if tables.coat.is_some() { unit(p.clearcoat) } else { 0.0 },
            coat_axes: None,
            sheen_color: if tables.sheen.is_some() { p.sheen_color.clamp(DVec3::ZERO, DVec3::ONE) } else { DVec3::ZERO },
            sheen_roughness: p.sheen_roughness,
            volume,
            diffuse_norm: (1.0 - specular.mix(1.0 - missing, five)).max(f64::MIN_POSITIVE),
            white_norm: missing,
        }
    }

    /// With a coat of another unit normal in the local frame, as seen from the viewer's side: z is above 0. Cosines of what the coat reflects are those with its own normal
    /// (`KHR_materials_clearcoat`).
    pub fn with_coat_normal(self, normal: DVec3) -> Self {
        let (x, y) = orthonormal_basis(normal);
        Self { coat_axes: Some([x, y, normal]), ..self }
    }

    /// A direction as the coat sees it.
    #[inline(always)]
    fn in_coat(&self, w: DVec3) -> DVec3 {
        match self.coat_axes {
            None => w,
            Some([x, y, z]) => DVec3::new(x.dot(w), y.dot(w), z.dot(w)),
        }
    }

    /// See [`super::Bsdf::is_specular`].
    #[inline]
    pub fn is_specular(&self) -> bool {
        let [metal, opaque, thin, thick] = self.mixture;
        let rough = self.specular.rough.is_some() && metal + thin > 0.0 || thick > 0.0 && !self.glass.is_specular();
        let coated = self.clearcoat > 0.0 && self.coat.rough.is_some();
        !rough && !coated && opaque == 0.0 && self.sheen_color == DVec3::ZERO
    }

    /// See [`super::Bsdf::evaluate`].
    #[inline]
    pub fn evaluate(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        if wo.z * wi.z == 0.0 {
            return (DVec3::ZERO, 0.0);
        }
        let (wo, wi) = self.oriented(wo, wi);
        let o = self.seen(wo);
        self.all(wo, wi, &o, &self.probabilities(&o))
    }

    /// See [`super::Bsdf::sample`].
    #[inline]
    pub fn sample(&self, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        if wo.z == 0.0 {
            return None;
        }
        let mirrored = !self.volume && wo.z < 0.0;
        let (wo, _) = self.oriented(wo, wo);
        let o = self.seen(wo);
        let p = self.probabilities(&o);
        let (lobe, pick) = choose(&p, pick)?;
        let mut s = self.sample_lobe(lobe, wo, pick, u)?;
        if s.specular {
            let weight = self.weight(lobe, &o, &self.seen(s.wi));
            s = Scattered { weight: s.weight * (weight / p[lobe]), pdf: s.pdf * p[lobe], ..s };
        } else {
            let (value, pdf) = self.all(wo, s.wi, &o, &p);
            if pdf <= 0.0 || s.wi.z == 0.0 {
                return None;
            }
            s = Scattered { weight: value / pdf, pdf, ..s };
        }
        Some(if mirrored { Scattered { wi: DVec3::new(s.wi.x, s.wi.y, -s.wi.z), ..s } } else { s })
    }

    /// Both directions mirrored by the surface where it looks alike from both sides, and the viewer stands inside.
    #[inline(always)]
    fn oriented(&self, wo: DVec3, wi: DVec3) -> (DVec3, DVec3) {
        let sign = if self.volume { 1.0 } else { 1f64.copysign(wo.z) };
        (DVec3::new(wo.x, wo.y, wo.z * sign), DVec3::new(wi.x, wi.y, wi.z * sign))
    }

    /// What the layers do with light from one direction.
    #[inline]
    fn seen(&self, w: DVec3) -> Seen {
        let bare = self.volume && w.z < 0.0;
        let coat = match self.tables.coat {
            Some(table) if !bare && self.clearcoat > 0.0 => self.clearcoat * self.coat.albedo(table, self.in_coat(w))[0],
            _ => 0.0,
        };
        let fibres = match self.tables.sheen {
            Some(table) if !bare && self.sheen_color != DVec3::ZERO => table.at(self.sheen_roughness, w.z),
            _ => 0.0,
        };
        let sheen = fibres.min(1.0) * self.sheen_color.max_element();
        let [specular, missing] = self.specular.albedo(self.tables.facets, w);
        Seen { coat: (1.0 - coat).max(0.0), sheen: (1.0 - sheen).max(0.0), fibres, specular: specular.clamp(0.0, 1.0), missing }
    }

    /// Probabilities of the lobes, by what they are thought to scatter.
    #[inline]
    fn probabilities(&self, o: &Seen) -> [f64; LOBES] {
        let [metal, opaque, thin, thick] = self.mixture;
        let color = self.base_color.max_element();
        let (under_coat, under_all) = (o.coat, o.coat * o.sheen);
        let mut p = [0.0; LOBES];
        p[COAT] = 1.0 - o.coat;
        p[SHEEN] = under_coat * (1.0 - o.sheen);
        p[METAL] = under_all * metal * color.max(0.05);
        p[SPECULAR] = under_all * (opaque + thin) * o.specular;
        p[DIFFUSE] = under_all * opaque * (1.0 - o.specular) * color;
        p[THIN] = under_all * thin * (1.0 - o.specular - o.missing).max(0.0) * color;
        p[THIN_DIFFUSE] = under_all * thin * o.missing * color;
        p[GLASS] = under_all * thick;
        let sum: f64 = p.iter().sum();
        if sum > 0.0 { p.map(|p| p / sum) } else { p }
    }

    /// What is left of a lobe under the layers above it and beside the others of the mixture.
    #[inline]
    fn weight(&self, lobe: usize, o: &Seen, i: &Seen) -> f64 {
        let [metal, opaque, thin, thick] = self.mixture;
        let coat = o.coat.min(i.coat);
        let all = coat * o.sheen.min(i.sheen);
        match lobe {
            COAT => self.clearcoat,
            SHEEN => coat,
            METAL => all * metal,
            SPECULAR => all * (opaque + thin),
            DIFFUSE => all * opaque,
            THIN | THIN_DIFFUSE => all * thin,
            _ => all * thick,
        }
    }

    /// All lobes together.
    #[inline]
    fn all(&self, wo: DVec3, wi: DVec3, o: &Seen, p: &[f64; LOBES]) -> (DVec3, f64) {
        let i = self.seen(wi);
        let (mut value, mut pdf) = (DVec3::ZERO, 0.0);
        for lobe in (0..LOBES).filter(|&lobe| p[lobe] > 0.0) {
            let (f, density) = self.evaluate_lobe(lobe, wo, wi, o, &i);
            value += f * self.weight(lobe, o, &i);
            pdf += density * p[lobe];
        }
        (value, pdf)
    }

    #[inline]
    fn evaluate_lobe(&self, lobe: usize, wo: DVec3, wi: DVec3, o: &Seen, i: &Seen) -> (DVec3, f64) {
        let nothing = (DVec3::ZERO, 0.0);
        let reflected = wo.z * wi.z > 0.0;
        let (cos, density) = (wi.z.abs(), cosine_density(wi));
        let across = DVec3::new(wi.x, wi.y, -wi.z);
        match lobe {
            GLASS => self.glass.evaluate(wo, wi),
            METAL => self.metal.evaluate(wo, wi),
            // The other lobes of one side or the other are alike from inside.
            THIN if !reflected => self.specular.evaluate(wo, across, |fresnel| self.base_color * (1.0 - fresnel.max_element())),
            THIN_DIFFUSE if !reflected => (self.base_color * again(o.missing, i.missing, self.white_norm) * cos, density),
            THIN | THIN_DIFFUSE => nothing,
            _ if !reflected => nothing,
            COAT if self.volume && wo.z < 0.0 => nothing,
            COAT => self.evaluate_coat(wo, wi),
            SHEEN if self.volume && wo.z < 0.0 => nothing,
            SHEEN => {
                // glTF's fibres reflect more than they get at the last grazing angles; there they are dimmed, alike for both directions.
                let least = 1.0 / o.fibres.max(i.fibres).max(1.0);
                (self.sheen_color * (sheen::brdf(self.sheen_roughness, wo, wi) * least * cos), density)
            }
            SPECULAR => self.specular.evaluate(wo, wi, |fresnel| fresnel),
            _ => (self.base_color * again(1.0 - o.specular, 1.0 - i.specular, self.diffuse_norm) * cos, density),
        }
    }

    #[inline]
    fn sample_lobe(&self, lobe: usize, wo: DVec3, pick: f64, u: DVec2) -> Option<Scattered> {
        let side = 1f64.copysign(wo.z);
        let flat = || {
            let up = cosine_hemisphere(u);
            DVec3::new(up.x, up.y, up.z * side)
        };
        let through = |s: Scattered| Scattered { wi: DVec3::new(s.wi.x, s.wi.y, -s.wi.z), transmitted: true, ..s };
        match lobe {
            GLASS => self.glass.sample(wo, pick, u),
            METAL => self.metal.sample(wo, pick, u),
            COAT => self.sample_coat(wo, u),
            SPECULAR => self.specular.sample(wo, u, |fresnel| fresnel),
            THIN => self.specular.sample(wo, u, |fresnel| self.base_color * (1.0 - fresnel.max_element())).map(through),
            THIN_DIFFUSE => Some(through(Scattered::reflected(flat(), DVec3::ZERO, 0.0))),
            _ => Some(Scattered::reflected(flat(), DVec3::ZERO, 0.0)),
        }
    }
}

impl MetallicRoughness<'_> {
    /// What the coat reflects from one direction of the outside to another, times the cosine with its normal; nothing where it is seen from behind.
    #[inline(always)]
    fn evaluate_coat(&self, wo: DVec3, wi: DVec3) -> (DVec3, f64) {
        let (o, i) = (self.in_coat(wo), self.in_coat(wi));
        if self.coat_axes.is_some() && !(o.z > 0.0 && i.z > 0.0) {
            return (DVec3::ZERO, 0.0);
        }
        self.coat.evaluate(o, i, |fresnel| fresnel)
    }

    /// A direction in which the coat reflects, where that leads to the outside.
    #[inline(always)]
    fn sample_coat(&self, wo: DVec3, u: DVec2) -> Option<Scattered> {
        let o = self.in_coat(wo);
        let Some([x, y, z]) = self.coat_axes else { return self.coat.sample(o, u, |fresnel| fresnel) };
        let s = self.coat.sample(o, u, |fresnel| fresnel).filter(|_| o.z > 0.0)?;
        let wi = x * s.wi.x + y * s.wi.y + z * s.wi.z;
        (wi.z > 0.0).then_some(Scattered { wi, ..s })
    }
}

/// What the layers do with light from one direction.
struct Seen {
    /// The shares that coat and sheen let pass.
    coat: f64,
    sheen: f64,
    /// What white fibres of the sheen reflect, and more than 1 where they reflect too much.
    fibres: f64,
    /// What the gloss of the dielectric reflects.
    specular: f64,
    /// What white facets of its roughness do not reflect at once.
    missing: f64,
}

/// A diffuse BRDF between the shares of two directions: `a b / (pi mean)`.
#[inline(always)]
fn again(a: f64, b: f64, mean: f64) -> f64 {
    if mean > 0.0 { a * b * (FRAC_1_PI / mean) } else { 0.0 }
}

/// The lobe in which `pick` falls, and its place there.
#[inline]
fn choose(p: &[f64; LOBES], pick: f64) -> Option<(usize, f64)> {
    let mut left = pick;
    let mut last = None;
    for (lobe, &p) in p.iter().enumerate().filter(|(_, p)| **p > 0.0) {
        if left < p {
            return Some((lobe, (left / p).clamp(0.0, 1.0 - f64::EPSILON / 2.0)));
        }
        left -= p;
        last = Some((lobe, 1.0 - f64::EPSILON / 2.0));
    }
    last
}
