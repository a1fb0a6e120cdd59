//! Scenes.

use std::sync::Arc;

use mlua::Value;

use super::{Form, Function, group};
use crate::job::{
    handle::{SceneNode, Thing},
    keys::{Field, Keys},
};

pub const FUNCTIONS: &[Function] =
    &[Function { path: "scene", form: Form::Table, keys: &["objects", "lights", "background", "name"], make: scene }];

const BRIGHTEST: f64 = 1e30;

fn scene(keys: &Keys) -> mlua::Result<Value> {
    let objects = keys.required("objects")?.list()?.iter().map(group::object).collect::<mlua::Result<Vec<_>>>()?;
    let lights = keys.or("lights", Vec::new(), |field| field.list()?.iter().map(light).collect())?;
    let background = keys.or("background", [0.0; 3], |field| field.color(BRIGHTEST))?;
    keys.make(|_| Thing::Scene(Arc::new(SceneNode { objects, lights, background })))
}

fn light(field: &Field) -> mlua::Result<tessera_engine::description::Light> {
    field.thing("a light (tessera.point or tessera.directional)", |handle| match &handle.thing {
        Thing::Light(light) => Some(light.clone()),
        _ => None,
    })
}
