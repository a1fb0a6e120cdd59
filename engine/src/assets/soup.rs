//! Polygons whose corners name position, texture coordinates and normal apart, as OBJ has them, on their way to meshes.

use super::{
    Mesh,
    normals::{Smoothing, generate, normalize},
    polygon::triangulate,
};

/// What a corner names where it names none.
pub(super) const NONE: u32 = u32::MAX;

/// A corner of a polygon: indices into the lists of a [`Soup`]. All but the position may be [`NONE`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(super) struct Corner {
    pub position: u32,
    pub uv: u32,
    pub normal: u32,
}

/// Lists, and triangles of corners that refer to them.
#[derive(Default)]
pub(super) struct Soup {
    /// Finite.
    pub positions: Vec<[f32; 3]>,
    /// One a position, or none at all.
    pub colors: Vec<[f32; 4]>,
    pub uvs: Vec<[f32; 2]>,
    pub normals: Vec<[f32; 3]>,
    triangles: Vec<[Corner; 3]>,
    smoothing: Vec<Smoothing>,
    materials: Vec<u32>,
    /// Triangles that were left out.
    pub flat: usize,
}

impl Soup {
    /// Adds a polygon; every index is in range. Triangles that name a position twice have no area and are left out, counted.
    pub fn push(&mut self, corners: &[Corner], smoothing: Smoothing, material: u32) {
        let mut add = |triangle: [Corner; 3]| {
            let [a, b, c] = triangle.map(|corner| corner.position);
            if a != b && b != c && c != a {
                self.triangles.push(triangle);
                self.smoothing.push(smoothing);
                self.materials.push(material);
            } else {
                self.flat += 1;
            }
        };
        match *corners {
            [a, b, c] => add([a, b, c]),
            _ => {
                let points: Vec<[f32; 3]> = corners.iter().map(|corner| self.positions[corner.position as usize]).collect();
                triangulate(&points).into_iter().for_each(|triangle| add(triangle.map(|i| corners[i])));
            }
        }
    }

    /// Whether there is nothing to draw.
    pub fn is_empty(&self) -> bool {
        self.triangles.is_empty()
    }

    /// One mesh for each of the materials that `names` names, where it has triangles. Returns them with the number of normals of the file that
    /// had no direction.
    pub fn into_meshes(mut self, names: &[String]) -> (Vec<Mesh>, usize) {
        self.complete_normals();
        let mut meshes: Vec<Mesh> =
            names.iter().zip(0..).map(|(name, material)| Mesh { name: name.clone(), material, ..Mesh::default() }).collect();
        let mut made = Made { last: vec![NONE; self.positions.len()], vertices: Vec::with_capacity(self.positions.len()) };
        for (triangle, &material) in self.triangles.iter().zip(&self.materials) {
            let mesh = &mut meshes[material as usize];
            let triangle = triangle.map(|corner| match made.find(corner, material) {
                Some(vertex) => vertex,
                None => made.add(corner, material, self.add_vertex(corner, mesh)),
            });
            mesh.triangles.push(triangle);
        }
        meshes.retain(|mesh| !mesh.triangles.is_empty());
        let bad = meshes.iter_mut().map(normalize).sum();
        (meshes, bad)
    }

    fn add_vertex(&self, corner: Corner, mesh: &mut Mesh) -> u32 {
        let position = corner.position as usize;
        mesh.positions.push(self.positions[position]);
        mesh.normals.push(self.normals[corner.normal as usize]);
        mesh.colors.extend(self.colors.get(position));
        if !self.uvs.is_empty() {
            // A corner without coordinates in a file that has some shows the texture's first place.
            mesh.uvs.push(self.uvs.get(corner.uv as usize).copied().unwrap_or_default());
        }
        mesh.positions.len() as u32 - 1
    }

    /// Gives a normal to every corner that has none.
    fn complete_normals(&mut self) {
        if self.triangles.as_flattened().iter().all(|corner| corner.normal != NONE) {
            return;
        }
        let triangles: Vec<[u32; 3]> = self.triangles.iter().map(|triangle| triangle.map(|corner| corner.position)).collect();
        let generated = generate(&self.positions, &triangles, &self.smoothing);
        // A position's corners mostly share one normal: it is enough to look at the last one that was made for the position.
        let mut last = vec![NONE; self.positions.len()];
        for (triangle, normals) in self.triangles.iter_mut().zip(generated) {
            for (corner, normal) in triangle.iter_mut().zip(normals).filter(|(corner, _)| corner.normal == NONE) {
                let last = &mut last[corner.position as usize];
                if *last == NONE || self.normals[*last as usize] != normal {
                    *last = self.normals.len() as u32;
                    self.normals.push(normal);
                }
                corner.normal = *last;
            }
        }
    }
}

/// Vertices of one position that are looked through before the same is made once more.
const MAX_LOOKED_THROUGH: usize = 64;

/// Vertices already made: for every position a chain of those that have it.
struct Made {
    /// The vertex that was made last for a position, or [`NONE`].
    last: Vec<u32>,
    vertices: Vec<MadeVertex>,
}

struct MadeVertex {
    corner: Corner,
    material: u32,
    /// Its number in its mesh.
    number: u32,
    /// The vertex that was made before it for the same position, or [`NONE`].
    before: u32,
}

impl Made {
    fn find(&self, corner: Corner, material: u32) -> Option<u32> {
        let mut at = self.last[corner.position as usize];
        for _ in 0..MAX_LOOKED_THROUGH {
            let vertex = self.vertices.get(at as usize)?;
            if vertex.corner == corner && vertex.material == material {
                return Some(vertex.number);
            }
            at = vertex.before;
        }
        None
    }

    fn add(&mut self, corner: Corner, material: u32, number: u32) -> u32 {
        let last = &mut self.last[corner.position as usize];
        let before = std::mem::replace(last, self.vertices.len() as u32);
        self.vertices.push(MadeVertex { corner, material, number, before });
        number
    }
}
