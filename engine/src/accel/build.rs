//! Binary trees over boxes.

use glam::{Vec3, Vec3A};
use obvhs::{
    aabb::Aabb,
    bvh2::{Bvh2, reinsertion::ReinsertionOptimizer},
    ploc::{PlocBuilder, PlocSearchDistance, SortPrecision},
};

use super::median;

/// A box in normalised coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Box3 {
    /// Lowest coordinates.
    pub min: Vec3,
    /// Highest coordinates.
    pub max: Vec3,
}

impl Box3 {
    /// Contains nothing.
    pub const EMPTY: Self = Self { min: Vec3::INFINITY, max: Vec3::NEG_INFINITY };

    /// The smallest box around points.
    pub fn of(points: impl IntoIterator<Item = Vec3>) -> Self {
        points.into_iter().fold(Self::EMPTY, |sum, p| Self { min: sum.min.min(p), max: sum.max.max(p) })
    }

    /// The smallest box around both.
    pub fn union(self, o: Self) -> Self {
        Self { min: self.min.min(o.min), max: self.max.max(o.max) }
    }

    /// What lies in both.
    pub fn intersection(self, o: Self) -> Self {
        Self { min: self.min.max(o.min), max: self.max.min(o.max) }
    }

    /// Half of the surface area; 0 for the empty box.
    pub fn half_area(&self) -> f32 {
        let d = (self.max - self.min).max(Vec3::ZERO);
        d.x * d.y + d.y * d.z + d.z * d.x
    }

    /// Twice the middle.
    pub fn centroid(&self) -> Vec3 {
        self.min + self.max
    }
}

/// A node of a binary tree.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BinaryNode {
    /// The box around everything below.
    pub bounds: Box3,
    /// What is below.
    pub below: Below,
}

/// What a node of a binary tree holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Below {
    /// The box of this index.
    Leaf(u32),
    /// Two nodes, at this index and the next; both stand after their parent.
    Pair(u32),
}

/// Builds a tree over at least one box; all are finite and in [-1, 1]. The root is node 0. The same boxes give the same tree everywhere.
pub fn build(boxes: &[Box3]) -> Vec<BinaryNode> {
    if is_nested(boxes) { median::build(boxes) } else { clustered(boxes) }
}

/// Locally ordered clustering (Meister, Bittner, "Parallel Locally-Ordered Clustering for BVH Construction", 2018), then reinsertion (Meister, Bittner,
/// "Parallel Reinsertion for BVH Optimization", 2018).
fn clustered(boxes: &[Box3]) -> Vec<BinaryNode> {
    if boxes.len() < 3 {
        return median::build(boxes);
    }
    let aabbs: Vec<Aabb> = boxes.iter().map(|b| Aabb::new(Vec3A::from(b.min), Vec3A::from(b.max))).collect();
    let indices = (0..boxes.len() as u32).collect();
    let mut tree = PlocBuilder::with_capacity(boxes.len()).build(PlocSearchDistance::Medium, &aabbs, indices, SortPrecision::U64, 1);
    ReinsertionOptimizer::default().run(&mut tree, 0.15, None);
    from_obvhs(&tree)
}

fn from_obvhs(tree: &Bvh2) -> Vec<BinaryNode> {
    let node = |index: usize| {
        let node = &tree.nodes[index];
        let bounds = Box3 { min: node.aabb.min.into(), max: node.aabb.max.into() };
        let below =
            if node.is_leaf() { Below::Leaf(tree.primitive_indices[node.first_index as usize]) } else { Below::Pair(node.first_index) };
        BinaryNode { bounds, below }
    };
    // Reinsertion leaves children anywhere: number them anew, parents first.
    let mut nodes = vec![node(0)];
    let mut next = 0;
    while next < nodes.len() {
        if let Below::Pair(first) = nodes[next].below {
            nodes[next].below = Below::Pair(nodes.len() as u32);
            nodes.extend([node(first as usize), node(first as usize + 1)]);
        }
        next += 1;
    }
    nodes
}

/// Whether many boxes share a middle. Clustering joins the smallest of nested boxes first and then one at a time: it would take
/// quadratic time and end in a chain.
fn is_nested(boxes: &[Box3]) -> bool {
    const MANY: usize = 128;
    let mut middles: Vec<[i32; 3]> = boxes.iter().map(|b| (b.centroid() * (1 << 20) as f32).to_array().map(|x| x as i32)).collect();
    middles.sort_unstable();
    middles.len() > MANY && (MANY..middles.len()).any(|i| middles[i] == middles[i - MANY])
}
