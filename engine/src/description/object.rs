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
    /// A flat parallelogram, a rectangle where its edges are perpendicular. Seen from its front, `edge_v` is counter-clockwise
    /// from `edge_u`. Its uv run from 0 to 1, u along `edge_u`, v against `edge_v`: where that points up, v = 0 lies at the top.
    Rectangle {
        /// Where both edges begin.
        corner: [f64; 3],
        /// From there to the next corner: any length but 0.
        edge_u: [f64; 3],
        /// From there to the other next corner: any length but 0, and not parallel to `edge_u`.
        edge_v: [f64; 3],
    },
    /// A round cylinder. Its uv are those of a cone.
    Cylinder {
        /// Middle of one end.
        from: [f64; 3],
        /// Middle of the other end, elsewhere than `from`.
        to: [f64; 3],
        /// Above 0.
        radius: f64,
        /// Whether discs close its ends.
        capped: bool,
    },
    /// A round cone, whole or truncated. The uv of its side are longitude about the axis and the place between the ends, v = 0 at `to`, each in [0, 1];
    /// those of its ends are a disc's.
    Cone {
        /// Middle of one end.
        from: [f64; 3],
        /// Middle of the other end, elsewhere than `from`.
        to: [f64; 3],
        /// Radius at `from`: 0, for an apex, or above.
        radius: f64,
        /// Radius at `to`: 0, for an apex, or above; not both are 0.
        to_radius: f64,
        /// Whether discs close its ends.
        capped: bool,
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
