//! Tables over directions and roughness of what microfacets do, for albedos.

use std::f64::consts::FRAC_2_PI;

use glam::{DVec2, DVec3};
use rayon::prelude::*;

use super::microfacet::{Ggx, SMOOTH_ALPHA};
use crate::math::atan2;

/// Directions of a row.
const NODES: usize = 24 * STRIDE + 1;
/// Every so many of them are computed in any case; a power of two.
const STRIDE: usize = 8;
/// Between two nodes, others are computed unless the one in the middle lies as near as this to the straight line, and at the last grazing angles.
const STRAIGHT: f64 = 1e-3;
/// Rows over roughness.
const ROUGHNESSES: usize = 21 * EVERY + 1;
/// Rows over azimuth.
const AZIMUTHS: usize = 12 * EVERY + 1;
/// Every so many rows are computed; those between follow from them.
const EVERY: usize = 3;
/// Roughnesses for which means are kept, even in the fourth root: they change faster than the rows.
const MEANS: usize = 768;
/// Steps of a mean's quadrature between two rows.
const STEPS: usize = 2;
/// Gauss and Legendre's quadrature over [0, 1]: places and weights.
const GAUSS: [(f64, f64); 3] = [(0.112_701_665_379_258_31, 5.0 / 18.0), (0.5, 4.0 / 9.0), (0.887_298_334_620_741_7, 5.0 / 18.0)];

/// What the rows stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rows {
    /// One isotropic alpha: one row.
    Fixed,
    /// One anisotropic alpha: rows over the first quarter of the azimuth, even in [`turn`].
    Azimuth(DVec2),
    /// Alpha from [`SMOOTH_ALPHA`] to 1, even in its square root.
    Roughness,
}

/// Functions of a direction and, maybe, of roughness, interpolated linearly.
///
/// Along a row, nodes are even in the mean of the cosine and of the fourth root of `cos / (cos + tilt)`, where `tilt = alpha sin` as the surface
/// sees it. Masking depends on little but the latter, which resolves the last grazing angles of the smoothest surface, at which albedos are steepest;
/// the cosine resolves where total reflection begins, and where that is near grazing angles, a third part, which rises there within the tilt. Of the nodes, those are computed between which functions bend.
#[derive(Clone, Debug, PartialEq)]
pub struct Table<const K: usize> {
    rows: Rows,
    /// The cosine about which functions bend most, if nodes are denser there.
    bend: Option<f64>,
    nodes: Vec<[[f64; K]; NODES]>,
    /// Means over the cosine-weighted hemisphere.
    means: Vec<[f64; K]>,
}

/// How a table is filled.
pub trait Fill<const K: usize> {
    /// The functions' values for facets and a direction on the outward side.
    fn value(&self, ggx: &Ggx, o: DVec3) -> [f64; K];
    /// What the means are taken of, from an interpolated value and the cosine; it must fade away from the surface like masking.
    fn meaning(&self, value: [f64; K], cos: f64) -> [f64; K];
    /// The cosine about which the functions bend within the tilt of facets, if that is near to grazing angles.
    fn bend(&self) -> Option<f64> {
        None
    }
    /// Which means fall like `alpha` for smooth surfaces.
    const FALLING: [bool; K];
}

impl<const K: usize> Table<K> {
    /// A table for one roughness.
    pub fn fixed<F: Fill<K> + Sync>(ggx: &Ggx, fill: &F) -> Self {
        let alpha = ggx.alpha();
        if alpha.x == alpha.y {
            let mut table = Self { rows: Rows::Fixed, bend: fill.bend(), nodes: vec![row(ggx, DVec2::X, fill)], means: Vec::new() };
            table.means = vec![table.mean_of(fill, alpha.x, 0.0)];
            return table;
        }
        let rows = computed(AZIMUTHS, |at| row(ggx, azimuth(alpha, grid(at, AZIMUTHS)), fill));
        let mut table = Self { rows: Rows::Azimuth(alpha), bend: fill.bend(), nodes: denser(rows), means: Vec::new() };
        table.means = vec![table.mean_of_azimuths(fill, alpha)];
        table
    }

    /// A table for all isotropic roughnesses.
    pub fn over_roughness<F: Fill<K> + Sync>(fill: &F) -> Self {
        let exact = |at: usize| {
            let alpha = squared(grid(at, ROUGHNESSES));
            row(&Ggx::clamped([alpha; 2]), DVec2::X, fill)
        };
        let mut nodes = denser(computed(ROUGHNESSES, exact));
        // The first rows differ most in proportion.
        for (at, row) in nodes.iter_mut().enumerate().take(EVERY).skip(1) {
            *row = exact(at);
        }
        let mut table = Self { rows: Rows::Roughness, bend: fill.bend(), nodes, means: Vec::new() };
        let means = |at: usize| {
            let root = at as f64 / MEANS as f64;
            let alpha = squared(root * root);
            let mean = table.mean_of(fill, alpha, roughness_row(alpha));
            std::array::from_fn(|k| if F::FALLING[k] { mean[k] / alpha } else { mean[k] })
        };
        table.means = (0..=MEANS).into_par_iter().map(means).collect();
        table
    }

    /// The values for facets and a direction, on either side. A table for all roughnesses takes anisotropic facets for isotropic ones.
    #[inline]
    pub fn at(&self, ggx: &Ggx, w: DVec3) -> [f64; K] {
        let alpha = ggx.alpha();
        let (x, y, cos) = (w.x * alpha.x, w.y * alpha.y, w.z.abs());
        let tilt = (x * x + y * y).sqrt();
        let row = match self.rows {
            Rows::Fixed => 0.0,
            Rows::Azimuth(_) => turn(alpha, DVec2::new(w.x, w.y)) * (AZIMUTHS - 1) as f64,
            Rows::Roughness if alpha.x == alpha.y => roughness_row(alpha.x),
            Rows::Roughness => roughness_row((0.5 * alpha.length_squared()).sqrt()),
        };
        self.interpolate(row, place(cos, tilt, self.bend))
    }

    /// Means over the cosine-weighted hemisphere of what [`Self::at`] tells; `F` filled the table.
    #[inline]
    pub fn mean<F: Fill<K>>(&self, ggx: &Ggx) -> [f64; K] {
        if self.rows != Rows::Roughness {
            return self.means.first().copied().unwrap_or([0.0; K]);
        }
        let alpha = (0.5 * ggx.alpha().length_squared()).sqrt();
        let (low, t) = cell(alpha.sqrt().sqrt() * MEANS as f64, self.means.len());
        let (a, b) = (self.means[low], self.means[low + 1]);
        std::array::from_fn(|k| (a[k] + (b[k] - a[k]) * t) * if F::FALLING[k] { alpha } else { 1.0 })
    }

    #[inline(always)]
    fn interpolate(&self, row: f64, x: f64) -> [f64; K] {
        let (node, t) = cell(x * (NODES - 1) as f64, NODES);
        let along = |row: &[[f64; K]; NODES]| -> [f64; K] {
            let (a, b) = (row[node], row[node + 1]);
            std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
        };
        if self.nodes.len() == 1 {
            return along(&self.nodes[0]);
        }
        let (low, t) = cell(row, self.nodes.len());
        let (a, b) = (along(&self.nodes[low]), along(&self.nodes[low + 1]));
        std::array::from_fn(|k| a[k] + (b[k] - a[k]) * t)
    }

    /// `2 int f cos dcos`, node by node, as closely as what is missing must be scattered again.
    fn mean_of<F: Fill<K>>(&self, fill: &F, alpha: f64, row: f64) -> [f64; K] {
        let mut sum = [0.0; K];
        let mut low = 0.0;
        for node in 1..NODES {
            let high = cosine_at(alpha, grid(node, NODES), self.bend);
            for (at, weight) in GAUSS {
                // Dense at the lower end: where a smooth surface begins to be seen as one, one cell holds many cosines.
                let cos = low + (high - low) * (at * at);
                let tilt = alpha * (1.0 - cos * cos).max(0.0).sqrt();
                let value = fill.meaning(self.interpolate(row, place(cos, tilt, self.bend)), cos);
                let weight = weight * 4.0 * at * (high - low) * cos;
                sum = std::array::from_fn(|k| sum[k] + value[k] * weight);
            }
            low = high;
        }
        sum
    }

    fn mean_of_azimuths<F: Fill<K>>(&self, fill: &F, alpha: DVec2) -> [f64; K] {
        let steps = (AZIMUTHS - 1) * STEPS;
        let mut sum = [0.0; K];
        for step in 0..steps {
            let at = |offset: f64| azimuth(alpha, (step as f64 + offset) / steps as f64);
            let angle = |direction: DVec2| atan2(direction.y, direction.x);
            let weight = (angle(at(0.0)) - angle(at(1.0))) * FRAC_2_PI;
            let row = (step as f64 + 0.5) / STEPS as f64;
            let value = self.mean_of(fill, (alpha * at(0.5)).length(), row);
            sum = std::array::from_fn(|k| sum[k] + value[k] * weight);
        }
        sum
    }
}

/// Those of so many rows that are computed, by all threads of the pool.
fn computed<const K: usize>(rows: usize, row: impl Fn(usize) -> [[f64; K]; NODES] + Sync + Send) -> Vec<[[f64; K]; NODES]> {
    (0..rows).step_by(EVERY).collect::<Vec<_>>().into_par_iter().map(row).collect()
}

/// The cell of an even grid of `nodes` in which `x` lies, and the place in it.
#[inline(always)]
fn cell(x: f64, nodes: usize) -> (usize, f64) {
    let low = (x as usize).min(nodes - 2);
    (low, (x - low as f64).clamp(0.0, 1.0))
}

/// A node's place in [0, 1].
#[inline(always)]
fn grid(node: usize, nodes: usize) -> f64 {
    node as f64 / (nodes - 1) as f64
}

/// Of `a + b`, the share of `a`; both are at least 0.
#[inline(always)]
fn share(a: f64, b: f64) -> f64 {
    if a + b > 0.0 { a / (a + b) } else { 0.0 }
}

/// The row of an alpha: rows are even in its square root, but what they hold bends less over a mixture of both.
#[inline(always)]
fn roughness_row(alpha: f64) -> f64 {
    let (low, t) = cell(alpha.sqrt() * (ROUGHNESSES - 1) as f64, ROUGHNESSES);
    let root = |row: usize| grid(row, ROUGHNESSES);
    let (a, b) = (squared(root(low)), squared(root(low + 1)));
    low as f64 + (t + 2.0 * (alpha - a) / (b - a)) / 3.0
}

fn squared(root: f64) -> f64 {
    (root * root).max(SMOOTH_ALPHA)
}

/// Where in a row a direction lies, from 0 along the surface to 1 straight on.
#[inline(always)]
fn place(cos: f64, tilt: f64, bend: Option<f64>) -> f64 {
    let even = cos + share(cos, tilt).sqrt().sqrt();
    match bend {
        None => 0.5 * even,
        Some(bend) => {
            // Rises from 0 to 1, fastest within the tilt; as a third part only where the tilt leaves the bend sharp.
            let beyond = (cos - bend) / ((cos - bend).abs() + 4.0 * tilt).max(f64::MIN_POSITIVE);
            let weight = bend / (bend + tilt);
            (even + weight * 0.5 * (1.0 + beyond)) / (2.0 + weight)
        }
    }
}

/// The cosine whose share in `cos + alpha sin` is `root^4`.
fn cosine(alpha: f64, root: f64) -> f64 {
    let share = (root * root) * (root * root);
    let (cos, sin) = (share * alpha, 1.0 - share);
    cos / (cos * cos + sin * sin).sqrt()
}

/// The cosine at a [`place`].
fn cosine_at(alpha: f64, at: f64, bend: Option<f64>) -> f64 {
    let Some(bend) = bend else { return cosine(alpha, solve(|root| 0.5 * (cosine(alpha, root) + root) - at)) };
    let of = |cos: f64| place(cos, alpha * (1.0 - cos * cos).max(0.0).sqrt(), Some(bend));
    cosine(alpha, solve(|root| of(cosine(alpha, root)) - at))
}

/// Where in the first quarter an azimuth lies, from 0 along y to 1 along x: the mean of the shares of x in the direction and in the tilt that the
/// surface sees.
#[inline(always)]
fn turn(alpha: DVec2, w: DVec2) -> f64 {
    let (x, y) = (w.x.abs(), w.y.abs());
    0.5 * (share(x, y) + share(x * alpha.x, y * alpha.y))
}

/// The azimuth, as a unit vector, at a [`turn`].
fn azimuth(alpha: DVec2, at: f64) -> DVec2 {
    let of = |share: f64| DVec2::new(share * alpha.y, (1.0 - share) * alpha.x).normalize_or(DVec2::X);
    of(solve(|share| turn(alpha, of(share)) - at))
}

/// Where in [0, 1] a rising function from at most 0 to at least 0 vanishes: by the regula falsi, as in Illinois.
fn solve(f: impl Fn(f64) -> f64) -> f64 {
    let (mut low, mut high, mut below, mut above) = (0.0, 1.0, f(0.0), f(1.0));
    let mut last = 0.0;
    for _ in 0..60 {
        if below >= 0.0 {
            return low;
        }
        if above <= 0.0 || high - low < 1e-15 {
            return high;
        }
        let x = (low * above - high * below) / (above - below);
        let value = f(x);
        // The end that stays twice counts half.
        if value < 0.0 {
            (low, below, above) = (x, value, if last < 0.0 { 0.5 * above } else { above });
        } else {
            (high, above, below) = (x, value, if last > 0.0 { 0.5 * below } else { below });
        }
        last = value;
    }
    high
}

/// Rows between the given ones by cubic interpolation (Lagrange's) from the four nearest, within their range.
fn denser<const K: usize>(rows: Vec<[[f64; K]; NODES]>) -> Vec<[[f64; K]; NODES]> {
    let between = |at: usize| {
        let first = (at / EVERY).saturating_sub(1).min(rows.len() - 4);
        let x = at as f64 / EVERY as f64 - first as f64;
        let weights = [
            (x - 1.0) * (x - 2.0) * (x - 3.0) / -6.0,
            x * (x - 2.0) * (x - 3.0) / 2.0,
            x * (x - 1.0) * (x - 3.0) / -2.0,
            x * (x - 1.0) * (x - 2.0) / 6.0,
        ];
        let value = |node: usize, k: usize| {
            let of: [f64; 4] = std::array::from_fn(|row| rows[first + row][node][k]);
            let sum: f64 = of.iter().zip(weights).map(|(value, weight)| value * weight).sum();
            sum.clamp(of.iter().copied().fold(f64::MAX, f64::min), of.iter().copied().fold(f64::MIN, f64::max))
        };
        std::array::from_fn(|node| std::array::from_fn(|k| value(node, k)))
    };
    (0..(rows.len() - 1) * EVERY + 1).map(between).collect()
}

fn row<const K: usize, F: Fill<K> + Sync>(ggx: &Ggx, azimuth: DVec2, fill: &F) -> [[f64; K]; NODES] {
    let alpha = (ggx.alpha() * azimuth).length();
    let value = |node: usize| {
        let cos = cosine_at(alpha, grid(node, NODES), fill.bend());
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        fill.value(ggx, DVec3::new(azimuth.x * sin, azimuth.y * sin, cos))
    };
    // By all threads of the pool: one row may be all that is asked for.
    let ends: Vec<[f64; K]> = (0..=NODES / STRIDE).into_par_iter().map(|end| value(end * STRIDE)).collect();
    let piece = |number: usize| {
        let mut piece = [[0.0; K]; STRIDE + 1];
        (piece[0], piece[STRIDE]) = (ends[number], ends[number + 1]);
        refine(&mut piece, 0, STRIDE, number == 0 || fill.bend().is_some(), &|node| value(number * STRIDE + node));
        piece
    };
    let pieces: Vec<_> = (0..NODES / STRIDE).into_par_iter().map(piece).collect();
    std::array::from_fn(|node| match node / STRIDE {
        number if number < pieces.len() => pieces[number][node % STRIDE],
        _ => ends[node / STRIDE],
    })
}

/// Fills a row between two nodes, of which there is a power of two; `all` of them, or where functions bend.
fn refine<const K: usize>(row: &mut [[f64; K]; STRIDE + 1], low: usize, high: usize, all: bool, value: &impl Fn(usize) -> [f64; K]) {
    let half = (high - low) / 2;
    if half == 0 {
        return;
    }
    let (a, middle, b) = (row[low], value(low + half), row[high]);
    row[low + half] = middle;
    let bend: [f64; K] = std::array::from_fn(|k| 0.5 * (a[k] + b[k]) - middle[k]);
    if all || bend.iter().any(|bend| bend.abs() > STRAIGHT) {
        refine(row, low, low + half, all, value);
        refine(row, low + half, high, all, value);
        return;
    }
    // The parabola through the three, within their range.
    for (node, row) in row.iter_mut().enumerate().take(high).skip(low + 1) {
        let t = (node - low) as f64 / half as f64 - 1.0;
        *row = std::array::from_fn(|k| {
            let value = middle[k] + t * (0.5 * (b[k] - a[k]) + t * bend[k]);
            value.clamp(a[k].min(b[k]).min(middle[k]), a[k].max(b[k]).max(middle[k]))
        });
    }
}
