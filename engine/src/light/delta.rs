//! Lights without extent, compiled for sampling from a point.

use glam::DVec3;

use super::rgb;
use crate::{
    description::{self, Falloff},
    math::{cos, max_abs, sin},
};
use std::f64::consts::PI;

/// A light source without extent: a point sees it in one direction alone.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Light {
    /// Shines from a point to all sides.
    Point {
        /// Position.
        position: DVec3,
        /// With fall-off, radiant intensity; without, the irradiance of a surface that faces the light at any distance.
        strength: DVec3,
        /// Whether irradiance weakens with the square of the distance.
        falloff: bool,
    },
    /// Shines from infinitely far away.
    Directional {
        /// Unit vector towards the light.
        towards: DVec3,
        /// Irradiance of a surface that faces the light.
        irradiance: DVec3,
        /// The squared sine of half the angle across which it is spread; 0 for none.
        spread: f64,
    },
    /// Shines from a point into a cone.
    Spot {
        /// Position.
        position: DVec3,
        /// Unit vector along its middle.
        axis: DVec3,
        /// Radiant intensity inside the inner cone.
        intensity: DVec3,
        /// Cosines of the angles between the axis and the borders of the inner and of the outer cone; the second is not above the first.
        cosines: [f64; 2],
    },
}

/// What a point receives from a light where nothing stands between.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightSample {
    /// Unit vector from the point towards the light.
    pub direction: DVec3,
    /// Distance to the light; infinite for a directional one.
    pub distance: f64,
    /// Irradiance of a surface at the point that faces the light: a diffuse surface of albedo a shows `a / pi * irradiance * cos`.
    pub irradiance: DVec3,
}

impl Light {
    /// Prepares a light of the description.
    pub fn compile(light: &description::Light) -> Self {
        match light {
            description::Light::Point { position, intensity, falloff, .. } => {
                let (scale, falloff) = match falloff {
                    Falloff::InverseSquare => (1.0, true),
                    // Radiance `intensity` of a white diffuse surface means irradiance `pi intensity`.
                    Falloff::None => (PI, false),
                };
                Self::Point { position: DVec3::from(*position), strength: rgb(*intensity) * scale, falloff }
            }
            description::Light::Directional { direction, irradiance, angle, .. } => {
                let half = angle.to_radians() * 0.5;
                Self::Directional { towards: -unit(*direction), irradiance: rgb(*irradiance), spread: sin(half) * sin(half) }
            }
            description::Light::Spot { position, direction, intensity, inner, outer, .. } => Self::Spot {
                position: DVec3::from(*position),
                axis: unit(*direction),
                intensity: rgb(*intensity),
                cosines: [*inner, *outer].map(|angle| cos(angle.to_radians())),
            },
        }
    }

    /// A disc at infinity of this radiance, seen under an angle of twice `radius` radians.
    pub fn disc(towards: DVec3, radiance: DVec3, radius: f64) -> Self {
        let spread = sin(radius) * sin(radius);
        Self::Directional { towards, irradiance: radiance * (PI * spread), spread }
    }

    /// The same light elsewhere.
    pub fn moved(self, by: DVec3) -> Self {
        match self {
            Self::Point { position, strength, falloff } => Self::Point { position: position + by, strength, falloff },
            Self::Spot { position, axis, intensity, cosines } => Self::Spot { position: position + by, axis, intensity, cosines },
            Self::Directional { .. } => self,
        }
    }

    /// Where it stands; `None` if infinitely far away.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } | Self::Spot { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }

    /// The light as `point` sees it. A point on the light itself receives nothing.
    #[inline(always)]
    pub fn sample(&self, point: DVec3) -> LightSample {
        match *self {
            Self::Point { position, strength, falloff } => {
                let Some((direction, distance, inverse)) = way(position - point) else { return LightSample::NOTHING };
                let irradiance = if falloff { strength * (inverse * inverse) } else { strength };
                LightSample { direction, distance, irradiance }
            }
            Self::Directional { towards, irradiance, .. } => LightSample { direction: towards, distance: f64::INFINITY, irradiance },
            Self::Spot { position, axis, intensity, cosines } => {
                let Some((direction, distance, inverse)) = way(position - point) else { return LightSample::NOTHING };
                LightSample { direction, distance, irradiance: intensity * (share(-direction.dot(axis), cosines) * inverse * inverse) }
            }
        }
    }

    /// What it gives off in all, as far as that is finite (without [`Falloff::InverseSquare`], and from infinitely far away, it is not).
    pub fn power(&self) -> Option<DVec3> {
        match *self {
            Self::Point { strength, falloff: true, .. } => Some(strength * (4.0 * PI)),
            // The smooth border counts half.
            Self::Spot { intensity, cosines: [inner, outer], .. } => Some(intensity * (PI * (2.0 - inner - outer))),
            Self::Point { .. } | Self::Directional { .. } => None,
        }
    }
}

impl LightSample {
    /// What a point on the light itself receives.
    const NOTHING: Self = Self { direction: DVec3::Y, distance: 0.0, irradiance: DVec3::ZERO };
}

/// Direction, distance, and its reciprocal; `None` for 0.
#[inline(always)]
fn way(to_light: DVec3) -> Option<(DVec3, f64, f64)> {
    let squared = to_light.length_squared();
    if squared == 0.0 {
        return None;
    }
    let distance = squared.sqrt();
    let inverse = 1.0 / distance;
    Some((to_light * inverse, distance, inverse))
}

/// The share of a spot light's intensity at this cosine from its axis: from 1 at the inner cone it falls smoothly to 0 at the outer one, by the polynomial 3 x^2 - 2 x^3 of
/// the cosine (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 12.2.1).
fn share(cos: f64, [inner, outer]: [f64; 2]) -> f64 {
    if cos >= inner {
        return 1.0;
    }
    if cos <= outer {
        return 0.0;
    }
    let x = (cos - outer) / (inner - outer);
    x * x * (3.0 - 2.0 * x)
}

fn unit(v: [f64; 3]) -> DVec3 {
    let v = DVec3::from(v);
    (v / max_abs(v)).normalize()
}
