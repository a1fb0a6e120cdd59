//! Cells of an image by importance.
//!
//! A pixel's cell is chosen in proportion to the light that comes from it, and a direction in it evenly by solid angle, so that nothing is
//! singular at the poles. Cumulated shares are stored in steps of about 2^-32 and the densities are those of the stored numbers, so that
//! sampling and density agree exactly however coarse the steps are; a cell that has any light gets one step at least, however bright the
//! others are.

use std::f64::consts::{PI, TAU};

use glam::DVec2;

use crate::math::cos;

/// The sum of all shares, in steps: the largest number that fits.
const WHOLE: u32 = u32::MAX;

/// The largest number below 1.
const BELOW_ONE: f64 = 1.0 - f64::EPSILON / 2.0;

/// Every so many shares the search has a guide: 16 shares fill a cache line, and all guides of a large image fit in a cache.
const BLOCK: usize = 16;

/// The distribution over an image's pixels.
#[derive(Clone, Debug)]
pub struct Cells {
    width: usize,
    /// Where each row's share begins.
    rows: Vec<u32>,
    /// Where each column's share of its row begins, row by row.
    columns: Vec<u32>,
    /// Every [`BLOCK`]th of the rows' numbers.
    row_guides: Vec<u32>,
    /// Every [`BLOCK`]th of each row's numbers, row by row.
    column_guides: Vec<u32>,
    /// Cosines of the polar angles of the rows' upper edges, and of the south pole.
    edges: Vec<f64>,
}

/// A chosen direction.
#[derive(Clone, Copy, Debug)]
pub struct Chosen {
    /// Image coordinate of the longitude, in [0, 1).
    pub u: f64,
    /// Cosine of the polar angle.
    pub cos: f64,
    /// Density by solid angle.
    pub pdf: f64,
}

impl Cells {
    /// Of an image that is not empty and whose pixels are finite and not negative; `None` if all are black.
    pub fn new(width: usize, height: usize, pixels: &[[f32; 3]]) -> Option<Self> {
        let edges: Vec<f64> = (0..=height).map(|row| if row == height { -1.0 } else { cos(PI * row as f64 / height as f64) }).collect();
        let mut columns = vec![0; width * height];
        let mut light = vec![0.0; height];
        let mut weights = Weights::new(width, height, pixels);
        for (row, starts) in columns.chunks_exact_mut(width).enumerate() {
            light[row] = accumulate(weights.of(row), starts) * (edges[row] - edges[row + 1]);
        }
        let mut rows = vec![0; height];
        if accumulate(&light, &mut rows) == 0.0 {
            return None;
        }
        let row_guides = rows.iter().step_by(BLOCK).copied().collect();
        let column_guides = columns.chunks_exact(width).flat_map(|starts| starts.iter().step_by(BLOCK)).copied().collect();
        Some(Self { width, rows, columns, row_guides, column_guides, edges })
    }

    /// Chooses by two numbers in [0, 1).
    #[inline]
    pub fn sample(&self, u: DVec2) -> Chosen {
        let (row, row_share, down) = choose(&self.rows, &self.row_guides, u.y);
        let guides = self.width.div_ceil(BLOCK);
        let guides = &self.column_guides[row * guides..(row + 1) * guides];
        let (column, column_share, along) = choose(self.columns_of(row), guides, u.x);
        let (upper, lower) = (self.edges[row], self.edges[row + 1]);
        Chosen {
            u: (column as f64 + along) / self.width as f64,
            cos: upper + (lower - upper) * down,
            pdf: self.density(row, row_share, column_share),
        }
    }

    /// The density by solid angle at image coordinates in [0, 1].
    #[inline]
    pub fn pdf(&self, uv: DVec2) -> f64 {
        let row = ((uv.y * self.rows.len() as f64) as usize).min(self.rows.len() - 1);
        let column = ((uv.x * self.width as f64) as usize).min(self.width - 1);
        self.density(row, share(&self.rows, row), share(self.columns_of(row), column))
    }

    #[inline(always)]
    fn columns_of(&self, row: usize) -> &[u32] {
        &self.columns[row * self.width..(row + 1) * self.width]
    }

    #[inline(always)]
    fn density(&self, row: usize, row_share: u32, column_share: u32) -> f64 {
        const STEP: f64 = 1.0 / WHOLE as f64;
        let solid_angle = TAU * (self.edges[row] - self.edges[row + 1]) / self.width as f64;
        (f64::from(row_share) * STEP) * (f64::from(column_share) * STEP) / solid_angle
    }
}

/// Writes where each share begins and returns the sum of the weights. A weight above 0 gets a step at least, a weight of 0 nothing.
fn accumulate(weights: &[f64], starts: &mut [u32]) -> f64 {
    let total: f64 = weights.iter().sum();
    let lit = weights.iter().filter(|weight| **weight > 0.0).count();
    // One step for each that has light; the others in proportion.
    let divided = (WHOLE as usize).saturating_sub(lit) as f64;
    let factor = if total > 0.0 { divided / total } else { 0.0 };
    let (mut sum, mut steps) = (0.0, 0);
    for (weight, start) in weights.iter().zip(starts) {
        *start = (sum * factor).min(divided) as u32 + steps;
        sum += weight;
        steps += u32::from(*weight > 0.0);
    }
    total
}

/// Steps of one share.
#[inline(always)]
fn share(starts: &[u32], i: usize) -> u32 {
    starts.get(i + 1).copied().unwrap_or(WHOLE) - starts[i]
}

/// The share in which `u` in [0, 1) falls, its steps, and where in it, in [0, 1).
#[inline(always)]
fn choose(starts: &[u32], guides: &[u32], u: f64) -> (usize, u32, f64) {
    let at = u * f64::from(WHOLE);
    let whole = at as u32;
    let last = |starts: &[u32]| starts.partition_point(|start| *start <= whole).saturating_sub(1);
    let block = last(guides) * BLOCK;
    let i = block + last(&starts[block..(block + BLOCK).min(starts.len())]);
    let steps = share(starts, i);
    (i, steps, ((at - f64::from(starts[i])) / f64::from(steps.max(1))).min(BELOW_ONE))
}

/// Mean luminance of the interpolated image in each cell of a row, times 64.
struct Weights<'p> {
    pixels: &'p [[f32; 3]],
    height: usize,
    /// Luminances of the rows above, at and below, as they are needed from the first row on.
    around: [Vec<f64>; 3],
    weights: Vec<f64>,
}

impl<'p> Weights<'p> {
    fn new(width: usize, height: usize, pixels: &'p [[f32; 3]]) -> Self {
        let around = [0, 0, 0].map(|row| luminances(pixels, width, row));
        Self { pixels, height, around, weights: vec![0.0; width] }
    }

    /// Rows must be asked for in sequence. The mean of a bilinear interpolation over a cell is 1/8, 6/8, 1/8 of the pixels along each axis.
    fn of(&mut self, row: usize) -> &[f64] {
        let width = self.weights.len();
        self.around.rotate_left(1);
        self.around[2] = luminances(self.pixels, width, (row + 1).min(self.height - 1));
        let [above, here, below] = &self.around;
        let column = |x: usize| above[x] + 6.0 * here[x] + below[x];
        let (mut before, mut at) = (column(width - 1), column(0));
        for (x, weight) in self.weights.iter_mut().enumerate() {
            let after = column(if x + 1 == width { 0 } else { x + 1 });
            *weight = before + 6.0 * at + after;
            (before, at) = (at, after);
        }
        &self.weights
    }
}

/// Of a row's pixels (Rec. 709).
fn luminances(pixels: &[[f32; 3]], width: usize, row: usize) -> Vec<f64> {
    let luminance = |[r, g, b]: &[f32; 3]| 0.2126 * f64::from(*r) + 0.7152 * f64::from(*g) + 0.0722 * f64::from(*b);
    pixels[row * width..(row + 1) * width].iter().map(luminance).collect()
}
