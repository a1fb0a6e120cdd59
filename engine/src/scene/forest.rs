//! The trees of a scene: one over all that stands at one place, and one for every mesh that stands at many.

use glam::DVec3;

use super::geometry::{Geometry, Instance, Placed, Transform, kind};
use crate::{
    accel::{Content, LeafRule, Part, Tree},
    math::max_abs,
    shape::Bounds,
};

/// Most instances whose triangles stand in the tree of the world.
const MOST_PARTS: usize = 1 << 16;

/// Most triangles of these.
const MOST_TRIANGLES: usize = 1 << 29;

/// Most triangles of other instances whose corners are looked at one by one.
const MOST_MEASURED: usize = 1 << 22;

/// Rounding of rays on their way into a mesh's coordinates counts for nothing beside that of boxes, if coordinates are not larger than this, in proportion to the mesh...
const NEAR: f64 = 65_536.0;

/// ... and if the way there and back makes them larger only by this; turned and evenly scaled, they grow by less than 3.
const GENTLE: f64 = 4.0;

/// Where they only move, they round once.
const FAR: f64 = (1u64 << 24) as f64;

impl Geometry {
    /// Builds all trees. The tree of the world holds all finite shapes, but for a few listed spheres.
    pub fn plant(&mut self, leaves: LeafRule) {
        let places = places_of(&self.instances[self.grounded..], self.meshes.len());
        for (mesh, places) in self.meshes.iter_mut().zip(places) {
            mesh.tree = (places > 0).then(|| Content::of(&mesh.triangles).grow(mesh.triangles.bounds(), leaves));
        }
        let content = self.content(self.grounded);
        let is_empty = content.boxes.is_empty() && content.parts.is_empty();
        self.tree = (!is_empty).then(|| content.bounds()).map(|bounds| content.grow(bounds, leaves));
    }

    /// Boxes around all objects of some materials; planes have no end.
    pub fn boxes(&self, is_one: impl Fn(u32) -> bool) -> Vec<Bounds> {
        let everywhere = Bounds { min: DVec3::NEG_INFINITY, max: DVec3::INFINITY };
        let mut boxes = Vec::new();
        let mut add = |material: u32, bounds: &dyn Fn() -> Bounds| boxes.extend(is_one(material).then(bounds));
        self.planes.iter().for_each(|plane| add(plane.material, &|| everywhere));
        self.spheres.iter().for_each(|sphere| add(sphere.material, &|| sphere.shape.bounds()));
        self.cuboids.iter().for_each(|cuboid| add(cuboid.material, &|| cuboid.shape.bounds()));
        self.discs.iter().for_each(|disc| add(disc.material, &|| disc.shape.bounds()));
        self.others.iter().for_each(|other| add(other.material, &|| other.shape.bounds()));
        self.transformed.iter().for_each(|of| add(of.material, &|| of.shape.transform.bounds(of.shape.shape.bounds())));
        let mesh_of = |instance: &Instance| &self.meshes[instance.mesh as usize];
        self.instances.iter().for_each(|of| add(of.material, &|| of.shape.transform.bounds_of(mesh_of(&of.shape))));
        boxes
    }

    /// Everything: so many instances triangle by triangle, of the others the boxes.
    fn content(&self, grounded: usize) -> Content<'_> {
        let mut content = Content { origin: self.origin, parts: Vec::new(), boxes: Vec::new(), references: Vec::new() };
        let mut add = |kind: u32, first: usize, bounds: &mut dyn Iterator<Item = Bounds>| {
            for (index, bounds) in bounds.enumerate() {
                content.boxes.push(bounds);
                content.references.push(kind << kind::SHIFT | (first + index) as u32);
            }
        };
        let spheres = self.spheres.iter().filter(|_| self.list.is_none());
        add(kind::SPHERE, 0, &mut spheres.map(|s| s.shape.bounds()));
        add(kind::CUBOID, 0, &mut self.cuboids.iter().map(|s| s.shape.bounds()));
        add(kind::DISC, 0, &mut self.discs.iter().map(|s| s.shape.bounds()));
        add(kind::OTHER, 0, &mut self.others.iter().map(|s| s.shape.bounds()));
        add(kind::TRANSFORMED, 0, &mut self.transformed.iter().map(|s| s.shape.transform.bounds(s.shape.shape.bounds())));
        let mesh_of = |instance: &Instance| &self.meshes[instance.mesh as usize];
        let (grounded, others) = self.instances.split_at(grounded);
        add(kind::MESH, grounded.len(), &mut others.iter().map(|s| s.shape.transform.bounds_of(mesh_of(&s.shape))));
        let part = |s: &Placed<Instance>| Part {
            triangles: &mesh_of(&s.shape).triangles,
            to_world: (!s.shape.transform.only_moves_to(self.origin)).then_some(s.shape.transform.to_world),
        };
        content.parts = grounded.iter().map(part).collect();
        content
    }

    /// All trees.
    pub fn trees(&self) -> impl Iterator<Item = &Tree> {
        self.tree.iter().chain(self.meshes.iter().filter_map(|mesh| mesh.tree.as_ref()))
    }

    /// Sorts instances: first those whose triangles shall stand in the tree of the world, so that rays neither meet boxes around them nor are moved to them.
    /// All meshes stand in it that are there once, and those that are there so few times that there are at most twice as many triangles, as far as limits allow and if the places
    /// are gentle.
    ///
    /// Also finds the box around everything.
    pub fn ground(&mut self) {
        self.instances.shrink_to_fit();
        let mut places = places_of(&self.instances, self.meshes.len());
        for Placed { shape: Instance { mesh, transform, .. }, .. } in &self.instances {
            if !is_gentle(transform, self.origin, self.meshes[*mesh as usize].triangles.bounds()) {
                places[*mesh as usize] = 0;
            }
        }
        let count = |mesh: usize| self.meshes[mesh].triangles.count();
        let mut meshes: Vec<usize> = (0..places.len()).filter(|&mesh| places[mesh] > 0).collect();
        meshes.sort_by_key(|&mesh| ((places[mesh] - 1) * count(mesh), mesh));
        let most: usize = meshes.iter().map(|&mesh| count(mesh)).sum();
        let mut grounded = vec![false; places.len()];
        let mut sums = [0; 3];
        for mesh in meshes {
            let with = [sums[0] + places[mesh], sums[1] + places[mesh] * count(mesh), sums[2] + (places[mesh] - 1) * count(mesh)];
            grounded[mesh] = with[0] <= MOST_PARTS && with[1] <= MOST_TRIANGLES && with[2] <= most;
            sums = if grounded[mesh] { with } else { sums };
        }
        let is_grounded = |placed: &Placed<Instance>| grounded[placed.shape.mesh as usize];
        self.instances.sort_unstable_by_key(|placed| (!is_grounded(placed), placed.object));
        self.grounded = self.instances.partition_point(is_grounded);
        // Nobody needs it to be tight where that would take long.
        let instanced: usize = self.instances[self.grounded..].iter().map(|placed| count(placed.shape.mesh as usize)).sum();
        let content = self.content(if instanced <= MOST_MEASURED { self.instances.len() } else { self.grounded });
        let is_empty = content.boxes.is_empty() && content.parts.is_empty();
        self.bounds = (!is_empty).then(|| content.bounds());
    }
}

/// How many instances there are of each mesh.
fn places_of(instances: &[Placed<Instance>], meshes: usize) -> Vec<usize> {
    let mut places = vec![0; meshes];
    instances.iter().for_each(|placed| places[placed.shape.mesh as usize] += 1);
    places
}

/// Whether what a ray meets in the mesh's coordinates it meets in the world's, as near as boxes in f32 can tell.
fn is_gentle(transform: &Transform, origin: DVec3, bounds: Bounds) -> bool {
    let [to_mesh, back] = transform.growths();
    let placed = transform.bounds(bounds);
    let size = max_abs(placed.max - placed.min);
    let farthest = max_abs(placed.max).max(max_abs(placed.min)).max(max_abs(transform.to_world.translation));
    if transform.only_moves_to(origin) {
        return farthest <= FAR * size;
    }
    back * to_mesh <= GENTLE && farthest.max(back * max_abs(transform.to_object.translation)) <= NEAR * size
}
