//! Models: files that were made elsewhere, with all files that they refer to.

use std::{path::PathBuf, sync::Arc};

use mlua::Value;
use tessera_engine::{
    assets::{model_format, model_references, part_references},
    description::{AssetId, Model, ModelFormat},
};

use super::{Form, Function, material, transform};
use crate::job::{
    context::{Context, Files, read_bounded},
    handle::{NodeKind, ObjectNode, Thing},
    keys::{Field, Keys},
    modules::real,
};

pub const FUNCTIONS: &[Function] =
    &[Function { path: "model", form: Form::Table, keys: &["file", "material", "transform", "name"], make: model }];

fn model(keys: &Keys) -> mlua::Result<Value> {
    let file = keys.required("file")?;
    let name = file.text()?;
    let format = model_format(&name).ok_or_else(|| file.wrong("a model file (.glb, .gltf, .obj or .ply)"))?;
    let material = material::optional(keys, "material")?;
    let transform = transform::optional(keys, "transform")?;
    let (path, id) = asset(&file, &name)?;
    let parts = path.map_or(Ok(Vec::new()), |path| parts(&file, format, id, &path))?;
    let model = Model { format, file: id, parts };
    keys.make(|source| Thing::Object(Arc::new(ObjectNode { kind: NodeKind::Model { model, material }, transform, source })))
}

/// Reads a file that a script names. Where no file is read, an id that stands for none.
pub fn asset(field: &Field, name: &str) -> mlua::Result<(Option<PathBuf>, AssetId)> {
    let mut context = Context::of(field.keys.lua)?;
    if matches!(context.files, Files::Inert) {
        return Ok((None, AssetId::of(&[])));
    }
    let fault = |what| {
        let fault = field.keys.fault(what);
        fault.with_help(
            "paths are relative to the folder of the Lua file that names them; a project is what lies below the nearest folder above the script that holds .luaurc or .git",
        )
    };
    let (path, bytes) = context.read(&field.keys.place.file, name).map_err(fault)?;
    let id = context.keep(bytes).map_err(|what| field.keys.fault(what))?;
    Ok((Some(path), id))
}

/// The files that a model refers to, and those that they refer to: all lie in the model's folder or below.
fn parts(field: &Field, format: ModelFormat, model: AssetId, path: &std::path::Path) -> mlua::Result<Vec<(String, AssetId)>> {
    use tessera_engine::description::AssetSource;
    let mut context = Context::of(field.keys.lua)?;
    let file_name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
    let bytes = context.assets.bytes(model).unwrap_or_default();
    let wrong = |name: &str, error: &dyn std::fmt::Display| field.keys.fault(format!("{name}: {error}"));
    let mut wanted = model_references(format, &bytes).map_err(|error| wrong(&file_name, &error))?;
    let mut parts: Vec<(String, AssetId)> = Vec::new();
    let folder = path.parent().unwrap_or(path);
    while let Some(name) = wanted.pop() {
        if parts.iter().any(|(known, _)| *known == name) {
            continue;
        }
        let bytes = read_part(folder, &name, parts.len()).map_err(|error| wrong(&file_name, &error))?;
        wanted.extend(part_references(&name, &bytes).map_err(|error| wrong(&name, &error))?);
        let id = context.keep(bytes).map_err(|error| wrong(&file_name, &error))?;
        parts.push((name, id));
    }
    parts.sort();
    Ok(parts)
}

fn read_part(folder: &std::path::Path, name: &str, known: usize) -> Result<Vec<u8>, String> {
    if known >= crate::limits::MODEL_PARTS {
        return Err(format!("it refers to more than {} files", crate::limits::MODEL_PARTS));
    }
    let path = real(&folder.join(name))?;
    if !path.starts_with(folder) {
        return Err(format!("the file {name:?} lies outside the model's folder"));
    }
    read_bounded(&path, crate::limits::SCRIPT_ASSET_BYTES)
}
