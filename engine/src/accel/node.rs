//! Nodes of eight children.

use super::{identity::Identity, simd::Lanes};

/// Bytes of one bound of all children of a node.
pub const BOUND: usize = size_of::<[f32; 8]>();

/// Marks a reference as one to a leaf.
pub const LEAF: u32 = 1 << 31;

/// Eight children: boxes in structure-of-arrays form, and references.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Lower x, y, z, upper x, y, z of each child, grown by `OUTWARD`. An empty place has an inverted infinite box, which no ray meets.
    pub bounds: [[f32; 8]; 6],
    /// Index of a node, or `LEAF` with what the builder was given for the leaf.
    pub children: [u32; 8],
}

impl Node {
    /// No children.
    pub const EMPTY: Self = Self {
        bounds: [
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::NEG_INFINITY; 8],
            [f32::NEG_INFINITY; 8],
        ],
        children: [LEAF; 8],
    };

    /// Adds all that it is.
    pub fn identify(&self, identity: &mut Identity) {
        identity.floats(self.bounds.as_flattened());
        identity.numbers(&self.children);
    }

    /// Parameters at which a ray meets one bound of every child.
    ///
    /// # Safety
    /// `bound` is a multiple of `BOUND` below 6 of them. The processor has the instructions of `L`.
    #[inline(always)]
    pub unsafe fn distance<L: Lanes>(&self, bound: usize, origin: L, inverse: L) -> L {
        // SAFETY: by this function's own condition.
        unsafe { L::load(&*(&raw const self.bounds).cast::<[f32; 8]>().byte_add(bound)).sub(origin).mul(inverse) }
    }
}
