//! The Lua API: one file a concept. [`FUNCTIONS`] is the table of contents; annotations and reference are held to it by tests.

mod camera;
mod color;
mod environment;
mod group;
mod frames;
mod job;
mod light;
mod material;
mod medium;
mod mesh;
mod metallic_roughness;
mod model;
mod param;
mod plan;
mod random;
mod render;
mod scene;
mod shape;
mod texture;
pub mod transform;

use mlua::{Lua, MultiValue, Table, Value};

use super::{
    fault::Fault,
    keys::{Keys, nearest},
    place::Place,
};

pub use frames::PARAMETER as FRAME_PARAMETER;
#[cfg(test)]
pub use random::METHODS;

/// A function of the API.
pub struct Function {
    /// Its name under `tessera`: `sphere`, `split.grid`.
    pub path: &'static str,
    /// How it is called.
    pub form: Form,
    /// Its keys, or its parameters in order.
    pub keys: &'static [&'static str],
    make: fn(&Keys) -> mlua::Result<Value>,
}

/// How a function is called.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Form {
    /// With one table of keys.
    Table,
    /// With one table of keys and a list.
    List,
    /// With values in order.
    Positional,
    /// Not at all: it is a value.
    Value,
}

/// All functions of the API, in the order of the reference.
pub const FUNCTIONS: &[&[Function]] = &[
    job::FUNCTIONS,
    scene::FUNCTIONS,
    shape::FUNCTIONS,
    mesh::FUNCTIONS,
    model::FUNCTIONS,
    group::FUNCTIONS,
    transform::FUNCTIONS,
    material::FUNCTIONS,
    metallic_roughness::FUNCTIONS,
    medium::FUNCTIONS,
    texture::FUNCTIONS,
    color::FUNCTIONS,
    light::FUNCTIONS,
    environment::FUNCTIONS,
    camera::FUNCTIONS,
    render::FUNCTIONS,
    plan::FUNCTIONS,
    random::FUNCTIONS,
    param::FUNCTIONS,
];

/// Tables of keys within a job, by the key that holds them.
#[cfg(test)]
pub const JOB_TABLES: &[(&str, &[&str])] = job::TABLES;

/// The table that `require("tessera")` returns.
pub fn table(lua: &Lua) -> mlua::Result<Table> {
    let root = lua.create_table()?;
    for function in FUNCTIONS.iter().copied().flatten() {
        let value = match function.form {
            Form::Value => (function.make)(&Keys::of_list(lua, function.path, function.keys, MultiValue::new())?)?,
            _ => Value::Function(lua.create_function(|lua, arguments: MultiValue| call(function, lua, arguments))?),
        };
        match function.path.split_once('.') {
            Some((inner, name)) => inner_table(lua, &root, inner)?.raw_set(name, value)?,
            None => root.raw_set(function.path, value)?,
        }
    }
    for inner in root.pairs::<Value, Value>().filter_map(|pair| pair.ok()?.1.as_table().cloned()) {
        freeze(lua, &inner, "this table of tessera")?;
    }
    freeze(lua, &root, "tessera")?;
    Ok(root)
}

fn call(function: &'static Function, lua: &Lua, arguments: MultiValue) -> mlua::Result<Value> {
    let keys = match function.form {
        Form::Table | Form::List => Keys::of_table(lua, function.path, function.keys, function.form == Form::List, arguments)?,
        Form::Positional | Form::Value => Keys::of_list(lua, function.path, function.keys, arguments)?,
    };
    (function.make)(&keys)
}

fn inner_table(lua: &Lua, root: &Table, name: &str) -> mlua::Result<Table> {
    match root.raw_get::<Value>(name)? {
        Value::Table(table) => Ok(table),
        _ => {
            let table = lua.create_table()?;
            root.raw_set(name, &table)?;
            Ok(table)
        }
    }
}

/// Makes a table of the API read-only, and unknown names in it faults.
fn freeze(lua: &Lua, table: &Table, what: &'static str) -> mlua::Result<()> {
    let mut names: Vec<String> = table.pairs::<String, Value>().filter_map(|pair| Some(pair.ok()?.0)).collect();
    names.sort();
    let index = lua.create_function(move |lua, (_, name): (Value, Value)| -> mlua::Result<Value> {
        let name = name.to_string()?;
        let fault: Fault = Place::of_running(lua).fault(format!("{what} has no `{name}`"));
        let help = match nearest(&name, names.iter().map(String::as_str)) {
            Some(near) => format!("did you mean `{near}`?"),
            None => format!("it has {}", names.join(", ")),
        };
        Err(fault.with_help(help).into())
    })?;
    let meta = lua.create_table()?;
    meta.raw_set("__index", index)?;
    meta.raw_set("__metatable", false)?;
    table.set_metatable(Some(meta))?;
    table.set_readonly(true);
    Ok(())
}
