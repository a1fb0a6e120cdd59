//! Sheen of cloth: the "Charlie" distribution of fibres ("Production Friendly Microfacet Sheen BRDF", Estevez and Kulla, 2017) with the smooth
//! visibility of Neubelt and Pettineo ("Crafting a Next-Gen Material Pipeline for The Order: 1886", 2013), as in glTF's `KHR_materials_sheen`.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use crate::math::{cos, pow};

/// Cosines and roughnesses of the table, and steps of its quadrature.
const COSINES: usize = 48;
const ROUGHNESSES: usize = 16;
const STEPS: usize = 40;

/// Below this, fibres that stand upright would be seen at grazing angles alone.
const LEAST_ROUGHNESS: f64 = 0.2;

/// The BRDF of white fibres for two directions on the outward side; `roughness` is perceptual, in [0, 1], clamped from below to 0.2.
#[inline]
pub fn brdf(roughness: f64, o: DVec3, i: DVec3) -> f64 {
    let (cos_o, cos_i, half) = (o.z, i.z, o + i);
    let squared = half.length_squared();
    if squared <= 0.0 || cos_o <= 0.0 || cos_i <= 0.0 {
        return 0.0;
    }
    let inverse = 1.0 / squared_roughness(roughness);
    let sin2 = ((half.x * half.x + half.y * half.y) / squared).min(1.0);
    // D = (2 + 1 / alpha) sin^(1 / alpha) / (2 pi), V = 1 / (4 (cos_o + cos_i - cos_o cos_i)).
    (2.0 + inverse) * pow(sin2, 0.5 * inverse) * (0.5 * FRAC_1_PI) / (4.0 * (cos_o + cos_i - cos_o * cos_i))
}

#[inline(always)]
fn squared_roughness(roughness: f64) -> f64 {
    let clamped = roughness.clamp(LEAST_ROUGHNESS, 1.0);
    clamped * clamped
}

/// Which share of light white fibres reflect, over the cosine and the roughness.
#[derive(Clone, Debug, PartialEq)]
pub struct SheenAlbedo(Vec<[f64; COSINES]>);

impl Default for SheenAlbedo {
    fn default() -> Self {
        Self::new()
    }
}

impl SheenAlbedo {
    /// Computes the table, which is the same for all materials; takes some ten milliseconds.
    pub fn new() -> Self {
        let step = (1.0 - LEAST_ROUGHNESS) / (ROUGHNESSES - 1) as f64;
        let row = |at: usize| {
            // Roots are even, so that grazing angles are resolved.
            std::array::from_fn(|node| {
                let root = node as f64 / (COSINES - 1) as f64;
                integrate(LEAST_ROUGHNESS + at as f64 * step, (root * root).max(1e-9))
            })
        };
        Self((0..ROUGHNESSES).map(row).collect())
    }

    /// The share that is reflected of light at the given cosine; the model gives more than 1 at the last grazing angles.
    #[inline]
    pub fn at(&self, roughness: f64, cos: f64) -> f64 {
        let (column, s) = cell(cos.abs().sqrt(), COSINES);
        let (row, t) = cell((roughness.clamp(LEAST_ROUGHNESS, 1.0) - LEAST_ROUGHNESS) / (1.0 - LEAST_ROUGHNESS), ROUGHNESSES);
        let along = |row: usize| self.0[row][column] + (self.0[row][column + 1] - self.0[row][column]) * s;
        along(row) + (along(row + 1) - along(row)) * t
    }
}

/// The cell of an even grid over [0, 1] in which `x` lies, and the place in it.
#[inline(always)]
fn cell(x: f64, nodes: usize) -> (usize, f64) {
    let at = x.clamp(0.0, 1.0) * (nodes - 1) as f64;
    let low = (at as usize).min(nodes - 2);
    (low, at - low as f64)
}

/// `int f cos dw` by midpoints, even in the root of the cosine.
fn integrate(roughness: f64, cosine: f64) -> f64 {
    let o = DVec3::new((1.0 - cosine * cosine).max(0.0).sqrt(), 0.0, cosine);
    let mut sum = 0.0;
    for turn in 0..STEPS {
        let (x, y) = {
            let angle = PI * (turn as f64 + 0.5) / STEPS as f64;
            (cos(angle), cos(angle - 0.5 * PI))
        };
        for step in 0..STEPS {
            let root = (step as f64 + 0.5) / STEPS as f64;
            let z = root * root;
            let sin = (1.0 - z * z).sqrt();
            sum += brdf(roughness, o, DVec3::new(x * sin, y * sin, z)) * z * (2.0 * root);
        }
    }
    sum * 2.0 * PI / (STEPS * STEPS) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Against uniform sampling of the hemisphere by a sequence.
    #[test]
    fn the_table_is_right() {
        let table = SheenAlbedo::new();
        for (roughness, cos) in [(0.0, 0.3f64), (0.2, 0.9), (0.37, 0.05), (0.5, 0.5), (0.81, 0.2), (1.0, 0.02), (1.0, 1.0)] {
            const COUNT: u32 = 200_000;
            let o = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
            let f = |n: u32| {
                let z = (f64::from(n) * 0.754_877_666_246_692_8).fract();
                let (angle, sin) = (2.0 * PI * (f64::from(n) * 0.569_840_290_998_053_2).fract(), (1.0 - z * z).sqrt());
                brdf(roughness, o, DVec3::new(sin * angle.cos(), sin * angle.sin(), z)) * z
            };
            let right = (0..COUNT).map(f).sum::<f64>() * 2.0 * PI / f64::from(COUNT);
            let told = table.at(roughness, cos);
            assert!((told - right).abs() < 3e-3 + 0.01 * right, "{told} is not {right} at {roughness}, {cos}");
        }
    }
}
