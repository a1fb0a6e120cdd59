//! Trees against every object in turn, and equal hits.

use glam::{DAffine3, DVec3};
use tessera_engine::{
    description::{MeshData, ObjectKind, Shape},
    scene::Scene,
    shape::{Cone, Cuboid, Disc, Plane, Ray, Rectangle, Sphere, triangle::Sheared},
};

use super::{
    scenes::{World, ask, ball, corners, placement, towards},
    trial::{Random, Tally, run},
};

/// A shape in its own coordinates.
enum Local {
    Sphere(Sphere),
    Plane(Plane),
    Cuboid(Cuboid),
    Disc(Disc),
    Rectangle(Rectangle),
    Cone(Cone),
    Mesh(MeshData),
}

/// An object without a tree.
struct Lone {
    shape: Local,
    /// World to object.
    map: Option<DAffine3>,
}

/// Number of an object, its part, and the bits of t.
type Met = (u32, u32, u64);

impl Lone {
    fn new(shape: &Shape, mesh: &MeshData, map: DAffine3) -> Self {
        let cone = |from: [f64; 3], to: [f64; 3], radii, capped| {
            Local::Cone(Cone::new([from.into(), to.into()], radii, capped).expect("ends that differ"))
        };
        let shape = match *shape {
            Shape::Sphere { center, radius } => Local::Sphere(Sphere { center: center.into(), radius }),
            Shape::Plane { point, normal } => Local::Plane(Plane::new(point.into(), unit(normal))),
            Shape::Box { min, max } => Local::Cuboid(Cuboid { min: min.into(), max: max.into() }),
            Shape::Disc { center, normal, radius } => Local::Disc(Disc { center: center.into(), normal: unit(normal), radius }),
            Shape::Mesh { .. } => Local::Mesh(mesh.clone()),
            Shape::Rectangle { corner, edge_u, edge_v } => {
                Local::Rectangle(Rectangle::new(corner.into(), edge_u.into(), edge_v.into()).expect("edges that are not parallel"))
            }
            Shape::Cylinder { from, to, radius, capped } => cone(from, to, [radius; 2], capped),
            Shape::Cone { from, to, radius, to_radius, capped } => cone(from, to, [radius, to_radius], capped),
        };
        Self { shape, map: (map != DAffine3::IDENTITY).then(|| map.inverse()) }
    }

    fn closest(&self, ray: &Ray) -> Option<(f64, u32)> {
        let whole = |t| (t, 0);
        let local = self.map.map_or(*ray, |map| ray.transformed(&map));
        match &self.shape {
            Local::Sphere(sphere) if self.map.is_none() => sphere.closest::<true>(&local).map(whole),
            Local::Sphere(sphere) => sphere.closest::<false>(&local).map(whole),
            Local::Plane(plane) => plane.closest(ray).map(whole),
            Local::Cuboid(cuboid) => cuboid.closest(&local),
            Local::Disc(disc) => disc.closest(&local).map(whole),
            Local::Rectangle(rectangle) => rectangle.closest(&local).map(whole),
            Local::Cone(cone) => cone.closest(&local),
            Local::Mesh(mesh) => nearest_triangle(mesh, &local),
        }
    }
}

/// As a scene makes it one.
fn unit(normal: [f64; 3]) -> DVec3 {
    let normal = DVec3::from(normal);
    (normal / normal.abs().max_element()).normalize()
}

fn nearest_triangle(mesh: &MeshData, ray: &Ray) -> Option<(f64, u32)> {
    let sheared = Sheared::new(ray.origin, ray.direction);
    let of = |triangle: usize| Some((sheared.hit(sheared.turned(corners(mesh, triangle)))?.t, triangle as u32));
    (0..mesh.triangles.len()).filter_map(of).min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)))
}

fn nearest(lone: &[Lone], ray: &Ray) -> Option<Met> {
    let of = |(object, lone): (usize, &Lone)| lone.closest(ray).map(|(t, part)| (t, object as u32, part));
    let least = lone.iter().enumerate().filter_map(of).min_by(|a, b| a.0.total_cmp(&b.0).then((a.1, a.2).cmp(&(b.1, b.2))));
    least.map(|(t, object, part)| (object, part, t.to_bits()))
}

/// One of every shape, plain and transformed, many times over; coordinates on a grid for half of the boxes and meshes.
fn crowd(random: &mut Random) -> (World, Vec<Lone>) {
    let mesh = ball(8, 12, 0.1);
    let (mut world, mut lone) = (World::default(), Vec::new());
    for i in 0..36 {
        let (center, radius) = (random.point() * 3.0, 0.1 + random.unit() * 0.6);
        let (to, normal) = ((center + random.direction() * (0.1 + random.unit())).to_array(), random.direction().to_array());
        let (from, grid) = (center.to_array(), center.round().to_array());
        // A plane with a map is a plane of its own, not the plane in coordinates of its own.
        let map = if i % 4 == 0 || i % 9 == 0 { DAffine3::IDENTITY } else { placement(random) };
        let shape = match i % 9 {
            0 if i == 0 => Shape::Plane { point: [0.0, -3.0, 0.0], normal },
            1 => Shape::Box { min: grid, max: grid.map(|x| x + 1.0) },
            2 => Shape::Disc { center: from, normal, radius },
            3 => Shape::Rectangle { corner: from, edge_u: normal, edge_v: random.direction().to_array() },
            4 => Shape::Cylinder { from, to, radius, capped: random.below(2) == 0 },
            5 => Shape::Cone { from, to, radius, to_radius: 0.0, capped: random.below(2) == 0 },
            6 => Shape::Cone { from, to, radius, to_radius: random.unit(), capped: random.below(2) == 0 },
            7 => Shape::Mesh { data: tessera_engine::description::AssetId([0; 32]) },
            _ => Shape::Sphere { center: from, radius },
        };
        lone.push(Lone::new(&shape, &mesh, map));
        world = if matches!(shape, Shape::Mesh { .. }) { world.with_mesh(&mesh, map) } else { world.with(shape, map) };
    }
    (world, lone)
}

/// Anywhere; from far away; with zeros of both signs; in the planes of boxes.
fn any_ray(random: &mut Random) -> Ray {
    let target = random.point() * 4.0;
    match random.below(4) {
        0 => Ray::new(random.point() * 4.0, random.direction()),
        1 => towards(target + random.direction() * random.power(0.0, 8.0), target),
        _ => {
            let zero = if random.below(2) == 0 { 0.0 } else { -0.0 };
            let (mut direction, axis) = (DVec3::splat(zero), random.below(3));
            direction[axis] = if random.below(2) == 0 { 1.0 } else { -1.0 };
            direction[(axis + 1) % 3] = if random.below(2) == 0 { random.signed() } else { zero };
            let origin = if random.below(2) == 0 { (target * 2.0).round() * 0.5 } else { target };
            Ray::new(origin, direction.normalize())
        }
    }
}

/// The nearest hits of crowds: the same object, the same part, the same bits of t.
pub fn brute_force(rays: u64) -> Tally {
    let mut random = Random::new(4);
    let crowds: Vec<(Scene, Vec<Lone>)> = (0..8).map(|_| crowd(&mut random)).map(|(world, lone)| (world.compile(), lone)).collect();
    run(rays, |random, count, tally| {
        let number = random.below(crowds.len());
        let (scene, lone) = &crowds[number];
        let rays: Vec<Ray> = (0..count).map(|_| any_ray(random)).collect();
        for (ray, answer) in rays.iter().zip(ask(scene, &rays)) {
            let expected = nearest(lone, ray);
            let found = answer.hits[0].map(|hit| (hit.object, hit.part, hit.t.to_bits()));
            let same = found == expected && answer.agrees();
            tally.check(same, || format!("crowd {number}, expected {expected:x?}: {}", answer.told(ray)));
        }
    })
}

/// Sheets of triangles in one plane and once more, coincident shapes, boxes that share a face, spheres.
fn doubles() -> World {
    let mut world = World::default();
    let mut sheet = MeshData::default();
    for i in 0..100_u32 {
        let [x, y] = [i % 10, i / 10].map(|at| at as f32 * 0.2 - 1.0);
        sheet.positions.extend([[x, y, 0.5], [x + 0.2, y, 0.5], [x + 0.2, y + 0.2, 0.5], [x, y + 0.2, 0.5]]);
        sheet.triangles.extend([[4 * i, 4 * i + 1, 4 * i + 2], [4 * i, 4 * i + 2, 4 * i + 3]]);
    }
    sheet.triangles.extend_from_within(..);
    let map = placement(&mut Random::new(5));
    for _ in 0..3 {
        world = world.with_mesh(&sheet, DAffine3::IDENTITY).with_mesh(&sheet, map);
        world = world.with(Shape::Box { min: [-1.0; 3], max: [0.0; 3] }, DAffine3::IDENTITY);
        world = world.with(Shape::Box { min: [-1.0, -1.0, 0.0], max: [0.0, 0.0, 1.0] }, DAffine3::IDENTITY);
        world = world.with(Shape::Disc { center: [0.0, 0.0, 1.5], normal: [0.0, 0.0, 1.0], radius: 1.0 }, DAffine3::IDENTITY);
        world = world
            .with(Shape::Rectangle { corner: [-1.0, -1.0, 1.5], edge_u: [2.0, 0.0, 0.0], edge_v: [0.0, 2.0, 0.0] }, DAffine3::IDENTITY);
        world = world.with(Shape::Sphere { center: [0.0, 0.0, -2.0], radius: 0.5 }, map);
    }
    world
}

/// Of equal hits the lowest object wins, and of its parts the lowest; trees of the same scene are the same.
pub fn coincident(rays: u64) -> Tally {
    let world = doubles();
    let scenes = [world.compile(), world.compile()];
    let first: Vec<(Scene, u32)> = (0..world.objects.len())
        .map(|object| {
            let lone = World { objects: vec![world.objects[object].clone()], assets: world.assets.clone() };
            let is_mesh = matches!(world.objects[object].kind, ObjectKind::Shape { shape: Shape::Mesh { .. }, .. });
            (lone.compile(), if is_mesh { 200 } else { u32::MAX })
        })
        .collect();
    let mut total = run(rays, |random, count, tally| {
        let rays: Vec<Ray> = (0..count).map(|_| towards(random.direction() * 6.0, random.point() * 2.0)).collect();
        let alone: Vec<_> = first.iter().map(|(scene, _)| ask(scene, &rays)).collect();
        for (i, (ray, answer)) in rays.iter().zip(ask(&scenes[0], &rays)).enumerate() {
            let hits = alone.iter().enumerate().filter_map(|(object, answers)| Some((answers[i].hits[0]?, object)));
            let winner = hits.min_by(|(a, i), (b, j)| a.t.total_cmp(&b.t).then(i.cmp(j)));
            let same = match (answer.hits[0], winner) {
                (Some(found), Some((hit, object))) => {
                    (found.t.to_bits(), found.object, found.part) == (hit.t.to_bits(), object as u32, hit.part)
                        && hit.part < first[object].1
                }
                (found, winner) => found.is_none() && winner.is_none(),
            };
            tally.check(same && answer.agrees(), || format!("expected {winner:?}: {}", answer.told(ray)));
        }
    });
    total.check(scenes[0].tree_hash() == scenes[1].tree_hash(), || "two trees of one scene".into());
    total
}
