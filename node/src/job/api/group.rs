//! Groups of objects, and their instances.

use std::sync::Arc;

use mlua::Value;

use super::{Form, Function, transform};
use crate::{
    job::{
        handle::{GroupNode, NodeKind, ObjectNode, Thing},
        keys::{Field, Keys},
    },
    limits,
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "group", form: Form::List, keys: &["name"], make: group },
    Function { path: "instance", form: Form::Table, keys: &["group", "transform", "name"], make: instance },
];

fn group(keys: &Keys) -> mlua::Result<Value> {
    let objects = keys.items()?.iter().map(object).collect::<mlua::Result<Vec<_>>>()?;
    let depth = 1 + objects.iter().map(|object| object.depth()).max().unwrap_or(0);
    if depth > limits::SCRIPT_GROUP_DEPTH {
        return Err(keys.fault(format!("more than {} groups within groups", limits::SCRIPT_GROUP_DEPTH)).into());
    }
    keys.make(|_| Thing::Group(Arc::new(GroupNode { objects, depth })))
}

fn instance(keys: &Keys) -> mlua::Result<Value> {
    let group = keys.required("group")?.thing("a group (tessera.group)", |handle| match &handle.thing {
        Thing::Group(group) => Some(Arc::clone(group)),
        _ => None,
    })?;
    let transform = transform::optional(keys, "transform")?;
    keys.make(|source| Thing::Object(Arc::new(ObjectNode { kind: NodeKind::Instance { group }, transform, source })))
}

/// An object of a list; a group stands for itself at its own place.
pub fn object(field: &Field) -> mlua::Result<Arc<ObjectNode>> {
    field
        .thing("an object (a shape, model, group or instance)", |handle| match &handle.thing {
            Thing::Object(object) => Some(Arc::clone(object)),
            Thing::Group(group) => {
                let kind = NodeKind::Instance { group: Arc::clone(group) };
                Some(Arc::new(ObjectNode { kind, transform: None, source: handle.source }))
            }
            _ => None,
        })
        .map_err(|error| elsewhere(field, error))
}

/// Lights are a likely thing to put among objects.
fn elsewhere(field: &Field, error: mlua::Error) -> mlua::Error {
    let is_light = field.thing("", |handle| matches!(handle.thing, Thing::Light(_)).then_some(())).is_ok();
    if is_light { field.wrong("an object (a shape, model, group or instance)").with_help("lights go into `lights`").into() } else { error }
}
