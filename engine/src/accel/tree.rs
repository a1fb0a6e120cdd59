//! A tree of eight-wide nodes over boxes.

use std::ops::ControlFlow;

use glam::DVec3;

use super::{
    build::{Box3, Draft},
    collapse::{Collapse, Collapsed, LeafRule},
    frame::{BoxRay, Normalisation},
    identity::Identity,
    node::{LEAF, Node},
    pages::settle,
    simd::Lanes,
    traverse::traverse,
};
use crate::shape::Bounds;

/// A tree over boxes of things that the caller keeps.
#[derive(Debug)]
pub struct Tree {
    frame: Normalisation,
    nodes: Vec<Node>,
    root: u32,
}

impl Tree {
    /// Builds a tree over at least one box; all are finite. `leaf` is given the boxes of every leaf and returns what visits of it will be
    /// given (31 bits).
    pub fn build(boxes: Vec<Bounds>, rule: LeafRule, leaf: impl FnMut(&[u32]) -> u32) -> Self {
        let frame = Normalisation::of(boxes.iter().fold(Bounds::EMPTY, |sum, b| sum.union(*b)));
        // Each is dropped as soon as it can be: a million instances weigh enough.
        let normalised = |b: Bounds| Box3 { min: frame.point(b.min).as_vec3(), max: frame.point(b.max).as_vec3() };
        let normalised: Vec<Box3> = boxes.iter().copied().map(normalised).collect();
        drop(boxes);
        let binary = Draft::over(&normalised).finish(&normalised);
        drop(normalised);
        Self::carry_out(frame, Collapse::plan(binary, rule), leaf)
    }

    /// Makes a planned tree. `leaf` as for [`Self::build`].
    pub fn carry_out(frame: Normalisation, plan: Collapse, leaf: impl FnMut(&[u32]) -> u32) -> Self {
        let Collapsed { nodes, root } = plan.carry_out(leaf);
        Self { frame, nodes: settle(nodes), root }
    }

    /// Its coordinates.
    #[inline(always)]
    pub fn frame(&self) -> &Normalisation {
        &self.frame
    }

    /// Nodes and root.
    pub fn parts(&self) -> (&[Node], u32) {
        (&self.nodes, self.root)
    }

    /// What visits would be given, where there is nothing but one leaf.
    #[inline(always)]
    pub fn only_leaf(&self) -> Option<u32> {
        (self.root & LEAF != 0).then_some(self.root & !LEAF)
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

    /// See [`traverse`].
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn visit<L: Lanes, const ANY: bool>(&self, ray: &BoxRay, limit: f32, leaf: impl FnMut(u32) -> ControlFlow<(), f32>) {
        // SAFETY: `build` made the nodes, which are never too deep.
        unsafe { traverse::<L, ANY>(&self.nodes, self.root, ray, limit, leaf) }
    }

    /// Adds all that it is, but for its coordinates.
    pub fn identify(&self, identity: &mut Identity) {
        identity.numbers(&[self.nodes.len() as u32, self.root]);
        self.nodes.iter().for_each(|node| node.identify(identity));
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

    /// Memory of the nodes in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::Baseline;

    /// Rays from where numbers end meet every box or none, but no empty place of a node.
    #[test]
    fn empty_places_are_never_visited() {
        let boxes = [-1.0, 0.0, 3.0].map(|x| Bounds::of([DVec3::splat(x), DVec3::splat(x + 0.5)]));
        let tree = Tree::build(boxes.to_vec(), LeafRule { most: 1, cost: 1.0 }, |things| 100 + things[0]);
        for size in [1.0, 1e20, 1e38, 1e50, 1e53, 1e56, 1e90, 1e200, 1e307, f64::INFINITY, f64::NAN] {
            for axes in [DVec3::X, DVec3::new(0.3, -0.5, 0.9), DVec3::NEG_ONE] {
                for length in [1.0, 1e-30, 1e30, 1e200] {
                    let ray = tree.ray::<false>(axes * size, -axes * length);
                    let leaf = |reference| {
                        assert!(reference >= 100, "{ray:?}");
                        ControlFlow::Continue(f32::INFINITY)
                    };
                    // SAFETY: every processor has the baseline.
                    unsafe { tree.visit::<Baseline, false>(&ray, f32::INFINITY, leaf) };
                }
            }
        }
    }
}
