//! Better trees: subtrees move to where they cost less (Meister, Bittner, "Parallel Reinsertion for Bounding Volume Hierarchy Optimization", 2018).
//!
//! As published, a search among boxes that overlap looks at most of the tree. Here it ends after some steps, with the best place so far.

use super::{
    build::{Below, BinaryNode, Box3},
    parallel,
};

/// Share of all nodes for which the first pass looks for a better place; later ones do so for a third of it, a fifth, and so on.
const SHARE: f32 = 0.15;

/// Passes.
const PASSES: usize = 16;

/// Nodes that one search looks at: as many as it needs where boxes overlap little; where they overlap much, trees cost 3 % more than without a bound.
const STEPS: u32 = 96;

/// Lowers the surface area cost of a tree whose root is node 0. Children may stand before their parents then.
pub fn improve(nodes: Vec<BinaryNode>) -> Vec<BinaryNode> {
    if nodes.len() < 4 {
        return nodes;
    }
    let mut tree = Linked::new(nodes);
    for pass in 0..PASSES {
        let count = (tree.nodes.len() as f32 * SHARE / (2 * pass + 1) as f32) as usize;
        tree.improve(count.clamp(1, tree.nodes.len() - 1));
    }
    tree.nodes
}

/// A subtree that costs less in another place.
#[derive(Clone, Copy)]
struct Move {
    /// How much smaller the sum of all boxes' areas becomes, halved.
    gain: f32,
    from: u32,
    /// What becomes its sibling.
    to: u32,
}

/// A tree that knows parents too.
struct Linked {
    nodes: Vec<BinaryNode>,
    parents: Vec<u32>,
    /// Whether a move of this pass has changed a node.
    touched: Vec<bool>,
}

/// The other one of a pair.
fn sibling(node: u32) -> u32 {
    ((node - 1) ^ 1) + 1
}

impl Linked {
    fn new(nodes: Vec<BinaryNode>) -> Self {
        let count = nodes.len();
        let mut tree = Self { nodes, parents: vec![0; count], touched: vec![false; count] };
        (0..count as u32).for_each(|at| tree.link(at));
        tree
    }

    /// Tells the children of a node where it is.
    fn link(&mut self, at: u32) {
        if let Below::Pair(first) = self.nodes[at as usize].below() {
            self.parents[first as usize] = at;
            self.parents[first as usize + 1] = at;
        }
    }

    fn bounds(&self, at: u32) -> Box3 {
        self.nodes[at as usize].bounds
    }

    /// Moves those of the largest nodes that gain by it, the best moves first.
    fn improve(&mut self, count: usize) {
        // The nodes near the root are among the first.
        let among = self.nodes.len().min(2 * count + 2);
        let mut candidates: Vec<(u32, u32)> = (1..among as u32).map(|at| (!self.bounds(at).half_area().to_bits(), at)).collect();
        if count < candidates.len() {
            candidates.select_nth_unstable(count);
            candidates.truncate(count);
        }
        parallel::sort(&mut candidates);
        let search = |ahead: &mut Vec<(f32, u32)>, at: usize| self.search(candidates[at].1, ahead);
        let mut moves: Vec<Move> = parallel::map_with(candidates.len(), Vec::new, search).into_iter().flatten().collect();
        moves.sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.from.cmp(&b.from)));
        self.touched.fill(false);
        moves.into_iter().for_each(|chosen| self.try_move(chosen));
    }

    /// The best place for a node, if there is a better one than where it is. `ahead` is room for nodes to look at, and what would be gained if they grew by nothing.
    fn search(&self, from: u32, ahead: &mut Vec<(f32, u32)>) -> Option<Move> {
        let bounds = self.bounds(from);
        let area = bounds.half_area();
        let parent = self.parents[from as usize];
        let mut best = Move { gain: 0.0, from, to: 0 };
        let (mut top, mut beside) = (parent, sibling(from));
        // What is gained by taking the node away, as seen from `top`, below which `left` is what remains.
        let (mut gain, mut left) = (self.bounds(parent).half_area(), self.bounds(beside));
        let mut steps = STEPS;
        ahead.clear();
        loop {
            ahead.push((gain, beside));
            while let Some((gain, at)) = ahead.pop() {
                if gain - area <= best.gain || steps == 0 {
                    continue;
                }
                steps -= 1;
                let node = self.nodes[at as usize];
                let here = gain - node.bounds.union(bounds).half_area();
                if here > best.gain {
                    best = Move { gain: here, from, to: at };
                }
                if let Below::Pair(first) = node.below() {
                    let below = here + node.bounds.half_area();
                    ahead.extend([(below, first), (below, first + 1)]);
                }
            }
            if top != parent {
                left = left.union(self.bounds(beside));
                gain += self.bounds(top).half_area() - left.half_area();
            }
            if top == 0 || steps == 0 {
                break;
            }
            steps -= 1;
            beside = sibling(top);
            top = self.parents[top as usize];
        }
        (best.gain > 0.0 && best.to != sibling(from)).then_some(best)
    }

    /// Moves a subtree, unless a move before it changed what this one is about.
    fn try_move(&mut self, Move { from, to, .. }: Move) {
        let (beside, parent) = (sibling(from), self.parents[from as usize]);
        let about = [to, from, beside, parent, self.parents[to as usize]];
        if about.iter().any(|&node| self.touched[node as usize]) {
            return;
        }
        about.iter().for_each(|&node| self.touched[node as usize] = true);
        // The pair goes below `to`, where the sibling's place is taken by what was there; the sibling goes to where their parent was.
        let (host, left) = (self.nodes[to as usize], self.nodes[beside as usize]);
        self.nodes[to as usize].put_below(Below::Pair(from.min(beside)));
        self.nodes[beside as usize] = host;
        self.nodes[parent as usize] = left;
        [to, beside, parent].into_iter().for_each(|node| self.link(node));
        self.refit(to);
        if parent != 0 {
            self.refit(self.parents[parent as usize]);
        }
    }

    /// Fits the boxes from a node with children upwards, as far as they change.
    fn refit(&mut self, mut at: u32) {
        while let Below::Pair(first) = self.nodes[at as usize].below() {
            let bounds = self.bounds(first).union(self.bounds(first + 1));
            if std::mem::replace(&mut self.nodes[at as usize].bounds, bounds) == bounds || at == 0 {
                return;
            }
            at = self.parents[at as usize];
        }
    }
}
