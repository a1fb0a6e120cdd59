//! Lights, compiled: each kind in a file of its own, and which of many to look at.

mod area;
mod caustics;
mod choice;
mod delta;
mod environment;
mod sky;
mod tree;

use glam::DVec3;

pub use self::{
    area::{Area, Emitter, EmitterSample},
    caustics::{Begin, Caustics, Departing, Photon, Region, Sources},
    choice::{Arriving, LightSampler, Vertex},
    delta::{Light, LightSample},
    environment::{Environment, ImageEnvironment, turned},
    sky::SunSky,
};

use crate::description;

fn rgb(color: description::Rgb) -> DVec3 {
    DVec3::new(color[0].into(), color[1].into(), color[2].into())
}

/// Luminance of a linear Rec. 709 colour (ITU-R BT.709-6, 3.2).
pub fn luminance(color: DVec3) -> f64 {
    0.2126 * color.x + 0.7152 * color.y + 0.0722 * color.z
}
