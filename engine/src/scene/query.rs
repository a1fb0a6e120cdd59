//! Rays against the scene.

use std::ops::ControlFlow;

use glam::{DVec2, DVec3};

use super::{
    Scene, Surface,
    directions::Directions,
    geometry::{Instance, LocalShape, Placed, kind},
    outlined::Outlined,
    surface::{Crossing, Thing, in_world},
    tracer::{Tracer, Work},
};
use crate::{
    accel::{Lanes, MeshHit, OTHER, Pencil, Simd},
    description::Render,
    sampling::mix,
    shape::{Point, Ray, Sphere, triangle::TriangleHit},
};

/// Where a ray meets something.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Parameter of the ray: the distance, as its direction is a unit vector.
    pub t: f64,
    /// Place of the object in the order of the scene.
    pub object: u32,
    /// Triangle of a mesh, face of a box, side or end of a cone; 0 on everything else.
    pub part: u32,
    /// Kind and index of the shape.
    reference: u32,
    /// Barycentric coordinates on a triangle: the weight of its second vertex.
    pub b1: f64,
    /// The weight of its third vertex.
    pub b2: f64,
}

const NONE: u32 = u32::MAX;

impl Hit {
    /// Where a ray of this `t_max` has met nothing: no object is below 0, so that a hit at `t_max` is none.
    #[inline(always)]
    pub(super) fn none(t_max: f64) -> Self {
        Self { t: t_max, object: 0, part: 0, reference: NONE, b1: 0.0, b2: 0.0 }
    }

    /// Of a triangle of an instance.
    #[inline(always)]
    pub(super) fn of_mesh(hit: &MeshHit, object: u32) -> Self {
        let reference = kind::MESH << kind::SHIFT | hit.instance;
        Self { t: hit.at.t, object, part: hit.triangle, reference, b1: hit.at.b1, b2: hit.at.b2 }
    }

    /// Of something else.
    #[inline(always)]
    pub(super) fn of_shape(t: f64, object: u32, part: u32, reference: u32) -> Self {
        Self { t, object, part, reference, b1: 0.0, b2: 0.0 }
    }

    /// The instance of a mesh that was hit.
    #[inline(always)]
    pub(super) fn instance(&self) -> Option<usize> {
        (self.reference >> kind::SHIFT == kind::MESH).then_some((self.reference & kind::INDEX) as usize)
    }

    /// `None` for the hit of nothing.
    #[inline(always)]
    pub(super) fn some(self) -> Option<Self> {
        (self.reference != NONE).then_some(self)
    }

    /// Takes over a hit that is nearer, or as near and of an earlier object.
    #[inline(always)]
    pub(super) fn offer(&mut self, hit: Hit) {
        if hit.t < self.t || (hit.t == self.t && (hit.object, hit.part) < (self.object, self.part)) {
            *self = hit;
        }
    }
}

impl Scene {
    /// The nearest surface that a ray of unit direction meets. Whoever traces many rays does it in [`Scene::run`].
    pub fn closest(&self, ray: &Ray) -> Option<Surface> {
        struct Closest<'r>(&'r Ray);
        impl Work for Closest<'_> {
            type Output = Option<Surface>;

            #[inline(always)]
            fn run(self, scene: impl Tracer) -> Option<Surface> {
                scene.closest(self.0)
            }
        }
        self.run(Closest(ray))
    }

    /// Whether anything stands in the way of a ray of unit direction: asks `blocks`, with the material, of every surface that it crosses before
    /// `t_max`, in no particular order, until one does. A closed shape is crossed twice. Whoever traces many rays does it in [`Scene::run`].
    pub fn any(&self, ray: &Ray, blocks: impl FnMut(u32, &Crossing) -> bool) -> bool {
        struct Any<'r, F>(&'r Ray, F);
        impl<F: FnMut(u32, &Crossing) -> bool> Work for Any<'_, F> {
            type Output = bool;

            #[inline(always)]
            fn run(self, scene: impl Tracer) -> bool {
                scene.any(self.0, self.1)
            }
        }
        self.run(Any(ray, blocks))
    }

    pub(super) fn simd(&self) -> Simd {
        self.geometry.simd
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn closest_beside_tree<L: Lanes>(&self, ray: &Ray, pencil: Option<&Pencil>) -> Hit {
        let geometry = &self.geometry;
        let mut best = Hit::none(ray.t_max);
        for (index, plane) in geometry.planes.iter().enumerate() {
            if let Some(t) = plane.shape.closest(ray) {
                best.offer(Hit {
                    t,
                    object: plane.object,
                    part: 0,
                    reference: kind::PLANE << kind::SHIFT | index as u32,
                    b1: 0.0,
                    b2: 0.0,
                });
            }
        }
        if let Some(list) = &geometry.list {
            let candidates = match pencil {
                // SAFETY: the caller has the instructions of `L`.
                Some(pencil) => unsafe { pencil.along::<L>(ray.direction, best.t) },
                // SAFETY: the caller has the instructions of `L`.
                None => unsafe { list.candidates::<L>(ray, best.t) },
            };
            for index in candidates {
                let sphere = &geometry.spheres[index];
                if let Some(t) = sphere.shape.closest::<true>(ray) {
                    let reference = kind::SPHERE << kind::SHIFT | index as u32;
                    best.offer(Hit { t, object: sphere.object, part: 0, reference, b1: 0.0, b2: 0.0 });
                }
            }
        }
        best
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn closest_in<L: Outlined>(&self, ray: &Ray, pencil: Option<&Pencil>) -> Hit {
        let geometry = &self.geometry;
        // SAFETY: the caller has the instructions of `L`.
        let mut best = unsafe { self.closest_beside_tree::<L>(ray, pencil) };
        let Some(tree) = &geometry.tree else { return best };
        if !geometry.instances.is_empty() {
            // SAFETY: the caller has the instructions of `L`.
            unsafe { L::closest_of_tree(self, tree, ray, &mut best) };
            return best;
        }
        let boxed = tree.ray::<true>(ray.origin, ray.direction);
        let limit = boxed.limit(best.t);
        let leaf = |reference: u32| {
            self.closest_of_shape(ray, reference & !OTHER, &mut best);
            ControlFlow::Continue(boxed.limit(best.t))
        };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { tree.visit::<L, false>(&boxed, limit, leaf) };
        best
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_beside_tree<L: Lanes>(
        &self,
        ray: &Ray,
        light: Option<usize>,
        blocked: &mut impl FnMut(Thing, f64) -> bool,
    ) -> bool {
        let geometry = &self.geometry;
        if geometry.planes.iter().any(|plane| plane.shape.closest(ray).is_some_and(|t| blocked(plane.thing(), t))) {
            return true;
        }
        if let Some(list) = &geometry.list {
            let candidates = match light.and_then(|light| geometry.from_lights[light].as_ref()) {
                // SAFETY: the caller has the instructions of `L`.
                Some(pencil) => unsafe { pencil.before::<L>(ray.origin) }.without(ray.leaves),
                // SAFETY: the caller has the instructions of `L`.
                None => unsafe { list.candidates::<L>(ray, ray.t_max) },
            };
            for index in candidates {
                let sphere = &geometry.spheres[index];
                let crossings = sphere.shape.crossings::<true>(ray.origin, ray.direction);
                if crossings.is_some_and(|[near, far]| blocked(sphere.thing(), near) || blocked(sphere.thing(), far)) {
                    return true;
                }
            }
        }
        false
    }

    /// # Safety
    /// The processor has the instructions of `L`.
    #[inline(always)]
    pub(super) unsafe fn any_in<L: Outlined>(
        &self,
        ray: &Ray,
        light: Option<usize>,
        mut blocks: impl FnMut(u32, &Crossing) -> bool,
    ) -> bool {
        let geometry = &self.geometry;
        let mut blocked = |thing: Thing, t: f64| t > 0.0 && t < ray.t_max && blocks(thing.material, &Crossing { t, object: thing.object });
        // SAFETY: the caller has the instructions of `L`.
        if unsafe { self.any_beside_tree::<L>(ray, light, &mut blocked) } {
            return true;
        }
        let Some(tree) = &geometry.tree else { return false };
        if !geometry.instances.is_empty() {
            // SAFETY: the caller has the instructions of `L`.
            return unsafe { L::any_of_tree(self, tree, ray, &mut |_, thing, t| blocked(thing, t)) };
        }
        let boxed = tree.ray::<true>(ray.origin, ray.direction);
        let limit = boxed.limit(ray.t_max);
        let mut found = false;
        let leaf = |reference: u32| {
            found = self.any_of_shape(ray, reference & !OTHER, &mut blocked);
            if found { ControlFlow::Break(()) } else { ControlFlow::Continue(limit) }
        };
        // SAFETY: the caller has the instructions of `L`.
        unsafe { tree.visit::<L, true>(&boxed, limit, leaf) };
        found
    }

    /// Whether a mesh has a surface at a hit: not cut away by its alpha mask, nor seen from a back that it does not have.
    #[cold]
    pub(super) fn is_there(&self, placed: &Placed<Instance>, hit: &MeshHit) -> bool {
        let material = &self.materials[placed.material as usize];
        if !material.double_sided && !hit.at.front {
            return false;
        }
        let Some(cutoff) = material.alpha_cutoff else { return true };
        let mesh = &self.geometry.meshes[placed.shape.mesh as usize];
        let texture = material.texture().map_or(1.0, |texture| self.textures[texture as usize].at(mesh.uvs_at(hit).into())[3]);
        let alpha = material.base_alpha * texture * mesh.color(hit)[3];
        let blends = material.blends && matches!(self.render, Render::Path { .. });
        if blends { f64::from(alpha) > chance(hit) } else { alpha >= cutoff }
    }

    /// The surface at a hit. All of it is inlined, so that no surface is handed over in memory: that would take longer than computing it.
    #[inline(always)]
    pub(crate) fn surface(&self, ray: &Ray, hit: &Hit) -> Option<Surface> {
        if hit.reference == NONE {
            return None;
        }
        let geometry = &self.geometry;
        let index = (hit.reference & kind::INDEX) as usize;
        let surface = match hit.reference >> kind::SHIFT {
            kind::SPHERE => {
                let sphere = &geometry.spheres[index];
                let bit = if geometry.list.is_some() { 1 << index } else { 0 };
                let mut point = sphere.shape.point(ray, hit.t);
                self.add_sphere_uv(&mut point, sphere.material);
                Surface { sphere: bit, ..in_world(point, hit, sphere.material) }
            }
            kind::CUBOID => {
                let cuboid = &geometry.cuboids[index];
                in_world(cuboid.shape.point(ray, hit.t, hit.part), hit, cuboid.material)
            }
            kind::DISC => {
                let disc = &geometry.discs[index];
                in_world(disc.shape.point(ray, hit.t), hit, disc.material)
            }
            kind::PLANE => {
                let plane = &geometry.planes[index];
                in_world(plane.shape.point(ray, hit.t), hit, plane.material)
            }
            kind::OTHER => {
                let other = &geometry.others[index];
                let textured = self.has_coordinates(other.material);
                in_world(other.shape.point(ray, hit.t, hit.part, textured), hit, other.material)
            }
            kind::TRANSFORMED => self.transformed_surface(ray, hit, index),
            _ => return Some(self.mesh_surface(hit, index)),
        };
        let material = &self.materials[surface.material as usize];
        if !(material.filtered || material.tangents.is_some()) {
            return Some(surface);
        }
        let Directions { tangents, footprints } = self.directions(hit.reference, hit.part, surface.point, surface.ng);
        Some(Surface { tangents, footprints, ..surface })
    }

    #[inline(always)]
    fn transformed_surface(&self, ray: &Ray, hit: &Hit, index: usize) -> Surface {
        let placed = &self.geometry.transformed[index];
        let transform = &placed.shape.transform;
        let local = ray.transformed(&transform.to_object);
        let mut point = match &placed.shape.shape {
            LocalShape::Sphere(sphere) => sphere.point(&local, hit.t),
            LocalShape::Cuboid(cuboid) => cuboid.point(&local, hit.t, hit.part),
            LocalShape::Disc(disc) => disc.point(&local, hit.t),
            LocalShape::Other(other) => other.point(&local, hit.t, hit.part, self.has_coordinates(placed.material)),
        };
        if matches!(placed.shape.shape, LocalShape::Sphere(_)) {
            self.add_sphere_uv(&mut point, placed.material);
        }
        let position = transform.to_world.transform_point3(point.position);
        let error = transform.error(point.error, point.position, position);
        in_world(Point { position, error, normal: transform.normal(point.normal), uv: point.uv }, hit, placed.material)
    }

    #[inline(always)]
    fn mesh_surface(&self, hit: &Hit, index: usize) -> Surface {
        let placed = &self.geometry.instances[index];
        let mesh = &self.geometry.meshes[placed.shape.mesh as usize];
        let at = MeshHit { instance: index as u32, triangle: hit.part, at: TriangleHit { t: hit.t, b1: hit.b1, b2: hit.b2, front: true } };
        let local = mesh.point(&at);
        let transform = &placed.shape.transform;
        let point = transform.to_world.transform_point3(local.position);
        let ng = transform.normal(local.ng);
        let ns = if mesh.normals.is_empty() { ng } else { transform.normal(local.ns) };
        let ns = match ns.dot(ng) {
            above if above > 0.0 => ns,
            below if below < 0.0 => -ns,
            // Perpendicular, zero or NaN.
            _ => ng,
        };
        let material = &self.materials[placed.material as usize];
        let [uv, uv2] = if material.has_coordinates { mesh.uvs_at(&at) } else { [DVec2::ZERO; 2] };
        let tangents = material.tangents.as_ref().map_or([DVec3::ZERO; 2], |coordinates| {
            mesh.tangents_at(&at, local.ns, coordinates).map(|tangent| transform.to_world.transform_vector3(tangent))
        });
        let footprints = if material.filtered { self.footprints_on_mesh(&at, point, ng) } else { Default::default() };
        let error = transform.error(local.error, local.position, point);
        Surface {
            point,
            t: hit.t,
            error,
            ng,
            ns,
            uv,
            uv2,
            tangents,
            footprints,
            color: mesh.color(&at),
            material: placed.material,
            object: hit.object,
            part: hit.part,
            sphere: 0,
        }
    }

    #[inline(always)]
    fn has_coordinates(&self, material: u32) -> bool {
        self.materials[material as usize].has_coordinates
    }

    /// Longitude and latitude cost more than the hit itself: only textures ask for them.
    #[inline(always)]
    fn add_sphere_uv(&self, point: &mut Point, material: u32) {
        if self.has_coordinates(material) {
            point.uv = Sphere::uv(point.normal);
        }
    }
}

/// A number in [0, 1) that depends on the place of a hit, down to its last bit: as if at random, a surface is there for as many rays as its opacity says (Enderton, Sintorn,
/// Shirley, Luebke, "Stochastic Transparency", 2010).
fn chance(hit: &MeshHit) -> f64 {
    let bits = [hit.at.t, hit.at.b1, hit.at.b2].map(f64::to_bits);
    let mixed = bits.into_iter().fold(u64::from(hit.triangle), |state, bits| mix(state ^ bits));
    (mixed >> 11) as f64 / (1_u64 << 53) as f64
}
