//! Triangles as the engine takes them.

/// Triangles of one material. Attributes are one a vertex, or none at all.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Mesh {
    /// The file's name for it, or its number there.
    pub name: String,
    /// Vertex positions, finite.
    pub positions: Vec<[f32; 3]>,
    /// Triangles as indices into `positions`, all in range; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// Unit normals; empty: flat shading, by each triangle's own normal.
    pub normals: Vec<[f32; 3]>,
    /// First set of texture coordinates, finite; v = 0 is the image's first row. Never empty where the material has a texture.
    pub uvs: Vec<[f32; 2]>,
    /// Second set; never empty where a texture of the material takes it (see [`crate::texture::Coordinates::second`]).
    pub second_uvs: Vec<[f32; 2]>,
    /// Unit tangents, or 0 where there is none, and the side of the bitangent, `side cross(normal, tangent)`: 1 or -1. Empty: those of the
    /// texture coordinates, or nobody asks for them.
    pub tangents: Vec<[f32; 4]>,
    /// Linear Rec. 709 and opacity, in [0, 1]; empty: white and opaque.
    pub colors: Vec<[f32; 4]>,
    /// Index into [`super::LoadedModel::materials`].
    pub material: usize,
}

/// A number of a file as a fraction: in [0, 1] whatever it was, 0 for one that is none.
pub(super) fn fraction(value: f32) -> f32 {
    if value > 0.0 { value.min(1.0) } else { 0.0 }
}
