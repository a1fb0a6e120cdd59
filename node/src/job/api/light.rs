//! Lights.

use mlua::Value;
use tessera_engine::description::{Falloff, Light};

use super::{Form, Function};
use crate::job::{handle::Thing, keys::Keys};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "point", form: Form::Table, keys: &["position", "intensity", "falloff", "name"], make: point },
    Function { path: "directional", form: Form::Table, keys: &["direction", "irradiance", "name"], make: directional },
];

/// Radiance has no physical bound; this keeps sums of it finite in single precision.
const BRIGHTEST: f64 = 1e30;

fn point(keys: &Keys) -> mlua::Result<Value> {
    let position = keys.required("position")?.vec3()?;
    let intensity = keys.required("intensity")?.color(BRIGHTEST)?;
    let falloffs = [("inverse_square", Falloff::InverseSquare), ("none", Falloff::None)];
    let falloff = keys.or("falloff", Falloff::InverseSquare, |field| field.choice(&falloffs))?;
    keys.make(|source| Thing::Light(Light::Point { position, intensity, falloff, source }))
}

fn directional(keys: &Keys) -> mlua::Result<Value> {
    let direction = keys.required("direction")?.direction()?;
    let irradiance = keys.required("irradiance")?.color(BRIGHTEST)?;
    keys.make(|source| Thing::Light(Light::Directional { direction, irradiance, source }))
}
