//! Lights.

use mlua::Value;
use tessera_engine::description::{Falloff, Light};

use super::{Form, Function, material::BRIGHTEST};
use crate::job::{
    handle::Thing,
    keys::{Keys, Range},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "point", form: Form::Table, keys: &["position", "intensity", "falloff", "name"], make: point },
    Function { path: "directional", form: Form::Table, keys: &["direction", "irradiance", "angle", "name"], make: directional },
    Function {
        path: "spot",
        form: Form::Table,
        keys: &["position", "direction", "look_at", "intensity", "inner", "outer", "name"],
        make: spot,
    },
];

const ANGLE: Range = Range { lowest: 0.0, highest: 179.999, open: false, words: "degrees from 0 to below 180" };
const CONE: Range = Range { lowest: 0.0, highest: 180.0, open: false, words: "degrees above 0, up to 180" };

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
    let angle = keys.or("angle", 0.0, |field| field.number(ANGLE))?;
    keys.make(|source| Thing::Light(Light::Directional { direction, irradiance, angle, source }))
}

/// By a direction or by a place that it shines on.
fn spot(keys: &Keys) -> mlua::Result<Value> {
    let position = keys.required("position")?.vec3()?;
    let direction = match (keys.optional("direction")?, keys.optional("look_at")?) {
        (Some(direction), None) => direction.direction()?,
        (None, Some(at)) => {
            let look_at = at.vec3()?;
            if look_at == position {
                return Err(at.fault("must differ from `position`").into());
            }
            std::array::from_fn(|axis| look_at[axis] - position[axis])
        }
        _ => return Err(keys.fault("needs `direction` or `look_at`, one of them").into()),
    };
    let intensity = keys.required("intensity")?.color(BRIGHTEST)?;
    let outer = keys.or("outer", 30.0, |field| field.number(CONE))?;
    let inner = keys.or("inner", outer * 0.8, |field| field.number(ANGLE))?;
    if inner > outer {
        return Err(keys.fault("`inner` must not be above `outer`").into());
    }
    keys.make(|source| Thing::Light(Light::Spot { position, direction, intensity, inner, outer, source }))
}
