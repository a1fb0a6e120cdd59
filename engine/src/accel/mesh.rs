//! The tree of one mesh.

use std::ops::ControlFlow;

use glam::{DVec3, Vec3};

use super::{
    build::{Box3, Draft},
    collapse::{Collapse, LeafRule},
    frame::Normalisation,
    identity::Identity,
    pack::{Pack, PackRay},
    pages::settle,
    simd::Lanes,
    split::{References, split},
    tree::Tree,
};
use crate::shape::{
    Bounds, Ray,
    triangle::{Sheared, TriangleHit},
};

/// Triangles and the tree over them, in the mesh's own coordinates.
#[derive(Debug)]
pub struct MeshTree {
    pub(super) tree: Tree,
    pub(super) packs: Vec<Pack>,
    /// Whether a triangle may lie in several packs.
    pub(super) is_split: bool,
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

/// A tree over triangles or, where that is cheaper, over parts of triangles.
struct Cheapest {
    tree: Collapse,
    /// The triangle of each part; none where triangles are whole.
    triangles: Vec<u32>,
}

impl Cheapest {
    fn of(whole: &[Box3], vertices: impl Fn(u32) -> [Vec3; 3], leaves: LeafRule) -> Self {
        let plain = Draft::over(whole);
        if let Some(References { boxes, triangles }) = split(whole, vertices) {
            let parts = Draft::over(&boxes);
            if parts.cost() < plain.cost() {
                return Self { tree: Collapse::plan(parts.finish(&boxes), leaves), triangles };
            }
        }
        Self { tree: Collapse::plan(plain.finish(whole), leaves), triangles: Vec::new() }
    }
}

/// A pack costs less than a node, measured.
const LEAVES: LeafRule = LeafRule { most: 8, cost: 0.7 };

impl MeshTree {
    /// Builds the tree of at least one triangle; positions are finite and indices in range.
    pub fn build(positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self::build_with(positions, triangles, LEAVES)
    }

    fn build_with(mut positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>, leaves: LeafRule) -> Self {
        let corners = triangles.iter().flatten().map(|&i| Vec3::from(positions[i as usize]).as_dvec3());
        let frame = Normalisation::scaling(Bounds::of(corners));
        // What scaling cannot keep, being 2^-126 of the mesh's size, is nothing for all who look at a position.
        let scaled: Vec<Vec3> = positions.iter().map(|&p| frame.point(Vec3::from(p).as_dvec3()).as_vec3()).collect();
        positions.iter_mut().zip(&scaled).for_each(|(p, scaled)| *p = frame.unscaled(scaled.as_dvec3()).as_vec3().into());
        let vertices = |triangle: u32| triangles[triangle as usize].map(|i| scaled[i as usize]);
        let boxes: Vec<Box3> = (0..triangles.len() as u32).map(|triangle| Box3::of(vertices(triangle))).collect();
        let cheapest = Cheapest::of(&boxes, vertices, leaves);
        drop(boxes);
        let mut packs = Vec::new();
        let tree = Tree::carry_out(frame, cheapest.tree, |leaf| {
            let mut leaf: Vec<u32> = leaf.iter().map(|&part| cheapest.triangles.get(part as usize).copied().unwrap_or(part)).collect();
            leaf.sort_unstable();
            leaf.dedup();
            packs.push(Pack::new(leaf.iter().map(|&triangle| (triangle, vertices(triangle)))));
            packs.len() as u32 - 1
        });
        let bounds = Bounds::of(triangles.iter().flatten().map(|&i| Vec3::from(positions[i as usize]).as_dvec3()));
        Self { tree, packs: settle(packs), is_split: !cheapest.triangles.is_empty(), positions, triangles, bounds }
    }

    /// Number of triangles.
    pub fn count(&self) -> usize {
        self.triangles.len()
    }

    /// Whether a triangle may lie in several leaves.
    #[cfg(test)]
    pub fn is_split(&self) -> bool {
        self.is_split
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// See [`Tree::outline`].
    pub fn outline(&self, visit: impl FnMut(Bounds)) {
        self.tree.outline(visit);
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

    /// The same mesh with other leaves.
    #[cfg(test)]
    pub fn with_leaves(&self, leaves: LeafRule) -> Self {
        Self::build_with(self.positions.clone(), self.triangles.clone(), leaves)
    }

    /// Adds its nodes and packs.
    pub fn identify(&self, identity: &mut Identity) {
        self.tree.identify(identity);
        identity.numbers(&[self.packs.len() as u32]);
        self.packs.iter().for_each(|pack| pack.identify(identity));
    }

    /// Nodes on the longest way through its tree.
    pub fn depth(&self) -> usize {
        self.tree.depth()
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        self.tree.bytes() + size_of_val(&*self.packs) + size_of_val(&*self.positions) + size_of_val(&*self.triangles)
    }

    /// Calls `visit` with hits in `0 < t <= limit`, of either side, in no particular order; it returns the limit for what follows, or breaks.
    /// A hit nearer than every limit is never left out. No triangle is hit twice if `ANY`.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn hits<L: Lanes, const ANY: bool>(
        &self,
        ray: &Ray,
        mut visit: impl FnMut(MeshHit) -> ControlFlow<(), f64>,
    ) -> ControlFlow<()> {
        let frame = self.tree.frame();
        let boxed = self.tree.ray::<false>(ray.origin, ray.direction);
        let sheared = Sheared::new(frame.point(ray.origin), ray.direction);
        let filter = PackRay::new(&boxed, &sheared);
        let mut limit = ray.t_max;
        let whole = boxed.limit(limit);
        let mut boxed_limit = whole;
        let mut flow = ControlFlow::Continue(());
        let mut told = Told::default();
        let leaf = |pack: u32| {
            // SAFETY: the tree's leaves are indices of packs.
            let pack = unsafe { self.packs.get_unchecked(pack as usize) };
            // SAFETY: the caller has the instructions of `L`.
            let mut candidates = unsafe { pack.candidates::<L>(&filter) };
            while candidates != 0 {
                let slot = candidates.trailing_zeros() as usize;
                candidates &= candidates - 1;
                // SAFETY: a candidate is one of eight.
                let Some(at) = (unsafe { pack.hit(slot, &sheared) }) else { continue };
                let at = TriangleHit { t: frame.unscaled(at.t), ..at };
                if at.t > limit || (ANY && self.is_split && !told.is_new(pack.id(slot))) {
                    continue;
                }
                match visit(MeshHit { triangle: pack.id(slot), at }) {
                    ControlFlow::Continue(lower) => limit = lower,
                    ControlFlow::Break(()) => {
                        flow = ControlFlow::Break(());
                        return ControlFlow::Break(());
                    }
                }
                boxed_limit = boxed.limit(limit);
            }
            ControlFlow::Continue(boxed_limit)
        };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { self.tree.visit::<L, ANY>(&boxed, whole, leaf) };
        flow
    }
}

/// The triangles that a ray has been told of.
#[derive(Default)]
pub(crate) struct Told {
    first: [u32; 8],
    count: usize,
    /// What the first places cannot hold: few rays go through so many surfaces and on.
    more: Vec<u32>,
}

impl Told {
    /// Forgets all.
    #[inline(always)]
    pub fn clear(&mut self) {
        self.count = 0;
        self.more.clear();
    }

    /// Notes a triangle; whether it was not known.
    #[inline(always)]
    pub fn is_new(&mut self, triangle: u32) -> bool {
        let known = self.first.iter().take(self.count).chain(&self.more).any(|&other| other == triangle);
        if !known {
            match self.first.get_mut(self.count) {
                Some(place) => (*place, self.count) = (triangle, self.count + 1),
                None => self.more.push(triangle),
            }
        }
        !known
    }
}
