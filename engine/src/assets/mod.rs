//! Model files: glTF, OBJ and PLY become plain meshes, materials and instances.
//!
//! A model may come from anywhere, so no byte of it is trusted: every range is checked before it is read, nothing is
//! allocated that the file's own length does not justify, and what a file asks for that is not modelled is named in a warning.

mod files;
mod gloss;
mod gltf;
mod light;
mod material;
mod mesh;
mod mtl;
mod normals;
mod obj;
mod ply;
mod polygon;
mod promises;
mod reference;
mod soup;
mod warnings;
#[cfg(test)]
pub(crate) mod tests;

use glam::DAffine3;

pub use crate::description::{AssetError, ModelFormat};
pub use light::{ModelLight, ModelLightKind};
pub use material::{AlphaMode, Anisotropy, Clearcoat, ModelEmission, ModelMaterial, NormalMap, Sheen, Specular, Transmission, Volume};
pub use mesh::Mesh;
#[doc(hidden)]
pub use promises::check_promises;
pub use reference::{model_format, model_references, part_references};
pub(crate) use warnings::Warnings;

use self::files::Files;
use crate::{
    description::{AssetSource, Model},
    texture::Texture,
};

/// A model file, read.
#[derive(Clone, Debug, Default)]
pub struct LoadedModel {
    /// Triangles of one material each, in their own coordinates.
    pub meshes: Vec<Mesh>,
    /// Every appearance of a mesh, in the order of the file's hierarchy.
    pub instances: Vec<Instance>,
    /// What the meshes are made of.
    pub materials: Vec<ModelMaterial>,
    /// Images with the coordinates that the materials look them up with: those that take the same image share it.
    pub textures: Vec<Texture>,
    /// Lights, in the order of the file's hierarchy.
    pub lights: Vec<ModelLight>,
    /// What the file asks for that is not modelled, each said once. The caller puts the file's name in front.
    pub warnings: Vec<String>,
}

/// A mesh at a place.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Instance {
    /// Index into [`LoadedModel::meshes`].
    pub mesh: usize,
    /// Mesh to model coordinates; finite and invertible. A mirroring map (negative determinant) leaves front faces front faces.
    pub transform: DAffine3,
}

/// Reads a model and all files that it refers to.
///
/// # Errors
/// Says what in the file is wrong (which mesh, accessor or line). The caller puts the file's name in front.
pub fn load(model: &Model, assets: &dyn AssetSource) -> Result<LoadedModel, AssetError> {
    let files = Files::new(model, assets);
    match model.format {
        ModelFormat::Gltf => gltf::load(&files),
        ModelFormat::Obj => obj::load(&files),
        ModelFormat::Ply => ply::load(&files),
    }
}
