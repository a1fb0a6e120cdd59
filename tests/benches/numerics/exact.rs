//! Single shapes against geometry in twice the precision: at grazing angles, from far away, near an apex.

use glam::{DAffine3, DVec3};
use tessera_engine::{
    description::{MeshData, Shape},
    shape::{Cone, Ray},
};

use super::{
    double::{Double, Vector},
    scenes::{World, ask, towards},
    trial::{Random, Tally, bits, run},
};

/// The unit roundoff of f64.
const UNIT: f64 = f64::EPSILON / 2.0;

/// Rays for every shape that is made.
const TURN: u64 = 64;

/// A flat shape: a corner, two edges, and how far inside a point with these coordinates along them is.
struct Flat {
    corner: DVec3,
    edges: [DVec3; 2],
    world: World,
    inside: fn([Double; 2]) -> Double,
}

fn least(numbers: impl IntoIterator<Item = Double>) -> Double {
    numbers.into_iter().reduce(|a, b| if a.0 < b.0 { a } else { b }).unwrap_or(Double(0.0, 0.0))
}

/// A triangle, a rectangle, a disc, a plane.
fn flat(random: &mut Random) -> Flat {
    let [corner, u, v] = [(); 3].map(|()| random.point().as_vec3().as_dvec3());
    let (u, v) = (u + u.signum() * 0.25, v - u.signum() * 0.25);
    let (corner, edges) = ((corner * 4.0).as_vec3().as_dvec3(), [u, v].map(|edge| edge.as_vec3().as_dvec3()));
    let (kind, normal) = (random.below(4), edges[0].cross(edges[1]).to_array());
    match kind {
        0 => {
            let ends = [corner, corner + edges[0], corner + edges[1]].map(|p| p.as_vec3());
            let edges = [1, 2].map(|i: usize| ends[i].as_dvec3() - ends[0].as_dvec3());
            let positions = ends.map(|p| p.to_array()).to_vec();
            let mesh = MeshData { positions, triangles: vec![[0, 1, 2]], ..Default::default() };
            let inside = |[a, b]: [Double; 2]| least([a, b, Double::from(1.0) - a - b]);
            Flat { corner: ends[0].as_dvec3(), edges, world: World::of_mesh(&mesh, DAffine3::IDENTITY), inside }
        }
        1 => {
            let shape = Shape::Rectangle { corner: corner.into(), edge_u: edges[0].into(), edge_v: edges[1].into() };
            let inside = |[a, b]: [Double; 2]| least([a, b, Double::from(1.0) - a, Double::from(1.0) - b]);
            Flat { corner, edges, world: World::of(shape, DAffine3::IDENTITY), inside }
        }
        2 => {
            // Axes of the plane z = constant, so that they are exact.
            let (corner, edges) = (corner, [DVec3::X, DVec3::Y]);
            let shape = Shape::Disc { center: corner.into(), normal: [0.0, 0.0, 1.0], radius: 1.0 };
            let inside = |[a, b]: [Double; 2]| Double::from(1.0) - (a * a + b * b).root();
            Flat { corner, edges, world: World::of(shape, DAffine3::IDENTITY), inside }
        }
        _ => Flat {
            corner,
            edges,
            world: World::of(Shape::Plane { point: corner.into(), normal }, DAffine3::IDENTITY),
            inside: |_| Double(1.0, 0.0),
        },
    }
}

impl Flat {
    /// Where a line crosses the plane: t, and how far inside the shape that is.
    fn crossing(&self, ray: &Ray) -> (Double, Double) {
        let [u, v] = self.edges.map(Vector::from);
        let (normal, direction) = (u.cross(v), Vector::from(ray.direction));
        let from = Vector::from(ray.origin) - Vector::from(self.corner);
        let t = -normal.dot(from) / normal.dot(direction);
        let p = from + direction.times(t);
        let area = normal.dot(normal);
        (t, (self.inside)([p.cross(v).dot(normal) / area, u.cross(p).dot(normal) / area]))
    }
}

/// Rays nearly in the plane, down to a cosine of 10^-7: whether they hit, and where.
pub fn grazing(rays: u64) -> Tally {
    run(rays, |random, count, tally| {
        for _ in 0..count / TURN {
            let flat = flat(random);
            let scene = flat.world.compile();
            let [u, v] = flat.edges;
            let normal = u.cross(v).normalize();
            let aim = |random: &mut Random| {
                let target = flat.corner + u * (random.signed() * 1.5) + v * (random.signed() * 1.5);
                let along = random.direction();
                let along = (along - normal * along.dot(normal)).normalize();
                let direction = (along + normal * random.power(-7.0, 0.0)).normalize();
                Ray::new(target - direction * random.power(-1.0, 2.0), direction)
            };
            let rays: Vec<Ray> = (0..TURN).map(|_| aim(random)).collect();
            for (ray, answer) in rays.iter().zip(ask(&scene, &rays)) {
                let (t, inside) = flat.crossing(ray);
                let cosine = ray.direction.dot(normal).abs();
                let lengths = ray.origin.length() + flat.corner.length() + 4.0;
                let right = match answer.hits[0] {
                    Some(hit) => inside.0 >= 0.0 && t.0 > 0.0 && (Double::from(hit.t) - t).0.abs() * cosine <= 16.0 * UNIT * lengths,
                    None => inside.0 <= 0.0 || t.0 <= 0.0,
                };
                let told = || format!("{:?} inside by {:e} at {:e}: {}", flat.world.objects[0].kind, inside.0, t.0, answer.told(ray));
                tally.check(right && answer.agrees(), told);
            }
        }
    })
}

/// How far the line of a ray passes from a point.
fn distance(point: DVec3, ray: &Ray) -> f64 {
    let direction = Vector::from(ray.direction);
    ((Vector::from(point) - Vector::from(ray.origin)).cross(direction).length() / direction.length()).0
}

/// Spheres from up to 10^12 radii away: points of hits lie on them but for 4 u distance / radius, the rays' points at their `t` but for 8 u, of which rounding in the quadratic
/// alone may take 9; and nothing within 0.9 radii is missed.
pub fn far_spheres(rays: u64) -> Tally {
    run(rays, |random, count, tally| {
        for _ in 0..count / TURN {
            let (radius, far) = (random.power(-3.0, 3.0), random.power(0.0, 12.0));
            let center = random.direction() * radius * random.unit() * 2.0;
            let scene = World::of(Shape::Sphere { center: center.into(), radius }, DAffine3::IDENTITY).compile();
            let aim = |random: &mut Random| {
                let target = center + random.direction() * radius * random.unit();
                towards(center + random.direction() * radius * (1.0 + far), target)
            };
            let rays: Vec<Ray> = (0..TURN).map(|_| aim(random)).collect();
            for (ray, answer) in rays.iter().zip(ask(&scene, &rays)) {
                let apart = |p: Vector| (((p - Vector::from(center)).length() - radius.into()) / radius.into()).0.abs();
                let at = |t: f64| Vector::from(ray.origin) + Vector::from(ray.direction).times(t.into());
                let reach = distance(center, ray) / radius;
                let relative = (ray.origin - center).length() / radius;
                let bound = UNIT * relative;
                let point_is_right = scene.closest(ray).is_none_or(|surface| apart(surface.point.into()) <= 4.0 * bound);
                let right = point_is_right && answer.hits[0].map_or(reach > 0.9, |hit| apart(at(hit.t)) <= 8.0 * bound);
                let off = answer.hits[0].map(|hit| apart(at(hit.t)) / bound);
                tally.check(right && answer.agrees(), || {
                    format!("radius {radius:e} about {center}, off by {off:?} u distance / radius, passes at {reach} radii: {}", bits(ray))
                });
            }
        }
    })
}

/// A capped cone with its apex at 0, about an axis of coordinates, so that it is what it says.
struct Apex {
    axis: usize,
    height: f64,
    radius: f64,
}

impl Apex {
    /// The largest signed distance to the side and to the end of a point of a ray: below 0 within.
    fn outside(&self, ray: &Ray, t: Double) -> f64 {
        let p = Vector::from(ray.origin) + Vector::from(ray.direction).times(t);
        let (along, slope) = (p.0[self.axis], Double::from(self.radius) / self.height.into());
        let [a, b] = [1, 2].map(|i| p.0[(self.axis + i) % 3]);
        let slant = (Double::from(1.0) + slope * slope).root();
        let side = ((a * a + b * b).root() - along * slope) / slant;
        side.0.max((along - self.height.into()).0)
    }

    /// Between which two the line is within: roots of the side, cut by the planes of the ends.
    fn crossings(&self, ray: &Ray) -> Option<[Double; 2]> {
        let (o, d) = (Vector::from(ray.origin).0, Vector::from(ray.direction).0);
        let slope = Double::from(self.radius) / self.height.into();
        let (growth, radius) = (d[self.axis] * slope, o[self.axis] * slope);
        let [i, j] = [1, 2].map(|i| (self.axis + i) % 3);
        let a = d[i] * d[i] + d[j] * d[j] - growth * growth;
        let b = o[i] * d[i] + o[j] * d[j] - radius * growth;
        let c = o[i] * o[i] + o[j] * o[j] - radius * radius;
        let discriminant = b * b - a * c;
        let ends = [-o[self.axis] / d[self.axis], (Double::from(self.height) - o[self.axis]) / d[self.axis]];
        let [low, high] = if ends[0].0 < ends[1].0 { ends } else { [ends[1], ends[0]] };
        if discriminant.0 < 0.0 && a.0 >= 0.0 {
            return None;
        }
        let q = -(b + if b.0 < 0.0 { -discriminant.root() } else { discriminant.root() });
        let [t0, t1] = [c / q, q / a];
        let (near, far) = if t0.0 < t1.0 { (t0, t1) } else { (t1, t0) };
        let unbound = Double::from(1e300);
        let (near, far) = match (a.0 < 0.0, growth.0 > 0.0) {
            (false, _) => (near, far),
            (true, true) => (far, unbound),
            (true, false) => (-unbound, near),
        };
        let (near, far) = (if near.0 > low.0 { near } else { low }, if far.0 < high.0 { far } else { high });
        ((far - near).0 > 0.0).then_some([near, far])
    }
}

/// Rays through and near the apex: as many roots, in the same places, as the quadratic equation has between the ends.
pub fn apexes(rays: u64) -> Tally {
    run(rays, |random, count, tally| {
        for _ in 0..count {
            let apex = Apex { axis: random.below(3), height: random.power(-2.0, 2.0), radius: random.power(-2.0, 2.0) };
            let to = DVec3::AXES[apex.axis] * apex.height;
            let Some(cone) = Cone::new([DVec3::ZERO, to], [0.0, apex.radius], true) else { continue };
            let near = apex.height * random.power(-12.0, 0.0);
            let origin = random.direction() * near;
            let ray = towards(origin, random.direction() * near * random.power(-16.0, 0.0) * random.below(8).min(1) as f64);
            // Where a root is told from none, or one place from another, by less than rounding, both will do.
            let bound = 32.0 * UNIT * (near + if near < 1e-2 * apex.height { 0.0 } else { apex.height + apex.radius });
            let off = match (cone.crossings(&ray), apex.crossings(&ray)) {
                (None, None) => 0.0,
                (None, Some([_, far])) if far.0 < 0.0 => 0.0,
                (None, Some([near, far])) => -apex.outside(&ray, (near + far) * Double::from(0.5)),
                (Some(found), _) => {
                    let close = found.iter().filter(|(t, _)| t.abs() < 4.0 * near);
                    close.map(|(t, _)| apex.outside(&ray, (*t).into()).abs()).fold(0.0, f64::max)
                }
            };
            let scale = if off.is_finite() { off / bound } else { f64::INFINITY };
            tally.check(scale <= 1.0, || {
                let told = (cone.crossings(&ray), apex.crossings(&ray).map(|roots| roots.map(|t| t.0)));
                format!(
                    "height {:e} radius {:e} along {}, off by {scale:e} bounds: {told:?} {}",
                    apex.height,
                    apex.radius,
                    apex.axis,
                    bits(&ray)
                )
            });
        }
    })
}
