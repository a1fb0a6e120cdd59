//! What a scene is made of, in numbers.

use super::geometry::{Geometry, LocalShape};
use crate::{accel::Tree, shape::Other};

/// Counts of a compiled scene.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Statistics {
    /// Spheres, transformed ones included.
    pub spheres: usize,
    /// Planes.
    pub planes: usize,
    /// Boxes, transformed ones included.
    pub boxes: usize,
    /// Discs, transformed ones included.
    pub discs: usize,
    /// Rectangles, transformed ones included.
    pub rectangles: usize,
    /// Cylinders, transformed ones included.
    pub cylinders: usize,
    /// Cones, transformed ones included.
    pub cones: usize,
    /// Different meshes.
    pub meshes: usize,
    /// Appearances of meshes.
    pub instances: usize,
    /// Triangles of the different meshes.
    pub triangles: usize,
    /// Triangles of all appearances.
    pub instanced_triangles: usize,
    /// Memory of meshes, their instances and trees in bytes.
    pub bytes: usize,
    /// Nodes on the longest way through any tree.
    pub depth: usize,
}

impl Statistics {
    pub(super) fn of(geometry: &Geometry) -> Self {
        let transformed = |is: fn(&LocalShape) -> bool| geometry.transformed.iter().filter(|placed| is(&placed.shape.shape)).count();
        let placed = geometry.others.iter().map(|placed| &placed.shape);
        let others = placed.chain(geometry.transformed.iter().filter_map(|placed| match &placed.shape.shape {
            LocalShape::Other(other) => Some(other),
            _ => None,
        }));
        let others = |is: fn(&Other) -> bool| others.clone().filter(|other| is(other)).count();
        let triangles = |mesh: u32| geometry.meshes[mesh as usize].triangles.count();
        Self {
            spheres: geometry.spheres.len() + transformed(|shape| matches!(shape, LocalShape::Sphere(_))),
            planes: geometry.planes.len(),
            boxes: geometry.cuboids.len() + transformed(|shape| matches!(shape, LocalShape::Cuboid(_))),
            discs: geometry.discs.len() + transformed(|shape| matches!(shape, LocalShape::Disc(_))),
            rectangles: others(|other| matches!(other, Other::Rectangle(_))),
            cylinders: others(|other| matches!(other, Other::Cone(cone) if cone.is_cylinder())),
            cones: others(|other| matches!(other, Other::Cone(cone) if !cone.is_cylinder())),
            meshes: geometry.meshes.len(),
            instances: geometry.instances.len(),
            triangles: geometry.meshes.iter().map(|mesh| mesh.triangles.count()).sum(),
            instanced_triangles: geometry.instances.iter().map(|placed| triangles(placed.shape.mesh)).sum(),
            bytes: geometry.meshes.iter().map(|mesh| mesh.bytes()).sum::<usize>()
                + size_of_val(&*geometry.instances)
                + geometry.tree.as_ref().map_or(0, |tree| tree.bytes())
                + geometry.list.as_ref().map_or(0, |list| list.bytes()),
            depth: geometry.trees().map(Tree::depth).max().unwrap_or(0),
        }
    }
}
