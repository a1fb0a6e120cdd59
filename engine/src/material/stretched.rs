//! Tables of facets whose roughness and anisotropy textures tell.

use std::ops::RangeInclusive;

use glam::DVec3;
use rayon::prelude::*;

use super::{
    microfacet::Ggx,
    table::{Fill, Table},
};

/// Tables over roughness, and over strength of anisotropy, of an axis that is not a single number.
const NODES: usize = 11;

/// Roughness along x and y of glTF's facets, of perceptual `roughness` and `strength` of anisotropy, each in [0, 1] (`KHR_materials_anisotropy`).
#[inline(always)]
pub fn alphas(roughness: f64, strength: f64) -> [f64; 2] {
    let alpha = roughness * roughness;
    [alpha + (1.0 - alpha) * strength * strength, alpha]
}

/// The roughness and strength of facets: the inverse of [`alphas`].
#[inline(always)]
fn parameters(ggx: &Ggx) -> [f64; 2] {
    let alpha = ggx.alpha();
    let stretch = if alpha.y < 1.0 { (alpha.x - alpha.y) / (1.0 - alpha.y) } else { 0.0 };
    [alpha.y.sqrt(), stretch.max(0.0).sqrt()]
}

/// Even nodes between two numbers, or one.
#[derive(Clone, Debug, PartialEq)]
struct Axis {
    first: f64,
    step: f64,
    nodes: usize,
}

impl Axis {
    fn new(range: &RangeInclusive<f64>) -> Self {
        let (first, length) = (*range.start(), range.end() - range.start());
        if length > 0.0 { Self { first, step: length / (NODES - 1) as f64, nodes: NODES } } else { Self { first, step: 1.0, nodes: 1 } }
    }

    fn at(&self, node: usize) -> f64 {
        self.first + node as f64 * self.step
    }

    /// The two nodes about a value, and the place between them.
    #[inline(always)]
    fn cell(&self, value: f64) -> [(usize, f64); 2] {
        if self.nodes == 1 {
            return [(0, 1.0), (0, 0.0)];
        }
        let x = (value - self.first) / self.step;
        let low = (x as usize).min(self.nodes - 2);
        let t = (x - low as f64).clamp(0.0, 1.0);
        [(low, 1.0 - t), (low + 1, t)]
    }
}

/// Tables of whatever facets a material has.
#[derive(Clone, Debug, PartialEq)]
pub enum Lookup<const K: usize> {
    /// Of one roughness, or of all isotropic ones.
    Table(Table<K>),
    /// Of many anisotropic ones.
    Stretched(Stretched<K>),
}

impl<const K: usize> Lookup<K> {
    /// See [`Table::at`].
    #[inline(always)]
    pub fn at(&self, ggx: &Ggx, w: DVec3) -> [f64; K] {
        match self {
            Self::Table(table) => table.at(ggx, w),
            Self::Stretched(tables) => tables.at(ggx, w),
        }
    }

    /// See [`Table::mean`].
    #[inline(always)]
    pub fn mean<F: Fill<K>>(&self, ggx: &Ggx) -> [f64; K] {
        match self {
            Self::Table(table) => table.mean::<F>(ggx),
            Self::Stretched(tables) => tables.mean::<F>(ggx),
        }
    }
}

/// Tables of anisotropic facets at the nodes of roughness and strength, between which it interpolates linearly.
#[derive(Clone, Debug, PartialEq)]
pub struct Stretched<const K: usize> {
    roughness: Axis,
    strength: Axis,
    tables: Vec<Table<K>>,
}

impl<const K: usize> Stretched<K> {
    /// For all facets of these roughnesses and strengths, as [`alphas`] takes them. `coarse` fills tables of which there are many.
    pub fn new<F: Fill<K> + Sync>(roughness: &RangeInclusive<f64>, strength: &RangeInclusive<f64>, fine: &F, coarse: &F) -> Self {
        let (roughness, strength) = (Axis::new(roughness), Axis::new(strength));
        let count = roughness.nodes * strength.nodes;
        let table = |at: usize| {
            let alpha = alphas(roughness.at(at / strength.nodes), strength.at(at % strength.nodes));
            Table::fixed(&Ggx::clamped(alpha), if count == 1 { fine } else { coarse })
        };
        Self { tables: (0..count).into_par_iter().map(table).collect(), roughness, strength }
    }

    /// See [`Table::at`].
    pub fn at(&self, ggx: &Ggx, w: DVec3) -> [f64; K] {
        self.interpolate(ggx, |table| table.at(ggx, w))
    }

    /// See [`Table::mean`].
    pub fn mean<F: Fill<K>>(&self, ggx: &Ggx) -> [f64; K] {
        self.interpolate(ggx, |table| table.mean::<F>(ggx))
    }

    #[inline(always)]
    fn interpolate(&self, ggx: &Ggx, of: impl Fn(&Table<K>) -> [f64; K]) -> [f64; K] {
        let [roughness, strength] = parameters(ggx);
        let mut sum = [0.0; K];
        for (row, a) in self.roughness.cell(roughness) {
            for (column, b) in self.strength.cell(strength).into_iter().filter(|(_, b)| a * b > 0.0) {
                let value = of(&self.tables[row * self.strength.nodes + column]);
                sum = std::array::from_fn(|k| sum[k] + value[k] * (a * b));
            }
        }
        sum
    }
}
