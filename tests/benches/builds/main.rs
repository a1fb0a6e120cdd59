//! What it takes to build the trees of meshes that builders fear, on one thread: `cargo bench -p tessera-tests --bench builds`.
//!
//! Prints, for every mesh, seconds, their ratio to those of a benign mesh of as many triangles, bytes that are kept a triangle, and the peak of the
//! process's memory. A mesh that takes more than three times as long as the benign one is marked. Names of meshes as arguments (`waves` is the benign one) leave the others out.
//! `-- --triangles N` changes their size; `-- --full` adds ten million slivers and fifty million triangles of a benign mesh, for which 16 GiB must do.

mod meshes;

use std::{fs, time::Instant};

use tessera_engine::{
    description::{
        Aovs, Camera, Film, Filter, Frame, Group, Material, MemoryAssets, MeshData, Object, ObjectKind, Quality, Render,
        Scene as Description, Shape, SourceId,
    },
    scene::{Scene, Statistics},
};

/// Triangles of a mesh unless `--triangles` says otherwise.
const TRIANGLES: usize = 200_000;

/// How many times as long as a benign mesh of as many triangles one may take.
const GOAL: f64 = 3.0;

/// What a build took.
struct Build {
    triangles: usize,
    seconds: f64,
    bytes: usize,
    depth: usize,
    /// The largest resident memory meanwhile, in bytes; without the mesh in its encoded form.
    peak: u64,
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let size = arguments.iter().skip_while(|argument| *argument != "--triangles").nth(1);
    let size = size.map_or(TRIANGLES, |size| size.parse().expect("--triangles takes a number"));
    let known = |name: &String| meshes::FEARED.iter().chain([&meshes::BENIGN]).any(|(known, _)| known == name);
    let names: Vec<&String> = arguments.iter().filter(|name| known(name)).collect();
    let benign = fastest(meshes::BENIGN.1, size, if size > 1_000_000 { 1 } else { 3 });
    report(meshes::BENIGN.0, &benign, &benign);
    for (name, make) in meshes::FEARED.iter().filter(|(name, _)| names.is_empty() || names.iter().any(|wanted| wanted == name)) {
        report(name, &fastest(*make, size, 1), &benign);
    }
    if arguments.iter().any(|argument| argument == "--full") {
        let benign = fastest(meshes::waves, 10_000_000, 1);
        report(meshes::BENIGN.0, &benign, &benign);
        let (name, make) = meshes::FEARED.iter().find(|(name, _)| *name == "slivers").expect("it is one of them");
        report(name, &fastest(*make, 10_000_000, 1), &benign);
        let large = fastest(meshes::waves, 50_000_000, 1);
        report(meshes::BENIGN.0, &large, &large);
    }
}

/// The fastest of so many builds.
fn fastest(make: fn(usize) -> MeshData, triangles: usize, rounds: usize) -> Build {
    let encoded = postcard::to_stdvec(&make(triangles)).expect("a mesh can be encoded");
    let (assets, frame) = scene(encoded);
    let builds = (0..rounds).map(|_| build(&assets, &frame));
    builds.min_by(|a, b| a.seconds.total_cmp(&b.seconds)).expect("at least one round")
}

fn build(assets: &MemoryAssets, frame: &Frame) -> Build {
    let encoded = assets.iter().next().expect("a mesh").1;
    let begin = Instant::now();
    std::hint::black_box(postcard::from_bytes::<MeshData>(encoded).expect("what was encoded can be decoded"));
    let decoding = begin.elapsed().as_secs_f64();
    // Tells the kernel to forget the highest value.
    let _ = fs::write("/proc/self/clear_refs", "5");
    let begin = Instant::now();
    let scene = Scene::compile(frame, assets).expect("the mesh can be built");
    let seconds = begin.elapsed().as_secs_f64() - decoding;
    let Statistics { triangles, bytes, depth, .. } = scene.statistics;
    Build { triangles, seconds, bytes, depth, peak: peak().saturating_sub(encoded.len() as u64) }
}

fn report(name: &str, build: &Build, benign: &Build) {
    let Build { triangles, seconds, bytes, depth, peak } = *build;
    // Meshes of grids are not of quite as many triangles as were asked for.
    let ratio = seconds / benign.seconds * benign.triangles as f64 / triangles as f64;
    let mark = if ratio > GOAL { "  <-- slow" } else { "" };
    println!(
        "{name:<20} {triangles:>9} triangles {seconds:8.3} s, ratio {ratio:6.2}, {:6.1} bytes a triangle, depth {depth:>3}, peak {:6.0} MiB{mark}",
        bytes as f64 / triangles as f64,
        peak as f64 / f64::from(1 << 20),
    );
}

/// A frame that shows one mesh.
fn scene(encoded: Vec<u8>) -> (MemoryAssets, Frame) {
    let mut assets = MemoryAssets::default();
    let data = assets.insert(encoded);
    let source = SourceId::default();
    let material = Material::Diffuse { reflectance: [0.5; 3], texture: None };
    let object = Object { kind: ObjectKind::Shape { shape: Shape::Mesh { data }, material: 0 }, transform: None, source };
    let scene = Description { materials: vec![material], groups: vec![Group { objects: vec![object] }], ..Description::default() };
    let frame = Frame {
        scene,
        camera: Camera::pinhole([0.0, 0.0, 9.0], [0.0; 3], [0.0, 1.0, 0.0], 45.0),
        film: Film { width: 64, height: 64, filter: Filter::Box },
        render: Render::Raycast,
        quality: Quality::of(1),
        seed: 1,
        aovs: Aovs::NONE,
    };
    (assets, frame)
}

/// The largest resident memory of this process in bytes, where the system tells it.
fn peak() -> u64 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"));
    line.and_then(|line| line.split_whitespace().next()?.parse::<u64>().ok()).map_or(0, |kib| kib << 10)
}
