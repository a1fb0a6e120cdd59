//! Nodes of eight children.

/// Marks a reference as one to a leaf.
pub const LEAF: u32 = 1 << 31;

/// Eight children: boxes in structure-of-arrays form, and references.
#[repr(C, align(64))]
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Lower x, y, z, upper x, y, z of each child. An empty place has an inverted infinite box, which no ray meets.
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
}
