//! Primitives: triangles and their attributes, of the vertices that the triangles use.

use glam::DVec3;
use gltf::json::{
    Accessor, Index, Root,
    accessor::Type,
    mesh::{Mode, Primitive, Semantic},
    validation::Checked,
};

use super::{AssetError, accessor::Reader, buffer::Buffers, material::Materials};
use crate::assets::{
    Mesh,
    files::Context,
    mesh::fraction,
    normals::{normalize, unit},
    warnings::Warnings,
};

/// Triangles that a file may make of each of its bytes, together with a fixed number: strips of byte indices make 1, and meshes may share them.
const TRIANGLES_PER_BYTE: usize = 4;

/// Turns primitives into meshes.
pub(super) struct Geometry<'a> {
    root: &'a Root,
    buffers: &'a Buffers<'a>,
    materials: &'a Materials,
    /// Indices that may still be read.
    budget: usize,
}

impl<'a> Geometry<'a> {
    pub fn new(root: &'a Root, buffers: &'a Buffers<'a>, materials: &'a Materials) -> Self {
        Self { root, buffers, materials, budget: 3 * (TRIANGLES_PER_BYTE * buffers.total() + 65_536) }
    }

    /// One primitive of a mesh; `None` where it has nothing to draw.
    pub fn mesh(&mut self, name: &str, primitive: &Primitive, warnings: &mut Warnings) -> Result<Option<Mesh>, AssetError> {
        let mode = match primitive.mode {
            Checked::Valid(mode @ (Mode::Triangles | Mode::TriangleStrip | Mode::TriangleFan)) => mode,
            Checked::Valid(_) => {
                warnings.object("mesh", format!("{name:?}"), "points and lines are not modelled; left out");
                return Ok(None);
            }
            Checked::Invalid => return Err(AssetError::new("its mode is none of glTF's")),
        };
        if primitive.targets.as_ref().is_some_and(|targets| !targets.is_empty()) {
            warnings.object("mesh", format!("{name:?}"), "morph targets are not modelled; drawn without them");
        }
        let Some(positions) = self.attribute(primitive, Semantic::Positions, &[Type::Vec3])? else {
            warnings.object("mesh", format!("{name:?}"), "has no positions; left out");
            return Ok(None);
        };
        let (mut triangles, flat) = self.triangles(primitive, mode, positions.count)?;
        // Strips are stitched with such triangles.
        if flat > 0 && mode == Mode::Triangles {
            let text = format!("triangles that name a vertex twice have no area; left out ({flat})");
            warnings.object("mesh", format!("{name:?}"), text);
        }
        if triangles.is_empty() {
            return Ok(None);
        }
        let used = compact(&mut triangles, positions.count);
        let mut mesh = Mesh { name: name.to_owned(), triangles, ..Mesh::default() };
        mesh.positions = used.iter().map(|index| positions.floats(index, 0.0)).collect();
        if let Some(bad) = mesh.positions.iter().position(|position| position.iter().any(|x| !x.is_finite())) {
            let vertex = used.iter().nth(bad).unwrap_or_default();
            return Err(AssetError::new(format!("the position of vertex {vertex} is not finite")));
        }
        self.attributes(primitive, &used, &mut mesh, positions.count, warnings)?;
        Ok(Some(mesh))
    }

    /// Fills all attributes but positions.
    fn attributes(
        &self,
        primitive: &Primitive,
        used: &Used,
        mesh: &mut Mesh,
        count: usize,
        warnings: &mut Warnings,
    ) -> Result<(), AssetError> {
        let reader = |semantic: Semantic, types: &[Type]| {
            let name = semantic.to_string();
            let reader = self.attribute(primitive, semantic, types)?;
            match reader {
                Some(reader) if reader.count < count => {
                    Err(AssetError::new(format!("{name} has {} elements, but POSITION has {count}", reader.count)))
                }
                reader => Ok(reader),
            }
        };
        let (quoted, count_used) = (format!("{:?}", mesh.name), mesh.positions.len());
        if let Some(normals) = reader(Semantic::Normals, &[Type::Vec3])? {
            mesh.normals = used.iter().map(|index| normals.floats(index, 0.0)).collect();
            if normalize(mesh) > 0 {
                warnings.object("mesh", quoted.clone(), "some normals have no direction; its triangles' are taken there");
            }
        }
        mesh.material = primitive.material.map_or(self.materials.materials.len() - 1, |material| material.value());
        let (Some(material), Some(sets)) = (self.materials.materials.get(mesh.material), self.materials.sets.get(mesh.material)) else {
            return Err(AssetError::new(format!("material {} does not exist (there are {})", mesh.material, self.root.materials.len())));
        };
        let mut coordinates = |set: u32, wanted: bool| -> Result<Vec<[f32; 2]>, AssetError> {
            let Some(uvs) = reader(Semantic::TexCoords(set), &[Type::Vec2])? else {
                if wanted {
                    let text = format!("has a texture, but no TEXCOORD_{set}; drawn in one of its colours");
                    warnings.object("mesh", quoted.clone(), text);
                }
                return Ok(vec![[0.0; 2]; if wanted { count_used } else { 0 }]);
            };
            Ok(used.iter().map(|index| uvs.floats(index, 0.0).map(|x| if x.is_finite() { x } else { 0.0 })).collect())
        };
        // A material of the user's own may ask for coordinates where the file's does not.
        mesh.uvs = coordinates(sets.first().copied().unwrap_or(0), !sets.is_empty())?;
        if let Some(&second) = sets.get(1) {
            mesh.second_uvs = coordinates(second, true)?;
        }
        if material.needs_tangents()
            && let Some(tangents) = reader(Semantic::Tangents, &[Type::Vec4])?
        {
            mesh.tangents = used.iter().map(|index| tangent(tangents.floats(index, 1.0))).collect();
        }
        if let Some(colors) = reader(Semantic::Colors(0), &[Type::Vec3, Type::Vec4])? {
            let colors = colors.normalized();
            mesh.colors = used.iter().map(|index| colors.floats(index, 1.0).map(fraction)).collect();
        }
        Ok(())
    }

    fn attribute(&self, primitive: &Primitive, semantic: Semantic, types: &[Type]) -> Result<Option<Reader<'a>>, AssetError> {
        let name = semantic.to_string();
        let accessor = primitive.attributes.get(&Checked::Valid(semantic));
        accessor.map(|&index| self.reader(index, types)).transpose().context(|| name)
    }

    fn reader(&self, index: Index<Accessor>, types: &[Type]) -> Result<Reader<'a>, AssetError> {
        Reader::new(&self.root.accessors, self.buffers, index, types)
    }

    /// Triangles as indices below `count`, without those that have no area because they name a vertex twice, and the number of these.
    fn triangles(&mut self, primitive: &Primitive, mode: Mode, count: usize) -> Result<(Vec<[u32; 3]>, usize), AssetError> {
        let reader = primitive.indices.map(|index| self.reader(index, &[Type::Scalar])).transpose().context(|| "indices".into())?;
        if reader.as_ref().is_some_and(|reader| !reader.is_unsigned()) {
            return Err(AssetError::new("its indices are not unsigned integers"));
        }
        if count > u32::MAX as usize {
            return Err(AssetError::new(format!("has {count} vertices, more than an index can name")));
        }
        let length = reader.as_ref().map_or(count, |reader| reader.count);
        self.budget = self.budget.checked_sub(length).ok_or_else(|| {
            AssetError::new(format!(
                "its {length} indices, with those before, are more than a file of {} bytes can mean",
                self.buffers.total()
            ))
        })?;
        let index = |at: usize| -> Result<u32, AssetError> {
            let index = reader.as_ref().map_or(at as u32, |reader| reader.index(at));
            match (index as usize) < count {
                true => Ok(index),
                false => Err(AssetError::new(format!("index {at} is {index}, but there are {count} vertices"))),
            }
        };
        let number = match mode {
            Mode::Triangles => length / 3,
            _ => length.saturating_sub(2),
        };
        let mut triangles = Vec::with_capacity(number);
        for i in 0..number {
            // glTF 2.0, section 3.7.2.1.
            let [a, b, c] = match mode {
                Mode::Triangles => [3 * i, 3 * i + 1, 3 * i + 2],
                Mode::TriangleStrip => [i, i + 1 + i % 2, i + 2 - i % 2],
                _ => [i + 1, i + 2, 0],
            };
            let [a, b, c] = [index(a)?, index(b)?, index(c)?];
            if a != b && b != c && c != a {
                triangles.push([a, b, c]);
            }
        }
        let flat = number - triangles.len();
        Ok((triangles, flat))
    }
}

/// A tangent made unit, or 0 if it has no direction, and the side of the bitangent.
fn tangent([x, y, z, side]: [f32; 4]) -> [f32; 4] {
    let [x, y, z] = unit(DVec3::new(x.into(), y.into(), z.into())).unwrap_or([0.0; 3]);
    [x, y, z, if side < 0.0 { -1.0 } else { 1.0 }]
}

/// The vertices that a mesh uses, in rising order.
enum Used {
    All(usize),
    Some(Vec<u32>),
}

impl Used {
    fn iter(&self) -> Box<dyn Iterator<Item = usize> + '_> {
        match self {
            Self::All(count) => Box::new(0..*count),
            Self::Some(list) => Box::new(list.iter().map(|&index| index as usize)),
        }
    }
}

/// Renumbers triangles over `count` vertices to those that they use. What it costs depends on the triangles alone: a mesh may take
/// a few vertices out of a long list that many meshes share.
fn compact(triangles: &mut [[u32; 3]], count: usize) -> Used {
    let indices = triangles.as_flattened_mut();
    if count <= indices.len() {
        let mut number = vec![u32::MAX; count];
        indices.iter().for_each(|&index| number[index as usize] = 0);
        if number.iter().all(|&used| used == 0) {
            return Used::All(count);
        }
        let used: Vec<u32> = (0..count as u32).filter(|&index| number[index as usize] == 0).collect();
        used.iter().zip(0..).for_each(|(&index, new)| number[index as usize] = new);
        indices.iter_mut().for_each(|index| *index = number[*index as usize]);
        return Used::Some(used);
    }
    let mut used = indices.to_vec();
    used.sort_unstable();
    used.dedup();
    indices.iter_mut().for_each(|index| *index = used.partition_point(|other| other < index) as u32);
    Used::Some(used)
}
