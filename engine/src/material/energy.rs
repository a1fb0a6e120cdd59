//! Albedos of microfacets: which share of light a rough surface scatters once. What is missing is scattered more often.

use std::ops::RangeInclusive;

use glam::DVec3;

use super::{
    conductor::schlick_weight,
    dielectric::interface,
    microfacet::Ggx,
    stretched::{Lookup, Stretched},
    table::{Fill, Table},
};
use crate::sampling::sin_cos_of_turn;

/// Points of a quadrature, two neighbours of Fibonacci's sequence: where total reflection begins at once, for one roughness, for all isotropic ones.
const FINEST: (u32, u32) = (4181, 2584);
const FINE: (u32, u32) = (2584, 1597);
const MIDDLE: (u32, u32) = (1597, 987);
/// The same, for each of many tables.
const COARSE: (u32, u32) = (610, 377);

/// What white facets reflect once, and what Schlick's weights of grazing angles take of it.
#[derive(Clone, Debug, PartialEq)]
pub struct Albedo(Lookup<2>);

impl Albedo {
    /// For one roughness along x and y, clamped as by [`Ggx::new`]; takes some milliseconds.
    pub fn fixed(alpha: [f64; 2]) -> Self {
        let facets = Facets(Normals::new(if alpha[0] == alpha[1] { FINE } else { MIDDLE }));
        Self(Lookup::Table(Table::fixed(&Ggx::clamped(alpha), &facets)))
    }

    /// For all isotropic roughnesses, in some hundred milliseconds; it takes anisotropic facets for isotropic ones.
    pub fn over_roughness() -> Self {
        Self(Lookup::Table(Table::over_roughness(&Facets(Normals::new(MIDDLE)))))
    }

    /// For facets of these roughnesses and strengths of anisotropy, as [`super::stretched::alphas`] takes them; in some ten milliseconds, and in a second if both are ranges.
    pub fn stretched(roughness: &RangeInclusive<f64>, strength: &RangeInclusive<f64>) -> Self {
        let [fine, coarse] = [MIDDLE, COARSE].map(|count| Facets(Normals::new(count)));
        Self(Lookup::Stretched(Stretched::new(roughness, strength, &fine, &coarse)))
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
        let [missing, excess] = self.0.at(ggx, w);
        [missing, excess + (1.0 - missing) * schlick_weight(w.z.abs())]
    }

    /// Mean of [`Self::missing`] over the cosine-weighted hemisphere.
    #[inline(always)]
    pub fn missing_average(&self, ggx: &Ggx) -> f64 {
        self.0.mean::<Facets>(ggx)[0]
    }

    /// Means of [`Self::schlick`] over the cosine-weighted hemisphere.
    #[inline(always)]
    pub fn schlick_average(&self, ggx: &Ggx) -> [f64; 2] {
        let [missing, excess] = self.0.mean::<Facets>(ggx);
        // The mean of Schlick's weight itself is 1 / 21.
        [missing, excess + 1.0 / 21.0]
    }
}

/// What the facets of a dielectric reflect or refract once.
#[derive(Clone, Debug, PartialEq)]
pub struct DielectricAlbedo {
    table: Lookup<3>,
    eta: f64,
    /// Means of the smooth transmittance over the cosine-weighted hemispheres outside and inside.
    transmitted: [f64; 2],
}

impl DielectricAlbedo {
    /// For one roughness along x and y, clamped as by [`Ggx::new`]; `eta` is the index of the inside relative to the outside, above 0.
    pub fn fixed(eta: f64, alpha: [f64; 2]) -> Self {
        let interfaces = Interfaces { normals: Normals::new(if alpha[0] == alpha[1] { FINEST } else { MIDDLE }), eta };
        Self::new(eta, Lookup::Table(Table::fixed(&Ggx::clamped(alpha), &interfaces)))
    }

    /// For all isotropic roughnesses, in some hundred milliseconds; it takes anisotropic facets for isotropic ones.
    pub fn over_roughness(eta: f64) -> Self {
        Self::new(eta, Lookup::Table(Table::over_roughness(&Interfaces { normals: Normals::new(MIDDLE), eta })))
    }

    /// As [`Albedo::stretched`].
    pub fn stretched(eta: f64, roughness: &RangeInclusive<f64>, strength: &RangeInclusive<f64>) -> Self {
        let [fine, coarse] = [MIDDLE, COARSE].map(|count| Interfaces { normals: Normals::new(count), eta });
        Self::new(eta, Lookup::Stretched(Stretched::new(roughness, strength, &fine, &coarse)))
    }

    fn new(eta: f64, table: Lookup<3>) -> Self {
        Self { table, eta, transmitted: transmitted_average(eta) }
    }

    /// Index of the inside relative to the outside.
    #[inline(always)]
    pub fn eta(&self) -> f64 {
        self.eta
    }

    /// Means of the transmittance of a smooth surface over the cosine-weighted hemispheres outside and inside.
    #[inline(always)]
    pub fn transmitted(&self) -> [f64; 2] {
        self.transmitted
    }

    /// What is reflected of light from `w` on the outside, in [0, 1].
    #[inline]
    pub fn reflected(&self, ggx: &Ggx, w: DVec3) -> f64 {
        let [excess, outside, _] = self.table.at(ggx, w);
        (excess + (1.0 - outside) * fresnel(w.z.abs(), self.eta)).clamp(0.0, 1.0)
    }

    /// Mean of [`Self::reflected`] over the cosine-weighted hemisphere.
    #[inline]
    pub fn reflected_average(&self, ggx: &Ggx) -> f64 {
        1.0 - self.transmitted[0] + self.table.mean::<Interfaces>(ggx)[0]
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

/// A quadrature over visible normals: a Fibonacci lattice, whose error stays small where facets begin to reflect down.
struct Normals {
    /// Sine and cosine of the turn, height in the spherical cap, weight.
    points: Vec<((f64, f64), f64, f64)>,
    /// How far two of the nearest neighbours of a point lie from it in their order.
    neighbours: [usize; 2],
}

impl Normals {
    fn new((count, step): (u32, u32)) -> Self {
        let point = |n: u32| {
            let height = 1.0 - (f64::from(n) + 0.5) / f64::from(count);
            let across = (f64::from(n) * f64::from(step) + 0.5) % f64::from(count) / f64::from(count);
            // Denser towards 1, where the few steep facets are that mirror light down.
            (sin_cos_of_turn(across), 1.0 - height * height * height, 3.0 * height * height / f64::from(count))
        };
        // Numbers of Fibonacci's about the root of the count: so far apart in height as in turn.
        let (mut a, mut b) = (1, 2);
        while b * b < count as usize {
            (a, b) = (b, a + b);
        }
        Self { points: (0..count).map(point).collect(), neighbours: [a, b] }
    }

    /// As [`Self::mean`], of a function that is also told how far the cosine between `o` and the normal changes up to the cells of the
    /// next points.
    fn mean_of_cells<const K: usize>(&self, ggx: &Ggx, o: DVec3, f: impl Fn(DVec3, f64) -> [f64; K]) -> [f64; K] {
        let normals: Vec<DVec3> = self.points.iter().map(|&(turn, height, _)| ggx.sample_visible_at(o, height, turn)).collect();
        let mut sum = [0.0; K];
        for (n, (&m, (_, _, weight))) in normals.iter().zip(&self.points).enumerate() {
            let apart = |by: usize| (normals[if n >= by { n - by } else { n + by }] - m).dot(o).abs();
            let value = f(m, 0.3 * apart(self.neighbours[0]).max(apart(self.neighbours[1])));
            sum = std::array::from_fn(|k| sum[k] + value[k] * weight);
        }
        sum
    }

    /// Mean of a function of the normals that are visible from `o`.
    fn mean<const K: usize>(&self, ggx: &Ggx, o: DVec3, f: impl Fn(DVec3) -> [f64; K]) -> [f64; K] {
        let mut sum = [0.0; K];
        for &(turn, height, weight) in &self.points {
            let value = f(ggx.sample_visible_at(o, height, turn));
            sum = std::array::from_fn(|k| sum[k] + value[k] * weight);
        }
        sum
    }
}

/// Fills the table of white facets: what is missing, and Schlick's part in excess of a smooth surface's, since it changes with the tilt alone.
struct Facets(Normals);

impl Fill<2> for Facets {
    const FALLING: [bool; 2] = [true, false];

    fn value(&self, ggx: &Ggx, o: DVec3) -> [f64; 2] {
        self.0.mean(ggx, o, |m| {
            let along = o.dot(m);
            let i = m * (2.0 * along) - o;
            let once = if i.z > 0.0 { ggx.sample_weight(o, i) } else { 0.0 };
            [1.0 - once, once * (schlick_weight(along) - schlick_weight(o.z))]
        })
    }

    fn meaning(&self, [missing, excess]: [f64; 2], cos: f64) -> [f64; 2] {
        [missing, excess - missing * schlick_weight(cos)]
    }
}

/// Fills the table of a dielectric: what is reflected outside in excess of a smooth surface; what is missing outside; what is missing inside.
struct Interfaces {
    normals: Normals,
    eta: f64,
}

impl Interfaces {
    /// The share that is reflected where nothing is masked, and what is missing, of light from the side to which `eta` is relative, of which mirrors
    /// would reflect `mirrored`; `spread` is how far the cosine on the facet varies about it.
    ///
    /// The cosine behind the facet is the root of what falls through 0 where total reflection begins, too suddenly for a quadrature over single
    /// points. There, the mean over the spread is taken, along the root.
    #[inline(always)]
    fn shares(ggx: &Ggx, o: DVec3, m: DVec3, spread: f64, eta: f64, mirrored: f64) -> [f64; 2] {
        const PLACES: [f64; 2] = [0.211_324_865_405_187_1, 0.788_675_134_594_812_9];
        let (cos, ratio) = (o.dot(m), 1.0 / eta);
        let at = |cos_t| Self::passing(ggx, o, m, (cos, cos_t, ratio), mirrored);
        let squared = 1.0 - (1.0 - cos * cos).max(0.0) * (ratio * ratio);
        let spread = 2.0 * cos * (ratio * ratio) * spread;
        if squared >= 3.0 * spread {
            return at(squared.max(0.0).sqrt());
        }
        let (low, high) = ((squared - spread).max(0.0).sqrt(), (squared + spread).max(0.0).sqrt());
        let total = 1.0 - (high * high - low * low) / (2.0 * spread).max(f64::MIN_POSITIVE);
        let mut sum = [total, total * (1.0 - mirrored)];
        if total < 1.0 {
            for place in PLACES {
                let cos_t = low + (high - low) * place;
                let [reflected, missing] = at(cos_t);
                let weight = cos_t * (high - low) / (2.0 * spread);
                sum = [sum[0] + reflected * weight, sum[1] + missing * weight];
            }
        }
        sum
    }

    /// As [`Self::shares`], for one pair of cosines before and behind a facet, and the ratio of their sines; as in [`interface`].
    #[inline(always)]
    fn passing(ggx: &Ggx, o: DVec3, m: DVec3, (cos, cos_t, ratio): (f64, f64, f64), mirrored: f64) -> [f64; 2] {
        let (below, beside) = (cos + ratio * cos_t, ratio * cos + cos_t);
        let (parallel, perpendicular, whole) = ((cos - ratio * cos_t) * beside, (ratio * cos - cos_t) * below, below * beside);
        let reflected = if whole > 0.0 { 0.5 * (parallel * parallel + perpendicular * perpendicular) / (whole * whole) } else { 1.0 };
        let i = m * (ratio * cos - cos_t) - o * ratio;
        let refracted = if i.z < 0.0 { (1.0 - reflected) * ggx.sample_weight(o, i) } else { 0.0 };
        [reflected, 1.0 - reflected * mirrored - refracted]
    }

    /// Reflected share outside, missing ones outside and inside.
    #[inline(always)]
    fn both(ggx: &Ggx, o: DVec3, m: DVec3, spread: f64, eta: f64) -> [f64; 3] {
        let i = m * (2.0 * o.dot(m)) - o;
        let mirrored = if i.z > 0.0 { ggx.sample_weight(o, i) } else { 0.0 };
        let [reflected, outside] = Self::shares(ggx, o, m, spread, eta, mirrored);
        let [_, inside] = Self::shares(ggx, o, m, spread, 1.0 / eta, mirrored);
        [reflected * mirrored, outside, inside]
    }
}

impl Fill<3> for Interfaces {
    const FALLING: [bool; 3] = [false, true, true];

    /// Where total reflection begins, if both indices are so near that this is a grazing angle: what leaves there leaves along the surface, and is masked.
    fn bend(&self) -> Option<f64> {
        const NEAR: f64 = 1.0 / 1.03;
        let ratio = self.eta.min(1.0 / self.eta);
        (ratio > NEAR && ratio < 1.0).then(|| (1.0 - ratio * ratio).sqrt())
    }

    fn value(&self, ggx: &Ggx, o: DVec3) -> [f64; 3] {
        let [reflected, outside, inside] = self.normals.mean_of_cells(ggx, o, |m, spread| Self::both(ggx, o, m, spread, self.eta));
        [reflected - (1.0 - outside) * fresnel(o.z, self.eta), outside, inside]
    }

    fn meaning(&self, [excess, outside, inside]: [f64; 3], cos: f64) -> [f64; 3] {
        [excess - outside * fresnel(cos, self.eta), outside, inside]
    }
}

#[cfg(test)]
mod tests {
    use glam::DVec2;

    use super::*;

    /// The mean over visible normals by many points of a sequence.
    fn brute<const K: usize>(ggx: &Ggx, o: DVec3, f: impl Fn(DVec3) -> [f64; K]) -> [f64; K] {
        const COUNT: u32 = 60_000;
        let mut sum = [0.0; K];
        for n in 0..COUNT {
            let u = DVec2::new((f64::from(n) * 0.754_877_666_246_692_8).fract(), (f64::from(n) * 0.569_840_290_998_053_2).fract());
            let value = f(ggx.sample_visible(o, u));
            sum = std::array::from_fn(|k| sum[k] + value[k]);
        }
        sum.map(|sum| sum / f64::from(COUNT))
    }

    fn facets(ggx: &Ggx, o: DVec3, m: DVec3) -> [f64; 2] {
        let i = m * (2.0 * o.dot(m)) - o;
        let once = if i.z > 0.0 { ggx.sample_weight(o, i) } else { 0.0 };
        [1.0 - once, once * schlick_weight(o.dot(m))]
    }

    const ALPHAS: [f64; 9] = [1e-4, 5e-4, 3e-3, 0.02, 0.07, 0.15, 0.35, 0.7, 1.0];
    const COSINES: [f64; 9] = [1e-4, 1e-3, 0.01, 0.04, 0.11, 0.3, 0.55, 0.8, 1.0];

    fn at(cos: f64) -> DVec3 {
        DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos)
    }

    type Told<'a, const K: usize> = &'a dyn Fn(&Ggx, DVec3) -> [f64; K];

    /// The worst error of tables for one roughness and for all, of what they tell of directions outside.
    fn errors<const K: usize>(right: impl Fn(&Ggx, DVec3) -> [f64; K], told: [Told<K>; 2]) -> [f64; 2] {
        let mut worst = [0f64; 2];
        for (alpha, cos) in ALPHAS.into_iter().flat_map(|alpha| COSINES.map(|cos| (alpha, cos))) {
            let (ggx, o) = (Ggx::clamped([alpha; 2]), at(cos));
            let right = right(&ggx, o);
            for (worst, told) in worst.iter_mut().zip(told) {
                *worst = told(&ggx, o).into_iter().zip(right).fold(*worst, |worst, (a, b)| worst.max((a - b).abs()));
            }
        }
        worst
    }

    #[test]
    fn tables_of_facets_are_right() {
        let over = Albedo::over_roughness();
        let fixed = ALPHAS.map(|alpha| (alpha, Albedo::fixed([alpha; 2])));
        let of = |ggx: &Ggx| &fixed.iter().find(|(alpha, _)| *alpha == ggx.alpha().x).unwrap().1;
        let right = |ggx: &Ggx, o| brute(ggx, o, |m| facets(ggx, o, m));
        let [one, all] = errors(right, [&|ggx, o| of(ggx).schlick(ggx, o), &|ggx, o| over.schlick(ggx, o)]);
        assert!(one < 6e-4 && all < 1e-3, "{one} {all}");
    }

    #[test]
    fn tables_of_anisotropic_facets_are_right() {
        let (ggx, fixed) = (Ggx::clamped([0.6, 0.05]), Albedo::fixed([0.6, 0.05]));
        for (cos, phi) in [(0.02, 0.1), (0.1, 0.8), (0.2, 1.57), (0.4, 1.2), (0.6, 0.4), (1.0, 0.0)] {
            let o = DVec3::new(at(cos).x * f64::cos(phi), at(cos).x * f64::sin(phi), cos);
            let error = DVec2::from_array(brute(&ggx, o, |m| facets(&ggx, o, m))) - DVec2::from_array(fixed.schlick(&ggx, o));
            assert!(error.x.abs() < 6e-4 && error.y.abs() < 2e-3, "{error} at {o}");
        }
    }

    #[test]
    fn tables_of_dielectrics_are_right() {
        for (eta, limit) in [(1.5, 9e-4), (4.0, 9e-4)] {
            let over = DielectricAlbedo::over_roughness(eta);
            let fixed = ALPHAS.map(|alpha| (alpha, DielectricAlbedo::fixed(eta, [alpha; 2])));
            let of = |ggx: &Ggx| &fixed.iter().find(|(alpha, _)| *alpha == ggx.alpha().x).unwrap().1;
            let right = |ggx: &Ggx, o: DVec3| brute(ggx, o, |m| Interfaces::both(ggx, o, m, 0.0, eta));
            let told =
                |table: &DielectricAlbedo, ggx: &Ggx, o: DVec3| [table.reflected(ggx, o), table.missing(ggx, o), table.missing(ggx, -o)];
            let [one, all] = errors(right, [&|ggx, o| told(of(ggx), ggx, o), &|ggx, o| told(&over, ggx, o)]);
            assert!(one < limit && all < 2.0 * limit, "{eta}: {one} {all}");
        }
    }

    /// Means against a sum over the hemisphere, for roughnesses between the rows of a table.
    #[test]
    fn means_are_means() {
        let (facets, glass) = (Albedo::over_roughness(), DielectricAlbedo::over_roughness(1.5));
        for alpha in [2e-5, 3e-4, 0.011, 0.17, 0.93] {
            let ggx = Ggx::clamped([alpha; 2]);
            const STEPS: u32 = 200_000;
            let mut sum = [0.0; 4];
            for step in 0..STEPS {
                // Dense at grazing angles: cos^2 = v^4, d(cos^2) = 4 v^3 dv.
                let v = (f64::from(step) + 0.5) / f64::from(STEPS);
                let (o, weight) = (at(v * v), 4.0 * v * v * v / f64::from(STEPS));
                let [missing, five] = facets.schlick(&ggx, o);
                let told = [missing, five, glass.reflected(&ggx, o), glass.missing(&ggx, -o)];
                sum = std::array::from_fn(|k| sum[k] + told[k] * weight);
            }
            let [missing, five] = facets.schlick_average(&ggx);
            let told = [missing, five, glass.reflected_average(&ggx), glass.missing_average(&ggx)[1]];
            for (sum, told) in sum.into_iter().zip(told) {
                assert!((sum / told - 1.0).abs() < 2e-3, "{sum} is not {told} at {alpha}");
            }
        }
    }
}
