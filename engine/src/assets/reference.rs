//! Names of further files: which files a model needs, so that a client can collect them before it submits a job.

use percent_encoding::percent_decode_str;

use super::{AssetError, ModelFormat, gltf, mtl, obj};

/// The format that a file's name tells: `.glb`, `.gltf`, `.obj` or `.ply`, in any case.
pub fn model_format(file_name: &str) -> Option<ModelFormat> {
    let (_, ending) = file_name.rsplit_once('.')?;
    match ending.to_ascii_lowercase().as_str() {
        "glb" | "gltf" => Some(ModelFormat::Gltf),
        "obj" => Some(ModelFormat::Obj),
        "ply" => Some(ModelFormat::Ply),
        _ => None,
    }
}

/// Names of the files that a model file refers to, relative to its folder, sorted, each once: the names of [`crate::description::Model::parts`].
/// Only files that its picture needs are named: no occlusion maps, for instance.
///
/// Of each of them, [`part_references`] may name more. An OBJ file is read, with a warning, even where the libraries and textures that it
/// names are left out of its parts; a glTF file needs all of them.
///
/// # Errors
/// The file cannot be read, or a name leaves the model's folder.
pub fn model_references(format: ModelFormat, bytes: &[u8]) -> Result<Vec<String>, AssetError> {
    let names = match format {
        ModelFormat::Gltf => gltf::references(bytes)?,
        ModelFormat::Obj => obj::references(bytes)?,
        ModelFormat::Ply => Vec::new(),
    };
    Ok(sorted(names))
}

/// Names of the files that a model's part refers to (textures of an MTL file; other parts refer to none), relative to the *model's*
/// folder, sorted, each once. `name` is the part's own name, as [`model_references`] gave it.
///
/// # Errors
/// The file cannot be read, or a name leaves the model's folder.
pub fn part_references(name: &str, bytes: &[u8]) -> Result<Vec<String>, AssetError> {
    match name.rsplit_once('.') {
        Some((_, ending)) if ending.eq_ignore_ascii_case("mtl") => Ok(sorted(mtl::references(name, bytes)?)),
        _ => Ok(Vec::new()),
    }
}

fn sorted(mut names: Vec<String>) -> Vec<String> {
    names.sort();
    names.dedup();
    names
}

/// The file that a URI names: percent-decoded, relative to the model's folder.
pub(super) fn uri_name(uri: &str) -> Result<String, AssetError> {
    if uri.contains("://") {
        return Err(AssetError::new(format!("refers to {uri:?}, which is not a file beside it"))
            .with_help("download that file, put it beside the model and refer to it by its name"));
    }
    let decoded = percent_decode_str(uri).decode_utf8();
    let name = decoded.map_err(|_| AssetError::new(format!("refers to {uri:?}, which is not UTF-8 text")))?;
    relative_name(&name)
}

/// A file name as one file writes it of another: with forward slashes, without `.` and `..`.
///
/// # Errors
/// It is empty, absolute, or leaves the model's folder.
pub(super) fn relative_name(name: &str) -> Result<String, AssetError> {
    let refused = |why: &str| {
        let message = format!("refers to a file {name:?}, which {why}");
        Err(AssetError::new(message).with_help("put the file into the model's folder and refer to it by its name there"))
    };
    let slashed = name.replace('\\', "/");
    if slashed.starts_with('/') || slashed.as_bytes().get(1) == Some(&b':') {
        return refused("is an absolute path");
    }
    if slashed.contains('\0') {
        return refused("no file can be called");
    }
    let mut parts: Vec<&str> = Vec::new();
    for part in slashed.split('/') {
        match part {
            "" | "." => {}
            ".." if parts.pop().is_none() => return refused("is outside of the model's folder"),
            ".." => {}
            _ => parts.push(part),
        }
    }
    if parts.is_empty() { refused("is no name") } else { Ok(parts.join("/")) }
}

/// The name, relative to the model's folder, of a file that the file `of` refers to relative to its own place.
pub(super) fn name_beside(of: &str, name: &str) -> Result<String, AssetError> {
    let absolute = name.starts_with(['/', '\\']) || name.as_bytes().get(1) == Some(&b':');
    match of.rsplit_once('/') {
        Some((folder, _)) if !absolute => relative_name(&format!("{folder}/{name}")),
        _ => relative_name(name),
    }
}
