//! What a ray met.

use glam::{DVec2, DVec3};

use super::Ray;
use crate::texture::{Footprint, Uvs};

/// The surface at a hit, in world coordinates.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Surface {
    /// The position, as near to the surface as f64 allows.
    pub point: DVec3,
    /// Parameter of the ray: the distance, as its direction is a unit vector.
    pub t: f64,
    /// Bound on the error of `point` and of what an intersection nearby adds: a ray that starts this far beside the surface does not meet it again.
    pub error: f64,
    /// Unit geometric normal on the shape's outward side, which may face away from the ray.
    pub ng: DVec3,
    /// Unit shading normal on the same side as `ng`.
    pub ns: DVec3,
    /// Texture coordinates; (0, 0) where the material has no texture or the mesh no coordinates.
    pub uv: DVec2,
    /// The second set of them, where the mesh has two; else (0, 0).
    pub uv2: DVec2,
    /// Along u, and to the upper side of the image, of any length; 0 where the material does not ask for them or nothing tells them.
    pub tangents: [DVec3; 2],
    /// What a pixel of the film covers of both sets of texture coordinates; 0 where the material does not ask for it.
    pub footprints: [Footprint; 2],
    /// Vertex colour and opacity; 1 where there is none.
    pub color: [f32; 4],
    /// Index into `materials` of the scene.
    pub material: u32,
    /// Place of the object in the order of the scene.
    pub object: u32,
    /// Triangle of a mesh, face of a box, side or end of a cone; 0 on everything else.
    pub part: u32,
    /// The bit of a listed sphere, 0 for everything else: see [`Ray::leaves`].
    pub sphere: u64,
}

impl Surface {
    /// Where on the surface textures are looked up.
    #[inline(always)]
    pub fn uvs(&self) -> Uvs {
        Uvs { sets: [self.uv, self.uv2], footprints: self.footprints }
    }

    /// Tangent and bitangent as unit vectors that are perpendicular to a unit normal and to each other; of either handedness, as images may be mirrored.
    /// `None` where there are none.
    #[inline]
    pub fn tangents_across(&self, normal: DVec3) -> Option<(DVec3, DVec3)> {
        let [along, up] = self.tangents;
        let along = along.try_normalize()?;
        let tangent = (along - normal * normal.dot(along)).try_normalize()?;
        let bitangent = normal.cross(tangent);
        Some((tangent, if bitangent.dot(up) < 0.0 { -bitangent } else { bitangent }))
    }

    /// A ray without end that leaves the surface along a unit vector, on whichever side that leads to.
    #[inline]
    pub fn spawn(&self, direction: DVec3) -> Ray {
        self.spawn_on(direction.dot(self.ng), direction)
    }

    /// A ray without end that leaves the surface along a unit vector, on the outward side if `side` is positive.
    #[inline(always)]
    fn spawn_on(&self, side: f64, direction: DVec3) -> Ray {
        Ray { leaves: self.leaves(side), ..Ray::new(self.start(side), direction) }
    }

    /// Where rays start that leave the surface on the outward side, if `side` is positive, or else on the other.
    #[inline(always)]
    pub fn start(&self, side: f64) -> DVec3 {
        self.point + self.ng * self.error.copysign(side)
    }

    /// What such rays leave: see [`Ray::leaves`].
    #[inline(always)]
    pub fn leaves(&self, side: f64) -> u64 {
        if side > 0.0 { self.sphere } else { 0 }
    }
}
