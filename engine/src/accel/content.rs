//! What a tree is built over: triangles of meshes at their places, and boxes of other things.

use glam::{DAffine3, DVec3, Vec3};

use super::{
    build::{Box3, Draft},
    collapse::{Collapse, LeafRule},
    frame::Normalisation,
    pack::{Pack, PackTriangle},
    pages, parallel,
    split::{References, split},
    tree::{OTHER, Tree},
    triangles::Triangles,
};
use crate::{math::max_abs, shape::Bounds};

/// A mesh at its place.
pub struct Part<'a> {
    /// Its triangles.
    pub triangles: &'a Triangles,
    /// Where they stand; `None` if all that is done is to put their origin at that of [`Content`].
    pub to_world: Option<DAffine3>,
}

/// All that a tree is over: at least one triangle or box. All are finite.
pub struct Content<'a> {
    /// Where the origin of meshes stands that are neither turned nor scaled nor moved.
    pub origin: DVec3,
    /// Instances, by their numbers; at most 2^16, of at most 2^29 triangles.
    pub parts: Vec<Part<'a>>,
    /// Boxes of other things.
    pub boxes: Vec<Bounds>,
    /// What the references of these boxes hold, 30 bits each.
    pub references: Vec<u32>,
}

/// The centre of triangles that stand in a tree as they are may be so many times farther from the origin than they are large: boxes get coarser then.
const NEAR: f64 = 16.0;

impl<'a> Content<'a> {
    /// Triangles of one mesh, where they are.
    pub fn of(triangles: &'a Triangles) -> Self {
        Self { origin: DVec3::ZERO, parts: vec![Part { triangles, to_world: None }], boxes: Vec::new(), references: Vec::new() }
    }

    /// The box around everything.
    pub fn bounds(&self) -> Bounds {
        self.parts.iter().map(|part| part.bounds(self.origin)).chain(self.boxes.iter().copied()).fold(Bounds::EMPTY, Bounds::union)
    }

    /// Builds the tree; everything lies within `bounds`.
    pub fn grow(self, bounds: Bounds, leaves: LeafRule) -> Tree {
        let frame = self.frame(bounds);
        let Self { origin, parts, boxes, references } = self;
        let soup = Soup::new(&frame, origin, &parts);
        let normalised = |b: &Bounds| Box3 { min: frame.point(b.min).as_vec3(), max: frame.point(b.max).as_vec3() };
        let others: Vec<Box3> = boxes.iter().map(normalised).collect();
        drop(boxes);
        let Cheapest { plan, triangles } = Cheapest::of(&soup, others, leaves);
        let (mut packed, mut begins) = (Vec::new(), vec![0]);
        let leaf = |leaf: &[u32]| {
            if let Some(other) = (leaf[0] as usize).checked_sub(triangles.count(&soup)) {
                return OTHER | references[other];
            }
            let mut leaf: Vec<u32> = leaf.iter().map(|&part| triangles.of(part)).collect();
            leaf.sort_unstable();
            leaf.dedup();
            packed.append(&mut leaf);
            begins.push(packed.len());
            begins.len() as u32 - 2
        };
        let collapsed = plan.carry_out(leaf);
        let pack = |at: usize| Pack::new(packed[begins[at]..begins[at + 1]].iter().map(|&triangle| soup.triangle(triangle)));
        let packs = pages::fill(begins.len() - 1, pack);
        Tree::new(frame, collapsed, packs, triangles.is_split())
    }

    /// Coordinates in which triangles may stand as they are, if there are any that are not moved, and if these are not far from their origin.
    fn frame(&self, bounds: Bounds) -> Normalisation {
        let middle = max_abs(bounds.min * 0.5 + bounds.max * 0.5 - self.origin);
        let half = max_abs(bounds.max * 0.5 - bounds.min * 0.5);
        let is_near = middle <= NEAR * half || (self.parts.len() == 1 && self.boxes.is_empty());
        let stays = self.parts.iter().any(|part| part.to_world.is_none());
        if stays && is_near { Normalisation::scaling(self.origin, bounds) } else { Normalisation::of(bounds) }
    }
}

impl Part<'_> {
    fn bounds(&self, origin: DVec3) -> Bounds {
        let Some(to_world) = self.to_world else {
            let Bounds { min, max } = self.triangles.bounds();
            return Bounds { min: min + origin, max: max + origin };
        };
        let corners = (0..self.triangles.count() as u32).flat_map(|triangle| self.triangles.vertices(triangle));
        Bounds::of(corners.map(|corner| to_world.transform_point3(corner)))
    }
}

/// Triangles of all parts in normalised coordinates, one after the other.
struct Soup<'a> {
    vertices: Vec<Vec3>,
    owners: Vec<Owner<'a>>,
    count: usize,
}

/// Where a part begins in the soup.
struct Owner<'a> {
    triangles: &'a Triangles,
    first_triangle: u32,
    first_vertex: usize,
    /// Whether its triangles are what they are in its mesh, but for a power of two.
    is_exact: bool,
}

impl<'a> Soup<'a> {
    fn new(frame: &Normalisation, origin: DVec3, parts: &[Part<'a>]) -> Self {
        let mut soup = Self { vertices: Vec::new(), owners: Vec::with_capacity(parts.len()), count: 0 };
        for part in parts {
            let first_vertex = soup.vertices.len();
            let stays = part.to_world.is_none() && frame.keeps(origin);
            let place = |position: DVec3| part.to_world.map_or(position + origin, |to_world| to_world.transform_point3(position));
            let mut is_exact = stays;
            soup.vertices.extend(part.triangles.positions().map(|position| {
                let vertex = if stays { frame.scaled(position) } else { frame.point(place(position)) }.as_vec3();
                // What is beyond 1 belongs to no triangle.
                is_exact &= vertex.abs().max_element() > 1.0 || frame.unscaled(vertex.as_dvec3()) == position;
                vertex
            }));
            soup.owners.push(Owner { triangles: part.triangles, first_triangle: soup.count as u32, first_vertex, is_exact });
            soup.count += part.triangles.count();
        }
        soup
    }

    fn owner(&self, triangle: u32) -> (usize, &Owner<'a>) {
        let part = self.owners.partition_point(|owner| owner.first_triangle <= triangle) - 1;
        (part, &self.owners[part])
    }

    fn vertices(&self, triangle: u32) -> [Vec3; 3] {
        let (_, owner) = self.owner(triangle);
        owner.triangles.indices(triangle - owner.first_triangle).map(|vertex| self.vertices[owner.first_vertex + vertex])
    }

    fn triangle(&self, triangle: u32) -> PackTriangle {
        let (part, owner) = self.owner(triangle);
        let vertices = self.vertices(triangle);
        PackTriangle { instance: part as u16, id: triangle - owner.first_triangle, vertices, is_exact: owner.is_exact }
    }
}

/// A tree over triangles or, where that is cheaper, over parts of triangles, and over other boxes, which come after these.
struct Cheapest {
    plan: Collapse,
    triangles: Parts,
}

/// Which triangle each of the first boxes is a part of; none where triangles are whole.
struct Parts(Vec<u32>);

impl Parts {
    fn of(&self, part: u32) -> u32 {
        self.0.get(part as usize).copied().unwrap_or(part)
    }

    fn count(&self, soup: &Soup) -> usize {
        if self.is_split() { self.0.len() } else { soup.count }
    }

    fn is_split(&self) -> bool {
        !self.0.is_empty()
    }
}

impl Cheapest {
    fn of(soup: &Soup, others: Vec<Box3>, leaves: LeafRule) -> Self {
        // Each set of boxes is dropped as soon as it can be: a million instances weigh enough.
        let mut whole: Vec<Box3> = parallel::map(soup.count, |triangle| Box3::of(soup.vertices(triangle as u32)));
        let parts = if whole.is_empty() { None } else { split(&whole, |triangle| soup.vertices(triangle)) };
        let plain = if whole.is_empty() {
            Draft::over(&others)
        } else {
            whole.extend_from_slice(&others);
            Draft::over(&whole)
        };
        drop(whole);
        if let Some(References { mut boxes, triangles }) = parts {
            boxes.extend_from_slice(&others);
            let split = Draft::over(&boxes);
            if split.cost() < plain.cost() {
                drop(boxes);
                let plan = Collapse::plan(split.finish(), leaves, triangles.len() as u32);
                return Self { plan, triangles: Parts(triangles) };
            }
        }
        drop(others);
        let plan = Collapse::plan(plain.finish(), leaves, soup.count as u32);
        Self { plan, triangles: Parts(Vec::new()) }
    }
}
