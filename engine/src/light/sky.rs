//! Sun and clear sky by day and in twilight, from physics.
//!
//! Sunlight is scattered once by molecules and aerosol along the line of sight (Nishita, Sirai, Tadamura, Nakamae, "Display of the Earth
//! Taking into Account Atmospheric Scattering", SIGGRAPH 1993), and further times by the approximation of Hillaire, "A Scalable and
//! Production Ready Sky and Atmosphere Rendering Technique", EGSR 2020. Colours stand for wavelengths of 680, 550 and 440 nm. Refraction is
//! left out.
//!
//! **Unit.** Radiance is relative to that of a white diffuse surface which faces the sun outside of the atmosphere: 1 for it, about 0.8 for
//! white paper in the sun at noon, about 0.05 to 0.1 for a blue sky. The sun's irradiance outside of the atmosphere is therefore pi, and
//! taken as white. One unit is 1361 / pi = 433 W / (m^2 sr) (solar constant: Kopp, Lean 2011) or about 42,000 cd / m^2 (133 klx: Darula,
//! Kittler, Gueymard 2005).

mod atmosphere;
#[cfg(test)]
mod tests;

use std::f64::consts::{FRAC_1_PI, FRAC_PI_2, PI, TAU};

use glam::DVec3;

use crate::math::{atan2, cos, sin, sin_cos};
use atmosphere::{Air, Atmosphere};

/// Angular radius of the sun's disc in degrees, as seen from Earth in the mean.
pub const SUN_RADIUS: f64 = 0.2665;

/// The sun's irradiance outside of the atmosphere: see the module.
const SUN_IRRADIANCE: f64 = PI;

/// A clear sky over a ground without end. Numbers beyond their ranges are moved into them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SunSky {
    /// Towards the sun's centre; +y is up. Any length but 0. Below the horizon there is twilight, then night.
    pub sun_direction: DVec3,
    /// How hazy the air is, 1.7 to 10: extinction of air with aerosol over that of pure air, looking straight up at 550 nm. 2 is very
    /// clear, 3 clear, 6 warm and moist, 10 hazy.
    pub turbidity: f64,
    /// Share of light that the ground reflects, 0 to 1.
    pub ground_albedo: DVec3,
}

impl SunSky {
    /// The sky as an image of the whole sphere, without the sun's disc: columns, rows and pixels, oriented as
    /// [`ImageEnvironment`](super::environment::ImageEnvironment) expects them. It has `height` rows (2 to 16,384) and twice as many
    /// columns. Below the horizon lies the ground, lit by sun and sky, without haze before it.
    pub fn sky(&self, height: u32) -> (u32, u32, Vec<[f32; 3]>) {
        let height = height.clamp(2, 16_384);
        let (rows, columns) = (height as usize, 2 * height as usize);
        let albedo = DVec3::from_array(self.ground_albedo.to_array().map(|share| within(share, 0.0, 1.0)));
        let atmosphere = Atmosphere::new(self.air(), albedo);
        let picture = Picture::new(&atmosphere, self.towards_sun(), columns);
        let mut pixels = Vec::with_capacity(rows * columns);
        let mut irradiance = SUN_IRRADIANCE * self.sunlight() * self.towards_sun().y.max(0.0);
        // Rows whose centre is not below the horizon.
        for row in 0..rows.div_ceil(2) {
            let polar = |row: f64| (PI * row / rows as f64).min(FRAC_PI_2);
            let sum = picture.row(polar(row as f64 + 0.5), &mut pixels);
            // The integral of the cosine over the row.
            let (upper, lower) = (sin(polar(row as f64)), sin(polar(row as f64 + 1.0)));
            irradiance += sum / columns as f64 * (PI * (lower * lower - upper * upper));
        }
        pixels.resize(rows * columns, to_pixel(albedo * irradiance * FRAC_1_PI));
        (2 * height, height, pixels)
    }

    /// The sun: radiance of its disc as seen through the atmosphere, the same all over, and the disc's angular radius in *degrees*,
    /// `SUN_RADIUS`. Where the horizon covers a part of it, radiance is less instead. A surface that faces it receives radiance times the
    /// disc's solid angle.
    pub fn sun(&self) -> (DVec3, f64) {
        let half = sin(0.5 * SUN_RADIUS.to_radians());
        // TAU (1 - cos) without cancellation.
        let solid_angle = 2.0 * TAU * half * half;
        (self.sunlight() * (SUN_IRRADIANCE / solid_angle), SUN_RADIUS)
    }

    fn air(&self) -> Air {
        Air::new(within(self.turbidity, 1.7, 10.0))
    }

    /// The share of its light that comes through.
    fn sunlight(&self) -> DVec3 {
        self.air().sunlight(0.0, self.towards_sun().y)
    }

    fn towards_sun(&self) -> DVec3 {
        let largest = self.sun_direction.abs().max_element();
        if largest > 0.0 && self.sun_direction.is_finite() { (self.sun_direction / largest).normalize() } else { DVec3::Y }
    }
}

/// The lowest number for what is none.
fn within(x: f64, lowest: f64, highest: f64) -> f64 {
    x.max(lowest).min(highest)
}

fn to_pixel(radiance: DVec3) -> [f32; 3] {
    radiance.to_array().map(|component| component.max(0.0) as f32)
}

/// Azimuths, from the sun's to the opposite one, at which scattered light is gathered. Without the phase functions, which are applied at
/// each pixel, it changes little in between.
const AZIMUTHS: usize = 48;

/// What is known of all rows of the image.
struct Picture<'a> {
    atmosphere: &'a Atmosphere,
    sun: DVec3,
    columns: Vec<Column>,
}

/// A column of the image.
struct Column {
    /// Cosine of the azimuth from the sun.
    cos: f64,
    /// The azimuth before it, and how far the column is on the way to the next one, 0 to 1.
    azimuth: (usize, f64),
}

impl<'a> Picture<'a> {
    fn new(atmosphere: &'a Atmosphere, sun: DVec3, columns: usize) -> Self {
        let longitude = atan2(sun.x, -sun.z);
        let column = |x: usize| {
            let turn = (x as f64 + 0.5) / columns as f64 - 0.5 - longitude / TAU;
            // To the left of the sun is as to the right.
            let azimuth = (turn - turn.round()).abs() * TAU;
            let at = azimuth / PI * (AZIMUTHS - 1) as f64;
            let before = (at as usize).min(AZIMUTHS - 2);
            Column { cos: cos(azimuth), azimuth: (before, at - before as f64) }
        };
        Self { atmosphere, sun, columns: (0..columns).map(column).collect() }
    }

    /// Appends the pixels at a polar angle up to pi / 2 and returns the sum of their radiances.
    fn row(&self, polar: f64, pixels: &mut Vec<[f32; 3]>) -> DVec3 {
        let (level, up) = sin_cos(polar);
        let sun_level = (1.0 - self.sun.y * self.sun.y).max(0.0).sqrt();
        let cos_to_sun = |cos_azimuth: f64| (up * self.sun.y + level * sun_level * cos_azimuth).clamp(-1.0, 1.0);
        let azimuth = |i: usize| cos(PI * i as f64 / (AZIMUTHS - 1) as f64);
        let scattered: [_; AZIMUTHS] = std::array::from_fn(|i| self.atmosphere.scattered(up.max(0.0), self.sun.y, cos_to_sun(azimuth(i))));
        let mut sum = DVec3::ZERO;
        pixels.extend(self.columns.iter().map(|column| {
            let (before, weight) = column.azimuth;
            let cosine = cos_to_sun(column.cos);
            let (a, b) = (scattered[before].towards(cosine), scattered[before + 1].towards(cosine));
            let radiance = SUN_IRRADIANCE * (a * (1.0 - weight) + b * weight);
            sum += radiance;
            to_pixel(radiance)
        }));
        sum
    }
}
