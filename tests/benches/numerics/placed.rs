//! Objects and cameras at their places: far away, mirrored, nested, impossible.

use std::sync::Mutex;

use glam::{DAffine3, DMat3, DVec3};
use tessera_engine::{
    description::{Camera, Group, Matrix, MemoryAssets, Object, ObjectKind, Shape, SourceId},
    scene::{Scene, Surface},
    shape::Ray,
};

use super::{
    double::{Double, Vector},
    scenes::{World, ask, ball, frame, matrix, towards},
    trial::{CHUNK, Random, Tally, bits, run},
};

/// Pixels of a side of the picture from far away, and samples of each.
const SIDE: usize = 64;
const SAMPLES: u64 = CHUNK / 8;

/// A camera 10^6 sizes away against parallel rays: pixels of a mean of samples, as a picture has them.
pub fn far_camera(rays: u64) -> Tally {
    let mut mesh = ball(48, 64, 0.1);
    mesh.normals = mesh.positions.clone();
    let world = World::of_mesh(&mesh, DAffine3::from_translation(DVec3::new(-0.4, 0.0, 0.0)));
    let world = world.with(Shape::Sphere { center: [0.5, 0.1, 0.3], radius: 0.4 }, DAffine3::IDENTITY);
    let backward = DVec3::new(0.55, 0.38, 0.75).normalize();
    let (far, half) = (2e6_f64, 1.25);
    let mut frame = frame(world.objects.clone());
    let horizontal_fov = 2.0 * (half / far).atan().to_degrees();
    frame.camera = Camera::pinhole((backward * far).into(), [0.0; 3], [0.0, 1.0, 0.0], horizontal_fov);
    (frame.film.width, frame.film.height) = (SIDE as u32, SIDE as u32);
    let scene = Scene::compile(&frame, &world.assets).expect("a scene that can be compiled");
    let right = (-backward).cross(DVec3::Y).normalize();
    let up = right.cross(-backward);
    let shade = |ray: &Ray| scene.closest(ray).map_or(0.1, |surface| surface.ns.dot(backward).abs());
    let sums = Mutex::new([0.0; 2]);
    let mut total = run(rays, |random, count, tally| {
        for _ in 0..count / SAMPLES {
            let (i, j) = (random.below(SIDE) as f64, random.below(SIDE) as f64);
            let [mut perspective, mut parallel] = [0.0; 2];
            for _ in 0..SAMPLES {
                let (x, y) = (i + random.unit(), j + random.unit());
                let [a, b] = [x, y].map(|x| (2.0 * x / SIDE as f64 - 1.0) * half);
                perspective += shade(&scene.camera.ray(x, y, glam::DVec2::ZERO));
                parallel += shade(&Ray::new(backward * 20.0 + right * a - up * b - scene.begin(), -backward));
                tally.rays += 1;
            }
            let Ok(mut sums) = sums.lock() else { return };
            *sums = [sums[0] + (perspective - parallel) * (perspective - parallel), sums[1] + parallel * parallel];
        }
    });
    let [off, all] = sums.into_inner().unwrap_or_default();
    let error = f64::sqrt(off / all);
    total.check(error < 1e-3, || format!("relative RMSE {error:e}"));
    total
}

/// A mesh mirrored in one coordinate or in all, by its vertices or by its place.
pub fn mirrored(rays: u64) -> Tally {
    let mesh = ball(20, 24, 0.2);
    let pairs = [DVec3::new(-1.0, 1.0, 1.0), DVec3::NEG_ONE].map(|scale| {
        let mut mirrored = mesh.clone();
        mirrored.positions.iter_mut().for_each(|p| *p = (DVec3::from(p.map(f64::from)) * scale).as_vec3().to_array());
        mirrored.triangles.iter_mut().for_each(|t| t.swap(1, 2));
        [World::of_mesh(&mesh, DAffine3::from_scale(scale)), World::of_mesh(&mirrored, DAffine3::IDENTITY)].map(|world| world.compile())
    });
    let bits_of = |surface: &Surface| (surface.t.to_bits(), surface.ng.to_array().map(f64::to_bits));
    run(rays, |random, count, tally| {
        let [placed, made] = &pairs[random.below(2)];
        let rays: Vec<Ray> = (0..count).map(|_| towards(random.direction() * random.power(0.5, 3.0), random.point())).collect();
        for ((ray, a), b) in rays.iter().zip(ask(placed, &rays)).zip(ask(made, &rays)) {
            let same = match (placed.closest(ray), made.closest(ray)) {
                (Some(a), Some(b)) => bits_of(&a) == bits_of(&b) && (a.point - b.point).length() <= a.error,
                (a, b) => a.is_none() && b.is_none(),
            };
            let part = a.hits[0].map(|hit| hit.part) == b.hits[0].map(|hit| hit.part);
            tally.check(same && part && a.agrees() && b.agrees(), || format!("{a:?} by its place: {}", b.told(ray)));
        }
    })
}

/// Maps that flatten or are no numbers.
fn impossible() -> Vec<Matrix> {
    let identity = matrix(DAffine3::IDENTITY);
    let changed = |row: usize, column: usize, value: f64| {
        let mut rows = identity;
        rows[row][column] = value;
        rows
    };
    let mut maps = vec![[[0.0; 4]; 3], [[1.0, 2.0, 3.0, 0.0], [2.0, 4.0, 6.0, 0.0], [0.0, 0.0, 1.0, 0.0]]];
    for row in 0..3 {
        maps.push(changed(row, row, 0.0));
        for value in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            maps.extend((0..4).map(|column| changed(row, column, value)));
        }
    }
    maps
}

/// Every kind of object with every impossible map: the error names the object by its place in the script.
pub fn singular(_: u64) -> Tally {
    let here = SourceId(42);
    let (from, to) = ([0.0; 3], [0.0, 1.0, 0.0]);
    let mut kinds = World::of_mesh(&ball(4, 4, 0.0), DAffine3::IDENTITY);
    for shape in [
        Shape::Sphere { center: from, radius: 1.0 },
        Shape::Plane { point: from, normal: to },
        Shape::Box { min: from, max: [1.0; 3] },
        Shape::Disc { center: from, normal: to, radius: 1.0 },
        Shape::Rectangle { corner: from, edge_u: to, edge_v: [1.0, 0.0, 0.0] },
        Shape::Cylinder { from, to, radius: 1.0, capped: true },
        Shape::Cone { from, to, radius: 1.0, to_radius: 0.0, capped: true },
    ] {
        kinds = kinds.with(shape, DAffine3::IDENTITY);
    }
    let instance = Object { kind: ObjectKind::Instance { group: 0 }, transform: None, source: here };
    let mut tally = Tally::default();
    for object in kinds.objects.iter().chain([&instance]) {
        for map in impossible() {
            let wrong = Object { transform: Some(map), source: here, ..object.clone() };
            let mut frame = frame(kinds.objects.clone());
            frame.scene.groups.push(Group { objects: vec![wrong] });
            frame.scene.root = 1;
            let error = Scene::compile(&frame, &kinds.assets).err();
            let named = error.as_ref().is_some_and(|error| error.source == here && error.message.contains("transform"));
            tally.check(named, || format!("{:?} at {map:?}: {error:?}", object.kind));
        }
    }
    tally
}

/// Maps within one another, the outermost first: turned, scaled by 10^-4 to 10^4, and moved; all of them together neither shrink nor grow.
struct Nest {
    maps: Vec<DAffine3>,
}

impl Nest {
    fn new(random: &mut Random) -> Self {
        let mut exponents: [f64; 16] = [(); 16].map(|()| random.signed() * 3.0);
        let mean = exponents.iter().sum::<f64>() / 16.0;
        exponents.iter_mut().for_each(|exponent| *exponent -= mean);
        let turn = |random: &mut Random, scale: f64| DMat3::from_axis_angle(random.direction(), random.unit() * 6.0) * scale;
        let map = |exponent: f64| DAffine3::from_mat3_translation(turn(random, 10f64.powf(exponent)), random.point());
        Self { maps: exponents.map(map).to_vec() }
    }

    fn compile(&self, shape: Shape) -> Scene {
        let mut frame = frame(World::of(shape, DAffine3::IDENTITY).objects);
        for (group, map) in self.maps.iter().rev().enumerate() {
            let instance =
                Object { kind: ObjectKind::Instance { group: group as u32 }, transform: Some(matrix(*map)), source: SourceId::default() };
            frame.scene.groups.push(Group { objects: vec![instance] });
        }
        frame.scene.root = self.maps.len() as u32;
        Scene::compile_around(&frame, &MemoryAssets::default(), DVec3::ZERO).expect("a scene that can be compiled")
    }

    fn place(&self, p: DVec3) -> DVec3 {
        self.maps.iter().rev().fold(p, |p, map| map.transform_point3(p))
    }

    /// The way back, in twice the precision.
    fn back(&self, p: DVec3) -> Vector {
        self.maps.iter().fold(p.into(), |p: Vector, map| {
            let [x, y, z] = [map.matrix3.x_axis, map.matrix3.y_axis, map.matrix3.z_axis].map(Vector::from);
            let (p, volume) = (p - map.translation.into(), x.dot(y.cross(z)));
            Vector([y.cross(z), z.cross(x), x.cross(y)].map(|covector| covector.dot(p) / volume))
        })
    }

    /// A bound on the sum of the magnitudes of all terms on the way of a point into the world.
    fn magnitude(&self, p: DVec3) -> f64 {
        let grown = |p: DVec3, map: &DAffine3| {
            let DMat3 { x_axis, y_axis, z_axis } = map.matrix3;
            x_axis.abs() * p.x + y_axis.abs() * p.y + z_axis.abs() * p.z + map.translation.abs()
        };
        self.maps.iter().rev().fold(p.abs(), grown).length()
    }
}

/// Points of a sphere in sixteen nested places, in its own coordinates: on it but for the bound of so many operations.
pub fn nested(rays: u64) -> Tally {
    let (center, radius) = (DVec3::new(0.1, 0.2, 0.3), 0.8);
    // Three products and three sums in each place, there and back.
    let operations = 16.0 * 6.0 * 2.0;
    run(rays, |random, count, tally| {
        let nest = Nest::new(random);
        let scene = nest.compile(Shape::Sphere { center: center.into(), radius });
        for _ in 0..count {
            let inner = center + random.direction() * radius * 0.9;
            let ray = towards(nest.place(center + random.direction() * 3.0), nest.place(inner));
            let surface = scene.closest(&ray);
            let off = surface.map(|surface| {
                let distance = (nest.back(surface.point) - center.into()).length() - Double::from(radius);
                distance.0.abs() / (nest.magnitude(inner) * operations * f64::EPSILON / 2.0)
            });
            tally.check(off.is_some_and(|off| off <= 1.0), || format!("off by {off:?} bounds: {} in {:?}", bits(&ray), nest.maps));
        }
    })
}
