//! From binary trees to nodes of eight children.

use super::{
    build::{Below, BinaryNode, Box3},
    frame::OUTWARD,
    node::{LEAF, Node},
};

/// What leaves of triangles are, and what they cost compared with testing one node.
#[derive(Clone, Copy, Debug)]
pub struct LeafRule {
    /// Most boxes in a leaf, at most 8.
    pub most: u32,
    /// Cost of visiting a leaf, of any size.
    pub cost: f32,
}

impl LeafRule {
    /// A pack of triangles costs less than a node, measured.
    pub const MEASURED: Self = Self { most: 8, cost: 0.7 };
}

/// Nodes and root reference.
pub struct Collapsed {
    /// All nodes.
    pub nodes: Vec<Node>,
    /// Reference to the root, which is a leaf when there is nothing else.
    pub root: u32,
}

/// How a subtree is best collapsed when it takes up one, two, ... seven places of a wide node.
#[derive(Clone, Copy)]
struct Plan {
    /// `split[k - 1]`: with k places, how many go to the first child; 0: use one place less.
    split: [u8; 7],
    /// How many of a wide node's eight places go to the first child, where this node becomes one; 0 where it becomes a leaf.
    wide: u8,
}

impl Plan {
    const LEAF: Self = Self { split: [0; 7], wide: 0 };
}

/// More boxes than a leaf may have.
const TOO_MANY: u32 = 9;

/// What a subtree costs at the least with one, two, ... seven places, and how many boxes it has.
#[derive(Clone, Copy)]
struct Costs {
    of: [f32; 7],
    count: u32,
}

/// A binary tree, and how it is best collapsed.
pub struct Collapse {
    binary: Vec<BinaryNode>,
    /// Of those that have a pair below, in the pairs' order.
    plans: Vec<Plan>,
}

impl Collapse {
    /// Finds the wide tree of least surface area cost (Wald et al., "Getting Rid of Packets", 2008; Ylitie et al., "Efficient Incoherent Ray Traversal on
    /// GPUs Through Compressed Wide BVHs", 2017, section 3.1). Nodes are in the order of [`super::build::Draft::finish`]. Boxes from `others` on are alone in their
    /// leaves, which cost as much as a node.
    pub fn plan(binary: Vec<BinaryNode>, rule: LeafRule, others: u32) -> Self {
        let mut plans = vec![Plan::LEAF; binary.len() / 2];
        // Costs are asked for once, by the parent. From the last pair to the first, those of the children of both of a pair are the last that were found.
        let mut known: Vec<Costs> = Vec::new();
        let mut of = |at: usize, known: &mut Vec<Costs>| {
            let area = binary[at].bounds.half_area();
            match (binary[at].below(), known.last_chunk::<2>()) {
                (Below::Leaf(other), _) if other >= others => Costs { of: [area; 7], count: TOO_MANY },
                (Below::Pair(pair), Some(&[second, first])) => {
                    known.truncate(known.len() - 2);
                    let (plan, costs) = weigh(area, [first, second], rule);
                    plans[pair as usize / 2] = plan;
                    costs
                }
                _ => Costs { of: [area * rule.cost; 7], count: 1 },
            }
        };
        for first in (1..binary.len()).step_by(2).rev() {
            let first_costs = of(first, &mut known);
            let second_costs = of(first + 1, &mut known);
            known.extend([second_costs, first_costs]);
        }
        of(0, &mut known);
        Self { binary, plans }
    }

    /// Makes the wide tree. `leaf` is given the boxes of every leaf, in ascending order, and returns what its reference holds (31 bits).
    pub fn carry_out(self, leaf: impl FnMut(&[u32]) -> u32) -> Collapsed {
        let Self { binary, plans } = &self;
        collapse(binary, &|at| if let Below::Pair(pair) = binary[at].below() { plans[pair as usize / 2] } else { Plan::LEAF }, leaf)
    }
}

fn collapse(binary: &[BinaryNode], plan_of: &impl Fn(usize) -> Plan, mut leaf: impl FnMut(&[u32]) -> u32) -> Collapsed {
    let mut out = Collapsed { nodes: Vec::new(), root: LEAF };
    let mut content = Vec::new();
    let mut reference = |at: usize, next_node: usize| {
        if plan_of(at).wide > 0 {
            return (next_node as u32, true);
        }
        content.clear();
        boxes_below(binary, at, &mut content);
        content.sort_unstable();
        (LEAF | leaf(&content), false)
    };
    let (root, inner) = reference(0, 0);
    out.root = root;
    let mut work = Vec::new();
    if inner {
        out.nodes.push(Node::EMPTY);
        work.push((0usize, 0usize));
    }
    let mut children = Vec::with_capacity(8);
    while let Some((at, place)) = work.pop() {
        children.clear();
        if let Below::Pair(first) = binary[at].below() {
            let places = plan_of(at).wide.into();
            gather(binary, plan_of, first as usize, places, &mut children);
            gather(binary, plan_of, first as usize + 1, 8 - places, &mut children);
        }
        // Any-hit traversal takes children in order: large ones are hit most.
        children.sort_by(|&a, &b| binary[b].bounds.half_area().total_cmp(&binary[a].bounds.half_area()).then(a.cmp(&b)));
        let mut node = Node::EMPTY;
        for (slot, &child) in children.iter().enumerate() {
            let Box3 { min, max } = binary[child].bounds;
            for axis in 0..3 {
                node.bounds[axis][slot] = min[axis] - OUTWARD;
                node.bounds[3 + axis][slot] = max[axis] + OUTWARD;
            }
            let (reference, inner) = reference(child, out.nodes.len());
            node.children[slot] = reference;
            if inner {
                work.push((child, out.nodes.len()));
                out.nodes.push(Node::EMPTY);
            }
        }
        out.nodes[place] = node;
    }
    out
}

/// The best plan for a node of this area over a pair: a leaf, or what its children are.
fn weigh(area: f32, [first, second]: [Costs; 2], rule: LeafRule) -> (Plan, Costs) {
    let mut plan = Plan::LEAF;
    let best_split = |places: usize| {
        let splits = places.saturating_sub(7).max(1)..places.min(8);
        let costs = splits.map(|k| (first.of[k - 1] + second.of[places - k - 1], k as u8));
        costs.fold((f32::INFINITY, 1), |best, next| if next.0 < best.0 { next } else { best })
    };
    let count = (first.count + second.count).min(TOO_MANY);
    let (below, wide) = best_split(8);
    let as_leaf = if count <= rule.most { area * rule.cost } else { f32::INFINITY };
    if as_leaf > area + below {
        plan.wide = wide;
    }
    let mut of = [as_leaf.min(area + below); 7];
    for places in 2..=7 {
        let (cost, split) = best_split(places);
        of[places - 1] = of[places - 2];
        if cost < of[places - 2] {
            of[places - 1] = cost;
            plan.split[places - 1] = split;
        }
    }
    (plan, Costs { of, count })
}

/// The nodes that take up to `places` places for the subtree at `at`.
fn gather(binary: &[BinaryNode], plan_of: &impl Fn(usize) -> Plan, at: usize, mut places: usize, out: &mut Vec<usize>) {
    let plan = plan_of(at);
    while places > 1 && plan.split[places - 1] == 0 {
        places -= 1;
    }
    match binary[at].below() {
        Below::Pair(first) if places > 1 => {
            let split = usize::from(plan.split[places - 1]);
            gather(binary, plan_of, first as usize, split, out);
            gather(binary, plan_of, first as usize + 1, places - split, out);
        }
        _ => out.push(at),
    }
}

fn boxes_below(binary: &[BinaryNode], at: usize, out: &mut Vec<u32>) {
    match binary[at].below() {
        Below::Leaf(index) => out.push(index),
        Below::Pair(first) => {
            boxes_below(binary, first as usize, out);
            boxes_below(binary, first as usize + 1, out);
        }
    }
}
