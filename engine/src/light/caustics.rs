//! Light that mirrors and lenses gather: a map of where it falls and from where it comes there, by which paths find it again.
//!
//! Rays that are scattered by chance hardly ever go the way through a lens to a small lamp. So photons are sent from the lights to whatever is smooth (Jensen, "Importance
//! Driven Path Tracing using the Photon Map", 1995), and where they fall, each small region of space keeps their directions in a quadtree (Müller, Gross, Novák, "Practical Path
//! Guiding for Efficient Light-Transport Simulation", 2017), as seen from its middle, so that what is near is found from all its points (Ruppert, Herholz, Lensch, "Robust Fitting
//! of Parallax-Aware Mixtures for Path Guiding", 2020). The map only proposes directions: what is computed from them does not depend on it, but for its noise.

mod octahedron;
mod source;
mod squares;
#[cfg(test)]
mod tests;

use glam::{DVec2, DVec3};

use crate::shape::Bounds;
use octahedron::{folded, unfolded};
pub use source::{Begin, Departing, Sources};
use squares::Squares;

/// Light on its way from a light over mirrors and lenses, where it meets a surface that scatters it.
#[derive(Clone, Copy, Debug)]
pub struct Photon {
    /// Where that is.
    pub point: DVec3,
    /// Unit vector to where it comes from.
    pub towards: DVec3,
    /// Its share of the light, above 0.
    pub flux: f64,
    /// The mirror or lens that it comes from, and the number of them on its way.
    pub caster: (u32, u32),
    /// How it left its light.
    pub begin: Begin,
}

/// Most photons of a cell.
const MOST: usize = 256;

/// What has less than this share of a cell's light is no beam of its own: each costs time at every point.
const LEAST: f64 = 0.05;

/// A cell reaches beyond its photons by this share of its size.
const MARGIN: f64 = 0.1;

/// Where gathered light falls, in cells of about as many photons each.
#[derive(Debug, Default)]
pub struct Caustics {
    nodes: Vec<Node>,
    cells: Vec<Cell>,
    beams: Vec<Beam>,
    lobes: Squares,
}

/// Of a tree over space.
#[derive(Clone, Copy, Debug)]
enum Node {
    /// What lies below the place on the axis is in the next node, the rest in the one of this number.
    Split {
        place: f64,
        axis: u32,
        above: u32,
    },
    Cell(u32),
}

/// Light that falls on a region.
#[derive(Debug)]
struct Cell {
    bounds: Bounds,
    middle: DVec3,
    /// Of a surface in it.
    area: f64,
    photons: u32,
    /// Of all of them.
    flux: f64,
    /// See [`Region::brilliance`].
    brilliance: f64,
    /// The first of its beams, and the one behind its last.
    beams: [u32; 2],
}

/// Light that comes from one mirror or lens, or all from those that send little.
#[derive(Clone, Copy, Debug)]
struct Beam {
    /// Its share of the cell's light and that of those before it.
    up_to: f64,
    share: f64,
    /// One over the distance at which the rays that arrive at different points come from one point; 0 for parallel ones, below 0 for those that have yet to meet.
    convergence: f64,
    /// Directions as seen from the cell's middle: among the lobes of all.
    lobes: u32,
}

impl Caustics {
    /// Of photons, which count in the order in which they are given.
    pub fn new(photons: &[Photon]) -> Self {
        let mut caustics = Self::default();
        if !photons.is_empty() {
            caustics.divide(photons, &mut (0..photons.len() as u32).collect::<Vec<_>>());
            caustics.compare();
        }
        caustics
    }

    /// Whether no light is gathered anywhere.
    pub fn is_empty(&self) -> bool {
        self.cells.is_empty()
    }

    /// Median by median across the longest side. `chosen` are numbers of photons, in any order.
    fn divide(&mut self, photons: &[Photon], chosen: &mut [u32]) {
        let point = |number: u32| photons[number as usize].point;
        let bounds = Bounds::of(chosen.iter().map(|&number| point(number)));
        let size = bounds.max - bounds.min;
        let axis = (0..3).fold(0, |longest, axis| if size[axis] > size[longest] { axis } else { longest });
        if chosen.len() <= MOST || size[axis] == 0.0 {
            self.nodes.push(Node::Cell(self.cells.len() as u32));
            // Sums to come are taken in the order of their numbers, which does not depend on how they were divided.
            chosen.sort_unstable();
            self.cell(bounds, chosen.iter().map(|&number| photons[number as usize]).collect());
            return;
        }
        let along = |number: u32| point(number)[axis];
        let (_, &mut median, _) = chosen.select_nth_unstable_by(chosen.len() / 2, |&a, &b| along(a).total_cmp(&along(b)));
        // Many may lie in one plane: all of these go to the same side.
        let beyond = |number: u32| if along(number) > bounds.min[axis] { along(number) } else { f64::INFINITY };
        let place = if along(median) > bounds.min[axis] {
            along(median)
        } else {
            chosen.iter().map(|&number| beyond(number)).fold(f64::INFINITY, f64::min)
        };
        let middle = partition(chosen, |number| along(number) < place);
        let at = self.nodes.len();
        self.nodes.push(Node::Split { place, axis: axis as u32, above: 0 });
        let (below, above) = chosen.split_at_mut(middle);
        self.divide(photons, below);
        self.nodes[at] = Node::Split { place, axis: axis as u32, above: self.nodes.len() as u32 };
        self.divide(photons, above);
    }

    /// Puts the brilliance of all cells in proportion to that of the middle one.
    fn compare(&mut self) {
        let mut roots: Vec<f64> = self.cells.iter().map(Cell::root).filter(|root| *root > 0.0).collect();
        roots.sort_unstable_by(f64::total_cmp);
        let Some(middle) = roots.get(roots.len() / 2) else { return };
        self.cells.iter_mut().for_each(|cell| cell.brilliance = cell.root() / middle);
    }

    /// Adds a cell of photons within these bounds.
    fn cell(&mut self, bounds: Bounds, mut photons: Vec<Photon>) {
        let (middle, size) = ((bounds.min + bounds.max) * 0.5, bounds.max - bounds.min);
        // Two sides of a box that is flat.
        let area = (size.x * size.y).max(size.y * size.z).max(size.z * size.x);
        let margin = DVec3::splat(size.length() * MARGIN);
        let bounds = Bounds { min: bounds.min - margin, max: bounds.max + margin };
        // A point within the cell must be nearer to its middle than where rays come together.
        let most = 0.5 / (bounds.max - middle).length().max(f64::MIN_POSITIVE);
        let (first, total, mut up_to) = (self.beams.len(), flux(&photons), 0.0);
        let count = photons.len() as u32;
        photons.sort_by_key(|photon| photon.caster);
        let beams = photons.chunk_by(|a, b| a.caster == b.caster);
        let (beams, weak): (Vec<_>, Vec<_>) = beams.partition(|photons| flux(photons) >= LEAST * total);
        let weak = weak.concat();
        for photons in beams.into_iter().chain([&*weak]).filter(|photons| !photons.is_empty()) {
            let share = flux(photons) / total;
            up_to += share;
            let convergence = convergence(photons).clamp(-most, most);
            let place = |photon: &Photon| unfolded(from_middle(photon.point - middle, convergence, photon.towards).0).0;
            let lobes = self.lobes.add(photons.iter().map(|photon| (place(photon), photon.flux)).collect());
            self.beams.push(Beam { up_to, share, convergence, lobes });
        }
        let beams = [first, self.beams.len()].map(|number| number as u32);
        self.cells.push(Cell { bounds, middle, area, photons: count, flux: total, brilliance: 0.0, beams });
    }

    /// What is known of gathered light about a point; `None` where there is none.
    #[inline]
    pub fn at(&self, point: DVec3) -> Option<Region<'_>> {
        let along = point.extend(0.0).to_array();
        let mut at = 0;
        loop {
            match *self.nodes.get(at)? {
                Node::Split { place, axis, above } => at = if along[axis as usize & 3] < place { at + 1 } else { above as usize },
                Node::Cell(cell) => {
                    let holds = |bounds: &Bounds| point.cmpge(bounds.min).all() && point.cmple(bounds.max).all();
                    let cell = self.cells.get(cell as usize).filter(|cell| holds(&cell.bounds))?;
                    let beams = &self.beams[cell.beams[0] as usize..cell.beams[1] as usize];
                    return Some(Region { cell, beams, lobes: &self.lobes, beside: point - cell.middle });
                }
            }
        }
    }
}

impl Cell {
    /// The root of the light on an area; 0 where photons lie on a line or in a point, of which nothing is known.
    fn root(&self) -> f64 {
        if self.area > 0.0 { (self.flux / self.area).sqrt() } else { 0.0 }
    }
}

/// Gathered light about a point.
#[derive(Debug)]
pub struct Region<'c> {
    cell: &'c Cell,
    beams: &'c [Beam],
    lobes: &'c Squares,
    /// The point as seen from the cell's middle.
    beside: DVec3,
}

impl Region<'_> {
    /// The area of a surface for each photon that fell there, in squares of scene units.
    pub fn area_of_photon(&self) -> f64 {
        self.cell.area / f64::from(self.cell.photons)
    }

    /// The root of how much light falls on an area of a surface, in proportion to what it is in half of all regions; 0 where that cannot be told.
    #[inline]
    pub fn brilliance(&self) -> f64 {
        self.cell.brilliance
    }

    /// A direction in which gathered light may come, for `pick` in [0, 1) and `u` in [0, 1)^2, and its density by solid angle.
    #[inline]
    pub fn sample(&self, pick: f64, u: DVec2) -> (DVec3, f64) {
        let Self { beams, lobes, beside, .. } = *self;
        let number = beams.partition_point(|beam| beam.up_to <= pick).min(beams.len() - 1);
        let Beam { share, convergence, lobes: own, .. } = beams[number];
        let (place, density) = lobes.sample(own, u);
        let (of_middle, evenly) = folded(place);
        // Along this from the middle, to a point one away from `aside`: in units of the distance at which rays come together.
        let aside = beside * convergence;
        let along = aside.dot(of_middle);
        let length = along + (along * along + 1.0 - aside.length_squared()).sqrt();
        let direction = (of_middle * length - aside).normalize();
        let own = share * density * evenly * direction.dot(of_middle) / (length * length);
        let others = beams.iter().enumerate().filter(|(other, _)| *other != number);
        (direction, own + others.map(|(_, beam)| self.pdf_of(beam, direction)).sum::<f64>())
    }

    /// The density with which [`Self::sample`] chooses a direction.
    #[inline]
    pub fn pdf(&self, direction: DVec3) -> f64 {
        self.beams.iter().map(|beam| self.pdf_of(beam, direction)).sum()
    }

    /// A beam's part of the density of a direction.
    #[inline]
    fn pdf_of(&self, beam: &Beam, direction: DVec3) -> f64 {
        let (of_middle, factor) = from_middle(self.beside, beam.convergence, direction);
        let (place, evenly) = unfolded(of_middle);
        beam.share * self.lobes.pdf(beam.lobes, place) * evenly * factor
    }
}

/// Puts those first that are `first`; returns how many they are.
fn partition(all: &mut [u32], first: impl Fn(u32) -> bool) -> usize {
    let mut count = 0;
    for at in 0..all.len() {
        if first(all[at]) {
            all.swap(count, at);
            count += 1;
        }
    }
    count
}

fn flux(photons: &[Photon]) -> f64 {
    photons.iter().map(|photon| photon.flux).sum()
}

/// Where rays come together that arrive in a direction at a point beside the middle, as seen from the middle, and the ratio of solid angles there and at the point: by the sphere of
/// all places at that distance from the point.
#[inline]
fn from_middle(beside: DVec3, convergence: f64, direction: DVec3) -> (DVec3, f64) {
    let way = direction + beside * convergence;
    let length = way.length();
    let of_middle = way * (1.0 / length);
    (of_middle, direction.dot(of_middle) / (length * length))
}

/// How much the directions of photons turn with their place, by least squares.
fn convergence(photons: &[Photon]) -> f64 {
    let flux = flux(photons);
    let mean = |of: fn(&Photon) -> DVec3| photons.iter().map(|photon| of(photon) * photon.flux).sum::<DVec3>() / flux;
    let (point, towards) = (mean(|photon| photon.point), mean(|photon| photon.towards));
    let Some(axis) = towards.try_normalize() else { return 0.0 };
    let (mut turn, mut aside) = (0.0, 0.0);
    for photon in photons {
        let across = (photon.point - point).reject_from_normalized(axis);
        turn -= photon.flux * (photon.towards - towards).dot(across);
        aside += photon.flux * across.length_squared();
    }
    if aside > 0.0 { turn / aside } else { 0.0 }
}
