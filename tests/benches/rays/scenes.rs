//! What rays are traced through: a scan-like mesh, architecture, hair, a field of instances, and real models where `TESSERA_MODELS` names a folder that has them: a scan,
//! and two machines of many parts, each of which is one mesh for Embree.

use std::{f64::consts::TAU, fs, path::Path};

use glam::{DMat3, DQuat, DVec2, DVec3};
use tessera_engine::{
    assets,
    description::{Frame, Group, Matrix, MemoryAssets, Model as File, ModelFormat, Object, ObjectKind, SourceId},
    scene::Scene,
};
use tessera_tests::s1;

use super::{Numbers, on_sphere};

/// Triangles, and where they are seen from.
pub struct Model {
    pub name: &'static str,
    pub positions: Vec<[f32; 3]>,
    pub triangles: Vec<[u32; 3]>,
    pub eye: DVec3,
    pub look_at: DVec3,
    /// Tangent of half the angle of view.
    pub half_view: f64,
    pub lamp: DVec3,
    /// Where the triangles are shown; once, where they are, if nowhere.
    pub places: Vec<Matrix>,
    /// A file of glTF that Tessera reads instead of these triangles.
    gltf: Option<Vec<u8>>,
}

/// Makes a scene, where there is what it needs.
type Make = fn() -> Option<Model>;

/// Names of all scenes, and what makes them.
pub const ALL: [(&str, Make); 7] = [
    ("knot", || Some(knot())),
    ("hall", || Some(hall())),
    ("needles", || Some(needles())),
    ("field", || Some(field())),
    ("bunny", bunny),
    ("engine", engine),
    ("truck", truck),
];

impl Model {
    fn new(name: &'static str, eye: [f64; 3], look_at: [f64; 3], half_view: f64, lamp: [f64; 3]) -> Self {
        let (positions, triangles) = (Vec::new(), Vec::new());
        Self {
            name,
            positions,
            triangles,
            eye: eye.into(),
            look_at: look_at.into(),
            half_view,
            lamp: lamp.into(),
            places: Vec::new(),
            gltf: None,
        }
    }

    /// The diagonal of its box.
    pub fn size(&self) -> f64 {
        let points = self.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
        let places = self.places.iter().map(|[x, y, z]| DVec3::new(x[3], y[3], z[3]));
        let points: Vec<DVec3> = if self.places.is_empty() { points.collect() } else { places.collect() };
        let (low, high) = points.into_iter().fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
        (high - low).length()
    }

    /// The scene that Tessera makes of it, by way of a file.
    pub fn compile(&self) -> Scene {
        let mut assets = MemoryAssets::default();
        let (format, bytes) = self.gltf.clone().map_or_else(|| (ModelFormat::Ply, self.ply()), |bytes| (ModelFormat::Gltf, bytes));
        let model = File { format, file: assets.insert(bytes), parts: Vec::new() };
        // Of a material that is seen from both sides, as everything is for Embree.
        let object = |transform: Option<Matrix>| {
            let kind = ObjectKind::Model { model: model.clone(), material: Some(0) };
            Object { kind, transform, source: SourceId::default() }
        };
        let places = self.places.iter().map(|place| object(Some(*place)));
        let objects = if self.places.is_empty() { vec![object(None)] } else { places.collect() };
        let mut frame: Frame = s1::frame(64, 64);
        frame.scene.groups = vec![Group { objects }];
        frame.scene.root = 0;
        Scene::compile_around(&frame, &assets, DVec3::ZERO).expect("the model compiles")
    }

    fn ply(&self) -> Vec<u8> {
        let mut bytes = format!(
            "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\nelement face {}\nproperty list uchar int vertex_indices\nend_header\n",
            self.positions.len(),
            self.triangles.len()
        )
        .into_bytes();
        self.positions.iter().flatten().for_each(|x| bytes.extend(x.to_le_bytes()));
        for triangle in &self.triangles {
            bytes.push(3);
            triangle.iter().for_each(|index| bytes.extend(index.to_le_bytes()));
        }
        bytes
    }

    fn vertex(&mut self, point: DVec3) -> u32 {
        self.positions.push(point.as_vec3().into());
        self.positions.len() as u32 - 1
    }

    /// A surface over the unit square, in so many steps.
    fn patch(&mut self, across: u32, along: u32, point: impl Fn(f64, f64) -> DVec3) {
        let first = self.positions.len() as u32;
        for i in 0..=across {
            for j in 0..=along {
                self.vertex(point(f64::from(i) / f64::from(across), f64::from(j) / f64::from(along)));
            }
        }
        let at = |i: u32, j: u32| first + i * (along + 1) + j;
        for (i, j) in (0..across).flat_map(|i| (0..along).map(move |j| (i, j))) {
            self.triangles.extend([[at(i, j), at(i + 1, j), at(i + 1, j + 1)], [at(i, j), at(i + 1, j + 1), at(i, j + 1)]]);
        }
    }

    /// A box of these half edges, turned about z.
    fn block(&mut self, middle: DVec3, half: DVec3, turn: f64) {
        let corner = |i: u32| {
            let side = |bit: u32, half: f64| if i & bit == 0 { -half } else { half };
            let flat = DVec2::from_angle(turn).rotate(DVec2::new(side(1, half.x), side(2, half.y)));
            middle + flat.extend(side(4, half.z))
        };
        let first = self.positions.len() as u32;
        (0..8).for_each(|i| _ = self.vertex(corner(i)));
        for [a, b, c, d] in
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]].map(|f| f.map(|i| first + i))
        {
            self.triangles.extend([[a, b, c], [a, c, d]]);
        }
    }

    /// An open tube between two points.
    fn tube(&mut self, from: DVec3, to: DVec3, radius: f64, sides: u32) {
        let (u, v) = (to - from).normalize().any_orthonormal_pair();
        self.patch(sides, 1, |around, along| {
            let angle = around * TAU;
            from.lerp(to, along) + (u * angle.cos() + v * angle.sin()) * radius
        });
    }
}

/// Waves over waves.
fn rough(p: DVec3) -> f64 {
    let wave = |i: i32| {
        let q = p * 1.9f64.powi(i) + f64::from(i);
        0.5f64.powi(i) * ((q.x * 1.7).sin() * (q.y * 2.1).cos() + (q.z * 1.9).sin() * (q.x * 0.9).cos())
    };
    (0..6).map(wave).sum()
}

/// A rough knot over rough ground: a million triangles of even size, as scans have.
fn knot() -> Model {
    let mut model = Model::new("knot", [3.5, -5.5, 3.5], [0.0, 0.0, -0.3], 0.6, [4.0, -3.0, 7.0]);
    let line = |u: f64| {
        let (s3, c3) = (3.0 * TAU * u).sin_cos();
        let (s2, c2) = (2.0 * TAU * u).sin_cos();
        DVec3::new((2.0 + c3) * c2, (2.0 + c3) * s2, -s3)
    };
    model.patch(1280, 300, |u, v| {
        let along = (line(u + 1e-3) - line(u - 1e-3)).normalize();
        let side = along.cross(DVec3::new(0.3, 0.2, 0.9)).normalize();
        let (s, c) = (v * TAU).sin_cos();
        let out = side * c + along.cross(side) * s;
        line(u) + out * (0.55 + 0.05 * rough(line(u) * 2.0 + out * 3.0))
    });
    model.patch(360, 360, |u, v| {
        let p = DVec3::new(u * 16.0 - 8.0, v * 16.0 - 8.0, 0.0);
        p + DVec3::Z * (0.12 * rough(p) - 2.2)
    });
    model
}

/// A closed hall: huge walls, fluted columns and cables, which are long and thin, boxes at all angles, small clutter.
fn hall() -> Model {
    let mut model = Model::new("hall", [-9.0, -27.0, 2.2], [2.0, 5.0, 2.8], 0.8, [1.0, 2.0, 7.6]);
    let mut numbers = Numbers(7);
    model.block(DVec3::new(0.0, 0.0, 4.0), DVec3::new(12.0, 30.0, 4.0), 0.0);
    for column in 0..32 {
        let foot = DVec3::new(if column % 2 == 0 { -7.5 } else { 7.5 }, f64::from(column / 2) * 3.7 - 28.0, 0.0);
        model.tube(foot, foot + DVec3::Z * 8.0, 0.45, 96);
        for flute in 0..24 {
            let (s, c) = (f64::from(flute) / 24.0 * TAU).sin_cos();
            let foot = foot + DVec3::new(c, s, 0.0) * 0.46;
            model.tube(foot, foot + DVec3::Z * 8.0, 0.03, 12);
        }
        for height in [0.2, 7.8] {
            model.block(foot + DVec3::Z * height, DVec3::new(0.7, 0.7, 0.2), 0.0);
        }
    }
    for _ in 0..500 {
        let mut end = || DVec3::new(numbers.between(-11.5, 11.5), numbers.between(-29.0, 29.0), numbers.between(5.0, 7.9));
        let (from, to) = (end(), end());
        model.tube(from, to, 0.015, 10);
    }
    for _ in 0..900 {
        let seat = DVec3::new(numbers.between(-11.0, 11.0), numbers.between(-28.0, 28.0), 0.45);
        let turn = numbers.between(0.0, TAU);
        let at = |x: f64, y: f64, z: f64| seat + DVec2::from_angle(turn).rotate(DVec2::new(x, y)).extend(z);
        model.block(seat, DVec3::new(0.25, 0.25, 0.02), turn);
        model.block(at(-0.24, 0.0, 0.3), DVec3::new(0.015, 0.25, 0.28), turn);
        for (x, y) in [(-0.22, -0.22), (0.22, -0.22), (-0.22, 0.22), (0.22, 0.22)] {
            model.tube(at(x, y, -0.45), at(x, y, 0.0), 0.015, 8);
        }
    }
    for _ in 0..160 {
        let middle = DVec3::new(numbers.between(-11.0, 11.0), numbers.between(-28.0, 28.0), 0.55);
        let radius = numbers.between(0.05, 0.15);
        model.patch(24, 12, |u, v| {
            let ((sa, ca), (sb, cb)) = ((u * TAU).sin_cos(), (v * 1.5).sin_cos());
            middle + DVec3::new(ca * sb, sa * sb, -cb) * radius
        });
    }
    model
}

/// A ball of hair: slivers at all angles, whose boxes are nearly empty.
fn needles() -> Model {
    let mut model = Model::new("needles", [0.0, -4.5, 1.2], [0.0; 3], 0.5, [3.0, -4.0, 5.0]);
    let mut numbers = Numbers(11);
    for _ in 0..200_000 {
        let root = on_sphere(numbers.unit(), numbers.unit());
        let tip = root * numbers.between(1.2, 1.7) + on_sphere(numbers.unit(), numbers.unit()) * 0.3;
        let side = (tip - root).cross(on_sphere(numbers.unit(), numbers.unit())).normalize() * 0.002;
        let triangle = [root - side, root + side, tip].map(|point| model.vertex(point));
        model.triangles.push(triangle);
    }
    model
}

/// Ten thousand rough balls of all sizes, turned and stretched, strewn over a plain.
fn field() -> Model {
    let mut model = Model::new("field", [0.0, -52.0, 9.0], [0.0, -20.0, 0.0], 0.6, [20.0, -30.0, 40.0]);
    model.patch(40, 20, |u, v| {
        let ((sa, ca), (sb, cb)) = ((u * TAU).sin_cos(), (v * TAU * 0.5).sin_cos());
        let out = DVec3::new(ca * sb, sa * sb, cb);
        out * (1.0 + 0.15 * rough(out * 2.0))
    });
    let mut numbers = Numbers(5);
    for _ in 0..10_000 {
        let size = numbers.between(0.15, 0.7);
        let turn = DQuat::from_axis_angle(on_sphere(numbers.unit(), numbers.unit()), numbers.between(0.0, TAU));
        let stretch = DVec3::new(numbers.between(0.5, 1.5), numbers.between(0.5, 1.5), numbers.between(0.5, 1.5)) * size;
        let map = DMat3::from_quat(turn) * DMat3::from_diagonal(stretch);
        let place = DVec3::new(numbers.between(-50.0, 50.0), numbers.between(-50.0, 50.0), numbers.between(0.0, 1.5));
        let rows = map.transpose().to_cols_array_2d();
        model.places.push(std::array::from_fn(|i| [rows[i][0], rows[i][1], rows[i][2], place[i]]));
    }
    model
}

/// The Stanford bunny.
fn bunny() -> Option<Model> {
    let folder = std::env::var_os("TESSERA_MODELS")?;
    let text = fs::read_to_string(Path::new(&folder).join("stanford-bunny.obj")).expect("the model can be read");
    let mut model = Model::new("bunny", [0.05, 0.12, 0.25], [-0.02, 0.1, 0.0], 0.35, [0.2, 0.4, 0.3]);
    for line in text.lines() {
        let mut words = line.split_whitespace();
        let kind = words.next();
        let mut three = || std::array::from_fn(|_| words.next().expect("three words"));
        match kind {
            Some("v") => model.positions.push(three().map(|word: &str| word.parse().expect("a coordinate"))),
            Some("f") => {
                let index = |word: &str| word.split('/').next().and_then(|word| word.parse::<u32>().ok()).expect("an index") - 1;
                model.triangles.push(three().map(index));
            }
            _ => {}
        }
    }
    Some(model)
}

/// Two cylinders and all that they move: 122,000 triangles of 79 parts, many of them turned.
fn engine() -> Option<Model> {
    machine("engine", "2CylinderEngine.glb", [-0.3, -0.9, 0.5])
}

/// A milk truck.
fn truck() -> Option<Model> {
    machine("truck", "CesiumMilkTruck.glb", [0.6, -0.7, 0.8])
}

/// A model of many meshes, seen from a direction.
fn machine(name: &'static str, file: &str, from: [f64; 3]) -> Option<Model> {
    let bytes = fs::read(Path::new(&std::env::var_os("TESSERA_MODELS")?).join(file)).expect("the model can be read");
    let mut assets = MemoryAssets::default();
    let file = File { format: ModelFormat::Gltf, file: assets.insert(bytes.clone()), parts: Vec::new() };
    let loaded = assets::load(&file, &assets).expect("the model is right");
    let mut model = Model { gltf: Some(bytes), ..Model::new(name, [0.0; 3], [0.0; 3], 0.45, [0.0; 3]) };
    for instance in &loaded.instances {
        let mesh = &loaded.meshes[instance.mesh];
        let first = model.positions.len() as u32;
        for position in &mesh.positions {
            model.vertex(instance.transform.transform_point3(DVec3::from(position.map(f64::from))));
        }
        model.triangles.extend(mesh.triangles.iter().map(|triangle| triangle.map(|vertex| first + vertex)));
    }
    let points = model.positions.iter().map(|p| DVec3::from(p.map(f64::from)));
    let (low, high) = points.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(low, high), p| (low.min(p), high.max(p)));
    model.look_at = (low + high) * 0.5;
    model.eye = model.look_at + DVec3::from(from).normalize() * (high - low).length();
    model.lamp = model.look_at + DVec3::new(0.3, -0.4, 0.9) * (high - low).length();
    Some(model)
}
