//! Albedos of microfacets: which share of light a rough surface scatters once. What is missing is scattered more often.

use std::f64::consts::PI;

use glam::DVec3;

use super::{
    conductor::schlick_weight,
    dielectric::interface,
    microfacet::Ggx,
    table::{Fill, Table},
};
use crate::math::sin_cos;

/// Turns of a quadrature over half of the azimuth, and heights.
const TURNS: usize = 16;
const HEIGHTS: usize = 32;

/// What white facets reflect once, and what Schlick's weights of grazing angles take of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Albedo(Table<2>);

impl Albedo {
    /// For one roughness along x and y, clamped as by [`Ggx::new`]; takes some milliseconds.
    pub fn fixed(alpha: [f64; 2]) -> Self {
        Self(Table::fixed(&Ggx::clamped(alpha), &Facets::new()))
    }

    /// For all isotropic roughnesses; of anisotropic ones it knows an estimate.
    pub fn over_roughness() -> Self {
        Self(Table::over_roughness(&Facets::new()))
    }

    /// `1 - E(w)`: what white facets do not reflect at once of light from `w`, in [0, 1].
    #[inline(always)]
    pub fn missing(&self, ggx: &Ggx, w: DVec3) -> f64 {
        self.0.at(ggx, w)[0]
    }

    /// `[1 - E(w), E_5(w)]`: beside what is missing, what facets reflect once that reflect `(1 - cos)^5`. Facets of reflectance
    /// `f0 + (f90 - f0) (1 - cos)^5` thus reflect `f0 E + (f90 - f0) E_5`.
    #[inline(always)]
    pub fn schlick(&self, ggx: &Ggx, w: DVec3) -> [f64; 2] {
        self.0.at(ggx, w)
    }

    /// Mean of [`Self::missing`] over the cosine-weighted hemisphere.
    #[inline(always)]
    pub fn missing_average(&self, ggx: &Ggx) -> f64 {
        self.0.mean::<Facets>(ggx)[0]
    }

    /// Means of [`Self::schlick`] over the cosine-weighted hemisphere.
    #[inline(always)]
    pub fn schlick_average(&self, ggx: &Ggx) -> [f64; 2] {
        self.0.mean::<Facets>(ggx)
    }
}

/// What the facets of a dielectric reflect or refract once.
#[derive(Clone, Debug, PartialEq)]
pub struct DielectricAlbedo {
    table: Table<3>,
    eta: f64,
    /// Means of the smooth transmittance over the cosine-weighted hemispheres outside and inside.
    transmitted: [f64; 2],
}

impl DielectricAlbedo {
    /// For one roughness along x and y, clamped as by [`Ggx::new`]; `eta` is the index of the inside relative to the outside, above 0.
    pub fn fixed(eta: f64, alpha: [f64; 2]) -> Self {
        Self { table: Table::fixed(&Ggx::clamped(alpha), &Interfaces::new(eta)), eta, transmitted: transmitted_average(eta) }
    }

    /// For all isotropic roughnesses; of anisotropic ones it knows an estimate.
    pub fn over_roughness(eta: f64) -> Self {
        Self { table: Table::over_roughness(&Interfaces::new(eta)), eta, transmitted: transmitted_average(eta) }
    }

    /// What is reflected of light from `w` on the outside, in [0, 1].
    #[inline]
    pub fn reflected(&self, ggx: &Ggx, w: DVec3) -> f64 {
        self.table.at(ggx, w)[0] * fresnel(w.z.abs(), self.eta)
    }

    /// Mean of [`Self::reflected`] over the cosine-weighted hemisphere.
    #[inline]
    pub fn reflected_average(&self, ggx: &Ggx) -> f64 {
        self.table.mean::<Interfaces>(ggx)[0]
    }

    /// What is neither reflected nor refracted at once of light from `w`, on the side of `w`, in [0, 1].
    #[inline]
    pub fn missing(&self, ggx: &Ggx, w: DVec3) -> f64 {
        let [_, outside, inside] = self.table.at(ggx, w);
        if w.z > 0.0 { outside } else { inside }
    }

    /// Means of [`Self::missing`] over the cosine-weighted hemispheres outside and inside.
    #[inline]
    pub fn missing_average(&self, ggx: &Ggx) -> [f64; 2] {
        let [_, outside, inside] = self.table.mean::<Interfaces>(ggx);
        [outside, inside]
    }

    /// Which share of the light that is scattered more than once is refracted, for light from outside and from inside.
    ///
    /// About what a smooth surface transmits of diffuse light, and less on one side where the lobes would not be reciprocal: those to the other
    /// side are normalised by that side's mean, `outside` and `inside` ("Revisiting Physically Based Shading at Imageworks", Kulla and Conty, 2017).
    #[inline]
    pub fn refracted_again(&self, [outside, inside]: [f64; 2]) -> [f64; 2] {
        let least = outside.min(inside);
        let [from_outside, from_inside] = self.transmitted;
        if least > 0.0 { [from_outside * least / outside, from_inside * least / inside] } else { [from_outside, from_inside] }
    }
}

/// Means of the transmittance of a smooth dielectric over the cosine-weighted hemispheres outside and inside. They differ by `eta^2`, since what
/// both sides exchange is the same.
pub fn transmitted_average(eta: f64) -> [f64; 2] {
    const STEPS: u32 = 512;
    // From the thinner side nothing is reflected totally, which a quadrature likes.
    let dense = eta.max(1.0 / eta);
    let at = |step: u32| {
        let cos = (f64::from(step) + 0.5) / f64::from(STEPS);
        (1.0 - fresnel(cos, dense)) * (2.0 * cos / f64::from(STEPS))
    };
    let thin: f64 = (0..STEPS).map(at).sum();
    let within = thin / (dense * dense);
    if eta >= 1.0 { [thin, within] } else { [within, thin] }
}

/// Reflectance of a smooth dielectric for light from the side to which `eta` is relative.
#[inline(always)]
pub fn fresnel(cos: f64, eta: f64) -> f64 {
    let sin = (1.0 - cos * cos).max(0.0).sqrt();
    interface(DVec3::new(sin, 0.0, -cos), DVec3::Z, eta).reflected
}

/// Midpoints of a quadrature over visible normals.
struct Normals {
    turns: Vec<(f64, f64)>,
}

impl Normals {
    fn new() -> Self {
        // All turns, so that anisotropic facets are served, too; isotropic ones need half of them.
        Self { turns: (0..2 * TURNS).map(|turn| sin_cos((turn as f64 + 0.5) * PI / TURNS as f64)).collect() }
    }

    /// Mean of a function of the normals that are visible from `o`.
    fn mean<const K: usize>(&self, ggx: &Ggx, o: DVec3, f: impl Fn(DVec3) -> [f64; K]) -> [f64; K] {
        // Isotropic facets are asked along x alone, where one half of the turns mirrors the other.
        let turns = if ggx.alpha().x == ggx.alpha().y { TURNS } else { 2 * TURNS };
        let mut sum = [0.0; K];
        for &turn in self.turns.iter().take(turns) {
            for height in 0..HEIGHTS {
                let value = f(ggx.sample_visible_at(o, (height as f64 + 0.5) / HEIGHTS as f64, turn));
                sum = std::array::from_fn(|k| sum[k] + value[k]);
            }
        }
        sum.map(|sum| sum / (turns * HEIGHTS) as f64)
    }
}

/// Fills the table of white facets: what is missing, and Schlick's part.
struct Facets(Normals);

impl Facets {
    fn new() -> Self {
        Self(Normals::new())
    }
}

impl Fill<2> for Facets {
    const FALLING: [bool; 2] = [true, false];

    fn value(&self, ggx: &Ggx, o: DVec3) -> [f64; 2] {
        self.0.mean(ggx, o, |m| {
            let along = o.dot(m);
            let i = m * (2.0 * along) - o;
            let once = if i.z > 0.0 { ggx.sample_weight(o, i) } else { 0.0 };
            [1.0 - once, once * schlick_weight(along)]
        })
    }

    fn meaning(&self, value: [f64; 2], _: f64) -> [f64; 2] {
        value
    }
}

/// Fills the table of a dielectric: what is reflected outside, relative to a smooth surface; what is missing outside; what is missing inside.
struct Interfaces {
    normals: Normals,
    eta: f64,
}

impl Interfaces {
    fn new(eta: f64) -> Self {
        Self { normals: Normals::new(), eta }
    }

    /// Reflected and missing shares of light from the side to which `eta` is relative.
    fn shares(ggx: &Ggx, o: DVec3, m: DVec3, eta: f64) -> (f64, f64) {
        let at = interface(-o, m, eta);
        let i = m * (2.0 * o.dot(m)) - o;
        let reflected = if i.z > 0.0 { at.reflected * ggx.sample_weight(o, i) } else { 0.0 };
        let refracted = at.refracted.filter(|i| i.z < 0.0).map_or(0.0, |i| (1.0 - at.reflected) * ggx.sample_weight(o, i));
        (reflected, 1.0 - reflected - refracted)
    }
}

impl Fill<3> for Interfaces {
    const FALLING: [bool; 3] = [false, true, true];

    fn value(&self, ggx: &Ggx, o: DVec3) -> [f64; 3] {
        let [reflected, outside, inside] = self.normals.mean(ggx, o, |m| {
            let (reflected, outside) = Self::shares(ggx, o, m, self.eta);
            let (_, inside) = Self::shares(ggx, o, m, 1.0 / self.eta);
            [reflected, outside, inside]
        });
        let smooth = fresnel(o.z, self.eta);
        [if smooth > 0.0 { reflected / smooth } else { 1.0 }, outside, inside]
    }

    fn meaning(&self, [ratio, outside, inside]: [f64; 3], cos: f64) -> [f64; 3] {
        [ratio * fresnel(cos, self.eta), outside, inside]
    }
}
