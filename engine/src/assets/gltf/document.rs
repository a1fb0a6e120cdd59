//! The container and its JSON: what the file says, before any of it is believed.

use std::borrow::Cow;

use gltf::{
    binary::{Error as GlbError, Glb},
    json::{Index, Root},
};
use serde::Deserialize;

use super::AssetError;

/// Extensions without which a file is still read right, or that only describe looks which a warning names.
const READABLE: [&str; 4] = ["KHR_texture_transform", "KHR_mesh_quantization", "KHR_lights_punctual", "KHR_xmp_json_ld"];

/// Extensions of which no warning is needed because they are there.
pub(super) const MODELLED: [&str; 13] = [
    "KHR_lights_punctual",
    "KHR_materials_anisotropy",
    "KHR_materials_clearcoat",
    "KHR_materials_emissive_strength",
    "KHR_materials_ior",
    "KHR_materials_sheen",
    "KHR_materials_specular",
    "KHR_materials_transmission",
    "KHR_materials_volume",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
    "KHR_xmp_json_ld",
    // Each material that asks for it is named.
    "KHR_materials_unlit",
];

/// A glTF file, taken apart.
pub(super) struct Document<'a> {
    /// Its JSON.
    pub root: Root,
    /// The binary chunk of a `.glb`.
    pub bin: Option<&'a [u8]>,
}

/// What must be known before the rest is read, because an extension may change what the rest looks like.
#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct Preamble {
    #[serde(default)]
    extensions_required: Vec<String>,
}

impl<'a> Document<'a> {
    /// Parses a `.glb` or a `.gltf`, told apart by its first bytes.
    pub fn parse(bytes: &'a [u8]) -> Result<Self, AssetError> {
        let (json, bin) = if bytes.starts_with(b"glTF") { chunks(bytes)? } else { (bytes, None) };
        let preamble: Preamble = serde_json::from_slice(json).map_err(|e| bad_json(&e))?;
        check_required(&preamble.extensions_required)?;
        let root = Root::from_slice(json).map_err(|e| bad_json(&e))?;
        Ok(Self { root, bin })
    }
}

/// The JSON and the binary chunk of a `.glb`.
fn chunks(bytes: &[u8]) -> Result<(&[u8], Option<&[u8]>), AssetError> {
    // The crate subtracts the header's 12 bytes from the length that it reads there.
    match bytes.get(8..12).and_then(|length| length.try_into().ok()).map(u32::from_le_bytes) {
        Some(12..) => {}
        _ => return Err(AssetError::new("glb header: the file is cut off")),
    }
    let glb = Glb::from_slice(bytes).map_err(|error| match error {
        gltf::Error::Binary(GlbError::Version(version)) => {
            AssetError::new(format!("glTF version {version} is not read")).with_help("export the model as glTF 2.0")
        }
        gltf::Error::Binary(GlbError::Length { length, .. }) => {
            let whole = u64::from(length) + 12;
            AssetError::new(format!("glb header: the file shall have {whole} bytes, but has {}: it is cut off", bytes.len()))
        }
        gltf::Error::Binary(GlbError::ChunkLength { ty, length, length_read }) => {
            AssetError::new(format!("glb {ty:?} chunk: shall have {length} bytes, but {length_read} are left: the file is damaged"))
        }
        other => AssetError::new(format!("glb: {other}")),
    })?;
    match (glb.json, glb.bin) {
        (Cow::Borrowed(json), None) => Ok((json, None)),
        (Cow::Borrowed(json), Some(Cow::Borrowed(bin))) => Ok((json, Some(bin))),
        _ => Err(AssetError::new("glb: chunks cannot be told apart")),
    }
}

fn bad_json(error: &serde_json::Error) -> AssetError {
    AssetError::new(format!("the file's JSON: {error}"))
}

fn check_required(extensions: &[String]) -> Result<(), AssetError> {
    let known = |name: &str| READABLE.contains(&name) || name.starts_with("KHR_materials_");
    let Some(extension) = extensions.iter().find(|name| !known(name)) else { return Ok(()) };
    let help = match extension.as_str() {
        "KHR_draco_mesh_compression" | "EXT_meshopt_compression" | "KHR_meshopt_compression" => {
            "export the model without mesh compression (gltf-transform copy IN.glb OUT.glb decompresses)"
        }
        "KHR_texture_basisu" | "EXT_texture_webp" | "EXT_texture_avif" | "MSFT_texture_dds" => "export the model with PNG or JPEG textures",
        _ => "export the model without it",
    };
    Err(AssetError::new(format!("needs the glTF extension {extension:?}, which is not read")).with_help(help))
}

/// The entry of a list that another entry refers to.
pub(super) fn at<'r, T>(list: &'r [T], index: Index<T>, what: &str) -> Result<&'r T, AssetError> {
    list.get(index.value()).ok_or_else(|| AssetError::new(format!("{what} {} does not exist (there are {})", index.value(), list.len())))
}

/// `mesh 2 "wheel"`.
pub(super) fn label(what: &str, index: usize, name: Option<&str>) -> String {
    match name {
        Some(name) => format!("{what} {index} {name:?}"),
        None => format!("{what} {index}"),
    }
}
