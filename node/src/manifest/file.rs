//! Manifests as files.

use std::path::Path;

use super::{Manifest, VERSION};
use crate::{
    error::{Error, ExitCode, Result},
    files, limits,
};

const HELP: &str = "name the .manifest.json that stands beside the picture";

/// Reads a manifest.
///
/// # Errors
/// [`ExitCode::File`] where the file cannot be read, is no manifest, or is of another version.
pub fn read(path: &Path) -> Result<Manifest> {
    let name = path.display().to_string();
    let unreadable = |error: std::io::Error| {
        let why = match error.kind() {
            std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
            std::io::ErrorKind::InvalidData => "not a manifest, nor text at all".to_owned(),
            _ => error.to_string(),
        };
        Error::new(ExitCode::File, format!("{name}: cannot be read: {why}")).with_help(HELP)
    };
    let length = std::fs::metadata(path).map_err(unreadable)?.len();
    if length > limits::MANIFEST_BYTES {
        return Err(Error::new(
            ExitCode::File,
            format!("{name}: {length} bytes are more than a manifest can have ({})", limits::MANIFEST_BYTES),
        )
        .with_help(HELP));
    }
    parse(&name, &std::fs::read_to_string(path).map_err(unreadable)?)
}

/// Reads a manifest from its text; `name` is the file's name for messages.
///
/// # Errors
/// As [`read`].
pub fn parse(name: &str, text: &str) -> Result<Manifest> {
    // The version first: a manifest of another version would be blamed for its first unknown key.
    #[derive(serde::Deserialize)]
    struct Version {
        version: u32,
    }
    let wrong = |error: serde_json::Error| {
        Error::new(ExitCode::File, format!("{name}:{}:{}: not a manifest: {error}", error.line(), error.column())).with_help(HELP)
    };
    let Version { version } = serde_json::from_str(text).map_err(wrong)?;
    if version != VERSION {
        return Err(Error::new(ExitCode::File, format!("{name}: manifest of version {version}, but this program reads version {VERSION}"))
            .with_help("use the program that wrote it: its version stands under \"program\""));
    }
    serde_json::from_str(text).map_err(wrong)
}

/// Writes a manifest, whole or not at all.
///
/// # Errors
/// [`ExitCode::File`] where the folder or the disk refuses.
pub fn write(path: &Path, manifest: &Manifest) -> Result<()> {
    files::write_whole(path, to_json(manifest)?.as_bytes())
}

/// The text of a manifest.
///
/// # Errors
/// None in practice: a manifest holds no type that JSON cannot code.
pub fn to_json(manifest: &Manifest) -> Result<String> {
    let text = serde_json::to_string_pretty(manifest);
    text.map(|text| text + "\n").map_err(|error| Error::new(ExitCode::Internal, format!("the manifest cannot be coded: {error}")))
}

/// The JSON Schema (2020-12) of manifests, made from the types; published as `schema.json` beside this file.
pub fn schema() -> serde_json::Value {
    schemars::schema_for!(Manifest).to_value()
}
