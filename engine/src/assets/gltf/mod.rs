//! glTF 2.0 (Khronos, ISO/IEC 12113:2022): `.gltf` and `.glb`.
//!
//! The crate `gltf` takes the container and its JSON apart; every index and range is checked here, where it is used.

mod accessor;
mod buffer;
mod document;
mod geometry;
mod hierarchy;
mod lights;
mod material;

use std::ops::Range;

use gltf::json::{
    Root,
    mesh::{Mesh as MeshEntry, Semantic},
    validation::Checked,
};

use self::{
    buffer::Buffers,
    document::{Document, MODELLED, label},
    geometry::Geometry,
    material::Materials,
};
use super::{
    AssetError, Instance, LoadedModel, Mesh,
    files::{Context, Files},
    warnings::Warnings,
};

/// Most instances of a model.
const MAX_INSTANCES: usize = 1 << 24;

/// Reads a glTF file and its buffers and images.
pub(super) fn load(files: &Files<'_>) -> Result<LoadedModel, AssetError> {
    let bytes = files.main()?;
    let document = Document::parse(&bytes)?;
    let root = &document.root;
    let mut warnings = Warnings::default();
    warn(root, &mut warnings);
    let buffers = Buffers::resolve(&document, files)?;
    let materials = material::load(root, &buffers, files, &mut warnings)?;
    let placements = hierarchy::placements(root, &mut warnings)?;

    let lights = lights::lights(root, &placements.lights, &mut warnings)?;
    let mut geometry = Geometry::new(root, &buffers, &materials);
    let mut meshes = Vec::new();
    let mut instances = Vec::new();
    // Which meshes of the model a mesh of the file became, when a node first showed it.
    let mut known: Vec<Option<Range<usize>>> = vec![None; root.meshes.len()];
    for placement in placements.meshes {
        let range = match &known[placement.index] {
            Some(range) => range.clone(),
            None => {
                let first = meshes.len();
                read_mesh(&root.meshes[placement.index], placement.index, &mut geometry, &mut meshes, &mut warnings)?;
                known[placement.index].insert(first..meshes.len()).clone()
            }
        };
        if instances.len() + range.len() > MAX_INSTANCES {
            return Err(AssetError::new(format!("shows its meshes more than {MAX_INSTANCES} times")));
        }
        instances.extend(range.map(|mesh| Instance { mesh, transform: placement.transform }));
    }
    if instances.is_empty() && lights.is_empty() {
        return Err(AssetError::new("has no triangles in its scene"));
    }
    let Materials { materials, textures, .. } = materials;
    Ok(LoadedModel { meshes, instances, materials, textures, lights, warnings: warnings.into_texts() })
}

/// Appends a mesh for each primitive that has something to draw.
fn read_mesh(
    entry: &MeshEntry,
    index: usize,
    geometry: &mut Geometry<'_>,
    meshes: &mut Vec<Mesh>,
    warnings: &mut Warnings,
) -> Result<(), AssetError> {
    warn_attributes(entry, index, warnings);
    let name = entry.name.clone().unwrap_or_else(|| index.to_string());
    for (number, primitive) in entry.primitives.iter().enumerate() {
        let place = || format!("{}, primitive {number}", label("mesh", index, entry.name.as_deref()));
        meshes.extend(geometry.mesh(&name, primitive, warnings).context(place)?);
    }
    Ok(())
}

/// Names of the files that a glTF file needs: buffers and images.
pub(super) fn references(bytes: &[u8]) -> Result<Vec<String>, AssetError> {
    let document = Document::parse(bytes)?;
    let root = &document.root;
    let buffers = root.buffers.iter().filter_map(|entry| buffer::reference(entry.uri.as_deref()));
    let images = material::needed_images(root)?;
    buffers.chain(images.iter().filter_map(|image| buffer::reference(image.uri.as_deref()))).collect()
}

/// What the file as a whole asks for that is not modelled.
fn warn(root: &Root, warnings: &mut Warnings) {
    for extension in &root.extensions_used {
        if !MODELLED.contains(&extension.as_str()) {
            warnings.file(format!("the glTF extension {extension} is not modelled"));
        }
    }
    if !root.animations.is_empty() {
        warnings.file("animations are not modelled; drawn at rest");
    }
    if !root.cameras.is_empty() {
        warnings.file("its cameras are not used");
    }
}

/// Attributes that would change the picture, but are not modelled.
fn warn_attributes(mesh: &MeshEntry, index: usize, warnings: &mut Warnings) {
    let name = mesh.name.as_ref().map_or_else(|| index.to_string(), |name| format!("{name:?}"));
    let attributes = || mesh.primitives.iter().flat_map(|primitive| primitive.attributes.keys());
    if attributes().any(|attribute| matches!(attribute, Checked::Valid(Semantic::Colors(1..)))) {
        warnings.object("mesh", name.clone(), "only its first vertex colours are modelled");
    }
    if attributes().any(|attribute| matches!(attribute, Checked::Invalid)) {
        warnings.object("mesh", name, "has vertex attributes that glTF does not know");
    }
}
