//! Binary trees from the leaves up: neighbours join that make the smallest box (Meister, Bittner, "Parallel Locally-Ordered Clustering for Bounding
//! Volume Hierarchy Construction", 2018; the first pass looks at the next neighbour only, as in Lacaze et al., "PLOC++", 2022).
//!
//! As published, nested boxes join one pair a pass, and equal ones hardly faster. Here ties go to pairs that may be mutual, and a pass of few joins
//! is followed by one in which everything joins its neighbour: the number of passes is a logarithm, whatever the boxes are.

use glam::Vec3;

use super::{
    build::{Below, BinaryNode, Box3},
    parallel,
};

/// Neighbours on either side that a cluster may join.
const WINDOW: usize = 16;

/// Clusters that one thread looks at.
const CHUNK: usize = 1 << 14;

/// A pass in which less than this part of all clusters joins is one of few joins.
const FEW: usize = 16;

/// Builds a tree over at least one box; all are finite and in [-1, 1]. The root is node 0, and the nodes near it are among the first.
pub fn build(boxes: &[Box3]) -> Vec<BinaryNode> {
    let mut clusters = Clusters::new(boxes);
    // Pairs fill the places from the last to the first.
    let mut nodes = vec![BinaryNode::new(Box3::EMPTY, Below::Leaf(0)); 2 * boxes.len() - 1];
    let mut free = nodes.len();
    let mut best = vec![u64::MAX; boxes.len() + WINDOW];
    let (mut first, mut stuck) = (true, false);
    while clusters.count > 1 {
        let before = clusters.count;
        match (stuck, first) {
            (true, _) => best[..before].iter_mut().enumerate().for_each(|(at, best)| *best = if at ^ 1 < before { 1 } else { u64::MAX }),
            (_, true) => clusters.search::<1>(&mut best),
            _ => clusters.search::<WINDOW>(&mut best),
        }
        clusters.join(&best, &mut nodes, &mut free);
        (first, stuck) = (false, (before - clusters.count) * FEW < before);
    }
    nodes[0] = clusters.node(0);
    nodes
}

/// Subtrees that have not been joined yet, along a space-filling curve. By coordinate, so that a cluster is compared with several others at a time;
/// behind the last stand as many boxes far away as it might be compared with.
struct Clusters {
    bounds: [Vec<f32>; 6],
    below: Vec<Below>,
    count: usize,
}

impl Clusters {
    fn new(boxes: &[Box3]) -> Self {
        let order = along_curve(boxes);
        let column = |i: usize| {
            let value = |b: &Box3| if i < 3 { b.min[i] } else { b.max[i - 3] };
            parallel::map(order.len() + WINDOW, |at| order.get(at).map_or(0.0, |&at| value(&boxes[at as usize])))
        };
        let bounds = std::array::from_fn(column);
        let mut clusters = Self { bounds, below: order.iter().map(|&at| Below::Leaf(at)).collect(), count: order.len() };
        clusters.put_padding();
        clusters
    }

    fn put_padding(&mut self) {
        const FAR_AWAY: f32 = (1u64 << 40) as f32;
        self.bounds.iter_mut().for_each(|column| column[self.count..self.count + WINDOW].fill(FAR_AWAY));
    }

    fn node(&self, at: usize) -> BinaryNode {
        let [x, y, z, to_x, to_y, to_z] = self.bounds.each_ref().map(|column| column[at]);
        BinaryNode::new(Box3 { min: Vec3::new(x, y, z), max: Vec3::new(to_x, to_y, to_z) }, self.below[at])
    }

    /// Finds for every cluster the one within `REACH` places that makes the smallest box with it: the area's bits above those of the exclusive or of
    /// both places. That is one order of all pairs, in which some pair comes first for both of its clusters, and equal boxes prefer their neighbours.
    fn search<const REACH: usize>(&self, best: &mut [u64]) {
        best[..self.count + REACH].fill(u64::MAX);
        let search = |first: usize, best: &mut [u64]| {
            let mut behind = [u64::MAX; REACH];
            for at in 0..best.len() {
                let areas = self.areas::<REACH>(first + at);
                let mut own = best[at];
                // Areas are not negative: their bits order as they do.
                let key = |apart: usize| u64::from(areas[apart].to_bits()) << 32 | ((first + at) ^ (first + at + 1 + apart)) as u64;
                let inside = (best.len() - at - 1).min(REACH);
                for (apart, other) in best[at + 1..][..inside].iter_mut().enumerate() {
                    (own, *other) = (own.min(key(apart)), key(apart).min(*other));
                }
                for (apart, other) in (inside..REACH).zip(&mut behind) {
                    (own, *other) = (own.min(key(apart)), key(apart).min(*other));
                }
                best[at] = own;
            }
            behind
        };
        let behind = parallel::map_chunks(&mut best[..self.count], CHUNK, search);
        for (chunk, behind) in behind.iter().enumerate() {
            let end = ((chunk + 1) * CHUNK).min(self.count);
            best[end..].iter_mut().zip(behind).for_each(|(best, key)| *best = (*best).min(*key));
        }
    }

    /// Half of the areas of the boxes around a cluster and each of those behind it.
    #[inline(always)]
    fn areas<const REACH: usize>(&self, at: usize) -> [f32; REACH] {
        let extent = |axis: usize| {
            let (low, high) = (&self.bounds[axis], &self.bounds[axis + 3]);
            let (own_low, own_high) = (low[at], high[at]);
            let (low, high) = (&low[at + 1..][..REACH], &high[at + 1..][..REACH]);
            let mut extent = [0.0; REACH];
            for lane in 0..REACH {
                let (low, high) = (low[lane], high[lane]);
                extent[lane] = (if high > own_high { high } else { own_high }) - (if low < own_low { low } else { own_low });
            }
            extent
        };
        let (x, y, z) = (extent(0), extent(1), extent(2));
        let mut areas = [0.0; REACH];
        for lane in 0..REACH {
            areas[lane] = x[lane] * y[lane] + y[lane] * z[lane] + z[lane] * x[lane];
        }
        areas
    }

    /// Joins those that are each other's best, in the place of the first.
    fn join(&mut self, best: &[u64], nodes: &mut [BinaryNode], free: &mut usize) {
        let mut kept = 0;
        for at in 0..self.count {
            let apart = best[at] as u32;
            let other = at ^ apart as usize;
            let mutual = other < self.count && best[other] as u32 == apart;
            if mutual && other < at {
                continue;
            }
            let mut node = self.node(at);
            if mutual {
                let pair = [node, self.node(other)];
                *free -= 2;
                nodes[*free..*free + 2].copy_from_slice(&pair);
                node = BinaryNode::new(pair[0].bounds.union(pair[1].bounds), Below::Pair(*free as u32));
            }
            self.put(kept, &node);
            kept += 1;
        }
        self.count = kept;
        self.put_padding();
    }

    fn put(&mut self, at: usize, node: &BinaryNode) {
        let Box3 { min, max } = node.bounds;
        for axis in 0..3 {
            self.bounds[axis][at] = min[axis];
            self.bounds[axis + 3][at] = max[axis];
        }
        self.below[at] = node.below();
    }
}

/// The order of boxes' middles along a Z-order curve (Morton, 1966); of those in one place by size, then as they come.
fn along_curve(boxes: &[Box3]) -> Vec<u32> {
    let all = Box3::of(boxes.iter().map(Box3::centroid));
    let scale = (all.max - all.min).map(|extent| if extent > 0.0 { LAST_CELL / extent } else { 0.0 });
    let key = |at: usize| {
        let b = &boxes[at];
        let cell = ((b.centroid() - all.min) * scale).min(Vec3::splat(LAST_CELL));
        let code = spread(cell.x as u64) | spread(cell.y as u64) << 1 | spread(cell.z as u64) << 2;
        (code, b.half_area().to_bits(), at as u32)
    };
    let mut keys: Vec<(u64, u32, u32)> = parallel::map(boxes.len(), key);
    parallel::sort(&mut keys);
    keys.into_iter().map(|(_, _, at)| at).collect()
}

/// Cells along an axis, but one.
const LAST_CELL: f32 = ((1 << 21) - 1) as f32;

/// Puts two zeros behind each of 21 bits.
fn spread(bits: u64) -> u64 {
    let bits = (bits | bits << 32) & 0x001f_0000_0000_ffff;
    let bits = (bits | bits << 16) & 0x001f_0000_ff00_00ff;
    let bits = (bits | bits << 8) & 0x100f_00f0_0f00_f00f;
    let bits = (bits | bits << 4) & 0x10c3_0c30_c30c_30c3;
    (bits | bits << 2) & 0x1249_2492_4924_9249
}
