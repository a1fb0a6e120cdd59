//! Cones, truncated cones and cylinders: one shape with two radii.

use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_1_PI, TAU};

use super::{Bounds, Disc, Point, Ray};
use crate::math::{UNIT, atan2, max_abs, orthonormal_basis};

/// All between two parallel circles about one axis. Radii may be equal (a cylinder), and one may be 0 (an apex).
///
/// Coordinates are taken from the narrower end: near an apex they are small there, and so are their errors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cone {
    /// Middle of the narrower end.
    narrow: DVec3,
    /// Unit vector from there to the wider end.
    axis: DVec3,
    height: f64,
    /// Of the narrower end, of the wider one.
    radii: [f64; 2],
    /// From one end to the other along the side.
    slant: f64,
    /// Of the angle between axis and side.
    sin: f64,
    cos: f64,
    /// By how much the radius grows along the axis.
    slope: f64,
    capped: bool,
    /// Whether the axis points from the first end to the second.
    forward: bool,
}

/// The parts of a cone's surface.
const SIDE: u32 = 0;
const NARROW: u32 = 1;
const WIDE: u32 = 2;

impl Cone {
    /// From the middle of one end to that of the other, with their radii: not negative, and not both 0. `None` if the ends coincide.
    pub fn new([from, to]: [DVec3; 2], radii: [f64; 2], capped: bool) -> Option<Self> {
        let forward = radii[0] <= radii[1];
        let (narrow, wide) = if forward { (from, to) } else { (to, from) };
        let radii = [radii[0].min(radii[1]), radii[0].max(radii[1])];
        let between = wide - narrow;
        let size = max_abs(between);
        if size == 0.0 {
            return None;
        }
        let towards = between / size;
        let length = towards.length();
        let (height, growth) = (size * length, radii[1] - radii[0]);
        let slant = DVec2::new(growth, height).length();
        Some(Self {
            narrow,
            axis: towards / length,
            height,
            radii,
            slant,
            sin: growth / slant,
            cos: height / slant,
            slope: growth / height,
            capped,
            forward,
        })
    }

    /// Scaled about the origin, then moved.
    pub fn moved(&self, scale: f64, by: DVec3) -> Self {
        Self {
            narrow: self.narrow * scale + by,
            height: self.height * scale,
            radii: self.radii.map(|radius| radius * scale),
            slant: self.slant * scale,
            ..*self
        }
    }

    /// Whether both radii are equal.
    pub fn is_cylinder(&self) -> bool {
        self.radii[0] == self.radii[1]
    }

    /// The box around both ends.
    pub fn bounds(&self) -> Bounds {
        self.cap(NARROW).bounds().union(self.cap(WIDE).bounds())
    }

    /// The nearest hit and its part.
    pub fn closest(&self, ray: &Ray) -> Option<(f64, u32)> {
        self.crossings(ray)?.into_iter().find(|(t, _)| *t > 0.0 && *t < ray.t_max)
    }

    /// Both crossings of the line, nearer first, each with its part, unless both lie behind the origin. The body is convex: the line is in it where it is
    /// between the planes of the ends and within the side. A crossing of an end that is not there is infinite.
    pub fn crossings(&self, ray: &Ray) -> Option<[(f64, u32); 2]> {
        let direction = ray.direction;
        let from_narrow = ray.origin - self.narrow;
        let along = self.axis.dot(direction);
        let across = direction - self.axis * along;
        let height = self.axis.dot(from_narrow);
        let [enters, leaves] = self.between_ends(height, along)?.map(|(t, _)| t);
        let enters = enters.max(0.0);
        if leaves < enters {
            return None;
        }
        // Where the line is nearest to the axis: from there, all that is squared below is no larger than the cone.
        let beside = from_narrow - self.axis * height;
        let nearest = -beside.dot(across) / across.length_squared();
        let crossings = self.crossings_from(nearest.max(enters).min(leaves), from_narrow, direction);
        // A line close to the side, and along it, may leave it far from there, where little is known of it then. Whether the ray starts within is known.
        let starts_within = beside.length_squared() < (self.radii[0] + self.slope * height).powi(2);
        match crossings {
            Some([(near, _), (far, _)]) if enters > 0.0 || starts_within == (near < 0.0 && far > 0.0) => crossings,
            None if enters > 0.0 || !starts_within => None,
            _ => self.crossings_from(0.0, from_narrow, direction),
        }
        .map(|crossings| crossings.map(|(t, part)| (if part == SIDE || self.capped { t } else { f64::INFINITY }, part)))
    }

    /// The crossings of a line, computed from where it has gone for `start`.
    #[inline(always)]
    fn crossings_from(&self, start: f64, from_narrow: DVec3, direction: DVec3) -> Option<[(f64, u32); 2]> {
        let along = self.axis.dot(direction);
        let across = direction - self.axis * along;
        let p = from_narrow + direction * start;
        let height = self.axis.dot(p);
        let beside = p - self.axis * height;
        if beside.length_squared() > self.radii[1] * self.radii[1] {
            return None;
        }
        let [enters, leaves] = self.within_side(height, beside, along, across)?;
        let [near, far] = self.between_ends(height, along)?;
        let near = if enters >= near.0 { (enters, SIDE) } else { near };
        let far = if leaves <= far.0 { (leaves, SIDE) } else { far };
        (near.0 <= far.0).then(|| [near, far].map(|(t, part)| (start + t, part)))
    }

    /// Where a line is between the planes of the ends.
    fn between_ends(&self, height: f64, along: f64) -> Option<[(f64, u32); 2]> {
        // An apex is a point of the side.
        let first = if self.radii[0] == 0.0 { SIDE } else { NARROW };
        if along == 0.0 {
            let between = (0.0..=self.height).contains(&height);
            return between.then_some([(f64::NEG_INFINITY, first), (f64::INFINITY, WIDE)]);
        }
        let (narrow, wide) = ((-height / along, first), ((self.height - height) / along, WIDE));
        Some(if along > 0.0 { [narrow, wide] } else { [wide, narrow] })
    }

    /// Where a line is within the side, without end in both directions, as far as it lies between the ends: `|beside + t across| <= radius + t growth`.
    ///
    /// Squared, that is a quadratic equation. By Lagrange's identity its discriminant is
    /// `|radius across - growth beside|^2 - |beside x across|^2`, in which nothing cancels but at the silhouette; for a cylinder that is
    /// the form of Haines, Günther, Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection" (Ray Tracing Gems, ch. 7). At an apex both terms
    /// vanish, each exactly.
    fn within_side(&self, height: f64, beside: DVec3, along: f64, across: DVec3) -> Option<[f64; 2]> {
        let (radius, growth) = (self.radii[0] + self.slope * height, self.slope * along);
        let a = across.length_squared() - growth * growth;
        let b = beside.dot(across) - radius * growth;
        let c = beside.length_squared() - radius * radius;
        // From within the side, a line that leads out of it cancels nothing in the usual form either; along the side, where Lagrange's does, it must.
        let discriminant = if a * c <= 0.0 {
            b * b - a * c
        } else {
            (across * radius - beside * growth).length_squared() - beside.cross(across).length_squared()
        };
        // A line that is steeper than the side meets it always.
        if discriminant < 0.0 && a >= 0.0 {
            return None;
        }
        let q = -(b + discriminant.max(0.0).sqrt().copysign(b));
        let (t0, t1) = match (q == 0.0, a == 0.0) {
            (false, _) => (c / q, q / a),
            // Along the axis of a cylinder.
            (true, true) if c > 0.0 => return None,
            (true, true) => (f64::NEG_INFINITY, f64::INFINITY),
            (true, false) => (0.0, 0.0),
        };
        let (lower, upper) = if t0 < t1 { (t0, t1) } else { (t1, t0) };
        // The steeper line meets the side once, and its mirror image beyond the apex once.
        Some(match a < 0.0 {
            false => [lower, upper],
            true if growth > 0.0 => [upper, f64::INFINITY],
            true => [f64::NEG_INFINITY, lower],
        })
    }

    /// The surface at a hit of a part: the point of the ray is moved along the normal onto it. `textured` asks for its uv. On the side they are
    /// longitude about the axis and the place between the ends, on the ends those of a disc.
    pub fn point(&self, ray: &Ray, t: f64, part: u32, textured: bool) -> Point {
        let p = (ray.origin - self.narrow) + ray.direction * t;
        let height = self.axis.dot(p);
        // Twice: once leaves a remainder along the axis that is large beside a thin cone.
        let beside = p - self.axis * height;
        let beside = beside - self.axis * self.axis.dot(beside);
        let mut point = if part == SIDE { self.point_of_side(height, beside) } else { self.point_of_cap(beside, part) };
        if textured {
            point.uv = if part == SIDE { self.uv(point.position) } else { self.cap(part).uv(point.position) };
        }
        point
    }

    fn point_of_side(&self, height: f64, beside: DVec3) -> Point {
        let size = max_abs(beside);
        let around = if size > 0.0 { (beside / size).normalize() } else { orthonormal_basis(self.axis).0 };
        // Along the side, from the narrower end.
        let l = ((around.dot(beside) - self.radii[0]) * self.sin + height * self.cos).clamp(0.0, self.slant);
        let radius = self.radii[0] + l * self.sin;
        let position = self.narrow + self.axis * (l * self.cos) + around * radius;
        let normal = if radius > 0.0 { around * self.cos - self.axis * self.sin } else { -self.axis };
        Point { position, error: self.error(position), normal, uv: DVec2::ZERO }
    }

    fn point_of_cap(&self, beside: DVec3, part: u32) -> Point {
        let cap = self.cap(part);
        let distance = beside.length();
        let position = cap.center + if distance > cap.radius { beside * (cap.radius / distance) } else { beside };
        Point { position, error: self.error(position), normal: cap.normal, uv: DVec2::ZERO }
    }

    /// Rounding of the point, and what a later intersection adds.
    fn error(&self, position: DVec3) -> f64 {
        16.0 * UNIT * (max_abs(position) + max_abs(self.narrow) + self.height + self.radii[1])
    }

    /// An end, which faces outward.
    fn cap(&self, part: u32) -> Disc {
        if part == NARROW {
            Disc { center: self.narrow, normal: -self.axis, radius: self.radii[0] }
        } else {
            Disc { center: self.narrow + self.axis * self.height, normal: self.axis, radius: self.radii[1] }
        }
    }

    /// Of a point of the side, each in [0, 1]: with the second end up, u = 0.5 faces +z, or +y where the axis lies along z, and u grows to the right as
    /// seen from outside; v grows from the second end to the first.
    fn uv(&self, position: DVec3) -> DVec2 {
        let p = position - self.narrow;
        let up = if self.forward { self.axis } else { -self.axis };
        let front = DVec3::Z - up * up.z;
        let front = if front.length_squared() > 1e-12 { front.normalize() } else { DVec3::Y };
        let u = 0.5 + atan2(up.cross(front).dot(p), front.dot(p)) * (0.5 * FRAC_1_PI);
        let v = (self.axis.dot(p) / self.height).clamp(0.0, 1.0);
        DVec2::new(u, if self.forward { 1.0 - v } else { v })
    }

    /// How the position changes with u and with v at a place of a part; u leads nowhere at an apex.
    pub fn along_uv(&self, position: DVec3, part: u32) -> [DVec3; 2] {
        if part != SIDE {
            return self.cap(part).along_uv();
        }
        let p = position - self.narrow;
        let beside = p - self.axis * self.axis.dot(p);
        let to_wide = self.axis * self.height + beside.normalize_or_zero() * (self.radii[1] - self.radii[0]);
        let (up, along_v) = if self.forward { (self.axis, -to_wide) } else { (-self.axis, to_wide) };
        [up.cross(beside) * TAU, along_v]
    }
}
