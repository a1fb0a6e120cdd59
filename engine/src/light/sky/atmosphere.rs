//! The Earth's atmosphere: what it absorbs and scatters. Lengths in km; light relative to the sun's irradiance outside of it.

use std::f64::consts::{FRAC_1_PI, PI};

use glam::DVec3;

use crate::math::{cos, exp, pow};

/// Radius of the Earth, and height of the atmosphere (Bruneton, Neyret, "Precomputed Atmospheric Scattering", EGSR 2008).
const EARTH: f64 = 6360.0;
const TOP: f64 = 100.0;

/// Scattering by molecules at the ground, and the height over which their density falls by e (Bruneton, Neyret 2008; Hillaire 2020, table
/// 1).
const RAYLEIGH: DVec3 = DVec3::new(5.802e-3, 13.558e-3, 33.1e-3);
const RAYLEIGH_HEIGHT: f64 = 8.0;

/// Absorption by ozone where it is densest; from there its density falls linearly to 0 (Hillaire 2020, table 1).
const OZONE: DVec3 = DVec3::new(0.650e-3, 1.881e-3, 0.085e-3);
const OZONE_MIDDLE: f64 = 25.0;
const OZONE_REACH: f64 = 15.0;

/// Aerosol: the height over which its density falls by e, the share of extinction that is scattering, and the asymmetry of scattering
/// (Bruneton, Neyret 2008), and Ångström's exponent of extinction by wavelength (Ångström, "On the Atmospheric Transmission of Sun
/// Radiation", 1929).
const AEROSOL_HEIGHT: f64 = 1.2;
const AEROSOL_ALBEDO: f64 = 0.9;
const AEROSOL_ASYMMETRY: f64 = 0.8;
const AEROSOL_EXPONENT: f64 = 1.3;

/// Wavelengths of the colours relative to the second.
const WAVELENGTHS: DVec3 = DVec3::new(680.0 / 550.0, 1.0, 440.0 / 550.0);

/// Sine of the sun's angular radius, within which it sets.
const SUN_SINE: f64 = 0.00465;

/// Steps along a ray: for the eye, for the depth of air, and for light that is scattered many times.
const VIEW_STEPS: usize = 40;
const DEPTH_STEPS: usize = 80;
const MULTIPLE_STEPS: usize = 16;

/// Directions over which light that is scattered many times is averaged: polar angles, and azimuths on one side of the sun.
const POLARS: usize = 12;
const AZIMUTHS: usize = 4;

/// An atmosphere with its tables.
#[derive(Debug)]
pub(super) struct Atmosphere {
    air: Air,
    /// Optical depth towards a place in the sky: by altitude and direction, as [`depth_coordinates`] maps them.
    depth: Table,
    /// Mean radiance of light that was scattered at least once: by altitude and height of the sun, as [`Atmosphere::multiple`] maps them.
    multiple: Table,
}

/// Light that reaches the eye, before phase functions.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Scattered {
    /// Scattered once by molecules.
    pub rayleigh: DVec3,
    /// Scattered once by aerosol.
    pub aerosol: DVec3,
    /// Scattered more often.
    pub multiple: DVec3,
}

impl Scattered {
    /// Radiance at an angle to the sun, by its cosine.
    pub fn towards(&self, cosine: f64) -> DVec3 {
        self.rayleigh * rayleigh_phase(cosine) + self.aerosol * aerosol_phase(cosine) + self.multiple
    }
}

fn rayleigh_phase(cosine: f64) -> f64 {
    3.0 / (16.0 * PI) * (1.0 + cosine * cosine)
}

/// Cornette, Shanks, "Physically Reasonable Analytic Expression for the Single-Scattering Phase Function", Applied Optics 31(16), 1992.
fn aerosol_phase(cosine: f64) -> f64 {
    const G: f64 = AEROSOL_ASYMMETRY;
    let spread = 1.0 + G * G - 2.0 * G * cosine;
    3.0 / (8.0 * PI) * (1.0 - G * G) * (1.0 + cosine * cosine) / ((2.0 + G * G) * spread * spread.sqrt())
}

impl Atmosphere {
    /// Of molecules that scatter, nothing else, above black ground: what closed forms tell of.
    #[cfg(test)]
    pub fn of_molecules() -> Self {
        Self::new(Air { rayleigh: RAYLEIGH, aerosol: DVec3::ZERO, ozone: DVec3::ZERO }, DVec3::ZERO)
    }

    pub fn new(air: Air, ground_albedo: DVec3) -> Self {
        let depth = Table::new(128, 32, |x, y| {
            let (altitude, cosine) = depth_place(x, y);
            air.depth(&Path::new(altitude, cosine))
        });
        let mut atmosphere = Self { air, depth, multiple: Table::new(1, 1, |_, _| DVec3::ZERO) };
        atmosphere.multiple = Table::new(32, 16, |x, y| {
            let s = 2.0 * x - 1.0;
            atmosphere.scattered_often(TOP * y * y, s * s.abs(), ground_albedo)
        });
        atmosphere
    }

    /// [`Air::sunlight`] by the table.
    pub fn sunlight(&self, altitude: f64, cosine: f64) -> DVec3 {
        let risen = risen(altitude, cosine);
        if risen == 0.0 {
            return DVec3::ZERO;
        }
        let (x, y) = depth_coordinates(altitude, cosine.max(horizon(altitude)));
        decay(self.depth.at(x, y)) * risen
    }

    /// What is scattered towards an eye on the ground from a direction: cosines of its angle and the sun's to the zenith, and of the angle
    /// between.
    pub fn scattered(&self, cosine: f64, sun: f64, between: f64) -> Scattered {
        let path = Path::new(0.0, cosine);
        let mut sum = Scattered::default();
        self.air.march(&path, path.to_top(), VIEW_STEPS, |t, altitude, here, weight| {
            let sun = path.sun(t, sun, between);
            let lit = weight * self.sunlight(altitude, sun);
            sum.rayleigh += lit * here.rayleigh;
            sum.aerosol += lit * here.aerosol;
            sum.multiple += weight * (here.rayleigh + here.aerosol) * self.multiple(altitude, sun);
        });
        sum
    }

    fn multiple(&self, altitude: f64, sun: f64) -> DVec3 {
        // Finer near the ground and where the sun sets.
        self.multiple.at(0.5 + 0.5 * sun.abs().sqrt().copysign(sun), (altitude / TOP).sqrt())
    }

    /// The mean radiance of light scattered at least once: that of once and from the ground, as if scattering were even to all sides, times
    /// the sum of the geometric series of further times, as if they were alike everywhere (Hillaire 2020, section 5.5).
    fn scattered_often(&self, altitude: f64, sun: f64, ground_albedo: DVec3) -> DVec3 {
        let (mut once, mut again) = (DVec3::ZERO, DVec3::ZERO);
        for i in 0..POLARS * AZIMUTHS {
            let up = 1.0 - 2.0 * ((i / AZIMUTHS) as f64 + 0.5) / POLARS as f64;
            let azimuth = PI * ((i % AZIMUTHS) as f64 + 0.5) / AZIMUTHS as f64;
            let level = ((1.0 - up * up) * (1.0 - sun * sun)).max(0.0).sqrt();
            let between = up * sun + level * cos(azimuth);
            let path = Path::new(altitude, up);
            let ground = path.to_ground();
            let through = self.air.march(&path, ground.unwrap_or(path.to_top()), MULTIPLE_STEPS, |t, altitude, here, weight| {
                let scattered = weight * (here.rayleigh + here.aerosol);
                once += scattered * self.sunlight(altitude, path.sun(t, sun, between)) * (0.25 * FRAC_1_PI);
                again += scattered;
            });
            if let Some(t) = ground {
                let sun = path.sun(t, sun, between);
                once += through * ground_albedo * self.sunlight(0.0, sun) * (FRAC_1_PI * sun.max(0.0));
            }
        }
        let n = (POLARS * AZIMUTHS) as f64;
        (once / n) / (DVec3::ONE - again / n)
    }
}

/// What the air consists of, at the ground, per km.
#[derive(Debug)]
pub(super) struct Air {
    rayleigh: DVec3,
    /// Extinction.
    aerosol: DVec3,
    ozone: DVec3,
}

/// The air somewhere, per km.
struct Here {
    /// Scattering by molecules.
    rayleigh: DVec3,
    /// Scattering by aerosol.
    aerosol: DVec3,
    extinction: DVec3,
}

impl Air {
    /// With as much aerosol as turbidity, at least 1, says.
    pub fn new(turbidity: f64) -> Self {
        // Turbidity is the extinction of all over that of molecules, straight up (Preetham, Shirley, Smits, "A Practical Analytic Model for
        // Daylight", SIGGRAPH 1999, appendix).
        let at_550_nm = (turbidity - 1.0) * RAYLEIGH.y * (RAYLEIGH_HEIGHT / AEROSOL_HEIGHT);
        let by_wavelength = WAVELENGTHS.to_array().map(|wavelength| at_550_nm * pow(wavelength, -AEROSOL_EXPONENT));
        Self { rayleigh: RAYLEIGH, aerosol: by_wavelength.into(), ozone: OZONE }
    }

    /// The share of sunlight that reaches an altitude where the cosine of the sun's angle to the zenith is `cosine`. The sun sets
    /// gradually.
    pub fn sunlight(&self, altitude: f64, cosine: f64) -> DVec3 {
        decay(self.depth(&Path::new(altitude, cosine.max(horizon(altitude))))) * risen(altitude, cosine)
    }

    fn at(&self, altitude: f64) -> Here {
        let rayleigh = self.rayleigh * exp(-altitude / RAYLEIGH_HEIGHT);
        let aerosol = self.aerosol * exp(-altitude / AEROSOL_HEIGHT);
        let ozone = self.ozone * (1.0 - (altitude - OZONE_MIDDLE).abs() / OZONE_REACH).max(0.0);
        Here { rayleigh, aerosol: aerosol * AEROSOL_ALBEDO, extinction: rayleigh + aerosol + ozone }
    }

    /// Follows a path: `visit` gets the distance and altitude of steps' middles, the air there, and the integral over the step of the share
    /// of light that comes through to the path's begin, in km. Returns the share that comes through from its end.
    fn march(&self, path: &Path, length: f64, steps: usize, mut visit: impl FnMut(f64, f64, &Here, DVec3)) -> DVec3 {
        let mut through = DVec3::ONE;
        for (t, step) in finer_at_first(length, steps) {
            let altitude = path.altitude(t);
            let here = self.at(altitude);
            let depth = here.extinction * step;
            let passes = decay(depth);
            // (1 - e^-x) / x, which is 1 - x / 2 for a small x.
            let mean = |x: f64, passes: f64| if x > 1e-6 { (1.0 - passes) / x } else { 1.0 - 0.5 * x };
            let mean = DVec3::new(mean(depth.x, passes.x), mean(depth.y, passes.y), mean(depth.z, passes.z));
            visit(t, altitude, &here, through * mean * step);
            through *= passes;
        }
        through
    }

    /// Optical depth of all air along a path that does not meet the ground.
    fn depth(&self, path: &Path) -> DVec3 {
        if path.cosine >= 0.0 {
            return self.depth_upwards(path, path.to_top());
        }
        // Down to the lowest point and up again: twice upwards from there.
        let below = path.radius() * path.cosine;
        let lowest = Path::new(path.altitude(-below), 0.0);
        self.depth_upwards(&lowest, -below) + self.depth_upwards(&lowest, lowest.to_top())
    }

    fn depth_upwards(&self, path: &Path, length: f64) -> DVec3 {
        finer_at_first(length, DEPTH_STEPS).map(|(t, step)| self.at(path.altitude(t)).extinction * step).sum()
    }
}

/// Middles and lengths of steps that grow linearly.
fn finer_at_first(length: f64, steps: usize) -> impl Iterator<Item = (f64, f64)> {
    let end = move |i: usize| length * (i * i) as f64 / (steps * steps) as f64;
    (0..steps).map(move |i| (0.5 * (end(i) + end(i + 1)), end(i + 1) - end(i)))
}

/// A line of sight.
struct Path {
    /// Where it begins, at least 0.
    altitude: f64,
    /// Cosine of its angle to the zenith there.
    cosine: f64,
}

impl Path {
    fn new(altitude: f64, cosine: f64) -> Self {
        Self { altitude: altitude.max(0.0), cosine }
    }

    fn radius(&self) -> f64 {
        EARTH + self.altitude
    }

    /// Square of the distance to the Earth's middle, less that of the ground: nothing cancels.
    fn above_ground(&self, t: f64) -> f64 {
        self.altitude * (2.0 * EARTH + self.altitude) + t * (t + 2.0 * self.radius() * self.cosine)
    }

    fn altitude(&self, t: f64) -> f64 {
        let above = self.above_ground(t).max(0.0);
        above / (EARTH + (EARTH * EARTH + above).sqrt())
    }

    /// Cosine of the sun's angle to the zenith at a distance, from that at the begin and that of its angle to the path.
    fn sun(&self, t: f64, sun: f64, between: f64) -> f64 {
        let radius = (EARTH * EARTH + self.above_ground(t).max(0.0)).sqrt();
        ((self.radius() * sun + t * between) / radius).clamp(-1.0, 1.0)
    }

    fn to_top(&self) -> f64 {
        let along = self.radius() * self.cosine;
        let below_top = (TOP - self.altitude).max(0.0) * (2.0 * EARTH + TOP + self.altitude);
        (along * along + below_top).sqrt() - along
    }

    fn to_ground(&self) -> Option<f64> {
        let along = self.radius() * self.cosine;
        let discriminant = along * along - self.altitude * (2.0 * EARTH + self.altitude);
        (along < 0.0 && discriminant >= 0.0).then(|| (-along - discriminant.sqrt()).max(0.0))
    }
}

/// Cosine of the angle between zenith and horizon.
fn horizon(altitude: f64) -> f64 {
    -(altitude * (2.0 * EARTH + altitude)).sqrt() / (EARTH + altitude)
}

/// The share of the sun's disc above the horizon, nearly, by the cosine of its angle to the zenith.
fn risen(altitude: f64, cosine: f64) -> f64 {
    let share = ((cosine - horizon(altitude)) / SUN_SINE * 0.5 + 0.5).clamp(0.0, 1.0);
    share * share * (3.0 - 2.0 * share)
}

/// Distance to the horizon from the highest altitude.
fn farthest() -> f64 {
    (TOP * (2.0 * EARTH + TOP)).sqrt()
}

/// Of the table of optical depth, for directions above the horizon: by the distance to the top of the atmosphere between its shortest and
/// longest, and the distance to the horizon (Bruneton, "Precomputed Atmospheric Scattering: a New Implementation", 2017).
fn depth_coordinates(altitude: f64, cosine: f64) -> (f64, f64) {
    let path = Path::new(altitude, cosine);
    let to_horizon = path.above_ground(0.0).sqrt();
    let (shortest, longest) = ((TOP - altitude).max(0.0), to_horizon + farthest());
    ((path.to_top() - shortest) / (longest - shortest), to_horizon / farthest())
}

/// The inverse of [`depth_coordinates`].
fn depth_place(x: f64, y: f64) -> (f64, f64) {
    let to_horizon = y * farthest();
    let altitude = (to_horizon * to_horizon / (EARTH + (EARTH * EARTH + to_horizon * to_horizon).sqrt())).min(TOP);
    let (shortest, longest) = (TOP - altitude, to_horizon + farthest());
    let distance = shortest + x * (longest - shortest);
    if distance == 0.0 {
        return (altitude, 1.0);
    }
    let below_top = (TOP - altitude) * (2.0 * EARTH + TOP + altitude);
    let cosine = (below_top - distance * distance) / (2.0 * (EARTH + altitude) * distance);
    (altitude, cosine.clamp(horizon(altitude), 1.0))
}

/// e^-depth.
fn decay(depth: DVec3) -> DVec3 {
    DVec3::new(exp(-depth.x), exp(-depth.y), exp(-depth.z))
}

/// Colours on a grid over the unit square, interpolated bilinearly.
#[derive(Debug)]
struct Table {
    columns: usize,
    rows: usize,
    values: Vec<DVec3>,
}

impl Table {
    fn new(columns: usize, rows: usize, of: impl Fn(f64, f64) -> DVec3) -> Self {
        let at = |i: usize, n: usize| i as f64 / (n - 1).max(1) as f64;
        let values = (0..columns * rows).map(|i| of(at(i % columns, columns), at(i / columns, rows))).collect();
        Self { columns, rows, values }
    }

    fn at(&self, x: f64, y: f64) -> DVec3 {
        let split = |x: f64, n: usize| {
            let at = x.clamp(0.0, 1.0) * (n - 1) as f64;
            let before = (at as usize).min(n.saturating_sub(2));
            (before, (before + 1).min(n - 1), at - before as f64)
        };
        let ((left, right, along), (upper, lower, down)) = (split(x, self.columns), split(y, self.rows));
        let row = |y: usize| self.values[y * self.columns + left] * (1.0 - along) + self.values[y * self.columns + right] * along;
        row(upper) * (1.0 - down) + row(lower) * down
    }
}
