//! Cones and cylinders against the distance to them along the ray, in twice the precision, and against closed forms.

use super::*;
use crate::{
    math::{UNIT, exp2, pow},
    shape::Cone,
};

/// A sum of two numbers, the second far below the first: about 106 bits (Dekker, "A Floating-Point Technique for Extending the Available
/// Precision", 1971).
#[derive(Clone, Copy)]
struct Double(f64, f64);

impl Double {
    fn sum(a: f64, b: f64) -> Self {
        let sum = a + b;
        let from_b = sum - a;
        Self(sum, (a - (sum - from_b)) + (b - from_b))
    }

    fn product(a: f64, b: f64) -> Self {
        let halves = |x: f64| {
            let scaled = 134_217_729.0 * x;
            let high = scaled - (scaled - x);
            (high, x - high)
        };
        let ((a1, a2), (b1, b2), product) = (halves(a), halves(b), a * b);
        Self(product, ((a1 * b1 - product) + a1 * b2 + a2 * b1) + a2 * b2)
    }

    fn plus(self, other: Self) -> Self {
        let Self(sum, error) = Self::sum(self.0, other.0);
        Self::sum(sum, error + self.1 + other.1)
    }

    fn minus(self, other: Self) -> Self {
        self.plus(Self(-other.0, -other.1))
    }

    fn times(self, other: Self) -> Self {
        let Self(product, error) = Self::product(self.0, other.0);
        Self::sum(product, error + self.0 * other.1 + self.1 * other.0)
    }

    fn over(self, other: Self) -> Self {
        let quotient = Self(self.0 / other.0, 0.0);
        let rest = self.minus(quotient.times(other));
        quotient.plus(Self(rest.0 / other.0, 0.0))
    }

    fn root(self) -> Self {
        if self.0 <= 0.0 {
            return Self(0.0, 0.0);
        }
        let root = Self(self.0.sqrt(), 0.0);
        root.plus(Self(self.minus(root.times(root)).0 / (2.0 * root.0), 0.0))
    }

    fn dot(a: [Self; 3], b: [Self; 3]) -> Self {
        a[0].times(b[0]).plus(a[1].times(b[1])).plus(a[2].times(b[2]))
    }
}

/// A cone as a user gives it.
#[derive(Clone, Copy, Debug)]
struct Given {
    from: DVec3,
    to: DVec3,
    radii: [f64; 2],
}

impl Given {
    fn cone(&self, capped: bool) -> Cone {
        Cone::new([self.from, self.to], self.radii, capped).unwrap()
    }

    fn size(&self) -> f64 {
        (self.to - self.from).length() + self.radii[0].max(self.radii[1])
    }

    /// The largest of the signed distances of a point of a ray to the planes of the ends and to the side: 0 on the surface, negative within, convex along
    /// the ray.
    fn outside(&self, ray: &Ray, t: f64) -> f64 {
        let (zero, from, to) = (Double(0.0, 0.0), self.from.to_array(), self.to.to_array());
        let (mut p, mut axis) = ([zero; 3], [zero; 3]);
        for i in 0..3 {
            p[i] = Double(ray.origin[i], 0.0).plus(Double::product(ray.direction[i], t)).minus(Double(from[i], 0.0));
            axis[i] = Double::sum(to[i], -from[i]);
        }
        let length = Double::dot(axis, axis).root();
        let height = Double::dot(axis, p).over(length);
        let unit = axis.map(|x| x.over(length));
        let beside: [Double; 3] = std::array::from_fn(|i| p[i].minus(unit[i].times(height)));
        let growth = Double::sum(self.radii[1], -self.radii[0]);
        let slant = length.times(length).plus(growth.times(growth)).root();
        let radius = Double(self.radii[0], 0.0).plus(growth.times(height).over(length));
        let side = Double::dot(beside, beside).root().minus(radius).times(length).over(slant);
        side.0.max(-height.0).max(height.minus(length).0)
    }

    /// Both crossings by searching for the least distance and for the changes of its sign; else the least distance.
    fn crossings(&self, ray: &Ray) -> Result<[f64; 2], f64> {
        let middle = (self.from + self.to) * 0.5 - ray.origin;
        let reach = 2.0 * self.size();
        let (first, last) = (middle.dot(ray.direction) - reach, middle.dot(ray.direction) + reach);
        let (mut low, mut high) = (first, last);
        for _ in 0..200 {
            let (a, b) = (low + (high - low) / 3.0, high - (high - low) / 3.0);
            if self.outside(ray, a) < self.outside(ray, b) { high = b } else { low = a }
        }
        let least = low + (high - low) / 2.0;
        if self.outside(ray, least) >= 0.0 {
            return Err(self.outside(ray, least));
        }
        Ok([first, last].map(|mut outer| {
            let mut inner = least;
            for _ in 0..100 {
                let between = outer + (inner - outer) / 2.0;
                if self.outside(ray, between) < 0.0 { inner = between } else { outer = between }
            }
            inner
        }))
    }

    /// Whether the crossings are where they should be but for `bound`, in distance from the surface; tells the largest deviation seen.
    fn check(&self, ray: &Ray, bound: f64) -> f64 {
        let found = self.cone(true).crossings(ray);
        let what = || format!("{self:?} {ray:?} {found:?}");
        let worst = match (self.crossings(ray), found) {
            (Err(_), None) => 0.0,
            (Err(_), Some(found)) => found.into_iter().map(|(t, _)| self.outside(ray, t).abs()).fold(0.0, f64::max),
            // A miss, unless all of it lies behind the origin: the line must be no deeper than the bound.
            (Ok([near, far]), None) if far > 0.0 => -self.outside(ray, near + (far - near) / 2.0),
            (Ok(_), None) => 0.0,
            (Ok(expected), Some(found)) => {
                let of = |(expected, (t, _)): (f64, (f64, u32))| self.outside(ray, t).abs().max(-self.outside(ray, (t + expected) / 2.0));
                expected.into_iter().zip(found).map(of).fold(0.0, f64::max)
            }
        };
        assert!(worst <= bound, "{worst:e} > {bound:e}: {}", what());
        worst / bound
    }
}

/// Long and short, thin and thick, with an apex, nearly with one, and nearly without a slope.
fn given(random: &mut Random) -> Given {
    let from = random.point();
    let to = from + random.direction() * pow(10.0, 3.0 * random.signed());
    let radius = pow(10.0, 3.0 * random.signed());
    let other = match random.bits() % 5 {
        0 => 0.0,
        1 => radius * 1e-9,
        2 => radius * (1.0 + 1e-9),
        3 => radius,
        _ => radius * random.unit(),
    };
    Given { from, to, radii: if random.bits().is_multiple_of(2) { [radius, other] } else { [other, radius] } }
}

/// A point of the body, of its axis, near a silhouette, or very near an end's middle, where an apex may be.
fn aim(given: &Given, random: &mut Random) -> DVec3 {
    let (at, across) = (random.unit(), random.direction());
    let on_axis = given.from.lerp(given.to, at);
    let radius = given.radii[0] * (1.0 - at) + given.radii[1] * at;
    match random.bits() % 4 {
        0 => on_axis + across * radius,
        1 => on_axis,
        2 => given.to + across * given.size() * pow(10.0, -16.0 * random.unit()),
        _ => on_axis + across * radius * random.unit(),
    }
}

/// From everywhere: errors are a few units in the last place of the largest length that matters, up to 10^12 times the size.
#[test]
fn crossings_of_cones_are_where_the_distance_changes_its_sign() {
    let mut random = Random(31);
    let mut worst = 0f64;
    for _ in 0..20_000 {
        let given = given(&mut random);
        let distance = given.size() * pow(10.0, 14.0 * random.unit() - 2.0);
        let target = aim(&given, &mut random);
        let direction = match random.bits() % 4 {
            // Nearly along the axis, or along the side.
            0 => ((given.to - given.from).normalize() + random.point() * pow(10.0, -17.0 * random.unit())).normalize(),
            1 => {
                let axis = (given.to - given.from).normalize();
                let out = axis.any_orthonormal_vector() * (given.radii[1] - given.radii[0]) / (given.to - given.from).length();
                ((axis + out).normalize() + random.point() * pow(10.0, -17.0 * random.unit())).normalize()
            }
            _ => random.direction(),
        };
        let ray = Ray::new(target - direction * distance, direction);
        let lengths = (ray.origin - given.from).length() + ray.origin.length() + given.size() + given.from.length();
        worst = worst.max(given.check(&ray, 16.0 * UNIT * lengths));
    }
    assert!(worst > 0.02, "the bound is no bound: {worst}");
}

/// Near an apex, the size of the cone does not count: errors are relative to the distance from the apex.
#[test]
fn an_apex_is_met_as_accurately_as_its_coordinates_allow() {
    let mut random = Random(32);
    for _ in 0..20_000 {
        let axis = random.direction();
        let given = Given { from: axis, to: DVec3::ZERO, radii: [pow(10.0, 2.0 * random.signed()), 0.0] };
        let near = pow(10.0, -12.0 * random.unit());
        let origin = random.direction() * near;
        let target = random.direction() * near * pow(10.0, -12.0 * random.unit());
        let ray = Ray::new(origin, (target - origin).normalize());
        // Only the crossings near the apex are that accurate.
        let Some([first, _]) = given.cone(true).crossings(&ray) else {
            let depth = given
                .crossings(&ray)
                .map_or(0.0, |[a, b]| if b > 0.0 && b < 4.0 * near { -given.outside(&ray, (a + b) / 2.0) } else { 0.0 });
            assert!(depth <= 32.0 * UNIT * near, "{depth:e} {given:?} {ray:?}");
            continue;
        };
        if first.0 > 0.0 && first.0 < 4.0 * near {
            let deviation = given.outside(&ray, first.0).abs();
            assert!(deviation <= 32.0 * UNIT * near, "{deviation:e} {given:?} {ray:?}");
        }
    }
}

/// Rays through an apex into the cone, steeper than its side, down to those along its axis: where they meet it, rounding alone decides between the side and the plane of that end.
#[test]
fn an_apex_has_no_hole() {
    let mut random = Random(34);
    for _ in 0..20_000 {
        let (apex, axis) = (random.point(), random.direction());
        let given = Given { from: apex + axis, to: apex, radii: [0.1 + random.unit(), 0.0] };
        let beside = 0.9 * pow(10.0, -20.0 * random.unit());
        let within = given.from + axis.cross(random.direction()).normalize() * given.radii[0] * beside;
        let direction = (within - apex).normalize();
        let ray = Ray::new(apex - direction * 4.0, direction);
        let hit = given.cone(false).closest(&ray);
        assert!(hit.is_some_and(|(t, _)| (t - 4.0).abs() < 1e-13), "{hit:?} {given:?} {ray:?}");
    }
}

/// By a power of two, so that nothing is rounded.
#[test]
fn cones_are_scaled_as_a_whole() {
    let mut random = Random(35);
    for _ in 0..1_000 {
        let Given { from, to, radii } = given(&mut random);
        let large = Cone::new([from * 4.0, to * 4.0], radii.map(|radius| radius * 4.0), true);
        assert_eq!(Some(Cone::new([from, to], radii, true).unwrap().moved(4.0, DVec3::ZERO)), large);
    }
}

/// Rays along the axis and through the apex, where most terms vanish.
#[test]
fn crossings_of_simple_cones_are_exact() {
    let cylinder = Given { from: DVec3::ZERO, to: DVec3::new(0.0, 2.0, 0.0), radii: [1.0; 2] };
    let cone = Given { radii: [1.0, 0.0], ..cylinder };
    let turned = Given { from: cone.to, to: cone.from, radii: [0.0, 1.0] };
    let ray = |origin: [f64; 3], direction: [f64; 3]| Ray::new(origin.into(), direction.into());
    let crossings = |given: &Given, ray: &Ray| given.cone(true).crossings(ray).map(|crossings| crossings.map(|(t, _)| t));
    assert_eq!(crossings(&cylinder, &ray([5.0, 1.0, 0.0], [-1.0, 0.0, 0.0])), Some([4.0, 6.0]));
    assert_eq!(crossings(&cylinder, &ray([0.5, 9.0, 0.0], [0.0, -1.0, 0.0])), Some([7.0, 9.0]));
    assert_eq!(crossings(&cylinder, &ray([1.5, 9.0, 0.0], [0.0, -1.0, 0.0])), None);
    assert_eq!(crossings(&cylinder, &ray([5.0, 2.5, 0.0], [-1.0, 0.0, 0.0])), None);
    assert_eq!(crossings(&cylinder, &ray([5.0, 1.0, 0.0], [1.0, 0.0, 0.0])), None);
    for cone in [cone, turned] {
        assert_eq!(crossings(&cone, &ray([0.0, 9.0, 0.0], [0.0, -1.0, 0.0])), Some([7.0, 9.0]));
        assert_eq!(crossings(&cone, &ray([0.25, 9.0, 0.0], [0.0, -1.0, 0.0])), Some([7.5, 9.0]));
        assert_eq!(crossings(&cone, &ray([5.0, 1.0, 0.0], [-1.0, 0.0, 0.0])), Some([4.5, 5.5]));
        // Through the apex alone; nothing of the mirror image beyond it.
        assert_eq!(crossings(&cone, &ray([5.0, 2.0, 0.0], [-1.0, 0.0, 0.0])), Some([5.0, 5.0]));
        assert_eq!(crossings(&cone, &ray([5.0, 3.0, 0.0], [-1.0, 0.0, 0.0])), None);
        assert_eq!(crossings(&cone, &ray([0.0, 3.0, 0.0], [0.0, 1.0, 0.0])), None);
        let down = ray([0.0, 9.0, 0.0], [0.0, -1.0, 0.0]);
        let (t, part) = cone.cone(false).closest(&down).unwrap();
        let point = cone.cone(false).point(&down, t, part, true);
        assert_eq!((t, point.position, point.normal), (7.0, cone.from.max(cone.to), DVec3::Y), "an open cone has its apex too");
    }
}

#[test]
fn open_ends_let_rays_through() {
    let tube = Given { from: DVec3::ZERO, to: DVec3::new(0.0, 2.0, 0.0), radii: [1.0; 2] };
    let through = Ray::new(DVec3::new(0.3, 9.0, 0.1), -DVec3::Y);
    assert_eq!(tube.cone(false).closest(&through), None);
    let slanted = Ray::new(DVec3::new(0.0, 3.0, 0.0), DVec3::new(0.6, -0.8, 0.0));
    let (t, _) = tube.cone(false).closest(&slanted).unwrap();
    assert!((t - 1.0 / 0.6).abs() < 1e-15, "the inner side, behind the open end");
    let (t, _) = tube.cone(true).closest(&slanted).unwrap();
    assert_eq!(t, 1.25, "the end");
}

/// However far away the ray comes from, and of whatever length its direction is.
#[test]
fn points_of_cones_lie_within_their_bound() {
    let mut random = Random(33);
    let mut worst = 0f64;
    for _ in 0..50_000 {
        let given = given(&mut random);
        let target = aim(&given, &mut random);
        let direction = random.direction() * exp2(f64::from(random.bits() % 80) - 40.0);
        let ray = Ray::new(target - direction.normalize() * given.size() * pow(10.0, 12.0 * random.unit()), direction);
        let cone = given.cone(random.bits().is_multiple_of(2));
        let Some((t, part)) = cone.closest(&ray) else { continue };
        let point = cone.point(&ray, t, part, false);
        let there = given.outside(&Ray::new(point.position, DVec3::ZERO), 0.0);
        assert!(there.abs() <= point.error / 2.0, "{there:e} {point:?} {given:?} {ray:?}");
        assert!((point.normal.length() - 1.0).abs() < 8.0 * UNIT);
        if cone.is_cylinder() && part == 0 {
            let along = point.normal.dot((given.to - given.from).normalize());
            assert!(along.abs() < 8.0 * UNIT, "{along:e} {given:?}");
        }
        worst = worst.max(there.abs() / point.error);
        // The normal points out, where the other side is not too near to tell.
        let ahead = given.outside(&Ray::new(point.position, point.normal), 1e-4 * given.size());
        assert!(ahead > 0.0 || given.radii[0].max(given.radii[1]) < 1e-12 * given.size(), "{point:?} {given:?}");
    }
    assert!(worst > 0.01, "{worst}");
}

/// Moved and scaled evenly it is compiled into the world; whatever else is done to it, it is the same surface.
#[test]
fn stretched_cylinders_are_elliptic() {
    let axes = DVec3::new(2.0, 0.5, -1.0);
    let unit = Shape::Cylinder { from: [0.0, -1.0, 0.0], to: [0.0, 1.0, 0.0], radius: 1.0, capped: false };
    let scene = Maker::default().add(unit, DAffine3::from_scale(axes)).compile();
    let mut hits = 0;
    for ray in rays_of(&scene, 10_000) {
        let Some(surface) = scene.closest(&ray) else { continue };
        let p = surface.point / axes;
        assert!((p.x * p.x + p.z * p.z - 1.0).abs() < 1e-14 && p.y.abs() <= 1.0);
        let gradient = DVec3::new(p.x / axes.x, 0.0, p.z / axes.z).normalize();
        assert!((surface.ng - gradient).length() < 1e-14, "{surface:?}");
        hits += 1;
    }
    assert!(hits > 500, "{hits}");
}

#[test]
fn textures_wrap_around_cones_and_cylinders() {
    let tall = Given { from: DVec3::ZERO, to: DVec3::new(0.0, 2.0, 0.0), radii: [1.0, 1.0] };
    let flipped = Given { from: tall.to, to: tall.from, radii: [1.0, 1.0] };
    let pointed = Given { radii: [1.0, 0.0], ..tall };
    let lying = Given { from: DVec3::ZERO, to: DVec3::new(0.0, 0.0, 2.0), ..tall };
    let uv = |given: &Given, origin: [f64; 3], direction: [f64; 3]| {
        let ray = Ray::new(origin.into(), direction.into());
        let (t, part) = given.cone(true).closest(&ray).unwrap();
        given.cone(true).point(&ray, t, part, true).uv.to_array()
    };
    assert_eq!(uv(&tall, [0.0, 0.5, 5.0], [0.0, 0.0, -1.0]), [0.5, 0.75]);
    assert_eq!(uv(&tall, [5.0, 1.5, 0.0], [-1.0, 0.0, 0.0]), [0.75, 0.25]);
    assert_eq!(uv(&flipped, [5.0, 1.5, 0.0], [-1.0, 0.0, 0.0]), [0.25, 0.75], "upside down");
    assert_eq!(uv(&pointed, [0.0, 0.5, 5.0], [0.0, 0.0, -1.0]), [0.5, 0.75]);
    assert_eq!(uv(&lying, [0.0, 5.0, 1.5], [0.0, -1.0, 0.0]), [0.5, 0.25]);
    // The ends are textured as discs are: u along x, v along z.
    assert_eq!(uv(&tall, [0.5, 5.0, 0.25], [0.0, -1.0, 0.0]), [0.75, 0.625]);
}

#[test]
fn statistics_tell_cones_from_cylinders() {
    let mut random = Random(5);
    let mut maker = Maker::default();
    for map in [DAffine3::IDENTITY, placement(&mut random)] {
        maker.add(Shape::Cylinder { from: [0.0; 3], to: [0.0, 1.0, 0.0], radius: 1.0, capped: true }, map);
        maker.add(Shape::Cone { from: [0.0; 3], to: [0.0, 1.0, 0.0], radius: 1.0, to_radius: 0.5, capped: false }, map);
    }
    maker.add(Shape::Rectangle { corner: [0.0; 3], edge_u: [0.0, 1.0, 0.0], edge_v: [1.0, 0.0, 0.0] }, DAffine3::IDENTITY);
    let statistics = maker.compile().statistics;
    assert_eq!((statistics.cylinders, statistics.cones, statistics.rectangles), (2, 2, 1));
}
