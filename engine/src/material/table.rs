//! Tables over directions and roughness of what microfacets do, for albedos.

use std::f64::consts::FRAC_2_PI;

use glam::{DVec2, DVec3};

use super::microfacet::{Ggx, SMOOTH_ALPHA};
use crate::math::atan2;

/// Directions of a row.
const NODES: usize = 64;
/// Rows over roughness.
const ROUGHNESSES: usize = 48;
/// Rows over azimuth.
const AZIMUTHS: usize = 20;
/// Roughnesses for which means are kept: they change faster than the rows.
const MEANS: usize = 256;
/// Steps of a mean's quadrature between two nodes.
const STEPS: usize = 4;

/// What the rows stand for.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rows {
    /// One isotropic alpha: one row.
    Fixed,
    /// One anisotropic alpha: rows over the first quarter of the azimuth, by the share of x in the tilt that the surface sees.
    Azimuth(DVec2),
    /// Alpha from [`SMOOTH_ALPHA`] to 1, even in its square root.
    Roughness,
}

/// Functions of a direction and, maybe, of roughness, interpolated linearly.
///
/// Along a row, nodes are even in the square root of `cos / (cos + tilt)`, where `tilt = alpha sin` as the surface sees it: masking depends on little
/// else, so that the spacing resolves the last grazing angles of the smoothest surface, at which albedos are steepest.
#[derive(Clone, Debug, PartialEq)]
pub struct Table<const K: usize> {
    rows: Rows,
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
    /// Which means fall like `alpha` for smooth surfaces.
    const FALLING: [bool; K];
}

impl<const K: usize> Table<K> {
    /// A table for one roughness.
    pub fn fixed<F: Fill<K>>(ggx: &Ggx, fill: &F) -> Self {
        let alpha = ggx.alpha();
        if alpha.x == alpha.y {
            let mut table = Self { rows: Rows::Fixed, nodes: vec![row(ggx, DVec2::X, fill)], means: Vec::new() };
            table.means = vec![table.mean_of(fill, alpha.x, 0.0)];
            return table;
        }
        let rows = |at: usize| row(ggx, azimuth(alpha, grid(at, AZIMUTHS)), fill);
        let mut table = Self { rows: Rows::Azimuth(alpha), nodes: (0..AZIMUTHS).map(rows).collect(), means: Vec::new() };
        table.means = vec![table.mean_of_azimuths(fill, alpha)];
        table
    }

    /// A table for all isotropic roughnesses.
    pub fn over_roughness<F: Fill<K>>(fill: &F) -> Self {
        let rows = |at: usize| {
            let alpha = squared(grid(at, ROUGHNESSES));
            Ggx::new(alpha, alpha).map_or([[0.0; K]; NODES], |ggx| row(&ggx, DVec2::X, fill))
        };
        let mut table = Self { rows: Rows::Roughness, nodes: (0..ROUGHNESSES).map(rows).collect(), means: Vec::new() };
        let means = |at: usize| {
            let alpha = squared(at as f64 / MEANS as f64);
            let mean = table.mean_of(fill, alpha, roughness_row(alpha));
            std::array::from_fn(|k| if F::FALLING[k] { mean[k] / alpha } else { mean[k] })
        };
        table.means = (0..=MEANS).map(means).collect();
        table
    }

    /// The values for facets and a direction, on either side.
    #[inline]
    pub fn at(&self, ggx: &Ggx, w: DVec3) -> [f64; K] {
        let alpha = ggx.alpha();
        let (x, y, cos) = (w.x.abs() * alpha.x, w.y.abs() * alpha.y, w.z.abs());
        let tilt = (x * x + y * y).sqrt();
        let row = match self.rows {
            Rows::Fixed => 0.0,
            Rows::Azimuth(_) => share(x, y) * (AZIMUTHS - 1) as f64,
            Rows::Roughness if alpha.x == alpha.y => roughness_row(alpha.x),
            Rows::Roughness => roughness_row((0.5 * alpha.length_squared()).sqrt()),
        };
        self.interpolate(row, share(cos, tilt).sqrt())
    }

    /// Means over the cosine-weighted hemisphere; `F` filled the table.
    #[inline]
    pub fn mean<F: Fill<K>>(&self, ggx: &Ggx) -> [f64; K] {
        if self.rows != Rows::Roughness {
            return self.means.first().copied().unwrap_or([0.0; K]);
        }
        let alpha = (0.5 * ggx.alpha().length_squared()).sqrt();
        let (low, t) = cell(alpha.sqrt() * MEANS as f64, self.means.len());
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

    /// `2 int f cos dcos` by midpoints, exact in the weights: `2 cos dcos` is the difference of the squared cosine.
    ///
    /// Steps are even in the cosine: for smooth surfaces the last cell holds nearly all of the hemisphere.
    fn mean_of<F: Fill<K>>(&self, fill: &F, alpha: f64, row: f64) -> [f64; K] {
        let mut sum = [0.0; K];
        for node in 0..NODES - 1 {
            let (low, high) = (cosine(alpha, grid(node, NODES)), cosine(alpha, grid(node + 1, NODES)));
            let width = (high - low) / STEPS as f64;
            for step in 0..STEPS {
                let cos = low + (step as f64 + 0.5) * width;
                let tilt = alpha * (1.0 - cos * cos).max(0.0).sqrt();
                let value = fill.meaning(self.interpolate(row, share(cos, tilt).sqrt()), cos);
                sum = std::array::from_fn(|k| sum[k] + value[k] * (2.0 * cos * width));
            }
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

/// The cosine whose share in `cos + alpha sin` is `x^2`.
fn cosine(alpha: f64, x: f64) -> f64 {
    let (cos, sin) = (x * x * alpha, 1.0 - x * x);
    cos / (cos * cos + sin * sin).sqrt()
}

/// The azimuth, as a unit vector, in which x has the share `x` in the tilt that the surface sees.
fn azimuth(alpha: DVec2, x: f64) -> DVec2 {
    DVec2::new(x * alpha.y, (1.0 - x) * alpha.x).normalize_or(DVec2::X)
}

fn row<const K: usize, F: Fill<K>>(ggx: &Ggx, azimuth: DVec2, fill: &F) -> [[f64; K]; NODES] {
    let alpha = (ggx.alpha() * azimuth).length();
    std::array::from_fn(|node| {
        let cos = cosine(alpha, grid(node, NODES));
        let sin = (1.0 - cos * cos).max(0.0).sqrt();
        fill.value(ggx, DVec3::new(azimuth.x * sin, azimuth.y * sin, cos))
    })
}
