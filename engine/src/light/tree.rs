//! Which of many lights to look at: a tree of lights, walked at random towards those that may matter most.
//!
//! Conty Estevez, Kulla, "Importance Sampling of Many Lights with Adaptive Tree Splitting" (2018), in the form of Pharr, Jakob, Humphreys, "Physically Based
//! Rendering", 4th ed., 12.6.3. Nothing here knows a length of its own: a scene of another scale is sampled alike.

use glam::DVec3;

use crate::{math::acos, math::cos, shape::Bounds};

/// What is known of a light, or of several.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cluster {
    /// The box around them.
    pub bounds: Bounds,
    /// Power; above 0.
    pub power: f64,
    /// Unit vector in the middle of their normals.
    pub axis: DVec3,
    /// Cosine of the largest angle between the axis and a normal.
    pub spread: f64,
    /// Cosine of the largest angle between a normal and what it gives off: 0 for surfaces, which are weakened by the cosine, -1 if light goes everywhere.
    pub reach: f64,
    /// Whether the opposite side of each shines too.
    pub two_sided: bool,
}

/// A tree of lights.
#[derive(Clone, Debug, Default)]
pub struct LightTree {
    /// The first is the root; the first child of a node stands behind it.
    nodes: Vec<Node>,
    /// The way from the root to each light, a bit a node, the lowest first: 1 leads to the second child.
    ways: Vec<u64>,
}

#[derive(Clone, Copy, Debug)]
struct Node {
    cluster: Cluster,
    /// A light, or the place of the second child.
    at: At,
}

#[derive(Clone, Copy, Debug)]
enum At {
    Light(u32),
    Second(u32),
}

/// Ways are so long at the most: below this depth, lights are halved by their number.
const DEEPEST_BY_COST: u32 = 30;

/// Places at which a split is tried along each axis.
const BINS: usize = 12;

impl LightTree {
    /// A tree of these lights.
    pub fn new(lights: &[Cluster]) -> Self {
        let mut tree = Self { nodes: Vec::with_capacity(2 * lights.len()), ways: vec![0; lights.len()] };
        let mut order: Vec<u32> = (0..lights.len() as u32).collect();
        if !order.is_empty() {
            tree.build(lights, &mut order, 0, 0);
        }
        tree
    }

    /// Whether there are no lights.
    pub fn is_empty(&self) -> bool {
        self.ways.is_empty()
    }

    fn build(&mut self, lights: &[Cluster], order: &mut [u32], depth: u32, way: u64) -> Cluster {
        let place = self.nodes.len();
        if let [light] = *order {
            let cluster = lights[light as usize];
            self.nodes.push(Node { cluster, at: At::Light(light) });
            self.ways[light as usize] = way;
            return cluster;
        }
        let middle = split(lights, order, depth);
        self.nodes.push(Node { cluster: lights[order[0] as usize], at: At::Second(0) });
        let (left, right) = order.split_at_mut(middle);
        let first = self.build(lights, left, depth + 1, way);
        let second = self.nodes.len() as u32;
        let cluster = first.joined(&self.build(lights, right, depth + 1, way | 1 << depth));
        self.nodes[place] = Node { cluster, at: At::Second(second) };
        cluster
    }

    /// A light for a point, and for a surface there of this unit normal, chosen by a number in [0, 1); and the probability of that. `None` if none can matter.
    #[inline]
    pub fn sample(&self, point: DVec3, normal: Option<DVec3>, mut u: f64) -> Option<(u32, f64)> {
        let mut node = self.nodes.first()?;
        if let At::Light(light) = node.at {
            return Some((light, 1.0));
        }
        let (mut at, mut probability) = (0, 1.0);
        loop {
            match node.at {
                At::Light(light) => return (probability > 0.0).then_some((light, probability)),
                At::Second(second) => {
                    let share = self.share_of_first(at, second as usize, point, normal)?;
                    if u < share {
                        u = (u / share).min(1.0 - f64::EPSILON);
                        probability *= share;
                        at += 1;
                    } else {
                        u = ((u - share) / (1.0 - share)).clamp(0.0, 1.0 - f64::EPSILON);
                        probability *= 1.0 - share;
                        at = second as usize;
                    }
                    node = &self.nodes[at];
                }
            }
        }
    }

    /// The probability with which [`Self::sample`] chooses a light.
    #[inline]
    pub fn probability(&self, point: DVec3, normal: Option<DVec3>, light: u32) -> f64 {
        let mut way = self.ways[light as usize];
        let (mut at, mut probability) = (0, 1.0);
        while let At::Second(second) = self.nodes[at].at {
            let Some(share) = self.share_of_first(at, second as usize, point, normal) else { return 0.0 };
            (at, probability) = if way & 1 == 0 { (at + 1, probability * share) } else { (second as usize, probability * (1.0 - share)) };
            way >>= 1;
        }
        probability
    }

    /// How probable the first child of a node is; `None` if neither can matter.
    #[inline]
    fn share_of_first(&self, at: usize, second: usize, point: DVec3, normal: Option<DVec3>) -> Option<f64> {
        let first = self.nodes[at + 1].cluster.importance(point, normal);
        let both = first + self.nodes[second].cluster.importance(point, normal);
        (both > 0.0).then(|| first / both)
    }
}

/// Sorts lights in two halves, neither empty; returns the size of the first.
fn split(lights: &[Cluster], order: &mut [u32], depth: u32) -> usize {
    let middle_of = |light: u32| {
        let Bounds { min, max } = lights[light as usize].bounds;
        min + (max - min) * 0.5
    };
    let centres = Bounds::of(order.iter().map(|&light| middle_of(light)));
    let size = centres.max - centres.min;
    let best = if depth < DEEPEST_BY_COST { best_split(lights, order, centres) } else { None };
    let halves = order.len() / 2;
    let Some((axis, bin)) = best else {
        let axis = if size.x >= size.y && size.x >= size.z {
            0
        } else if size.y >= size.z {
            1
        } else {
            2
        };
        order.sort_unstable_by(|&a, &b| middle_of(a)[axis].total_cmp(&middle_of(b)[axis]).then(a.cmp(&b)));
        return halves;
    };
    order.sort_unstable_by_key(|&light| (bin_of(middle_of(light), centres, axis) > bin, light));
    let first = order.partition_point(|&light| bin_of(middle_of(light), centres, axis) <= bin);
    if first == 0 || first == order.len() { halves } else { first }
}

fn bin_of(centre: DVec3, centres: Bounds, axis: usize) -> usize {
    let share = (centre[axis] - centres.min[axis]) / (centres.max[axis] - centres.min[axis]);
    ((share * BINS as f64) as usize).min(BINS - 1)
}

/// The axis, and the last bin of the first half, with the lowest sum of costs.
fn best_split(lights: &[Cluster], order: &[u32], centres: Bounds) -> Option<(usize, usize)> {
    let whole = order.iter().map(|&light| lights[light as usize]).reduce(|a, b| a.joined(&b))?.bounds;
    let size = whole.max - whole.min;
    let mut best: Option<(f64, usize, usize)> = None;
    for axis in 0..3 {
        if centres.max[axis] <= centres.min[axis] {
            continue;
        }
        let mut bins: [Option<Cluster>; BINS] = [None; BINS];
        for &light in order {
            let cluster = &lights[light as usize];
            let middle = cluster.bounds.min + (cluster.bounds.max - cluster.bounds.min) * 0.5;
            let bin = &mut bins[bin_of(middle, centres, axis)];
            *bin = Some(bin.map_or(*cluster, |bin| bin.joined(cluster)));
        }
        // A box that is thin across the axis should rather be cut along another.
        let regular = size.max_element() / size[axis];
        let join = |bins: &[Option<Cluster>]| bins.iter().flatten().copied().reduce(|a, b| a.joined(&b));
        for bin in 0..BINS - 1 {
            let (Some(below), Some(above)) = (join(&bins[..=bin]), join(&bins[bin + 1..])) else { continue };
            let cost = (below.cost() + above.cost()) * regular;
            if cost.is_finite() && best.is_none_or(|(lowest, ..)| cost < lowest) {
                best = Some((cost, axis, bin));
            }
        }
    }
    best.map(|(_, axis, bin)| (axis, bin))
}

impl Cluster {
    fn joined(&self, other: &Self) -> Self {
        let (axis, spread) = joined_cones((self.axis, self.spread), (other.axis, other.spread));
        Self {
            bounds: self.bounds.union(other.bounds),
            power: self.power + other.power,
            axis,
            spread,
            reach: self.reach.min(other.reach),
            two_sided: self.two_sided || other.two_sided,
        }
    }

    /// What it costs to have them together: power, times size, times how far their light is scattered (the solid angle of the cone that holds it).
    fn cost(&self) -> f64 {
        use std::f64::consts::{FRAC_PI_2, PI};
        let (spread, reach) = (acos(self.spread), acos(self.reach));
        let outer = (spread + reach).min(PI);
        let sin = (1.0 - self.spread * self.spread).max(0.0).sqrt();
        let angle =
            2.0 * PI * (1.0 - self.spread) + FRAC_PI_2 * (2.0 * outer * sin - cos(spread - 2.0 * outer) - 2.0 * spread * sin + self.spread);
        let size = self.bounds.max - self.bounds.min;
        self.power * angle * (size.x * size.y + size.y * size.z + size.z * size.x)
    }

    /// A guess at how much of its light arrives at a point, and at a surface of this normal there: power over the square of the distance, times the largest cosines that the box allows.
    #[inline]
    pub fn importance(&self, point: DVec3, normal: Option<DVec3>) -> f64 {
        let Bounds { min, max } = self.bounds;
        let half = (max - min) * 0.5;
        let radius2 = half.length_squared();
        let way = point - (min + half);
        let to_centre2 = way.length_squared();
        let distance2 = to_centre2.max(radius2);
        if to_centre2 <= radius2 || distance2 == 0.0 {
            // From within, all directions are possible.
            return if distance2 > 0.0 { self.power / distance2 } else { f64::MAX.sqrt() };
        }
        let way = way * (1.0 / to_centre2.sqrt());
        // The angle that the box takes of the view.
        let sin2_b = radius2 / to_centre2;
        let (cos_b, sin_b) = ((1.0 - sin2_b).sqrt(), sin2_b.sqrt());
        let along = self.axis.dot(way);
        let along = if self.two_sided { along.abs() } else { along };
        let sin_o = (1.0 - self.spread * self.spread).max(0.0).sqrt();
        let (cos_x, sin_x) = less(along, (1.0 - along * along).max(0.0).sqrt(), self.spread, sin_o);
        let (cos_p, _) = less(cos_x, sin_x, cos_b, sin_b);
        if cos_p <= self.reach {
            return 0.0;
        }
        // Without a surface, no cosine weakens the light.
        let mut importance = if self.reach == 0.0 { self.power * cos_p / distance2 } else { self.power / distance2 };
        if let Some(normal) = normal {
            let cos_i = way.dot(normal).abs();
            importance *= less(cos_i, (1.0 - cos_i * cos_i).max(0.0).sqrt(), cos_b, sin_b).0;
        }
        importance.max(0.0)
    }
}

/// Cosine and sine of the angle a - b, or of 0 where that is below.
#[inline]
fn less(cos_a: f64, sin_a: f64, cos_b: f64, sin_b: f64) -> (f64, f64) {
    if cos_a > cos_b { (1.0, 0.0) } else { (cos_a * cos_b + sin_a * sin_b, sin_a * cos_b - cos_a * sin_b) }
}

/// The smallest cone around two, near enough: axis and cosine of half its angle (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 3.8.4).
fn joined_cones((a, cos_a): (DVec3, f64), (b, cos_b): (DVec3, f64)) -> (DVec3, f64) {
    use std::f64::consts::PI;
    let (angle_a, angle_b) = (acos(cos_a), acos(cos_b));
    let between = acos(a.dot(b).clamp(-1.0, 1.0));
    if (between + angle_b).min(PI) <= angle_a {
        return (a, cos_a);
    }
    if (between + angle_a).min(PI) <= angle_b {
        return (b, cos_b);
    }
    let half = (angle_a + between + angle_b) * 0.5;
    let across = a.cross(b);
    if half >= PI || across.length_squared() == 0.0 {
        return (a, -1.0);
    }
    // Turn a towards b.
    let turn = half - angle_a;
    let side = across.normalize().cross(a);
    ((a * cos(turn) + side * crate::math::sin(turn)).normalize(), cos(half))
}
