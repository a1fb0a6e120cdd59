//! The trees of a scene: one over all that stands at one place, and one for every mesh that stands at many.

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

/// Rounding of rays on their way into a mesh's coordinates counts for nothing beside that of boxes, if coordinates are not larger than this, in proportion to the mesh...
const NEAR: f64 = 65_536.0;

/// ... and if the way there and back makes them larger only by this; turned and evenly scaled, they grow by less than 3.
const GENTLE: f64 = 4.0;

impl Geometry {
    /// Builds all trees. The tree of the world holds all finite shapes, but for a few listed spheres; instances whose triangles stand in it come first.
    pub fn plant(&mut self, leaves: LeafRule) {
        let grounded = self.ground();
        let places = places_of(&self.instances[grounded..], self.meshes.len());
        for (mesh, places) in self.meshes.iter_mut().zip(places) {
            mesh.tree = (places > 0).then(|| Content::of(&mesh.triangles).grow(mesh.triangles.bounds(), leaves));
        }
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
        add(kind::MESH, grounded, &mut self.instances[grounded..].iter().map(|s| s.shape.transform.bounds_of(mesh_of(&s.shape))));
        content.parts.extend(self.instances[..grounded].iter().map(|s| Part {
            triangles: &mesh_of(&s.shape).triangles,
            to_world: (!s.shape.transform.only_moves_to(self.origin)).then_some(s.shape.transform.to_world),
        }));
        let is_empty = content.boxes.is_empty() && content.parts.is_empty();
        let bounds = (!is_empty).then(|| content.bounds());
        self.tree = bounds.map(|bounds| content.grow(bounds, leaves));
        let listed = self.list.iter().flat_map(|_| self.spheres.iter().map(|s| s.shape.bounds()));
        self.bounds = bounds.into_iter().chain(listed).reduce(Bounds::union);
    }

    /// All trees.
    pub fn trees(&self) -> impl Iterator<Item = &Tree> {
        self.tree.iter().chain(self.meshes.iter().filter_map(|mesh| mesh.tree.as_ref()))
    }

    /// Sorts instances: first those whose triangles shall stand in the tree of the world, so that rays neither meet boxes around them nor are moved to them. Returns how many.
    /// All meshes stand in it that are there once, and those that are there so few times that there are at most twice as many triangles.
    fn ground(&mut self) -> usize {
        let mut places = places_of(&self.instances, self.meshes.len());
        for Placed { shape: Instance { mesh, transform, .. }, .. } in &self.instances {
            if !transform.only_moves_to(self.origin) && !is_gentle(transform, self.meshes[*mesh as usize].triangles.bounds()) {
                places[*mesh as usize] = 0;
            }
        }
        let count = |mesh: usize| self.meshes[mesh].triangles.count();
        let mut meshes: Vec<usize> = (0..places.len()).filter(|&mesh| places[mesh] > 0).collect();
        meshes.sort_by_key(|&mesh| ((places[mesh] - 1) * count(mesh), mesh));
        let most: usize = meshes.iter().map(|&mesh| count(mesh)).sum();
        let mut grounded = vec![false; places.len()];
        let (mut parts, mut triangles, mut more) = (0, 0, 0);
        for mesh in meshes {
            parts += places[mesh];
            triangles += places[mesh] * count(mesh);
            more += (places[mesh] - 1) * count(mesh);
            grounded[mesh] = parts <= MOST_PARTS && triangles <= MOST_TRIANGLES && more <= most;
        }
        let is_grounded = |placed: &Placed<Instance>| grounded[placed.shape.mesh as usize];
        self.instances.sort_unstable_by_key(|placed| (!is_grounded(placed), placed.object));
        self.instances.partition_point(is_grounded)
    }
}

/// How many instances there are of each mesh.
fn places_of(instances: &[Placed<Instance>], meshes: usize) -> Vec<usize> {
    let mut places = vec![0; meshes];
    instances.iter().for_each(|placed| places[placed.shape.mesh as usize] += 1);
    places
}

/// Whether what a ray meets in the mesh's coordinates it meets in the world's, as near as boxes in f32 can tell.
fn is_gentle(transform: &Transform, bounds: Bounds) -> bool {
    let [to_mesh, back] = transform.growths();
    let placed = transform.bounds(bounds);
    let size = max_abs(placed.max - placed.min);
    let farthest = max_abs(placed.max).max(max_abs(placed.min)).max(max_abs(transform.to_world.translation));
    back * to_mesh <= GENTLE && farthest.max(back * max_abs(transform.to_object.translation)) <= NEAR * size
}
