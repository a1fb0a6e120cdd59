//! The tree of one mesh.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use super::{collapse::LeafRule, pack::Pack, simd::Lanes, tree::Tree};
use crate::shape::{
    Bounds, Ray,
    triangle::{Sheared, TriangleHit},
};

/// Triangles and the tree over them, in the mesh's own coordinates.
#[derive(Debug)]
pub struct MeshTree {
    tree: Tree,
    packs: Vec<Pack>,
    /// Triangle of each place of each pack.
    ids: Vec<[u32; 8]>,
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    bounds: Bounds,
}

/// A hit of a mesh.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeshHit {
    /// Index of the triangle.
    pub triangle: u32,
    /// Where it was hit.
    pub at: TriangleHit,
}

impl MeshTree {
    /// Builds the tree of at least one triangle; positions are finite and indices in range.
    pub fn build(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        let vertices = |triangle: u32| triangles[triangle as usize].map(|i| Vec3::from(positions[i as usize]).as_dvec3());
        let boxes: Vec<Bounds> = (0..triangles.len() as u32).map(|triangle| Bounds::of(vertices(triangle))).collect();
        let bounds = boxes.iter().fold(Bounds::EMPTY, |sum, b| sum.union(*b));
        let (mut packs, mut ids) = (Vec::new(), Vec::new());
        // A pack costs less than a node, measured.
        let tree = Tree::build(&boxes, LeafRule { most: 8, cost: 0.7 }, |frame, leaf| {
            packs.push(Pack::new(leaf.iter().map(|&triangle| vertices(triangle).map(|p| frame.point(p)))));
            ids.push(std::array::from_fn(|slot| leaf.get(slot).copied().unwrap_or(u32::MAX)));
            packs.len() as u32 - 1
        });
        Self { tree, packs, ids, positions, triangles, bounds }
    }

    /// Number of triangles.
    pub fn count(&self) -> usize {
        self.triangles.len()
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// Indices of a triangle's vertices.
    pub fn indices(&self, triangle: u32) -> [usize; 3] {
        self.triangles[triangle as usize].map(|i| i as usize)
    }

    /// Vertices of a triangle.
    #[inline(always)]
    pub fn vertices(&self, triangle: u32) -> [DVec3; 3] {
        self.triangles[triangle as usize].map(|i| Vec3::from(self.positions[i as usize]).as_dvec3())
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes()
            + size_of_val(&*self.packs)
            + size_of_val(&*self.ids)
            + size_of_val(&*self.positions)
            + size_of_val(&*self.triangles)
    }

    /// Calls `visit` with hits in `0 < t <= limit`, of either side, in no particular order; it returns the limit for what follows, or breaks.
    /// A hit nearer than every limit is never left out.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn hits<L: Lanes, const ANY: bool>(
        &self,
        ray: &Ray,
        mut visit: impl FnMut(MeshHit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        let boxed = self.tree.ray::<false>(ray.origin, ray.direction);
        let sheared = Sheared::new(ray.origin, ray.direction);
        let mut limit = ray.t_max;
        let mut flow = ControlFlow::Continue(());
        let leaf = |pack: u32| {
            // SAFETY: the tree's leaves are indices of packs; the caller has the instructions of `L`.
            let mut candidates = unsafe { self.packs.get_unchecked(pack as usize).candidates::<L>(&boxed) };
            while candidates != 0 {
                let triangle = self.ids[pack as usize][candidates.trailing_zeros() as usize];
                candidates &= candidates - 1;
                let Some(at) = sheared.hit(self.vertices(triangle)).filter(|at| at.t <= limit) else { continue };
                match visit(MeshHit { triangle, at }) {
                    ControlFlow::Continue(lower) => limit = lower,
                    ControlFlow::Break(()) => {
                        flow = ControlFlow::Break(());
                        return ControlFlow::Break(());
                    }
                }
            }
            ControlFlow::Continue(boxed.limit(limit))
        };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { self.tree.visit::<L, ANY>(&boxed, boxed.limit(ray.t_max), leaf) };
        flow
    }
}
