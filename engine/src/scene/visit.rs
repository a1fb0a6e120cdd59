//! What rays meet in the trees of a scene.

use super::{
    Scene,
    geometry::{Instance, LocalShape, Placed, kind},
    outlined::Outlined,
    query::Hit,
    surface::Thing,
};
use crate::{
    accel::{MeshHit, Tree, Visitor},
    shape::{Ray, triangle::TriangleHit},
};

/// Asks whether something stands in the way of a ray at a distance.
pub(super) trait Blocked: FnMut(usize, Thing, f64) -> bool {}

impl<F: FnMut(usize, Thing, f64) -> bool> Blocked for F {}

/// Finds nearest hits.
pub(super) struct Closest<'a, L> {
    pub scene: &'a Scene,
    pub rays: &'a [Ray],
    pub best: &'a mut [Hit],
    pub lanes: std::marker::PhantomData<L>,
}

impl<L: Outlined> Visitor for Closest<'_, L> {
    #[inline(always)]
    fn triangle(&mut self, ray: usize, hit: MeshHit) -> f64 {
        let placed = self.scene.instance(hit.instance);
        let best = &mut self.best[ray];
        if !placed.shape.masked || self.scene.is_there(placed, &hit) {
            best.offer(Hit::of_mesh(&hit, placed.object));
        }
        best.t
    }

    #[inline(always)]
    fn exact(&self, ray: usize, instance: u32, triangle: u32) -> Option<TriangleHit> {
        // SAFETY: whoever made this has the instructions of `L`.
        unsafe { L::exact(self.scene, &self.rays[ray], instance, triangle) }
    }

    #[inline(always)]
    fn other(&mut self, ray: usize, reference: u32) -> f64 {
        let (of, best) = (&self.rays[ray], &mut self.best[ray]);
        // SAFETY: whoever made this has the instructions of `L`.
        unsafe { L::closest_of_leaf(self.scene, of, reference, best) };
        best.t
    }
}

/// Finds nearest hits in an instance's own tree.
struct ClosestThere<'a> {
    scene: &'a Scene,
    number: u32,
    best: &'a mut Hit,
}

impl Visitor for ClosestThere<'_> {
    #[inline(always)]
    fn triangle(&mut self, _: usize, hit: MeshHit) -> f64 {
        let (placed, hit) = (self.scene.instance(self.number), MeshHit { instance: self.number, ..hit });
        if !placed.shape.masked || self.scene.is_there(placed, &hit) {
            self.best.offer(Hit::of_mesh(&hit, placed.object));
        }
        self.best.t
    }

    fn exact(&self, _: usize, _: u32, _: u32) -> Option<TriangleHit> {
        None
    }

    fn other(&mut self, _: usize, _: u32) -> f64 {
        self.best.t
    }
}

/// Finds out what blocks rays.
pub(super) struct Any<'a, L, B> {
    pub scene: &'a Scene,
    pub rays: &'a [Ray],
    pub is_blocked: &'a mut [bool],
    pub blocked: &'a mut B,
    pub lanes: std::marker::PhantomData<L>,
}

impl<L, B> Any<'_, L, B> {
    #[inline(always)]
    fn note(&mut self, ray: usize, is_blocked: bool) -> f64 {
        self.is_blocked[ray] = is_blocked;
        if is_blocked { -1.0 } else { self.rays[ray].t_max }
    }
}

impl<L: Outlined, B: Blocked> Visitor for Any<'_, L, B> {
    #[inline(always)]
    fn triangle(&mut self, ray: usize, hit: MeshHit) -> f64 {
        let placed = self.scene.instance(hit.instance);
        let there = !placed.shape.masked || self.scene.is_there(placed, &hit);
        let is_blocked = there && (self.blocked)(ray, placed.thing(), hit.at.t);
        self.note(ray, is_blocked)
    }

    #[inline(always)]
    fn exact(&self, ray: usize, instance: u32, triangle: u32) -> Option<TriangleHit> {
        // SAFETY: whoever made this has the instructions of `L`.
        unsafe { L::exact(self.scene, &self.rays[ray], instance, triangle) }
    }

    #[inline(always)]
    fn other(&mut self, ray: usize, reference: u32) -> f64 {
        let blocked = &mut *self.blocked;
        // SAFETY: whoever made this has the instructions of `L`.
        let is_blocked = unsafe { L::any_of_leaf(self.scene, &self.rays[ray], reference, &mut |thing, t| blocked(ray, thing, t)) };
        self.note(ray, is_blocked)
    }
}

/// Finds out what blocks a ray in an instance's own tree.
struct AnyThere<'a, F> {
    scene: &'a Scene,
    number: u32,
    t_max: f64,
    is_blocked: bool,
    blocked: F,
}

impl<F: FnMut(Thing, f64) -> bool> Visitor for AnyThere<'_, F> {
    #[inline(always)]
    fn triangle(&mut self, _: usize, hit: MeshHit) -> f64 {
        let (placed, hit) = (self.scene.instance(self.number), MeshHit { instance: self.number, ..hit });
        let there = !placed.shape.masked || self.scene.is_there(placed, &hit);
        self.is_blocked = there && (self.blocked)(placed.thing(), hit.at.t);
        if self.is_blocked { -1.0 } else { self.t_max }
    }

    fn exact(&self, _: usize, _: u32, _: u32) -> Option<TriangleHit> {
        None
    }

    fn other(&mut self, _: usize, _: u32) -> f64 {
        self.t_max
    }
}

impl Scene {
    #[inline(always)]
    fn instance(&self, number: u32) -> &Placed<Instance> {
        &self.geometry.instances[number as usize]
    }

    /// Where a ray hits a triangle of an instance whose triangles stand in the tree of the world, moved.
    #[inline(always)]
    pub(super) fn exact_in(&self, ray: &Ray, instance: u32, triangle: u32) -> Option<TriangleHit> {
        let placed = self.instance(instance);
        self.geometry.meshes[placed.shape.mesh as usize].triangles.hit(triangle, &placed.shape.of_ray(ray))
    }

    /// What a leaf of the world's tree holds that is no pack of triangles.
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn closest_of_leaf_in<L: Outlined>(&self, ray: &Ray, reference: u32, best: &mut Hit) {
        if reference >> kind::SHIFT != kind::MESH {
            return self.closest_of_shape(ray, reference, best);
        }
        let number = reference & kind::INDEX;
        let (Some(tree), placed) = (self.tree_of(number), self.instance(number)) else { return };
        let (local, limit) = (placed.shape.of_ray(ray), best.t);
        // SAFETY: the caller has the instructions of `L`.
        unsafe { tree.walk::<L, false>(&local, limit, &mut ClosestThere { scene: self, number, best }) };
    }

    /// See [`Self::closest_of_leaf_in`].
    ///
    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_of_leaf_in<L: Outlined>(
        &self,
        ray: &Ray,
        reference: u32,
        blocked: &mut impl FnMut(Thing, f64) -> bool,
    ) -> bool {
        if reference >> kind::SHIFT != kind::MESH {
            return self.any_of_shape(ray, reference, blocked);
        }
        let number = reference & kind::INDEX;
        let (Some(tree), placed) = (self.tree_of(number), self.instance(number)) else { return false };
        let local = placed.shape.of_ray(ray);
        let mut visitor = AnyThere { scene: self, number, t_max: ray.t_max, is_blocked: false, blocked };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { tree.walk::<L, true>(&local, ray.t_max, &mut visitor) };
        visitor.is_blocked
    }

    #[inline(always)]
    fn tree_of(&self, instance: u32) -> Option<&Tree> {
        self.geometry.meshes[self.instance(instance).shape.mesh as usize].tree.as_ref()
    }

    /// A shape other than a mesh.
    #[inline(always)]
    pub(super) fn closest_of_shape(&self, ray: &Ray, reference: u32, best: &mut Hit) {
        let geometry = &self.geometry;
        let index = (reference & kind::INDEX) as usize;
        let mut offer = |hit: Option<(f64, u32)>, object: u32| {
            if let Some((t, part)) = hit {
                best.offer(Hit::of_shape(t, object, part, reference));
            }
        };
        match reference >> kind::SHIFT {
            kind::SPHERE => {
                let sphere = &geometry.spheres[index];
                offer(sphere.shape.closest::<true>(ray).map(|t| (t, 0)), sphere.object);
            }
            kind::CUBOID => {
                let cuboid = &geometry.cuboids[index];
                offer(cuboid.shape.closest(ray), cuboid.object);
            }
            kind::DISC => {
                let disc = &geometry.discs[index];
                offer(disc.shape.closest(ray).map(|t| (t, 0)), disc.object);
            }
            kind::TRANSFORMED => {
                let placed = &geometry.transformed[index];
                let local = ray.transformed(&placed.shape.transform.to_object);
                let hit = match &placed.shape.shape {
                    LocalShape::Sphere(sphere) => sphere.closest::<false>(&local).map(|t| (t, 0)),
                    LocalShape::Cuboid(cuboid) => cuboid.closest(&local),
                    LocalShape::Disc(disc) => disc.closest(&local).map(|t| (t, 0)),
                    LocalShape::Other(other) => other.closest(&local),
                };
                offer(hit, placed.object);
            }
            _ => {
                let other = &geometry.others[index];
                offer(other.shape.closest(ray), other.object);
            }
        }
    }

    /// See [`Self::closest_of_shape`].
    #[inline(always)]
    pub(super) fn any_of_shape(&self, ray: &Ray, reference: u32, blocked: &mut impl FnMut(Thing, f64) -> bool) -> bool {
        let geometry = &self.geometry;
        let index = (reference & kind::INDEX) as usize;
        let (crossings, thing) = match reference >> kind::SHIFT {
            kind::SPHERE => {
                let sphere = &geometry.spheres[index];
                (sphere.shape.crossings::<true>(ray.origin, ray.direction), sphere.thing())
            }
            kind::CUBOID => {
                let cuboid = &geometry.cuboids[index];
                (cuboid.shape.crossings(ray.origin, ray.direction).map(|[near, far]| [near.0, far.0]), cuboid.thing())
            }
            kind::DISC => {
                let disc = &geometry.discs[index];
                (disc.shape.closest(ray).map(|t| [t, f64::INFINITY]), disc.thing())
            }
            kind::TRANSFORMED => {
                let placed = &geometry.transformed[index];
                let local = ray.transformed(&placed.shape.transform.to_object);
                let crossings = match &placed.shape.shape {
                    LocalShape::Sphere(sphere) => sphere.crossings::<false>(local.origin, local.direction),
                    LocalShape::Cuboid(cuboid) => cuboid.crossings(local.origin, local.direction).map(|[near, far]| [near.0, far.0]),
                    LocalShape::Disc(disc) => disc.closest(&local).map(|t| [t, f64::INFINITY]),
                    LocalShape::Other(other) => other.crossings(&local),
                };
                (crossings, placed.thing())
            }
            _ => {
                let other = &geometry.others[index];
                (other.shape.crossings(ray), other.thing())
            }
        };
        crossings.is_some_and(|[near, far]| blocked(thing, near) || blocked(thing, far))
    }
}
