//! Environments: the radiance that arrives from infinitely far away.
//!
//! **Orientation of images.** An image shows the whole sphere by longitude and latitude, as seen from inside with +y up: its middle column
//! (u = 1/2) lies in direction -z, where a camera in its usual pose looks; u grows to the right, so that u = 3/4 is +x, both edges are +z
//! and u = 1/4 is -x; the first row (v = 0) is straight up, +y, and the last one straight down. This is how most tools store and show such
//! images.

mod cells;
#[cfg(test)]
mod tests;

use std::f64::consts::{FRAC_1_PI, PI, TAU};

use glam::{DMat3, DVec2, DVec3};

use crate::math::{acos, atan2, cos, sin, sin_cos};
use cells::Cells;

/// The radiance of rays that leave the scene.
#[derive(Clone, Debug)]
pub enum Environment {
    /// The same in all directions; components finite and not negative.
    Constant(DVec3),
    /// By direction.
    Image(ImageEnvironment),
}

/// Density of directions that are spread evenly over the sphere, per steradian.
const EVENLY: f64 = 0.25 * FRAC_1_PI;

impl Environment {
    /// What arrives from a direction, a unit vector that points away from the scene.
    #[inline]
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Image(image) => image.radiance(direction),
        }
    }

    /// A direction for `u` in [0, 1)^2, as a unit vector towards the environment, the radiance that arrives from there, and the density,
    /// above 0, with which it was chosen, by solid angle in steradians. Directions are spread evenly over the sphere where the radiance is
    /// constant, otherwise nearly in proportion to luminance. `None` if the environment is black.
    #[inline]
    pub fn sample(&self, u: DVec2) -> Option<(DVec3, DVec3, f64)> {
        match self {
            Self::Constant(radiance) => (*radiance != DVec3::ZERO).then(|| (on_sphere(TAU * u.x, 1.0 - 2.0 * u.y), *radiance, EVENLY)),
            Self::Image(image) => image.sample(u),
        }
    }

    /// The density, by solid angle, with which [`Environment::sample`] chooses a unit vector. Above 0 wherever the radiance is.
    #[inline]
    pub fn pdf(&self, direction: DVec3) -> f64 {
        match self {
            Self::Constant(DVec3::ZERO) => 0.0,
            Self::Constant(_) => EVENLY,
            Self::Image(image) => image.pdf(direction),
        }
    }

    /// The mean over the sphere: the irradiance of a surface that it surrounds evenly is pi times as much.
    pub fn mean_radiance(&self) -> DVec3 {
        match self {
            Self::Constant(radiance) => *radiance,
            Self::Image(image) => image.mean,
        }
    }
}

/// The rotation by an angle in degrees about +y, counterclockwise as seen from above: an environment turned by a positive angle moves to
/// the left before a viewer who looks at it from inside.
pub fn turned(degrees: f64) -> DMat3 {
    let (sin, cos) = sin_cos(degrees.to_radians());
    DMat3::from_cols(DVec3::new(cos, 0.0, -sin), DVec3::Y, DVec3::new(sin, 0.0, cos))
}

/// An image of the whole sphere by longitude and latitude, oriented as the module says. Between the centres of pixels it is interpolated
/// bilinearly; columns go on around the sphere, the first and last row reach to the poles.
#[derive(Clone, Debug)]
pub struct ImageEnvironment {
    width: usize,
    height: usize,
    pixels: Vec<[f32; 3]>,
    to_world: DMat3,
    scale: f64,
    mean: DVec3,
    /// `None` if all is black.
    cells: Option<Box<Cells>>,
}

impl ImageEnvironment {
    /// Takes linear Rec. 709 pixels, row by row from the top, whose radiance is `scale` times their value. `to_world` is a rotation: see
    /// [`turned`].
    ///
    /// # Errors
    /// Says what is wrong with the size, the rotation or the scale, or which pixel is negative or no finite number.
    pub fn new(width: u32, height: u32, pixels: Vec<[f32; 3]>, to_world: DMat3, scale: f64) -> Result<Self, String> {
        let (columns, rows) = (width as usize, height as usize);
        if columns == 0 || rows == 0 || columns.checked_mul(rows) != Some(pixels.len()) {
            return Err(format!("an environment of {width} x {height} pixels cannot have {} of them", pixels.len()));
        }
        if !is_rotation(to_world) {
            return Err("the environment's to_world must be a rotation".into());
        }
        let brightest = brightest(columns, &pixels)?;
        if !(scale >= 0.0 && scale.is_finite() && f64::from(brightest) * scale <= f64::from(f32::MAX)) {
            return Err(format!("the environment's scale must not be negative, nor make it brighter than {:e}: {scale}", f32::MAX));
        }
        let cells = if scale == 0.0 { None } else { Cells::new(columns, rows, &pixels).map(Box::new) };
        let mean = mean(columns, rows, &pixels) * scale;
        Ok(Self { width: columns, height: rows, pixels, to_world, scale, mean, cells })
    }

    /// See [`Environment::radiance`].
    #[inline]
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        self.lookup(self.uv(direction))
    }

    /// See [`Environment::sample`].
    #[inline]
    pub fn sample(&self, u: DVec2) -> Option<(DVec3, DVec3, f64)> {
        let chosen = self.cells.as_ref()?.sample(u);
        let direction = self.to_world * on_sphere(TAU * (chosen.u - 0.5), chosen.cos);
        let radiance = self.lookup(DVec2::new(chosen.u, acos(chosen.cos) * FRAC_1_PI));
        Some((direction, radiance, chosen.pdf))
    }

    /// See [`Environment::pdf`].
    #[inline]
    pub fn pdf(&self, direction: DVec3) -> f64 {
        self.cells.as_ref().map_or(0.0, |cells| cells.pdf(self.uv(direction)))
    }

    /// Image coordinates of a unit vector, each in [0, 1].
    #[inline]
    fn uv(&self, direction: DVec3) -> DVec2 {
        // A rotation's transpose is its inverse.
        let DVec3 { x, y, z } = self.to_world.transpose() * direction;
        DVec2::new(0.5 + atan2(x, -z) * (0.5 * FRAC_1_PI), acos(y.clamp(-1.0, 1.0)) * FRAC_1_PI)
    }

    #[inline]
    fn lookup(&self, uv: DVec2) -> DVec3 {
        let (x, y) = (uv.x * self.width as f64 - 0.5, uv.y * self.height as f64 - 0.5);
        let (left, top) = (x.floor(), y.floor());
        let (to_right, down) = (x - left, y - top);
        // Left of the first column lies the last one.
        let left = if left < 0.0 { self.width - 1 } else { (left as usize).min(self.width - 1) };
        let right = if left + 1 == self.width { 0 } else { left + 1 };
        // Casts end at 0: above the first row lies itself.
        let (upper, lower) = ((top as usize).min(self.height - 1), ((top + 1.0) as usize).min(self.height - 1));
        let row = |row: usize| self.pixel(left, row) * (1.0 - to_right) + self.pixel(right, row) * to_right;
        (row(upper) * (1.0 - down) + row(lower) * down) * self.scale
    }

    #[inline(always)]
    fn pixel(&self, x: usize, y: usize) -> DVec3 {
        let [r, g, b] = self.pixels[y * self.width + x];
        DVec3::new(r.into(), g.into(), b.into())
    }
}

/// The unit vector of a longitude, from -z towards +x, and of the cosine of the angle to +y.
#[inline(always)]
fn on_sphere(longitude: f64, cos: f64) -> DVec3 {
    let from_axis = (1.0 - cos * cos).max(0.0).sqrt();
    let (sin, ahead) = sin_cos(longitude);
    DVec3::new(sin * from_axis, cos, -ahead * from_axis)
}

fn is_rotation(m: DMat3) -> bool {
    let product = m.transpose() * m;
    product.abs_diff_eq(DMat3::IDENTITY, 1e-9) && m.determinant() > 0.0
}

/// The largest component of all pixels.
fn brightest(width: usize, pixels: &[[f32; 3]]) -> Result<f32, String> {
    let mut brightest = 0f32;
    for (i, pixel) in pixels.iter().enumerate() {
        if !pixel.iter().all(|component| component.is_finite() && *component >= 0.0) {
            let (x, y) = (i % width, i / width);
            return Err(format!("pixel ({x}, {y}) of the environment is {pixel:?}; colours must be finite and not negative"));
        }
        brightest = pixel.iter().fold(brightest, |a, b| a.max(*b));
    }
    Ok(brightest)
}

/// The exact mean over the sphere of the interpolated image.
fn mean(width: usize, height: usize, pixels: &[[f32; 3]]) -> DVec3 {
    let mut mean = DVec3::ZERO;
    for (row, pixels) in pixels.chunks_exact(width).enumerate() {
        let sum = pixels.iter().fold(DVec3::ZERO, |sum, [r, g, b]| sum + DVec3::new((*r).into(), (*g).into(), (*b).into()));
        mean += sum / width as f64 * row_share(row, height);
    }
    mean
}

/// A row's share of the sphere: half the integral, over the polar angle, of the sine times the row's weight in the interpolation, which
/// falls linearly to 0 at the next rows' centres and is 1 between the first or last row's centre and the pole.
fn row_share(row: usize, height: usize) -> f64 {
    let step = PI / height as f64;
    // The weight below the centre of a row at polar angle a: integral over t in [0, step] of (1 - t / step) sin(a + t).
    let below = |row: usize| {
        if row + 1 == height {
            1.0 - cos(0.5 * step)
        } else {
            let a = (row as f64 + 0.5) * step;
            cos(a) - (sin(a + step) - sin(a)) / step
        }
    };
    // Above it is the same upside down.
    0.5 * (below(row) + below(height - 1 - row))
}
