//! Pixel filters, sampled by importance: a sample belongs to one pixel alone, and lies where the filter weighs much.
//!
//! Filters are products of a function of x and the same of y (pbrt-v4, 8.8). Where that function is negative, samples are drawn by its
//! magnitude and carry a negative weight (Ernst, Stamminger & Greiner, "Filter Importance Sampling", 2006).

use crate::{
    description,
    math::{cos, exp},
};
use glam::DVec2;
use std::f64::consts::PI;

/// A pixel filter; all lengths are in pixels, from the pixel's centre along each axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Filter {
    /// The pixel's own square, evenly.
    Box,
    /// The pixel's centre alone.
    Point,
    /// A Gaussian, cut off at the radius and lowered so that it ends at 0.
    Gaussian {
        /// Where it ends.
        radius: f64,
        /// Its standard deviation before the cut.
        sigma: f64,
    },
    /// The window of Blackman and Harris with four terms (Harris, "On the Use of Windows for Harmonic Analysis with the Discrete Fourier
    /// Transform", 1978).
    BlackmanHarris {
        /// Where it ends.
        radius: f64,
    },
    /// The cubic of Mitchell and Netravali ("Reconstruction Filters in Computer Graphics", 1988), stretched to a radius (theirs is 2).
    Mitchell {
        /// Where it ends.
        radius: f64,
        /// Blur.
        b: f64,
        /// Ringing; with the usual b = c = 1/3, the filter is negative beyond 4/7 of its radius.
        c: f64,
    },
}

impl Filter {
    /// The Gaussian of a radius whose standard deviation is a third of it.
    pub fn gaussian(radius: f64) -> Self {
        Self::Gaussian { radius, sigma: radius / 3.0 }
    }

    /// Mitchell and Netravali's own choice, b = c = 1/3.
    pub fn mitchell(radius: f64) -> Self {
        Self::Mitchell { radius, b: 1.0 / 3.0, c: 1.0 / 3.0 }
    }

    /// Its radius, and its value along an axis at a distance within it, up to a factor.
    fn profile(self) -> (f64, impl Fn(f64) -> f64) {
        let radius = match self {
            Self::Box => 0.5,
            Self::Point => 0.0,
            Self::Gaussian { radius, .. } | Self::BlackmanHarris { radius } | Self::Mitchell { radius, .. } => radius,
        };
        let value = move |x: f64| match self {
            Self::Box | Self::Point => 1.0,
            Self::Gaussian { radius, sigma } => {
                let gaussian = |x: f64| exp(-0.5 * (x / sigma) * (x / sigma));
                gaussian(x) - gaussian(radius)
            }
            Self::BlackmanHarris { radius } => {
                let turn = PI * (x / radius);
                0.35875 + 0.48829 * cos(turn) + 0.14128 * cos(2.0 * turn) + 0.01168 * cos(3.0 * turn)
            }
            Self::Mitchell { radius, b, c } => mitchell(2.0 * (x / radius), b, c),
        };
        (radius, value)
    }
}

/// Mitchell and Netravali's cubic at a distance within [0, 2]; its integral over [-2, 2] is 1.
fn mitchell(x: f64, b: f64, c: f64) -> f64 {
    let [c3, c2, c1, c0] = if x < 1.0 {
        [12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b]
    } else {
        [-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c]
    };
    (((c3 * x + c2) * x + c1) * x + c0) / 6.0
}

/// A filter made ready for sampling.
#[derive(Clone, Debug)]
pub struct PixelFilter(Kind);

#[derive(Clone, Debug)]
enum Kind {
    Box,
    Point,
    Shaken,
    Table(Box<Axis>),
}

impl PixelFilter {
    /// Tabulates a filter. One that is no filter (its radius is not positive, its integral is not, a parameter is not finite) becomes
    /// the filter `Point`.
    pub fn new(filter: Filter) -> Self {
        Self(match filter {
            Filter::Box => Kind::Box,
            Filter::Point => Kind::Point,
            _ => Axis::new(filter).map_or(Kind::Point, |axis| Kind::Table(Box::new(axis))),
        })
    }

    /// That of a film.
    pub fn of(filter: description::Filter) -> Self {
        Self::new(match filter {
            description::Filter::Box => Filter::Box,
            description::Filter::Point => Filter::Point,
            description::Filter::Gaussian => Filter::gaussian(1.5),
            description::Filter::BlackmanHarris => Filter::BlackmanHarris { radius: 1.5 },
            description::Filter::Mitchell => Filter::mitchell(2.0),
        })
    }

    /// One whose samples never look at the same place: what depends on a ray down to its last bit is then another for each. That of the pixel's centre looks up to 2^-21 of a pixel
    /// beside it.
    pub fn shaken(self) -> Self {
        Self(if matches!(self.0, Kind::Point) { Kind::Shaken } else { self.0 })
    }

    /// Where a sample looks, as an offset from the pixel's centre in pixels, and its weight: the mean of weight times g(offset) over all `u` of
    /// [0, 1)^2 is the filtered g, integral(f g) / integral(f). The weight is 1 for filters that are nowhere negative. In x and in y the
    /// offset grows with the number.
    #[inline]
    pub fn sample(&self, u: DVec2) -> (DVec2, f64) {
        match &self.0 {
            Kind::Box => (u - 0.5, 1.0),
            Kind::Point => (DVec2::ZERO, 1.0),
            Kind::Shaken => ((u - 0.5) * SHAKE, 1.0),
            Kind::Table(axis) => {
                let ((x, weight_x), (y, weight_y)) = (axis.sample(u.x), axis.sample(u.y));
                (DVec2::new(x, y), weight_x * weight_y)
            }
        }
    }

    /// The largest offset along an axis.
    #[cfg(test)]
    fn radius(&self) -> f64 {
        match &self.0 {
            Kind::Box => 0.5,
            Kind::Point => 0.0,
            Kind::Shaken => 0.5 * SHAKE,
            Kind::Table(axis) => axis.cell * CELLS as f64,
        }
    }
}

/// The side of the square in which samples look that should all look at its middle, in pixels.
const SHAKE: f64 = 1.0 / (1u64 << 20) as f64;

/// Cells of the half axis. The filter is linear within each: for a Gaussian of three standard deviations, off by 2e-5 of its peak.
const CELLS: usize = 256;

/// The filter along the half axis [0, radius], piecewise linear.
#[derive(Clone, Debug)]
struct Axis {
    /// Length of a cell in pixels.
    cell: f64,
    /// Values at the ends of the cells.
    values: [f64; CELLS + 1],
    /// Integral of the magnitude (linear between the magnitudes at the ends) up to the starts of the cells, over the whole.
    cumulative: [f64; CELLS + 1],
    /// Magnitudes at the ends of the cells are divided by this to make the density of a cell's position, in cells.
    total: f64,
    /// The last cell that starts at or before each multiple of 1 / CELLS.
    guide: [u16; CELLS],
    /// Integral of the magnitude over that of the filter.
    weight: f64,
}

impl Axis {
    fn new(filter: Filter) -> Option<Self> {
        let (radius, value) = filter.profile();
        let cell = radius / CELLS as f64;
        let values: [f64; CELLS + 1] = std::array::from_fn(|i| value(i as f64 * cell));
        let mut cumulative = [0.0; CELLS + 1];
        let mut integral = 0.0;
        for i in 0..CELLS {
            cumulative[i + 1] = cumulative[i] + 0.5 * (values[i].abs() + values[i + 1].abs());
            integral += 0.5 * (values[i] + values[i + 1]);
        }
        let total = cumulative[CELLS];
        let weight = total / integral;
        // Negated, so that NaNs end here too. Weights beyond 100 are noise, and a filter of integral 0 has no mean.
        if !(cell > 0.0 && cell.is_finite() && total.is_finite() && integral > 0.0 && weight < 100.0) {
            return None;
        }
        cumulative.iter_mut().for_each(|c| *c /= total);
        let mut guide = [0; CELLS];
        let mut at = 0;
        for (i, guide) in guide.iter_mut().enumerate() {
            while cumulative[at + 1] <= i as f64 / CELLS as f64 {
                at += 1;
            }
            *guide = at as u16;
        }
        Some(Self { cell, values, cumulative, total, guide, weight })
    }

    /// An offset and its weight.
    #[inline]
    fn sample(&self, u: f64) -> (f64, f64) {
        let v = 2.0 * u - 1.0;
        let (distance, weight) = self.sample_half(v.abs());
        (distance.copysign(v), weight)
    }

    /// A distance and its weight by the inverse of the cumulative distribution.
    #[inline(always)]
    fn sample_half(&self, v: f64) -> (f64, f64) {
        // The number 0 falls on v = 1: into the last cell that is not empty.
        let v = v.min(1.0 - f64::EPSILON / 2.0);
        let mut i = usize::from(self.guide[(v * CELLS as f64) as usize]);
        while self.cumulative[i + 1] <= v {
            i += 1;
        }
        let (a, b) = (self.values[i], self.values[i + 1]);
        let (p, q) = (a.abs(), b.abs());
        // The area behind a fraction t of the cell is p t + (q - p) t^2 / 2; this form of its inverse cancels nothing.
        let area = (v - self.cumulative[i]) * self.total;
        let t = (2.0 * area / (p + (p * p + 2.0 * area * (q - p)).max(0.0).sqrt())).min(1.0);
        let weight = if a >= 0.0 && b >= 0.0 {
            self.weight
        } else {
            // The filter over the density, which differ where the sign changes within the cell.
            self.weight * (a + (b - a) * t) / (p + (q - p) * t)
        };
        ((i as f64 + t) * self.cell, weight)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::sampling::Sampler;

    fn filters() -> [Filter; 6] {
        [
            Filter::gaussian(1.5),
            Filter::Gaussian { radius: 2.0, sigma: 0.3 },
            Filter::BlackmanHarris { radius: 1.5 },
            Filter::mitchell(2.0),
            Filter::Mitchell { radius: 1.7, b: 0.0, c: 0.5 },
            Filter::Mitchell { radius: 2.0, b: 1.0, c: 0.0 },
        ]
    }

    /// Filters a function of the offset by midpoint quadrature of the formula.
    fn filtered(filter: Filter, g: impl Fn(DVec2) -> f64) -> f64 {
        let n = 500;
        let (radius, value) = filter.profile();
        let nodes: Vec<_> =
            (0..n).map(|i| ((f64::from(i) + 0.5) / f64::from(n) * 2.0 - 1.0) * radius).map(|x| (x, value(x.abs()))).collect();
        let (mut sum, mut norm) = (0.0, 0.0);
        for &(x, fx) in &nodes {
            for &(y, fy) in &nodes {
                sum += fx * fy * g(DVec2::new(x, y));
                norm += fx * fy;
            }
        }
        sum / norm
    }

    /// The mean of weight times g over the samples of 2^16 indices.
    fn sampled(filter: Filter, g: impl Fn(DVec2) -> f64) -> f64 {
        let filter = PixelFilter::new(filter);
        let samples = (0..1 << 16).map(|i| filter.sample(Sampler::new(1, (2, 3), i).pair(0)));
        samples.map(|(offset, weight)| weight * g(offset)).sum::<f64>() / 65_536.0
    }

    #[test]
    fn means_of_samples_are_filtered_functions() {
        type Function = fn(DVec2) -> f64;
        let functions: [Function; 5] = [
            |_| 1.0,
            |p| p.x * p.x,
            |p| p.x + 0.3 * p.y + p.x * p.x * p.y * p.y,
            |p| exp(-2.0 * (p.x - 0.4).abs() - p.y * p.y),
            |p| cos(9.0 * p.x + 2.0 * p.y),
        ];
        for filter in filters() {
            for g in functions {
                let (expected, mean) = (filtered(filter, g), sampled(filter, g));
                assert!((expected - mean).abs() < 2e-4, "{filter:?} {expected} {mean}");
            }
        }
    }

    /// Chi-square of 2^16 random offsets along x in 32 cells, against the magnitude of the formula.
    #[test]
    fn offsets_are_distributed_by_magnitude() {
        for filter in filters() {
            let (radius, value) = filter.profile();
            let compiled = PixelFilter::new(filter);
            let mut counts = [0.0; 32];
            for x in 0..1 << 16 {
                let (offset, _) = compiled.sample(Sampler::new(1, (x, 0), 0).pair(0));
                counts[(((offset.x / radius + 1.0) * 16.0) as usize).min(31)] += 1.0;
            }
            let mass: [f64; 32] = std::array::from_fn(|i| {
                (0..100).map(|j| value(((i as f64 + (f64::from(j) + 0.5) / 100.0) / 16.0 - 1.0).abs() * radius).abs()).sum()
            });
            let norm = 65_536.0 / mass.iter().sum::<f64>();
            let chi_square: f64 = counts.iter().zip(mass).map(|(n, m)| (n - m * norm) * (n - m * norm) / (m * norm).max(5.0)).sum();
            assert!(chi_square < 31.0 + 5.0 * f64::sqrt(62.0), "{filter:?} {chi_square}");
        }
    }

    #[test]
    fn positive_filters_weigh_every_sample_alike() {
        for filter in [Filter::gaussian(1.5), Filter::BlackmanHarris { radius: 2.0 }, Filter::Mitchell { radius: 2.0, b: 1.0, c: 0.0 }] {
            let filter = PixelFilter::new(filter);
            assert!((0..4096).all(|i| filter.sample(Sampler::new(1, (2, 3), i).pair(0)).1 == 1.0));
        }
    }

    /// The magnitude's integral over [-2, 2] is 1.105 along an axis (1 plus twice the area of the lobes), so weights are within 1.105^2 = 1.221.
    #[test]
    fn weights_of_mitchell_are_bounded_and_negative_in_the_lobes() {
        let filter = PixelFilter::new(Filter::mitchell(2.0));
        for i in 0..1 << 14 {
            let (offset, weight) = filter.sample(Sampler::new(1, (2, 3), i).pair(0));
            let beyond = |x: f64| if (x.abs() - 8.0 / 7.0).abs() > 0.01 { f64::from(i8::from(x.abs() < 8.0 / 7.0) * 2 - 1) } else { 0.0 };
            assert!(weight.abs() < 1.23 && weight * beyond(offset.x) * beyond(offset.y) >= 0.0, "{offset} {weight}");
        }
    }

    #[test]
    fn box_and_point_are_exact() {
        let u = DVec2::new(0.1, 0.9);
        assert_eq!(PixelFilter::new(Filter::Box).sample(u), (u - 0.5, 1.0));
        assert_eq!(PixelFilter::new(Filter::Point).sample(u), (DVec2::ZERO, 1.0));
    }

    #[test]
    fn offsets_stay_within_the_radius_and_grow_with_the_number() {
        for filter in filters() {
            let (compiled, (radius, _)) = (PixelFilter::new(filter), filter.profile());
            assert!((compiled.radius() - radius).abs() < 1e-15);
            let (mut last, mut first) = (f64::NEG_INFINITY, None);
            let numbers = (0..4096).map(|i| f64::from(i) / 4096.0).chain([1.0 - f64::EPSILON / 2.0]);
            for u in numbers {
                let (offset, weight) = compiled.sample(DVec2::new(u, 0.5));
                assert!(offset.x >= last && offset.x.abs() <= radius && weight.is_finite() && offset.y == 0.0, "{filter:?} {u} {offset}");
                last = offset.x;
                first = first.or(Some(offset.x));
            }
            assert!((last - radius).abs() < 0.02 && (first.unwrap() + radius).abs() < 0.02, "{first:?} {last}");
        }
    }

    #[test]
    fn what_is_no_filter_is_a_point() {
        let bad = [
            Filter::gaussian(0.0),
            Filter::gaussian(f64::NAN),
            Filter::Gaussian { radius: 1.0, sigma: 0.0 },
            Filter::Gaussian { radius: 1.0, sigma: 1e300 },
            Filter::BlackmanHarris { radius: -1.0 },
            Filter::mitchell(f64::INFINITY),
            Filter::Mitchell { radius: 2.0, b: f64::NAN, c: 0.0 },
            Filter::Mitchell { radius: 2.0, b: 0.0, c: 1e9 },
        ];
        for filter in bad {
            assert_eq!(PixelFilter::new(filter).sample(DVec2::new(0.3, 0.2)), (DVec2::ZERO, 1.0), "{filter:?}");
        }
    }
}
