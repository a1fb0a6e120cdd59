//! Densities over the unit square, learnt from points, in quadtrees.

use glam::DVec2;

/// A square with more points is divided.
const MOST: usize = 8;

/// Squares are halved at most so many times: on an unfolded sphere, the smallest are seen under 0.1 degrees or so.
const DEEPEST: u32 = 11;

/// What quarters get beside what their points say, as points are few.
const EVEN_SHARE: f64 = 0.1;

/// The squares of all densities. A density is even within each of its undivided squares, the *leaves*. These stand side by side, with the probability of all before them: one is chosen
/// by bisection, and the point within it by what is left of the number that chose it.
#[derive(Debug, Default)]
pub struct Squares {
    nodes: Vec<Quarters>,
    leaves: Vec<Leaf>,
    lobes: Vec<Lobe>,
}

/// One density.
#[derive(Clone, Copy, Debug)]
struct Lobe {
    /// The node of the whole square.
    root: u32,
    /// Its first leaf, and the end behind its last.
    leaves: [u32; 2],
}

/// The quarters of a square, left before right and the lower row before the upper one: nodes, or leaves with [`IS_LEAF`].
type Quarters = [u32; 4];

const IS_LEAF: u32 = 1 << 31;

/// An undivided square, or the end behind the last.
#[derive(Clone, Copy, Debug)]
struct Leaf {
    /// The probability of all before it.
    from: f32,
    place: Place,
}

/// A square: how often it was halved, and the row and column of its corner among the smallest squares.
#[derive(Clone, Copy, Debug)]
struct Place(u32);

impl Place {
    const WHOLE: Self = Self(0);

    fn depth(self) -> u32 {
        self.0 >> (2 * DEEPEST)
    }

    /// How many bits of a row or column tell places within it.
    fn shift(self) -> u32 {
        DEEPEST - self.depth()
    }

    fn corner(self) -> [u32; 2] {
        [0, DEEPEST].map(|at| self.0 >> at & ((1 << DEEPEST) - 1))
    }

    fn quarter(self, quarter: usize) -> Self {
        let (depth, shift, quarter) = (self.depth() + 1, self.shift() - 1, quarter as u32);
        let [column, row] = self.corner();
        Self((column | (quarter & 1) << shift) | (row | (quarter >> 1) << shift) << DEEPEST | depth << (2 * DEEPEST))
    }
}

/// Row and column of a point among the smallest squares.
#[inline(always)]
fn cell(point: DVec2) -> [u32; 2] {
    const SIDE: f64 = (1 << DEEPEST) as f64;
    point.to_array().map(|along| ((along * SIDE) as u32).min((1 << DEEPEST) - 1))
}

/// The quarter in which a cell lies, of a square whose half is so many bits wide.
#[inline(always)]
fn quarter([column, row]: [u32; 2], shift: u32) -> usize {
    ((column >> shift & 1) | (row >> shift & 1) << 1) as usize
}

impl Squares {
    /// Adds the density of points in [0, 1)^2 with weights above 0, at least one: its number.
    pub fn add(&mut self, mut points: Vec<(DVec2, f64)>) -> u32 {
        let first = self.leaves.len();
        let root = self.divide(&mut points, Place::WHOLE, 1.0, &mut 0.0);
        let end = self.leaves.len();
        self.leaves.push(Leaf { from: 1.0, place: Place::WHOLE });
        self.lobes.push(Lobe { root, leaves: [first as u32, end as u32] });
        self.lobes.len() as u32 - 1
    }

    /// Adds a square of points, of which there are so many in proportion to all; `before` is the probability of all leaves so far.
    fn divide(&mut self, points: &mut [(DVec2, f64)], place: Place, probability: f64, before: &mut f64) -> u32 {
        let node = self.nodes.len();
        self.nodes.push([0; 4]);
        let shift = place.shift() - 1;
        let of = |(point, _): &(DVec2, f64)| quarter(cell(*point), shift);
        points.sort_by_key(of);
        let total: f64 = points.iter().map(|(_, weight)| weight).sum();
        let mut rest = points;
        for at in 0..4 {
            let (inner, others) = rest.split_at_mut(rest.partition_point(|point| of(point) <= at));
            rest = others;
            let share = 0.25 * EVEN_SHARE + (1.0 - EVEN_SHARE) * inner.iter().map(|(_, weight)| weight).sum::<f64>() / total;
            let place = place.quarter(at);
            self.nodes[node][at] = if inner.len() > MOST && place.depth() < DEEPEST {
                self.divide(inner, place, probability * share, before)
            } else {
                self.leaves.push(Leaf { from: before.min(1.0) as f32, place });
                *before += probability * share;
                (self.leaves.len() as u32 - 1) | IS_LEAF
            };
        }
        node as u32
    }

    /// A point for `u` in [0, 1)^2, and its density.
    #[inline]
    pub fn sample(&self, lobe: u32, u: DVec2) -> (DVec2, f64) {
        let [first, end] = self.lobes[lobe as usize].leaves.map(|leaf| leaf as usize);
        // The first begins at 0.
        let leaf = first + self.leaves[first + 1..end].partition_point(|leaf| f64::from(leaf.from) <= u.x);
        let (from, probability) = self.interval(leaf);
        let place = self.leaves[leaf].place;
        let corner = place.corner().map(|along| f64::from(along) / f64::from(1 << DEEPEST));
        let size = 1.0 / f64::from(1 << place.depth());
        let within = DVec2::new(((u.x - from) / probability).min(1.0 - f64::EPSILON), u.y);
        (DVec2::from(corner) + within * size, probability / (size * size))
    }

    /// The density with which [`Self::sample`] chooses a point.
    #[inline]
    pub fn pdf(&self, lobe: u32, point: DVec2) -> f64 {
        let cell = cell(point);
        let (mut at, mut shift) = (self.lobes[lobe as usize].root, DEEPEST);
        while at & IS_LEAF == 0 {
            shift -= 1;
            at = self.nodes[at as usize][quarter(cell, shift)];
        }
        let (_, probability) = self.interval((at & !IS_LEAF) as usize);
        probability * f64::from(1u32 << (2 * (DEEPEST - shift)))
    }

    /// The probability of all before a leaf, and its own.
    #[inline]
    fn interval(&self, leaf: usize) -> (f64, f64) {
        let (from, to) = (f64::from(self.leaves[leaf].from), f64::from(self.leaves[leaf + 1].from));
        (from, to - from)
    }
}
