//! Scenes.

use std::{cell::Cell, sync::Arc};

use mlua::Value;
use tessera_engine::description::Environment;

use super::{Form, Function, environment, group, medium};
use crate::job::{
    fault::Fault,
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
    let is_shape = Cell::new(false);
    let light = field.thing("a light (tessera.point, spot or directional)", |handle| {
        is_shape.set(matches!(handle.thing, Thing::Object(_)));
        if let Thing::Light(light) = &handle.thing { Some(light.clone()) } else { None }
    });
    light.map_err(|error| {
        if is_shape.get() { Fault::from(&error).with_help("shapes stand in `objects`, also those that shine").into() } else { error }
    })
}
