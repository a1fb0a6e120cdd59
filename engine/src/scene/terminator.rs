//! Points on the smooth surface that vertex normals tell of, for coarse meshes.

use glam::DVec3;

use super::{
    Scene, Surface,
    geometry::{Instance, Mesh, Placed},
};

impl Scene {
    /// The surface that a ray along `direction` has met as the smooth one that its vertex normals tell of, if it is of a mesh that has them: moved outwards, and with its shading normal for
    /// its own. Rays that leave it there are not blocked by neighbouring triangles that the smooth surface does not have (Hanika, "Hacking the Shadow Terminator", Ray Tracing
    /// Gems II, 2021, chapter 4). That is wrong as far as vertex normals do not tell of a smooth surface: a bias.
    ///
    /// What light goes through stays as it is, as do places where the two normals do not agree on which side is seen.
    #[inline(never)]
    pub fn smoothed(&self, surface: &Surface, direction: DVec3) -> Surface {
        let (seen, as_shaded) = (direction.dot(surface.ng), direction.dot(surface.ns));
        let goes_through = self.materials[surface.material as usize].recipe.has_inside();
        let Some(placed) = self.instance_of(surface.object).filter(|_| seen * as_shaded > 0.0 && !goes_through) else { return *surface };
        let mesh = &self.geometry.meshes[placed.shape.mesh as usize];
        if mesh.normals.is_empty() {
            return *surface;
        }
        let side = -1f64.copysign(seen);
        let point = surface.start(side) + lift(mesh, placed, surface, side);
        Surface { point, error: 0.0, ng: surface.ns, ..*surface }
    }

    /// The mesh that an object is.
    fn instance_of(&self, object: u32) -> Option<&Placed<Instance>> {
        let (grounded, others) = self.geometry.instances.split_at(self.geometry.grounded);
        let find = |of: &'_ [Placed<Instance>]| of.binary_search_by_key(&object, |placed| placed.object).ok();
        find(grounded).map(|at| &grounded[at]).or_else(|| find(others).map(|at| &others[at]))
    }
}

/// From a point of a triangle to the mean, by its barycentric coordinates, of its projections onto the planes that are perpendicular to the normals of the vertices: of those planes that it lies
/// below, as seen from one side.
fn lift(mesh: &Mesh, placed: &Placed<Instance>, surface: &Surface, side: f64) -> DVec3 {
    let transform = &placed.shape.transform;
    let corners = mesh.triangles.vertices(surface.part).map(|corner| transform.to_world.transform_point3(corner));
    let weights = barycentric(surface.point, corners);
    let mut lift = DVec3::ZERO;
    for ((corner, index), weight) in corners.into_iter().zip(mesh.triangles.indices(surface.part)).zip(weights) {
        let normal = transform.normal(glam::Vec3::from(mesh.normals[index]).as_dvec3());
        let outwards = normal * 1f64.copysign(side * normal.dot(surface.ng));
        let below = (surface.point - corner).dot(outwards).min(0.0);
        if below.is_finite() {
            lift -= outwards * (below * weight);
        }
    }
    lift
}

/// The weights of a triangle's vertices at a point of it, by areas; 0 for a triangle without area.
fn barycentric(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let area = |from: DVec3, to: DVec3| (from - point).cross(to - point).dot(normal) / normal.length_squared();
    let weights = [area(b, c), area(c, a), area(a, b)].map(|weight| weight.clamp(0.0, 1.0));
    if weights.iter().all(|weight| weight.is_finite()) { weights } else { [0.0; 3] }
}
