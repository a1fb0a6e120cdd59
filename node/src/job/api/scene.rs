//! Scenes.

use std::sync::Arc;

use mlua::Value;
use tessera_engine::description::Environment;

use super::{Form, Function, environment, group, medium};
use crate::job::{
    handle::{SceneNode, Thing},
    keys::{Field, Keys},
};

pub const FUNCTIONS: &[Function] =
    &[Function { path: "scene", form: Form::Table, keys: &["objects", "lights", "background", "medium", "name"], make: scene }];

fn scene(keys: &Keys) -> mlua::Result<Value> {
    let objects = keys.required("objects")?.list()?.iter().map(group::object).collect::<mlua::Result<Vec<_>>>()?;
    let lights = keys.or("lights", Vec::new(), |field| field.list()?.iter().map(light).collect())?;
    let background = keys.or("background", Environment::default(), |field| environment::read(&field))?;
    let medium = medium::optional(keys, "medium")?;
    keys.make(|_| Thing::Scene(Arc::new(SceneNode { objects, lights, background, medium })))
}

fn light(field: &Field) -> mlua::Result<tessera_engine::description::Light> {
    field.thing("a light (tessera.point, spot or directional)", |handle| match &handle.thing {
        Thing::Light(light) => Some(light.clone()),
        _ => None,
    })
}
