//! Objects: shapes with a material and a place, models read from files, and instances of groups.

use serde::{Deserialize, Serialize};

use super::{AssetId, GroupId, MaterialId, SourceId};

/// An affine map, object to world, in row-major order: `[[xx, xy, xz, tx], ...]`, so that `p'.x = xx p.x + xy p.y + xz p.z + tx`.
pub type Matrix = [[f64; 4]; 3];

/// Objects that are placed together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Group {
    /// The objects, in the order of the script.
    pub objects: Vec<Object>,
}

/// One thing in a group.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Object {
    /// What it is.
    pub kind: ObjectKind,
    /// Where it is within its group; `None` is the identity.
    pub transform: Option<Matrix>,
    /// Where the script made it.
    #[serde(skip)]
    pub source: SourceId,
}

/// What an object is.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum ObjectKind {
    /// A shape of one material.
    Shape {
        /// Its geometry.
        shape: Shape,
        /// Its material.
        material: MaterialId,
    },
    /// A file made elsewhere, with its own hierarchy and materials.
    Model {
        /// The file and those it refers to.
        model: Model,
        /// Replaces every material of the file.
        material: Option<MaterialId>,
    },
    /// All objects of a group, placed once more.
    Instance {
        /// An earlier group.
        group: GroupId,
    },
}

/// A piece of geometry in its own coordinates.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Shape {
    /// All points at `radius` from `center`. Its uv are longitude and latitude about y, each in [0, 1].
    Sphere {
        /// Middle.
        center: [f64; 3],
        /// Above 0.
        radius: f64,
    },
    /// An infinite plane. Its uv are scene units along two axes of the plane; for the normal (0, 1, 0) they are x and z.
    Plane {
        /// Any point of the plane.
        point: [f64; 3],
        /// Any length but 0.
        normal: [f64; 3],
    },
    /// A box along the axes of its coordinates.
    Box {
        /// The corner with the lowest coordinates.
        min: [f64; 3],
        /// The corner with the highest coordinates; above `min` in each.
        max: [f64; 3],
    },
    /// A flat circle. Its uv run from 0 to 1 across the diameter.
    Disc {
        /// Middle.
        center: [f64; 3],
        /// Any length but 0.
        normal: [f64; 3],
        /// Above 0.
        radius: f64,
    },
    /// A triangle mesh that a script made: an asset that holds a [`super::MeshData`].
    Mesh {
        /// The coded mesh.
        data: AssetId,
    },
}

/// A model file and the files that it refers to.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Model {
    /// How the file is read.
    pub format: ModelFormat,
    /// The file itself.
    pub file: AssetId,
    /// Further files by the name under which the first refers to them (a glTF URI, an OBJ's `mtllib`, an MTL's `map_Kd`), sorted by name.
    pub parts: Vec<(String, AssetId)>,
}

/// Formats of model files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum ModelFormat {
    /// glTF 2.0, as `.gltf` or `.glb`.
    Gltf,
    /// Wavefront OBJ with MTL.
    Obj,
    /// Stanford PLY, text or binary.
    Ply,
}
