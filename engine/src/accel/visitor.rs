//! What walks through trees tell of what they meet.

use crate::shape::triangle::TriangleHit;

/// A hit of a triangle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshHit {
    /// Which of the meshes that stand in the tree.
    pub instance: u32,
    /// Index of the triangle in its mesh.
    pub triangle: u32,
    /// Where it was hit.
    pub at: TriangleHit,
}

/// Whoever walks rays, by their numbers, through a tree. Functions that return limits say how far their ray is followed from then on: below 0, no farther.
pub trait Visitor {
    /// A ray hits a triangle in `0 < t <= limit`, on either side; hits come in no particular order.
    fn triangle(&mut self, ray: usize, hit: MeshHit) -> f64;

    /// Where a ray hits, with `t > 0`, a triangle that does not stand in the tree as it is.
    fn exact(&self, ray: usize, instance: u32, triangle: u32) -> Option<TriangleHit>;

    /// A ray meets the box of something else, by its reference.
    fn other(&mut self, ray: usize, reference: u32) -> f64;
}
