//! Triangles: the watertight test of Woop, Benthin, Wald ("Watertight Ray/Triangle Intersection", JCGT 2(1), 2013), in f64.
//!
//! The ray is sheared onto the z axis; every vertex is projected by the same arithmetic for all of its triangles, and the edge functions
//! of the projected vertices round monotonically, so that their signs are right or zero. Those that come out as zero are computed anew
//! without rounding, so that all signs are right: where rounding made them zero, triangles far too small to be told apart from a point would be met by
//! rays that pass far beside it. Where the ray meets an edge or a vertex truly, it is moved aside by less than any number (Edelsbrunner, Mücke, "Simulation of
//! Simplicity", 1990): of the triangles that meet there, it goes through as many as beside it, so that no ray slips between them and none is counted twice.

use glam::DVec3;

use crate::math::{fma, orthonormal_basis};

/// A ray made ready for triangles. Its axes are turned so that the direction's largest component comes last.
#[derive(Clone, Copy, Debug)]
pub struct Sheared {
    /// Which axis of the world each of its own is.
    axes: [usize; 3],
    origin: [f64; 3],
    direction: [f64; 3],
    /// How far the first and the second axis lean along the last, and the last one's scale.
    shear: [f64; 3],
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

/// A ray's own axes, by the last of them.
pub const AXES: [[usize; 3]; 3] = [[1, 2, 0], [2, 0, 1], [0, 1, 2]];

/// The axis along which a direction of these magnitudes goes most.
#[inline(always)]
pub fn last_axis([x, y, z]: [f64; 3]) -> usize {
    if x > y {
        if x > z { 0 } else { 2 }
    } else if y > z {
        1
    } else {
        2
    }
}

impl Sheared {
    /// Prepares a ray whose direction is not 0.
    #[inline(always)]
    pub fn new(origin: DVec3, direction: DVec3) -> Self {
        let axes = AXES[last_axis(direction.abs().to_array())];
        let (origin, direction) = (turned(axes, origin), turned(axes, direction));
        let scale = 1.0 / direction[2];
        Self { axes, origin, direction, shear: [direction[0] * scale, direction[1] * scale, scale] }
    }

    /// Which axis of the world each of the ray's own is.
    #[inline(always)]
    pub fn axes(&self) -> [usize; 3] {
        self.axes
    }

    /// A triangle in the ray's own axes.
    #[inline(always)]
    pub fn turned(&self, [a, b, c]: [DVec3; 3]) -> [[f64; 3]; 3] {
        [turned(self.axes, a), turned(self.axes, b), turned(self.axes, c)]
    }

    /// The hit with `t > 0`, of either side, of a triangle in the ray's own axes.
    #[inline(always)]
    pub fn hit(&self, [a, b, c]: [[f64; 3]; 3]) -> Option<TriangleHit> {
        let (near_a, near_b, near_c) = (less(a, self.origin), less(b, self.origin), less(c, self.origin));
        let ((ax, ay), (bx, by), (cx, cy)) = (self.project(near_a), self.project(near_b), self.project(near_c));
        let mut u = cx * by - cy * bx;
        let mut v = ax * cy - ay * cx;
        let mut w = bx * ay - by * ax;
        if is_outside(u, v, w) {
            return None;
        }
        if (u == 0.0) | (v == 0.0) | (w == 0.0) {
            (u, v, w) = (exact(u, (cx, cy), (bx, by)), exact(v, (ax, ay), (cx, cy)), exact(w, (bx, by), (ax, ay)));
            if is_outside(side(u, (cx, cy), (bx, by)), side(v, (ax, ay), (cx, cy)), side(w, (bx, by), (ax, ay))) {
                return None;
            }
        }
        let sum = u + v + w;
        if sum == 0.0 {
            return None;
        }
        // Along the normal, the distance to the plane keeps its accuracy however thin the triangle is: vertices are f32, so the edges are
        // nearly exact. At grazing angles the depths of the vertices bound it.
        let normal = cross(less(b, a), less(c, a));
        let approach = dot(normal, self.direction);
        let t = dot(normal, near_a) / approach;
        let (da, db, dc) = (near_a[2] * self.shear[2], near_b[2] * self.shear[2], near_c[2] * self.shear[2]);
        let t = least(greatest(t, least(least(da, db), dc)), greatest(greatest(da, db), dc));
        (t > 0.0).then(|| TriangleHit { t, b1: v / sum, b2: w / sum, front: approach < 0.0 })
    }

    /// Where a point lies beside the ray.
    #[inline(always)]
    fn project(&self, [x, y, z]: [f64; 3]) -> (f64, f64) {
        (x - self.shear[0] * z, y - self.shear[1] * z)
    }
}

/// Whether edge functions have both signs: without branches, of which nobody could foretell the way.
#[inline(always)]
fn is_outside(u: f64, v: f64, w: f64) -> bool {
    ((u < 0.0) | (v < 0.0) | (w < 0.0)) & ((u > 0.0) | (v > 0.0) | (w > 0.0))
}

/// An edge function, or, where that came out as 0, what rounding took from its products, which were equal then.
#[cold]
#[inline(never)]
fn exact(rounded: f64, (px, py): (f64, f64), (qx, qy): (f64, f64)) -> f64 {
    let rest = |a: f64, b: f64| fma(a, b, -(a * b));
    if rounded == 0.0 { rest(px, qy) - rest(py, qx) } else { rounded }
}

/// On which side of an edge the ray passes once it is moved by (e, e^2), e > 0 and smaller than any number.
#[inline(always)]
fn side(exact: f64, (px, py): (f64, f64), (qx, qy): (f64, f64)) -> f64 {
    if exact != 0.0 {
        exact
    } else if py != qy {
        py - qy
    } else {
        qx - px
    }
}

/// The smaller one, or `b` where they cannot be compared: one instruction.
#[inline(always)]
fn least(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
fn greatest(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}

#[inline(always)]
fn turned([x, y, z]: [usize; 3], v: DVec3) -> [f64; 3] {
    // Not of the vector itself, which would branch for every component.
    let v = v.to_array();
    [v[x], v[y], v[z]]
}

#[inline(always)]
fn less(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - b[1] * a[2], a[2] * b[0] - b[2] * a[0], a[0] * b[1] - b[0] * a[1]]
}

#[inline(always)]
fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Normal on the counter-clockwise side, of twice the area's length; of a triangle without area, some vector perpendicular to its edges: rounding lets rays meet it.
#[inline(always)]
pub fn geometric_normal([a, b, c]: [DVec3; 3]) -> DVec3 {
    let normal = (b - a).cross(c - a);
    if normal == DVec3::ZERO { beside([b - a, c - a]) } else { normal }
}

#[cold]
fn beside(edges: [DVec3; 2]) -> DVec3 {
    let edge = edges.into_iter().find(|edge| *edge != DVec3::ZERO);
    edge.map_or(DVec3::Z, |edge| orthonormal_basis(edge.normalize()).0)
}
