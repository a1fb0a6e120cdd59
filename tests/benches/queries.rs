//! What a ray costs, on one thread: `cargo bench -p tessera-tests --bench queries`.
//!
//! Prints nanoseconds a ray for rays from the camera, shadow rays and diffusely scattered rays: in scene S1 and, where `TESSERA_MODELS` names a folder
//! with `stanford-bunny.obj`, on that model. Every figure is the sum of the fastest of several rounds over each of 16 chunks, so that other
//! load on the machine counts little.

use std::{env, fs, path::Path, time::Instant};

use glam::DVec3;
use tessera_engine::{
    camera::frame_all,
    description::{Frame, Group, MemoryAssets, Model, ModelFormat, Object, ObjectKind, SourceId},
    scene::Scene,
    shape::{Bounds, Ray},
};
use tessera_tests::s1;

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 192;
const ROUNDS: usize = 15;

fn main() {
    let frame = s1::frame(WIDTH, HEIGHT);
    report("S1", &Scene::compile(&frame, &MemoryAssets::default()).expect("S1 compiles"));
    match env::var_os("TESSERA_MODELS") {
        Some(folder) => report("bunny", &bunny(&frame, &Path::new(&folder).join("stanford-bunny.obj"))),
        None => println!("TESSERA_MODELS is not set: no model is measured"),
    }
}

fn bunny(frame: &Frame, file: &Path) -> Scene {
    let mut assets = MemoryAssets::default();
    let file = assets.insert(fs::read(file).expect("the model can be read"));
    let model = Model { format: ModelFormat::Obj, file, parts: Vec::new() };
    let object = Object { kind: ObjectKind::Model { model, material: None }, transform: None, source: SourceId::default() };
    let mut frame = frame.clone();
    frame.scene.groups = vec![Group { objects: vec![object] }];
    frame.scene.root = 0;
    let scene = Scene::compile(&frame, &assets).expect("the model compiles");
    let (min, max) = scene.bounds().expect("the model has triangles");
    frame.camera = frame_all(Bounds { min, max }, f64::from(WIDTH) / f64::from(HEIGHT));
    let start = Instant::now();
    let scene = Scene::compile(&frame, &assets).expect("the model compiles");
    println!("bunny: {:?}, compiled in {:.0} ms", scene.statistics, start.elapsed().as_secs_f64() * 1e3);
    scene
}

fn report(name: &str, scene: &Scene) {
    let Rays { camera, shadow, diffuse } = rays(scene);
    println!("{name}, from the camera, nearest hit: {:.1} ns", cost(&camera, |ray| scene.closest(ray).is_some()));
    println!("{name}, to a light, any hit: {:.1} ns", cost(&shadow, |ray| scene.any(ray, |_, _| true)));
    println!("{name}, diffusely scattered, nearest hit: {:.1} ns", cost(&diffuse, |ray| scene.closest(ray).is_some()));
    println!("{name}, diffusely scattered, any hit: {:.1} ns", cost(&diffuse, |ray| scene.any(ray, |_, _| true)));
}

#[derive(Default)]
struct Rays {
    camera: Vec<Ray>,
    shadow: Vec<Ray>,
    diffuse: Vec<Ray>,
}

fn rays(scene: &Scene) -> Rays {
    let mut rays = Rays::default();
    let light = DVec3::from(s1::LIGHTS[0].0) - scene.begin();
    let mut state = 1u64;
    let mut unit = || {
        state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (state >> 11) as f64 / (1u64 << 53) as f64 * 2.0 - 1.0
    };
    for pixel in 0..WIDTH * HEIGHT {
        let ray = scene.camera.ray(f64::from(pixel % WIDTH) + 0.5, f64::from(pixel / WIDTH) + 0.5, glam::DVec2::ZERO);
        rays.camera.push(ray);
        let Some(surface) = scene.closest(&ray) else { continue };
        let towards = light - surface.point;
        rays.shadow.push(Ray { t_max: towards.length(), ..surface.spawn(towards.normalize()) });
        let facing = surface.ng * -ray.direction.dot(surface.ng).signum();
        let scattered = facing * 1.001 + DVec3::new(unit(), unit(), unit()).normalize_or_zero();
        rays.diffuse.push(surface.spawn(scattered.normalize()));
    }
    rays
}

/// Nanoseconds a ray.
fn cost(rays: &[Ray], query: impl Fn(&Ray) -> bool) -> f64 {
    let of_chunk = |chunk: &[Ray]| {
        let round = || {
            let start = Instant::now();
            std::hint::black_box(chunk.iter().filter(|ray| query(ray)).count());
            start.elapsed().as_secs_f64()
        };
        (0..ROUNDS).map(|_| round()).fold(f64::INFINITY, f64::min)
    };
    rays.chunks(rays.len().div_ceil(16)).map(of_chunk).sum::<f64>() / rays.len() as f64 * 1e9
}
