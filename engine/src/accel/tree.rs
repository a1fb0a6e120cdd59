//! A tree of eight-wide nodes over boxes.

use std::ops::ControlFlow;

use glam::DVec3;

use super::{
    build::{self, Box3},
    collapse::{Collapsed, LeafRule, collapse},
    frame::{BoxRay, Normalisation},
    median,
    node::Node,
    simd::Lanes,
    traverse::{MAX_DEPTH, traverse},
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
    pub fn build(boxes: &[Bounds], rule: LeafRule, mut leaf: impl FnMut(&Normalisation, &[u32]) -> u32) -> Self {
        let frame = Normalisation::of(boxes.iter().fold(Bounds::EMPTY, |sum, b| sum.union(*b)));
        let normalised: Vec<Box3> =
            boxes.iter().map(|b| Box3 { min: frame.point(b.min).as_vec3(), max: frame.point(b.max).as_vec3() }).collect();
        let binary = build::build(&normalised);
        let binary = if depth_fits(&binary) { binary } else { median::build(&normalised) };
        let Collapsed { nodes, root } = collapse(&binary, rule, |boxes| leaf(&frame, boxes));
        Self { frame, nodes, root }
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
        // SAFETY: `build` made the nodes, and checked their depth.
        unsafe { traverse::<L, ANY>(&self.nodes, self.root, ray, limit, leaf) }
    }

    /// Memory of the nodes in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.nodes)
    }
}

/// Whether the stack of a traversal is large enough: a wide tree is never deeper than the binary tree that it was made of.
fn depth_fits(binary: &[build::BinaryNode]) -> bool {
    let mut depth = vec![1; binary.len()];
    for (at, node) in binary.iter().enumerate() {
        if let build::Below::Pair(first) = node.below {
            depth[first as usize] = depth[at] + 1;
            depth[first as usize + 1] = depth[at] + 1;
        }
    }
    depth.into_iter().max().unwrap_or(0) <= MAX_DEPTH
}
