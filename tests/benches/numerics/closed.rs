//! Closed surfaces: nothing leaves them unseen.

use std::f64::consts::TAU;

use glam::{DAffine3, DVec3};
use tessera_engine::{
    description::{MeshData, Shape},
    scene::Scene,
    shape::Ray,
};

use super::{
    scenes::{World, ask, ball, corners, crossings, matrix, moved, placement, towards},
    trial::{Random, Tally, bits, run},
};

/// A closed mesh about a middle, from which all of it is in sight.
struct Closed {
    mesh: MeshData,
    map: DAffine3,
    middle: DVec3,
    size: f64,
    scene: Scene,
}

impl Closed {
    fn new(mesh: MeshData, map: DAffine3, middle: DVec3, size: f64) -> Self {
        let scene = World::of_mesh(&mesh, map).compile();
        Self { mesh, map, middle, size, scene }
    }

    fn told(&self) -> String {
        format!("ball of {} triangles at {:?}", self.mesh.triangles.len(), matrix(self.map))
    }

    /// A point of an edge, or a vertex.
    fn target(&self, vertex: bool, random: &mut Random) -> DVec3 {
        let corners = corners(&self.mesh, random.below(self.mesh.triangles.len()));
        let corner = random.below(3);
        let along = if vertex { 0.0 } else { random.unit() };
        self.map.transform_point3(corners[corner].lerp(corners[(corner + 1) % 3], along))
    }

    /// A point near the middle, or beyond all.
    fn origin(&self, outside: bool, random: &mut Random) -> DVec3 {
        let from = if outside { random.direction() * 4.0 } else { random.point() * 0.3 };
        self.map.transform_point3(self.middle + from * self.size)
    }

    fn rays(&self, vertex: bool, outside: bool, count: u64, random: &mut Random) -> Vec<Ray> {
        (0..count).map(|_| towards(self.origin(outside, random), self.target(vertex, random))).collect()
    }

    fn leaks(&self, vertex: bool, count: u64, random: &mut Random, tally: &mut Tally) {
        let rays = self.rays(vertex, false, count, random);
        for (ray, answer) in rays.iter().zip(ask(&self.scene, &rays)) {
            tally.check(answer.is_met(), || format!("{}: {}", self.told(), answer.told(ray)));
        }
    }
}

/// Round, bumpy, of long thin triangles, and transformed.
fn meshes() -> Vec<Closed> {
    let plain = |mesh| Closed::new(mesh, DAffine3::IDENTITY, DVec3::ZERO, 1.0);
    let turned = Closed::new(ball(40, 60, 0.2), placement(&mut Random::new(1)), DVec3::ZERO, 1.0);
    let needles = Closed::new(ball(3, 400, 0.0), DAffine3::IDENTITY, DVec3::ZERO, 0.3);
    vec![plain(ball(60, 80, 0.2)), plain(ball(300, 400, 0.1)), needles, turned]
}

fn leaks(meshes: &[Closed], vertex: bool, rays: u64) -> Tally {
    run(rays, |random, count, tally| meshes[random.below(meshes.len())].leaks(vertex, count, random, tally))
}

/// From inside, at any point of any edge.
pub fn edges(rays: u64) -> Tally {
    leaks(&meshes(), false, rays)
}

/// From inside, at any vertex.
pub fn vertices(rays: u64) -> Tally {
    leaks(&meshes(), true, rays)
}

fn leaks_at(scale: f64, by: DVec3, rays: u64) -> Tally {
    let mesh = Closed::new(moved(&ball(60, 80, 0.2), scale, by), DAffine3::IDENTITY, by, scale);
    run(rays, |random, count, tally| mesh.leaks(random.below(2) == 0, count, random, tally))
}

/// Where f32 positions are coarse.
pub fn offset(rays: u64) -> Tally {
    leaks_at(1.0, DVec3::new(148_376.0, 1_234.0, -223_423.0), rays)
}

/// Smaller than any f32 tolerance.
pub fn tiny(rays: u64) -> Tally {
    leaks_at(2f64.powi(-60), DVec3::ZERO, rays)
}

/// Larger than any.
pub fn huge(rays: u64) -> Tally {
    leaks_at(2f64.powi(60), DVec3::ZERO, rays)
}

/// Chooses a point to aim at.
type Aim = fn(&mut Random) -> DVec3;

/// Closed shapes about 0 that are no meshes, with points where their parts meet.
fn solids() -> Vec<(Shape, Aim)> {
    let (from, to) = ([0.0, -1.0, 0.0], [0.0, 1.0, 0.0]);
    let cone = |radius, to_radius| Shape::Cone { from, to, radius, to_radius, capped: true };
    vec![
        (Shape::Sphere { center: [0.0; 3], radius: 1.0 }, |random| random.direction()),
        (Shape::Box { min: [-1.0; 3], max: [1.0; 3] }, |random| {
            let mut edge = DVec3::from_array([(); 3].map(|()| if random.below(2) == 0 { 1.0 } else { -1.0 }));
            if random.below(2) == 0 {
                edge[random.below(3)] *= random.unit();
            }
            edge
        }),
        (Shape::Cylinder { from, to, radius: 1.0, capped: true }, |random| rim(if random.below(2) == 0 { 1.0 } else { -1.0 }, 1.0, random)),
        (cone(1.0, 0.6), |random| if random.below(2) == 0 { rim(1.0, 0.6, random) } else { rim(-1.0, 1.0, random) }),
        (cone(1.0, 0.0), |random| if random.below(2) == 0 { DVec3::Y } else { rim(-1.0, 1.0, random) }),
    ]
}

/// A point of a circle about y.
fn rim(height: f64, radius: f64, random: &mut Random) -> DVec3 {
    let (sin, cos) = (TAU * random.unit()).sin_cos();
    DVec3::new(cos * radius, height, sin * radius)
}

/// The same for shapes that are no meshes, plain and transformed.
pub fn rims(rays: u64) -> Tally {
    let mut random = Random::new(2);
    let maps = [DAffine3::IDENTITY, DAffine3::from_translation(DVec3::new(3.1, -2.7, 1.3)), placement(&mut random), placement(&mut random)];
    let scenes: Vec<_> = solids()
        .into_iter()
        .flat_map(|(shape, target)| maps.map(|map| (World::of(shape.clone(), map).compile(), shape.clone(), map, target)))
        .collect();
    run(rays, |random, count, tally| {
        let (scene, shape, map, target) = &scenes[random.below(scenes.len())];
        let inside = |random: &mut Random| map.transform_point3(random.point() * 0.2 - DVec3::Y * 0.3);
        let rays: Vec<Ray> = (0..count).map(|_| towards(inside(random), map.transform_point3(target(random)))).collect();
        for (ray, answer) in rays.iter().zip(ask(scene, &rays)) {
            tally.check(answer.is_met(), || format!("{shape:?} at {map:?}: {}", answer.told(ray)));
        }
    })
}

/// From outside, whether all crossings of a ray are even in number.
fn parity(vertex: bool, rays: u64) -> Tally {
    let meshes = meshes();
    run(rays, |random, count, tally| {
        let closed = &meshes[random.below(meshes.len())];
        let rays = closed.rays(vertex, true, count, random);
        for (ray, counts) in rays.iter().zip(crossings(&closed.scene, &rays)) {
            let even = counts[0] == counts[1] && counts[0].is_multiple_of(2);
            tally.check(even, || format!("{}: {counts:?} crossings of {}", closed.told(), bits(ray)));
        }
    })
}

/// At any point of any edge.
pub fn parity_of_edges(rays: u64) -> Tally {
    parity(false, rays)
}

/// At any vertex.
pub fn parity_of_vertices(rays: u64) -> Tally {
    parity(true, rays)
}

/// From surface to surface until nothing follows. Not at edges: where these are seen from the side, there is nothing between going in and out.
pub fn walks(rays: u64) -> Tally {
    let meshes = meshes();
    run(rays, |random, count, tally| {
        let closed = &meshes[random.below(meshes.len())];
        for _ in 0..count {
            let within = closed.map.transform_point3(closed.middle + random.point() * closed.size * 0.5);
            let first = towards(closed.origin(true, random), within);
            let (mut ray, mut within, mut sound) = (first, false, true);
            while let Some(surface) = closed.scene.closest(&ray) {
                sound &= (surface.ng.dot(ray.direction) > 0.0) == within;
                within = !within;
                ray = surface.spawn(ray.direction);
            }
            tally.check(sound && !within, || format!("{}: {}", closed.told(), bits(&first)));
        }
    })
}
