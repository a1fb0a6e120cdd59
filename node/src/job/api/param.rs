//! Parameters: values that the user gives with `--set name=value`.

use mlua::Value;

use super::{Form, Function};
use crate::job::{
    context::{Context, Files},
    keys::{Field, Keys},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "param", form: Form::Positional, keys: &["name", "default"], make: param },
    Function { path: "param_file", form: Form::Positional, keys: &["name", "default"], make: param_file },
];

/// A value of the default's type; without a default, a text that must be given.
fn param(keys: &Keys) -> mlua::Result<Value> {
    let default = keys.optional("default")?;
    match (declare(keys)?, default) {
        (Some((name, text)), Some(default)) => parse(keys, &name, &text, &default),
        (Some((_, text)), None) => keys.lua.create_string(text).map(Value::String),
        (None, Some(default)) => typed(&default).map(|()| default.value),
        (None, None) => Err(missing(keys)?),
    }
}

/// A file: given with `--set` it is relative to the working directory, the default to the folder of the Lua file.
fn param_file(keys: &Keys) -> mlua::Result<Value> {
    let default = keys.or("default", None, |field| field.text().map(Some))?;
    let Some((name, text)) = declare(keys)? else {
        return match default {
            Some(default) => keys.lua.create_string(default).map(Value::String),
            None => Err(missing(keys)?),
        };
    };
    let mut context = Context::of(keys.lua)?;
    let path = match context.files {
        Files::Inert => text,
        Files::Disk => {
            let fault = |what| {
                keys.fault(format!("--set {name}={text}: {what}"))
                    .with_help("paths on the command line are relative to the working directory")
            };
            context.modules.grant(&text).map_err(fault)?.display().to_string()
        }
    };
    keys.lua.create_string(path).map(Value::String)
}

/// Notes that the script knows a parameter, and returns what was given for it.
fn declare(keys: &Keys) -> mlua::Result<Option<(String, String)>> {
    let name = keys.required("name")?.text()?;
    let mut context = Context::of(keys.lua)?;
    context.declared.push(name.clone());
    Ok(context.given.get(&name).map(|text| (name, text.clone())))
}

fn missing(keys: &Keys) -> mlua::Result<mlua::Error> {
    let name = keys.required("name")?.text()?;
    Ok(keys.fault(format!("the job needs a value for `{name}`")).with_help(format!("give it with --set {name}=VALUE")).into())
}

fn typed(default: &Field) -> mlua::Result<()> {
    match default.value {
        Value::Number(_) | Value::Integer(_) | Value::Boolean(_) | Value::String(_) => Ok(()),
        _ => Err(default.wrong("a number, true, false or a text").into()),
    }
}

fn parse(keys: &Keys, name: &str, text: &str, default: &Field) -> mlua::Result<Value> {
    typed(default)?;
    let wrong = |expected: &str| keys.fault(format!("--set {name}={text}: must be {expected}")).into();
    match default.value {
        Value::Number(_) | Value::Integer(_) => {
            let number = text.trim().parse::<f64>().ok().filter(|number| number.is_finite());
            number.map(Value::Number).ok_or_else(|| wrong("a number"))
        }
        Value::Boolean(_) => text.trim().parse().map(Value::Boolean).map_err(|_| wrong("true or false")),
        _ => keys.lua.create_string(text).map(Value::String),
    }
}
