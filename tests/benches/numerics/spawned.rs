//! Rays that leave surfaces.

use glam::{DAffine3, DMat3, DVec3};
use tessera_engine::{
    description::{MeshData, Shape},
    scene::Scene,
    shape::Ray,
};

use super::{
    scenes::{World, placement, towards},
    trial::{Random, Tally, bits, run},
};

/// Shapes near 0 that a ray leaves for good on the one side, and crosses so many times more on the other.
fn convex() -> Vec<(Shape, u32)> {
    let (from, to) = ([-0.2, -0.5, 0.1], [0.4, 0.6, 0.7]);
    let cone = |radius, to_radius| (Shape::Cone { from, to, radius, to_radius, capped: true }, 1);
    let (center, normal) = ([0.3, -0.2, 0.5], [0.3, 0.5, -0.4]);
    vec![
        (Shape::Sphere { center, radius: 0.7 }, 1),
        (Shape::Box { min: [-0.5, -0.3, 0.1], max: [0.4, 0.6, 0.9] }, 1),
        (Shape::Disc { center, normal, radius: 0.7 }, 0),
        (Shape::Plane { point: center, normal }, 0),
        (Shape::Rectangle { corner: [-0.3, -0.5, 0.1], edge_u: [0.7, 0.5, 0.3], edge_v: [-0.4, 0.6, 0.2] }, 0),
        (Shape::Cylinder { from, to, radius: 0.4, capped: true }, 1),
        cone(0.6, 0.0),
        cone(0.2, 0.5),
    ]
}

/// A strictly convex mesh whose faces are no two in one plane.
fn octahedron() -> MeshData {
    let positions = vec![[1.0, 0.1, 0.0], [-1.1, 0.0, 0.0], [0.0, 1.2, 0.1], [0.1, -0.9, 0.0], [0.0, 0.0, 1.0], [0.1, 0.0, -1.3]];
    let faces = [[0, 2, 4], [2, 1, 4], [3, 0, 4], [1, 3, 4], [2, 0, 5], [1, 2, 5], [0, 3, 5], [3, 1, 5]];
    MeshData { positions, triangles: faces.to_vec(), ..Default::default() }
}

/// From 10^-8 to 10^8 in size, up to 10^6 sizes away, turned and sheared or not.
fn anywhere(random: &mut Random) -> (DAffine3, f64) {
    let scale = random.power(-8.0, 8.0);
    let distance = if random.below(4) == 0 { 0.0 } else { random.power(0.0, 6.0) };
    let linear = if random.below(2) == 0 { DMat3::IDENTITY } else { placement(random).matrix3 };
    (DAffine3::from_mat3_translation(linear * scale, random.point() * scale * distance), scale)
}

fn crossings(scene: &Scene, ray: &Ray) -> u32 {
    let mut seen = 0;
    scene.any(ray, |_, _| {
        seen += 1;
        false
    });
    seen
}

/// Leaves the surface anywhere, or nearly along it.
fn leaving(normal: DVec3, random: &mut Random) -> DVec3 {
    let direction = random.direction();
    if random.below(4) > 0 {
        return direction;
    }
    (direction - normal * direction.dot(normal) * (1.0 - random.power(-12.0, 0.0))).normalize()
}

/// Rays that leave a shape cross it as often as geometry says: neither themselves again, nor nothing where there is another side.
pub fn again(rays: u64) -> Tally {
    let (shapes, octahedron) = (convex(), octahedron());
    run(rays, |random, count, tally| {
        let (map, scale) = anywhere(random);
        let pick = random.below(shapes.len() + 1);
        let (name, scene, behind) = match shapes.get(pick) {
            Some((shape, behind)) => (format!("{shape:?}"), World::of(shape.clone(), map).compile(), *behind),
            None => ("octahedron".into(), World::of_mesh(&octahedron, map).compile(), 1),
        };
        let middle = map.transform_point3(DVec3::new(0.1, 0.0, 0.4));
        for _ in 0..count {
            let ray = towards(middle + random.direction() * scale * 4.0, middle + random.point() * scale * 0.7);
            let Some(surface) = scene.closest(&ray) else { continue };
            let direction = leaving(surface.ng, random);
            // Without the note of what it leaves: it is the geometry that is tested.
            let spawned = Ray { leaves: 0, ..surface.spawn(direction) };
            let outward = direction.dot(surface.ng) >= 0.0;
            let seen = crossings(&scene, &spawned);
            // One that goes in nearly along the surface may come out across an edge that two faces share.
            let right = if outward || behind == 0 { seen == 0 } else { (1..=2).contains(&seen) };
            tally.check(right, || format!("{name} at {map:?}: {seen} crossings by {} after {}", bits(&spawned), bits(&ray)));
        }
    })
}

/// The same shape once more, inside or behind, so far away from the first.
fn within(shape: &Shape, gap: f64) -> Shape {
    let mut inner = shape.clone();
    match &mut inner {
        Shape::Sphere { radius, .. } => *radius -= gap,
        Shape::Box { min, max } => {
            min.iter_mut().for_each(|x| *x += gap);
            max.iter_mut().for_each(|x| *x -= gap);
        }
        Shape::Disc { center: point, normal, .. } | Shape::Plane { point, normal } => {
            *point = (DVec3::from(*point) - DVec3::from(*normal).normalize() * gap).to_array();
        }
        Shape::Rectangle { corner, edge_u, edge_v } => {
            let normal = DVec3::from(*edge_u).cross(DVec3::from(*edge_v)).normalize();
            *corner = (DVec3::from(*corner) - normal * gap).to_array();
        }
        Shape::Cylinder { from, to, radius, .. } => {
            shorten([from, to], gap);
            *radius -= gap;
        }
        Shape::Cone { from, to, radius, to_radius, .. } => {
            shorten([from, to], gap);
            // Measured across the axis, the sides are farther apart than across themselves.
            *radius -= 1.5 * gap;
            *to_radius -= 1.5 * gap;
        }
        Shape::Mesh { .. } => {}
    }
    inner
}

/// Moves two points towards each other, each by so much.
fn shorten([from, to]: [&mut [f64; 3]; 2], gap: f64) {
    let (a, b) = (DVec3::from(*from), DVec3::from(*to));
    let by = (b - a).normalize() * gap;
    (*from, *to) = ((a + by).to_array(), (b - by).to_array());
}

/// A surface some six bounds of its error behind another one is found by what leaves that one.
pub fn neighbours(rays: u64) -> Tally {
    let shapes: Vec<Shape> =
        convex().into_iter().map(|(shape, _)| shape).filter(|shape| !matches!(shape, Shape::Cone { to_radius: 0.0, .. })).collect();
    run(rays, |random, count, tally| {
        let by = random.point() * random.power(0.0, 6.0);
        let shape = &shapes[random.below(shapes.len())];
        let map = DAffine3::from_translation(by);
        let outer = World::of(shape.clone(), map);
        let lone = outer.compile();
        let middle = map.transform_point3(DVec3::new(0.1, 0.0, 0.4));
        let aim = |random: &mut Random| towards(middle + random.direction() * 4.0, middle + random.point() * 0.3);
        let Some(error) = (0..50).find_map(|_| lone.closest(&aim(random)).map(|surface| surface.error)) else { return };
        let scene = outer.with(within(shape, 6.0 * error), map).compile();
        for _ in 0..count {
            let ray = aim(random);
            let Some(first) = scene.closest(&ray) else { continue };
            // At rims and from behind there is no neighbour to be met.
            if first.material != 0 || first.ng.dot(ray.direction) > -0.5 {
                continue;
            }
            let spawned = first.spawn(-first.ng);
            // Nor where the shape is thinner than the gaps between both.
            if lone.closest(&spawned).is_some_and(|behind| behind.t < 100.0 * error) {
                continue;
            }
            let next = scene.closest(&spawned);
            let met = next.is_some_and(|next| next.material == 1 && next.t <= 16.0 * error);
            tally.check(met, || format!("{shape:?} at {by}: {next:?} by {} after {}", bits(&spawned), bits(&ray)));
        }
    })
}

/// Spheres whose radii differ by 4e-5: the inner one is found behind the outer one, and that one again on the way back.
pub fn shells(rays: u64) -> Tally {
    run(rays, |random, count, tally| {
        let radius = random.power(-8.0, 8.0);
        let center = random.direction() * radius * 4.0;
        let shell = |radius| Shape::Sphere { center: center.to_array(), radius };
        let map = if random.below(2) == 0 { DAffine3::IDENTITY } else { DAffine3::from_mat3(placement(random).matrix3) };
        let scene = World::of(shell(radius), map).with(shell(radius * (1.0 + 4e-5)), map).compile();
        for _ in 0..count {
            let origin = map.transform_point3(center + random.direction() * radius * 5.0);
            let ray = towards(origin, map.transform_point3(center + random.direction() * radius * 0.99 * random.unit()));
            let outer = scene.closest(&ray);
            let inner = outer.and_then(|outer| scene.closest(&outer.spawn(ray.direction)));
            let back = inner.and_then(|inner| scene.closest(&inner.spawn(-ray.direction)));
            let seen = [outer, inner, back].map(|surface| surface.map(|surface| surface.material));
            tally.check(seen == [Some(1), Some(0), Some(1)], || {
                format!("radius {radius:e} about {center} at {map:?}: {seen:?} by {}", bits(&ray))
            });
        }
    })
}
