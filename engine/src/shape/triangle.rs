//! Triangles: the watertight test of Woop, Benthin, Wald ("Watertight Ray/Triangle Intersection", JCGT 2(1), 2013), in f64.
//!
//! The ray is sheared onto the z axis; every vertex is projected by the same arithmetic for all of its triangles, and the edge functions
//! of the projected vertices round monotonically, so that their signs are right or zero. Zero counts as inside: no ray slips between
//! triangles that share an edge or a vertex.

use glam::DVec3;

/// A ray made ready for triangles.
#[derive(Clone, Copy, Debug)]
pub struct Sheared {
    origin: DVec3,
    direction: DVec3,
    /// Axes: the largest of the direction's components is z.
    axes: [usize; 3],
    /// Shear and scale.
    shear: DVec3,
}

/// A hit: `t` and the barycentric coordinates of the second and third vertex.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TriangleHit {
    /// Parameter of the ray.
    pub t: f64,
    /// Weight of the second vertex.
    pub b1: f64,
    /// Weight of the third vertex.
    pub b2: f64,
    /// Whether the front (counter-clockwise side) was hit.
    pub front: bool,
}

impl Sheared {
    /// Prepares a ray whose direction is not 0.
    #[inline(always)]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let size = direction.abs();
        let z = if size.x > size.y {
            if size.x > size.z { 0 } else { 2 }
        } else if size.y > size.z {
            1
        } else {
            2
        };
        let (x, y) = ([1, 2, 0][z], [2, 0, 1][z]);
        let scale = 1.0 / direction[z];
        Self { origin, direction, axes: [x, y, z], shear: DVec3::new(direction[x] * scale, direction[y] * scale, scale) }
    }

    /// Axes: that of the direction's largest component is the last.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// How far the first and the second axis lean along the last.
    #[inline(always)]
    pub fn shear(&self) -> [f64; 2] {
        [self.shear.x, self.shear.y]
    }

    /// The hit with `t > 0`, of either side.
    #[inline(always)]
    pub fn hit(&self, vertices: [DVec3; 3]) -> Option<TriangleHit> {
        let [x, y, z] = self.axes;
        let relative = vertices.map(|vertex| vertex - self.origin);
        let [a, b, c] = relative.map(|p| (p[x] - self.shear.x * p[z], p[y] - self.shear.y * p[z]));
        let u = c.0 * b.1 - c.1 * b.0;
        let v = a.0 * c.1 - a.1 * c.0;
        let w = b.0 * a.1 - b.1 * a.0;
        if (u < 0.0 || v < 0.0 || w < 0.0) && (u > 0.0 || v > 0.0 || w > 0.0) {
            return None;
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        let (b1, b2) = (v / sum, w / sum);
        // Along the normal, the distance to the plane keeps its accuracy however thin the triangle is: vertices are f32, so the edges are
        // nearly exact. At grazing angles the depths of the vertices bound it.
        let normal = geometric_normal(vertices);
        let t = normal.dot(relative[0]) / normal.dot(self.direction);
        let [da, db, dc] = relative.map(|p| p[z] * self.shear.z);
        let t = t.max(da.min(db).min(dc)).min(da.max(db).max(dc));
        (t > 0.0).then_some(TriangleHit { t, b1, b2, front: normal.dot(self.direction) < 0.0 })
    }
}

/// Normal on the counter-clockwise side, of twice the area's length.
#[inline(always)]
pub fn geometric_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    (b - a).cross(c - a)
}
