//! Binary trees over boxes.

use glam::Vec3;

use super::{cluster, median, reinsert, traverse::MAX_DEPTH};

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
    /// What is below: twice the index, plus 1 for a pair. Trees over a million instances are large enough while they are made.
    below: u32,
}

impl BinaryNode {
    /// A node whose box is the one around all that is below.
    pub fn new(bounds: Box3, below: Below) -> Self {
        Self { bounds, below: below.packed() }
    }

    /// What is below.
    pub fn below(&self) -> Below {
        if self.below & 1 == 1 { Below::Pair(self.below >> 1) } else { Below::Leaf(self.below >> 1) }
    }

    /// Puts something else below; the box stays.
    pub fn put_below(&mut self, below: Below) {
        self.below = below.packed();
    }
}

/// What a node of a binary tree holds. Indices are below 2^31.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Below {
    /// The box of this index.
    Leaf(u32),
    /// Two nodes, at this index and the next.
    Pair(u32),
}

impl Below {
    fn packed(self) -> u32 {
        match self {
            Self::Leaf(index) => index << 1,
            Self::Pair(index) => index << 1 | 1,
        }
    }
}

/// A tree that is not at its best yet: enough to tell which of two sets of boxes has the cheaper one.
pub struct Draft(Vec<BinaryNode>);

impl Draft {
    /// Over at least one box; all are finite and in [-1, 1]. The same boxes give the same tree everywhere.
    pub fn over(boxes: &[Box3]) -> Self {
        Self(cluster::build(boxes))
    }

    /// What a random ray costs that looks at every box whose parent it meets, in proportion to the area of the root's.
    pub fn cost(&self) -> f64 {
        self.0.iter().map(|node| f64::from(node.bounds.half_area())).sum()
    }

    /// The tree at its best. The root is node 0, children stand after their parents, and what is below the first of two comes right after them, before what is
    /// below the second. No way through it is longer than may be traversed.
    pub fn finish(self) -> Vec<BinaryNode> {
        let nodes = in_order(&reinsert::improve(self.0));
        if depth(&nodes) <= MAX_DEPTH { nodes } else { median::build(&leaves(&nodes)) }
    }
}

/// The same tree with its nodes in the order that [`Draft::finish`] promises.
fn in_order(nodes: &[BinaryNode]) -> Vec<BinaryNode> {
    let mut ordered = Vec::with_capacity(nodes.len());
    ordered.push(nodes[0]);
    let mut work = vec![0usize];
    while let Some(at) = work.pop() {
        if let Below::Pair(first) = ordered[at].below() {
            let new = ordered.len();
            ordered[at].put_below(Below::Pair(new as u32));
            ordered.extend_from_slice(&nodes[first as usize..first as usize + 2]);
            work.extend([new + 1, new]);
        }
    }
    ordered
}

/// The boxes that a tree was made of.
fn leaves(nodes: &[BinaryNode]) -> Vec<Box3> {
    let mut boxes = vec![Box3::EMPTY; nodes.len() / 2 + 1];
    for node in nodes {
        if let Below::Leaf(index) = node.below() {
            boxes[index as usize] = node.bounds;
        }
    }
    boxes
}

/// Nodes on the longest way from the root, or 255 if there are more. A wide tree is never deeper than the binary tree that it is made of.
fn depth(nodes: &[BinaryNode]) -> usize {
    let mut depth = vec![1u8; nodes.len()];
    for (at, node) in nodes.iter().enumerate() {
        if let Below::Pair(first) = node.below() {
            let below = depth[at].saturating_add(1);
            depth[first as usize..first as usize + 2].fill(below);
        }
    }
    depth.into_iter().max().unwrap_or(0).into()
}

const _: () = assert!(MAX_DEPTH < 255);

#[cfg(test)]
mod tests {
    use super::*;

    /// Boxes of all kinds: anywhere, equal, nested in a corner, nested about a middle, one around all others.
    fn feared(count: u32) -> Vec<Vec<Box3>> {
        let cube = |middle: Vec3, half: f32| Box3 { min: middle - half, max: middle + half };
        let anywhere = |i: u32| Vec3::new((i * 7919 % 1009) as f32, (i * 104_729 % 997) as f32, (i * 1_299_709 % 991) as f32) / 1009.0;
        let part = |i: u32| i as f32 / count as f32;
        vec![
            (0..count).map(|i| cube(anywhere(i) - 0.5, 0.01)).collect(),
            (0..count).map(|_| cube(Vec3::ZERO, 0.5)).collect(),
            (0..count).map(|i| Box3 { min: Vec3::NEG_ONE, max: Vec3::splat(part(i)) }).collect(),
            (0..count).map(|i| cube(Vec3::ZERO, part(count - i))).collect(),
            (0..count).map(|i| if i == 7 { cube(Vec3::ZERO, 1.0) } else { cube(anywhere(i) - 0.5, 0.001) }).collect(),
            (0..count).map(|i| cube(anywhere(i) * 0.1, 0.9)).collect(),
        ]
    }

    /// Every box is below the root once, and every node's box is that of what is below it.
    fn check(nodes: &[BinaryNode], boxes: &[Box3]) {
        let mut seen = vec![false; boxes.len()];
        let mut work = vec![0usize];
        while let Some(at) = work.pop() {
            match nodes[at].below() {
                Below::Leaf(index) => {
                    assert_eq!(nodes[at].bounds, boxes[index as usize]);
                    assert!(!std::mem::replace(&mut seen[index as usize], true));
                }
                Below::Pair(first) => {
                    let first = first as usize;
                    assert_eq!(nodes[at].bounds, nodes[first].bounds.union(nodes[first + 1].bounds));
                    work.extend([first, first + 1]);
                }
            }
        }
        assert!(seen.into_iter().all(|seen| seen));
    }

    fn cost(nodes: &[BinaryNode]) -> f64 {
        nodes.iter().map(|node| f64::from(node.bounds.half_area())).sum()
    }

    #[test]
    fn trees_hold_every_box_once_however_many_there_are() {
        for count in (1..40).chain([1000]) {
            for boxes in feared(count) {
                let clustered = cluster::build(&boxes);
                check(&clustered, &boxes);
                check(&reinsert::improve(clustered), &boxes);
                for nodes in [Draft::over(&boxes).finish(), median::build(&boxes)] {
                    check(&nodes, &boxes);
                    assert_eq!((in_order(&nodes), leaves(&nodes)), (nodes, boxes.clone()));
                }
            }
        }
    }

    /// As published, clustering makes chains of nested and of equal boxes, as deep as they are many.
    #[test]
    fn clusters_of_feared_boxes_are_shallow() {
        for (kind, boxes) in feared(20_000).iter().enumerate() {
            let depth = depth(&in_order(&cluster::build(boxes)));
            assert!(depth <= 40, "{kind}: {depth}");
        }
    }

    #[test]
    fn clustering_beats_medians_and_reinsertion_beats_clustering() {
        for (kind, boxes) in feared(5000).iter().enumerate() {
            let clustered = cluster::build(boxes);
            let (by_median, by_cluster, improved) =
                (cost(&median::build(boxes)), cost(&clustered), cost(&reinsert::improve(clustered.clone())));
            println!("{kind}: {by_median} by medians, {by_cluster} by clusters, {improved} improved");
            assert!(by_cluster < by_median * 1.01, "{kind}");
            assert!(improved < by_cluster * 1.0001, "{kind}");
        }
    }
}
