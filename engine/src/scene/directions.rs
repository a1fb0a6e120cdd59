//! Which way texture coordinates run on a surface, for materials that ask: tangents lie along them, and pixels of the film cover some of them.

use glam::{DVec2, DVec3};

use super::{
    Scene,
    geometry::{LocalShape, Mesh, kind},
};
use crate::{accel::MeshHit, texture::Footprint};

/// See [`crate::shape::Surface`].
pub(super) struct Directions {
    pub tangents: [DVec3; 2],
    pub footprints: [Footprint; 2],
}

impl Scene {
    /// Of anything but a mesh, at a place with this normal.
    #[inline(never)]
    pub(super) fn directions(&self, reference: u32, part: u32, place: DVec3, normal: DVec3) -> Directions {
        let [along_u, along_v] = self.along_uv(reference, part, place, normal);
        let footprint = footprint([along_u, along_v], self.camera.pixel_on(place, normal));
        Directions { tangents: [along_u, -along_v], footprints: [footprint, Footprint::default()] }
    }

    /// How a place of anything but a mesh changes with u and with v.
    fn along_uv(&self, reference: u32, part: u32, place: DVec3, normal: DVec3) -> [DVec3; 2] {
        let geometry = &self.geometry;
        let index = (reference & kind::INDEX) as usize;
        match reference >> kind::SHIFT {
            kind::SPHERE => geometry.spheres[index].shape.along_uv(normal),
            kind::CUBOID => geometry.cuboids[index].shape.along_uv(part),
            kind::DISC => geometry.discs[index].shape.along_uv(),
            kind::PLANE => geometry.planes[index].shape.along_uv(),
            kind::OTHER => geometry.others[index].shape.along_uv(place, part),
            _ => {
                let placed = &geometry.transformed[index].shape;
                let local = placed.transform.to_object.transform_point3(place);
                let along = match &placed.shape {
                    LocalShape::Sphere(sphere) => sphere.along_uv((local - sphere.center).normalize_or_zero()),
                    LocalShape::Cuboid(cuboid) => cuboid.along_uv(part),
                    LocalShape::Disc(disc) => disc.along_uv(),
                    LocalShape::Other(other) => other.along_uv(local, part),
                };
                along.map(|along| placed.transform.to_world.transform_vector3(along))
            }
        }
    }

    /// What a pixel of the film covers of both sets of a mesh's texture coordinates.
    #[inline(never)]
    pub(super) fn footprints_on_mesh(&self, hit: &MeshHit, place: DVec3, normal: DVec3) -> [Footprint; 2] {
        let placed = &self.geometry.instances[hit.instance as usize].shape;
        let mesh = &self.geometry.meshes[placed.mesh as usize];
        let steps = self.camera.pixel_on(place, normal);
        mesh.along_uvs(hit.triangle).map(|along| footprint(along.map(|along| placed.transform.to_world.transform_vector3(along)), steps))
    }
}

impl Mesh {
    /// How places of a triangle change with u and with v, for both sets of texture coordinates; not finite where these are the same all over it
    /// (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 6.5.1).
    fn along_uvs(&self, triangle: u32) -> [[DVec3; 2]; 2] {
        let [a, b, c] = self.triangles.vertices(triangle);
        let (to_b, to_c) = (b - a, c - a);
        let [uvs_a, uvs_b, uvs_c] = self.triangles.indices(triangle).map(|i| self.uvs_of(i));
        std::array::from_fn(|set| {
            let (uv_b, uv_c) = (uvs_b[set] - uvs_a[set], uvs_c[set] - uvs_a[set]);
            let determinant = uv_b.perp_dot(uv_c);
            [(to_b * uv_c.y - to_c * uv_b.y) / determinant, (to_c * uv_b.x - to_b * uv_c.x) / determinant]
        })
    }
}

/// By how much u and v change along steps on a surface: the least squares of what is left (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 10.1.1).
fn footprint([along_u, along_v]: [DVec3; 2], steps: [DVec3; 2]) -> Footprint {
    let (uu, uv, vv) = (along_u.length_squared(), along_u.dot(along_v), along_v.length_squared());
    let determinant = uu * vv - uv * uv;
    Footprint(steps.map(|step| {
        let (u, v) = (along_u.dot(step), along_v.dot(step));
        (DVec2::new(vv * u - uv * v, uu * v - uv * u) / determinant).as_vec2()
    }))
}
