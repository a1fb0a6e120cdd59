//! A tree of eight-wide nodes over triangles and boxes.

use std::ops::ControlFlow;

use glam::DVec3;

use super::{
    collapse::Collapsed,
    frame::{BoxRay, Normalisation},
    identity::Identity,
    node::{LEAF, Node},
    pack::{Pack, PackRay},
    pages::settle,
    simd::Lanes,
    told::Told,
    traverse::traverse,
    visitor::{MeshHit, Visitor},
};
use crate::shape::{Bounds, Ray, triangle::TriangleHit};

/// Marks a leaf's reference as one to something else than a pack of triangles.
pub const OTHER: u32 = 1 << 30;

/// A tree over triangles, which it keeps, and over boxes of things that the caller keeps.
#[derive(Debug)]
pub struct Tree {
    frame: Normalisation,
    pub(super) nodes: Vec<Node>,
    pub(super) packs: Vec<Pack>,
    pub(super) root: u32,
    /// Whether a triangle may lie in several packs.
    pub(super) is_split: bool,
}

impl Tree {
    /// From what a planned tree became, and packs in memory of [`super::pages`]; see [`super::content::Content`].
    pub(super) fn new(frame: Normalisation, collapsed: Collapsed, packs: Vec<Pack>, is_split: bool) -> Self {
        Self { frame, nodes: settle(collapsed.nodes), packs, root: collapsed.root, is_split }
    }

    /// Its coordinates.
    #[inline(always)]
    pub fn frame(&self) -> &Normalisation {
        &self.frame
    }

    /// Calls `visit` with boxes that together hold everything: those two nodes down, at most 64; with none where there is nothing but one leaf.
    pub fn outline(&self, mut visit: impl FnMut(Bounds)) {
        let Some(root) = self.nodes.get(self.root as usize) else { return };
        for (reference, bounds) in root.boxes() {
            match self.nodes.get(reference as usize) {
                Some(node) => node.boxes().for_each(|(_, bounds)| visit(self.frame.unscaled_box(bounds))),
                None => visit(self.frame.unscaled_box(bounds)),
            }
        }
    }

    /// Prepares a ray for [`Tree::visit`].
    #[inline(always)]
    pub fn ray<const UNIT_LENGTH: bool>(&self, origin: DVec3, direction: DVec3) -> BoxRay {
        self.frame.ray::<UNIT_LENGTH>(origin, direction)
    }

    /// See [`traverse`]; leaves are other things.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn visit<L: Lanes, const ANY: bool>(&self, ray: &BoxRay, limit: f32, leaf: impl FnMut(u32) -> ControlFlow<(), f32>) {
        // SAFETY: the nodes come from `Collapse`, and are never too deep.
        unsafe { traverse::<L, ANY>(&self.nodes, self.root, ray, limit, leaf) }
    }

    /// Tells of all that a ray meets up to `limit`: nothing nearer than every limit is left out. No triangle is hit twice if `ANY`. The ray's number is 0.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn walk<L: Lanes, const ANY: bool>(&self, ray: &Ray, limit: f64, visitor: &mut impl Visitor) {
        let frame = &self.frame;
        let boxed = frame.ray::<false>(ray.origin, ray.direction);
        let filter = PackRay::new(&boxed);
        let whole = boxed.limit(limit);
        let (mut limit, mut boxed_limit) = (limit, whole);
        let mut told = Told::default();
        let leaf = |reference: u32| {
            if reference & OTHER != 0 {
                limit = visitor.other(0, reference & !OTHER);
                boxed_limit = boxed.limit(limit);
                return if limit < 0.0 { ControlFlow::Break(()) } else { ControlFlow::Continue(boxed_limit) };
            }
            // SAFETY: leaves are other things or indices of packs.
            let pack = unsafe { self.packs.get_unchecked(reference as usize) };
            // SAFETY: the caller has the instructions of `L`.
            let mut candidates = unsafe { pack.candidates::<L>(&filter) };
            while candidates != 0 {
                let slot = candidates.trailing_zeros() as usize;
                candidates &= candidates - 1;
                // SAFETY: a candidate is one of eight.
                let (instance, triangle) = unsafe { pack.id(slot) };
                let at = if pack.is_exact() {
                    // SAFETY: a candidate is one of eight.
                    unsafe { pack.hit(slot, frame.point(ray.origin), ray.direction) }
                        .map(|at| TriangleHit { t: frame.unscaled(at.t), ..at })
                } else {
                    visitor.exact(0, instance, triangle)
                };
                let Some(at) = at else { continue };
                if at.t > limit || (ANY && self.is_split && !told.is_new(instance, triangle)) {
                    continue;
                }
                limit = visitor.triangle(0, MeshHit { instance, triangle, at });
                if limit < 0.0 {
                    return ControlFlow::Break(());
                }
                boxed_limit = boxed.limit(limit);
            }
            ControlFlow::Continue(boxed_limit)
        };
        // SAFETY: the caller has the instructions of `L`; nodes are as `traverse` wants them.
        unsafe { traverse::<L, ANY>(&self.nodes, self.root, &boxed, whole, leaf) };
    }

    /// Adds all that it is, but for its coordinates.
    pub fn identify(&self, identity: &mut Identity) {
        identity.numbers(&[self.nodes.len() as u32, self.packs.len() as u32, self.root]);
        self.nodes.iter().for_each(|node| node.identify(identity));
        self.packs.iter().for_each(|pack| pack.identify(identity));
    }

    /// Nodes on the longest way from the root to a leaf.
    pub fn depth(&self) -> usize {
        let mut depth = vec![1; self.nodes.len()];
        // Children stand after their parents.
        for (at, node) in self.nodes.iter().enumerate() {
            node.children.iter().filter(|child| *child & LEAF == 0).for_each(|child| depth[*child as usize] = depth[at] + 1);
        }
        depth.into_iter().max().unwrap_or(0)
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes) + size_of_val(&*self.packs)
    }

    /// Whether a triangle may lie in several leaves.
    #[cfg(test)]
    pub fn is_split(&self) -> bool {
        self.is_split
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::{Baseline, Content, LeafRule};

    /// Rays from where numbers end meet every box or none, but no empty place of a node.
    #[test]
    fn empty_places_are_never_visited() {
        let boxes = [-1.0, 0.0, 3.0].map(|x| Bounds::of([DVec3::splat(x), DVec3::splat(x + 0.5)]));
        let content = Content { origin: DVec3::ZERO, parts: Vec::new(), boxes: boxes.to_vec(), references: vec![100, 101, 102] };
        let tree = content.grow(Bounds::of(boxes.iter().flat_map(|b| b.corners())), LeafRule { most: 8, cost: 1.0 });
        for size in [1.0, 1e20, 1e38, 1e50, 1e53, 1e56, 1e90, 1e200, 1e307, f64::INFINITY, f64::NAN] {
            for axes in [DVec3::X, DVec3::new(0.3, -0.5, 0.9), DVec3::NEG_ONE] {
                for length in [1.0, 1e-30, 1e30, 1e200] {
                    let ray = tree.ray::<false>(axes * size, -axes * length);
                    let leaf = |reference| {
                        assert!(reference >= OTHER + 100, "{ray:?}");
                        ControlFlow::Continue(f32::INFINITY)
                    };
                    // SAFETY: every processor has the baseline.
                    unsafe { tree.visit::<Baseline, false>(&ray, f32::INFINITY, leaf) };
                }
            }
        }
    }
}
