//! The triangles of a mesh.

use glam::{DVec3, Vec3};

use super::{frame::Normalisation, pages::prefetch};
use crate::shape::{
    Bounds, Ray,
    triangle::{Sheared, TriangleHit},
};

/// Triangles in the mesh's own coordinates.
#[derive(Debug)]
pub struct Triangles {
    positions: Vec<[f32; 3]>,
    triangles: Vec<[u32; 3]>,
    bounds: Bounds,
    frame: Normalisation,
}

impl Triangles {
    /// At least one; positions are finite and indices in range.
    pub fn new(mut positions: Vec<[f32; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        let bounds = |positions: &[[f32; 3]]| Bounds::of(triangles.iter().flatten().map(|&i| Vec3::from(positions[i as usize]).as_dvec3()));
        let frame = Normalisation::scaling(DVec3::ZERO, bounds(&positions));
        // What scaling cannot keep, being 2^-126 of the mesh's size, is nothing for all who look at a position.
        for position in &mut positions {
            let scaled = frame.point(Vec3::from(*position).as_dvec3()).as_vec3();
            *position = frame.unscaled(scaled.as_dvec3()).as_vec3().into();
        }
        Self { bounds: bounds(&positions), frame, positions, triangles }
    }

    /// Number of triangles.
    pub fn count(&self) -> usize {
        self.triangles.len()
    }

    /// The box around them.
    pub fn bounds(&self) -> Bounds {
        self.bounds
    }

    /// All that there are to be vertices.
    pub fn positions(&self) -> impl Iterator<Item = DVec3> {
        self.positions.iter().map(|&position| Vec3::from(position).as_dvec3())
    }

    /// Indices of a triangle's vertices.
    pub fn indices(&self, triangle: u32) -> [usize; 3] {
        self.triangles[triangle as usize].map(|i| i as usize)
    }

    /// Vertices of a triangle.
    #[inline(always)]
    pub fn vertices(&self, triangle: u32) -> [DVec3; 3] {
        // Not by `array::map`, which code for other instructions calls.
        let [a, b, c] = self.triangles[triangle as usize];
        let position = |i: u32| Vec3::from(self.positions[i as usize]).as_dvec3();
        [position(a), position(b), position(c)]
    }

    /// Asks memory for the indices of a triangle.
    #[inline(always)]
    pub fn prefetch_indices(&self, triangle: u32) {
        prefetch::<1>(self.triangles.as_ptr().wrapping_add(triangle as usize).cast());
    }

    /// Asks memory for its vertices.
    #[inline(always)]
    pub fn prefetch_vertices(&self, triangle: u32) {
        self.triangles[triangle as usize].iter().for_each(|i| prefetch::<1>(self.positions.as_ptr().wrapping_add(*i as usize).cast()));
    }

    /// Where a ray in the mesh's coordinates hits a triangle, with `t > 0`: the same bits as packs find.
    #[inline(always)]
    pub fn hit(&self, triangle: u32, ray: &Ray) -> Option<TriangleHit> {
        let sheared = Sheared::new(self.frame.point(ray.origin), ray.direction);
        let [a, b, c] = self.vertices(triangle);
        let at = sheared.hit(sheared.turned([self.frame.point(a), self.frame.point(b), self.frame.point(c)]))?;
        Some(TriangleHit { t: self.frame.unscaled(at.t), ..at })
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        size_of_val(&*self.positions) + size_of_val(&*self.triangles)
    }
}
