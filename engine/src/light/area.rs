//! Surfaces that shine, compiled for sampling from a point.

use std::f64::consts::PI;

use glam::{DVec2, DVec3};

use crate::{
    math::{UNIT, max_abs, orthonormal_basis},
    sampling::{concentric_disc, uniform_cone, uniform_cone_pdf, uniform_sphere, uniform_triangle},
    shape::{Bounds, Disc, Sphere},
};

/// A surface whose points can be chosen at random.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Area {
    /// Seen from outside.
    Sphere(Sphere),
    /// A flat circle.
    Disc(Disc),
    /// All points `corner + a u + b v` with a and b in [0, 1].
    Parallelogram {
        /// Where both edges begin.
        corner: DVec3,
        /// The edges.
        edges: [DVec3; 2],
    },
    /// All points `corner + a u + b v` with a, b and 1 - a - b in [0, 1].
    Triangle {
        /// Where both edges begin.
        corner: DVec3,
        /// The edges.
        edges: [DVec3; 2],
    },
}

/// A surface that shines evenly.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emitter {
    /// Its points.
    pub area: Area,
    /// Unit normal; of no use for a sphere.
    normal: DVec3,
    /// In squares of scene units.
    size: f64,
    /// Radiance on the side of the normal, the mean of it where it has a texture.
    pub radiance: DVec3,
    /// Whether the other side shines too.
    pub two_sided: bool,
    /// Whether the radiance varies: it has to be looked up where a ray meets it.
    pub textured: bool,
    /// Place of the object in the order of the scene.
    pub object: u32,
    /// Triangle of a mesh, or face of a box.
    pub part: u32,
}

/// A point on an emitter, as seen from another point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct EmitterSample {
    /// Unit vector towards it.
    pub direction: DVec3,
    /// How far a ray towards it goes without meeting it.
    pub distance: f64,
    /// Density by solid angle.
    pub pdf: f64,
}

impl Emitter {
    /// `None` if it has no area that numbers can tell from 0, or does not shine.
    pub fn new(area: Area, radiance: DVec3, two_sided: bool, object: u32, part: u32) -> Option<Self> {
        let (normal, size) = match &area {
            Area::Sphere(sphere) => (DVec3::ZERO, 4.0 * PI * sphere.radius * sphere.radius),
            Area::Disc(disc) => (disc.normal, PI * disc.radius * disc.radius),
            Area::Parallelogram { edges: [u, v], .. } => split(u.cross(*v), 1.0),
            Area::Triangle { edges: [u, v], .. } => split(u.cross(*v), 0.5),
        };
        let shines = size > 0.0 && size.is_finite() && normal.is_finite() && radiance.max_element() > 0.0;
        shines.then_some(Self { area, normal, size, radiance, two_sided, textured: false, object, part })
    }

    /// The same with its front where its back was.
    #[must_use]
    pub fn turned(self) -> Self {
        Self { normal: -self.normal, ..self }
    }

    /// Area in squares of scene units.
    pub fn size(&self) -> f64 {
        self.size
    }

    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        match &self.area {
            Area::Sphere(sphere) => sphere.bounds(),
            Area::Disc(disc) => disc.bounds(),
            Area::Parallelogram { corner, edges: [u, v] } => Bounds::of([*corner, *corner + *u, *corner + *v, *corner + *u + *v]),
            Area::Triangle { corner, edges: [u, v] } => Bounds::of([*corner, *corner + *u, *corner + *v]),
        }
    }

    /// The middle of the directions of its normals, and the cosine of the angle within which all lie.
    pub fn normals(&self) -> (DVec3, f64) {
        match self.area {
            Area::Sphere(_) => (DVec3::Z, -1.0),
            _ => (self.normal, 1.0),
        }
    }

    /// A point on it, chosen evenly by area, and the unit normal there.
    #[inline]
    pub fn point(&self, u: DVec2) -> (DVec3, DVec3) {
        match &self.area {
            Area::Sphere(sphere) => {
                let normal = uniform_sphere(u);
                (sphere.center + normal * sphere.radius, normal)
            }
            Area::Disc(disc) => {
                let at = concentric_disc(u) * disc.radius;
                let (x, y) = orthonormal_basis(disc.normal);
                (disc.center + x * at.x + y * at.y, self.normal)
            }
            Area::Parallelogram { corner, edges } => (*corner + edges[0] * u.x + edges[1] * u.y, self.normal),
            Area::Triangle { corner, edges } => {
                let [_, b1, b2] = uniform_triangle(u);
                (*corner + edges[0] * b1 + edges[1] * b2, self.normal)
            }
        }
    }

    /// A point on it that `from` may see, chosen by two numbers in [0, 1); `None` if it does not shine there.
    #[inline]
    pub fn sample(&self, from: DVec3, u: DVec2) -> Option<EmitterSample> {
        match &self.area {
            Area::Sphere(sphere) => sample_sphere(sphere, from, u),
            _ => self.towards(self.point(u).0, from),
        }
    }

    /// The density, by solid angle, with which [`Self::sample`] chooses a direction from `from` that meets the emitter at this distance.
    #[inline]
    pub fn pdf(&self, from: DVec3, direction: DVec3, distance: f64) -> f64 {
        match &self.area {
            Area::Sphere(sphere) => Cone::of(sphere, from).map_or(0.0, |cone| uniform_cone_pdf(cone.sin2)),
            _ => self.density(direction, distance * distance),
        }
    }

    /// From one by area to one by solid angle (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 6.2.5).
    #[inline]
    fn density(&self, direction: DVec3, squared: f64) -> f64 {
        squared / (self.size * direction.dot(self.normal).abs())
    }

    #[inline]
    fn towards(&self, point: DVec3, from: DVec3) -> Option<EmitterSample> {
        let way = point - from;
        let squared = way.length_squared();
        if squared == 0.0 {
            return None;
        }
        let distance = squared.sqrt();
        let direction = way * (1.0 / distance);
        let cos = -direction.dot(self.normal);
        if cos == 0.0 || (cos < 0.0 && !self.two_sided) {
            return None;
        }
        let pdf = self.density(direction, squared);
        pdf.is_finite().then_some(EmitterSample { direction, distance: before(distance, from, point), pdf })
    }
}

/// A vector as a unit vector and its length, times a factor.
fn split(v: DVec3, factor: f64) -> (DVec3, f64) {
    let scale = max_abs(v);
    let unit = (v / scale).normalize();
    (unit, (v / scale).length() * scale * factor)
}

/// A distance shortened so far that a ray does not meet what stands there: by more than rounding moves a surface (see [`crate::scene::Surface::error`]) that is not seen
/// from all too near the edge.
#[inline]
fn before(distance: f64, from: DVec3, point: DVec3) -> f64 {
    const SHARE: f64 = 1.0 / (1_u64 << 36) as f64;
    distance - distance * SHARE - 1024.0 * UNIT * (max_abs(from) + max_abs(point))
}

/// The directions in which a sphere is seen.
struct Cone {
    /// Unit vector towards its middle.
    axis: DVec3,
    distance: f64,
    /// Square of the sine of the angle between the axis and the border.
    sin2: f64,
}

impl Cone {
    /// `None` from inside.
    #[inline]
    fn of(sphere: &Sphere, from: DVec3) -> Option<Self> {
        let way = sphere.center - from;
        let squared = way.length_squared();
        let sin2 = sphere.radius * sphere.radius / squared;
        // Not a number is inside too.
        (sin2 < 1.0).then(|| {
            let distance = squared.sqrt();
            Self { axis: way * (1.0 / distance), distance, sin2 }
        })
    }
}

/// By solid angle (Pharr, Jakob, Humphreys, "Physically Based Rendering", 4th ed., 6.2.4).
#[inline]
fn sample_sphere(sphere: &Sphere, from: DVec3, u: DVec2) -> Option<EmitterSample> {
    let cone = Cone::of(sphere, from)?;
    let (x, y) = orthonormal_basis(cone.axis);
    let local = uniform_cone(u, cone.sin2);
    let direction = x * local.x + y * local.y + cone.axis * local.z;
    let beside = cone.distance * cone.distance * (local.x * local.x + local.y * local.y);
    let distance = cone.distance * local.z - (sphere.radius * sphere.radius - beside).max(0.0).sqrt();
    let far = sphere.radius + max_abs(sphere.center);
    Some(EmitterSample { direction, distance: before(distance, from, DVec3::splat(far)), pdf: uniform_cone_pdf(cone.sin2) })
}
