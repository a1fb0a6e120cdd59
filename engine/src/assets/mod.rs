//! Model files: glTF, OBJ and PLY become plain meshes, materials and instances.
//!
//! A model may come from anywhere, so no byte of it is trusted: every range is checked before it is read, nothing is
//! allocated that the file's own length does not justify, and what a file asks for that is not modelled is named in a warning.

mod files;
mod gltf;
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
mod tests;

use glam::DAffine3;

pub use crate::description::{AssetError, ModelFormat};
pub use mesh::Mesh;
#[doc(hidden)]
pub use promises::check_promises;
pub use reference::{model_format, model_references, part_references};

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
    /// Images that the materials refer to.
    pub textures: Vec<Texture>,
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

/// The surface of a mesh: Lambertian, of the product of base colour, texture and vertex colour.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelMaterial {
    /// The file's name for it, or its number there.
    pub name: String,
    /// Linear Rec. 709 and opacity, each in [0, 1].
    pub base_color: [f32; 4],
    /// Index into [`LoadedModel::textures`]; [`Mesh::uvs`] are already those that it asks for.
    pub texture: Option<usize>,
    /// The surface is cut away where opacity is below this; `None`: opaque everywhere.
    pub alpha_cutoff: Option<f32>,
    /// Whether the back of its triangles is seen too.
    pub double_sided: bool,
}

impl ModelMaterial {
    /// Grey without texture.
    fn matte(name: &str, grey: f32, double_sided: bool) -> Self {
        Self { name: name.to_owned(), base_color: [grey, grey, grey, 1.0], texture: None, alpha_cutoff: None, double_sided }
    }
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
