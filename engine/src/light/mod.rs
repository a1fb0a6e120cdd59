//! Lights, compiled for sampling from a point.

use glam::DVec3;

use crate::description::{self, Falloff};
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
            description::Light::Directional { direction, irradiance, .. } => {
                Self::Directional { towards: -DVec3::from(*direction).normalize(), irradiance: rgb(*irradiance) }
            }
        }
    }

    /// The same light elsewhere.
    pub fn moved(self, by: DVec3) -> Self {
        match self {
            Self::Point { position, strength, falloff } => Self::Point { position: position + by, strength, falloff },
            Self::Directional { .. } => self,
        }
    }

    /// Where it stands; `None` if infinitely far away.
    pub fn position(&self) -> Option<DVec3> {
        match *self {
            Self::Point { position, .. } => Some(position),
            Self::Directional { .. } => None,
        }
    }

    /// The light as `point` sees it. A point on the light itself receives nothing.
    #[inline(always)]
    pub fn sample(&self, point: DVec3) -> LightSample {
        match *self {
            Self::Point { position, strength, falloff } => {
                let to_light = position - point;
                let squared = to_light.length_squared();
                if squared == 0.0 {
                    return LightSample { direction: DVec3::Y, distance: 0.0, irradiance: DVec3::ZERO };
                }
                let distance = squared.sqrt();
                let inverse = 1.0 / distance;
                let irradiance = if falloff { strength * (inverse * inverse) } else { strength };
                LightSample { direction: to_light * inverse, distance, irradiance }
            }
            Self::Directional { towards, irradiance } => LightSample { direction: towards, distance: f64::INFINITY, irradiance },
        }
    }
}

fn rgb(color: description::Rgb) -> DVec3 {
    DVec3::new(color[0].into(), color[1].into(), color[2].into())
}
