//! Scenes as users make them, held against brute force and closed forms.

mod brute_force;
mod brushed;
mod builds;
mod coats;
mod cones;
mod errors;
mod footprints;
mod meshes;
mod models;
mod pencils;
mod rectangles;
mod spawn;
mod transforms;

use crate::description::{
    Aovs, Camera, Film, Filter, Frame, Group, Material, Matrix, MemoryAssets, MeshData, Object, ObjectKind, Quality, Render,
    Scene as Description, Shape, SourceId,
};
use crate::{scene::Scene, shape::Ray};
use glam::{DAffine3, DMat3, DVec2, DVec3};

/// A small generator of numbers, the same in every run (PCG-XSH-RR).
pub struct Random(pub u64);

impl Random {
    pub fn bits(&mut self) -> u32 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((((self.0 >> 18) ^ self.0) >> 27) as u32).rotate_right((self.0 >> 59) as u32)
    }

    /// In [0, 1).
    pub fn unit(&mut self) -> f64 {
        f64::from(self.bits()) / 4_294_967_296.0
    }

    /// In [-1, 1).
    pub fn signed(&mut self) -> f64 {
        self.unit() * 2.0 - 1.0
    }

    pub fn point(&mut self) -> DVec3 {
        DVec3::new(self.signed(), self.signed(), self.signed())
    }

    pub fn direction(&mut self) -> DVec3 {
        loop {
            let p = self.point();
            if (1e-6..1.0).contains(&p.length_squared()) {
                return p.normalize();
            }
        }
    }
}

pub fn shape(shape: Shape, material: u32) -> Object {
    Object { kind: ObjectKind::Shape { shape, material }, transform: None, source: SourceId::default() }
}

pub fn sphere(center: DVec3, radius: f64, material: u32) -> Object {
    shape(Shape::Sphere { center: center.into(), radius }, material)
}

pub fn frame(objects: Vec<Object>) -> Frame {
    let diffuse = Material::Diffuse { reflectance: [0.5; 3], texture: None };
    Frame {
        scene: Description {
            materials: vec![diffuse, Material::Mirror { reflectance: [0.9; 3] }, Material::smooth_glass(1.5, [1.0; 3])],
            groups: vec![Group { objects }],
            ..Default::default()
        },
        camera: Camera::pinhole([0.0, 3.5, 11.0], [0.0, 0.8, 0.0], [0.0, 1.0, 0.0], 45.0),
        film: Film { width: 1024, height: 768, filter: Filter::Point },
        render: Render::Raycast,
        quality: Quality::of(1),
        seed: 0,
        aovs: Aovs::NONE,
    }
}

pub fn compile(objects: Vec<Object>) -> Scene {
    Scene::compile_around(&frame(objects), &MemoryAssets::default(), DVec3::ZERO).unwrap()
}

/// The 32 spheres over a floor that the speed of small scenes is measured on.
pub fn spheres_on_a_floor() -> Vec<Object> {
    let mut objects = vec![shape(Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }, 0)];
    for i in 0..30 {
        let radius = 0.3 + 0.1 * f64::from(i % 4);
        let (rho, angle) = (0.95 * (f64::from(i) + 0.5).sqrt(), 2.399_963 * f64::from(i));
        objects.push(sphere(DVec3::new(rho * crate::math::cos(angle), radius, rho * crate::math::sin(angle)), radius, i as u32 % 3));
    }
    objects.push(sphere(DVec3::new(-4.5, 1.6, -6.5), 1.6, 1));
    objects.push(sphere(DVec3::new(1.2, 1.9, 2.5), 0.6, 2));
    objects
}

/// A closed, bumpy ball of `2 rows columns - 2 columns` triangles about the origin, counter-clockwise from outside.
pub fn ball(rows: u32, columns: u32, bumps: f64) -> MeshData {
    use crate::math::{cos, sin};
    use std::f64::consts::{PI, TAU};
    let at = |row: u32, column: u32| {
        let (theta, phi) = (PI * f64::from(row) / f64::from(rows), TAU * f64::from(column) / f64::from(columns));
        let radius = 1.0 + bumps * sin(7.0 * theta) * cos(5.0 * phi) * sin(theta);
        (DVec3::new(sin(theta) * sin(phi), cos(theta), sin(theta) * cos(phi)) * radius).as_vec3().to_array()
    };
    let mut mesh = MeshData { positions: vec![at(0, 0)], ..Default::default() };
    mesh.positions.extend((1..rows).flat_map(|row| (0..columns).map(move |column| at(row, column))));
    mesh.positions.push(at(rows, 0));
    let last = mesh.positions.len() as u32 - 1;
    let index = |row: u32, column: u32| match row {
        0 => 0,
        _ if row == rows => last,
        _ => 1 + (row - 1) * columns + column % columns,
    };
    for row in 0..rows {
        for column in 0..columns {
            let [a, b, c, d] = [index(row, column), index(row + 1, column), index(row + 1, column + 1), index(row, column + 1)];
            mesh.triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0]));
        }
    }
    mesh
}

/// A place in row-major order.
pub fn matrix(map: DAffine3) -> Matrix {
    let rows = map.matrix3.transpose().to_cols_array_2d();
    std::array::from_fn(|i| [rows[i][0], rows[i][1], rows[i][2], map.translation[i]])
}

/// An object and the assets of a scene that is being made.
#[derive(Default)]
pub struct Maker {
    pub objects: Vec<Object>,
    pub assets: MemoryAssets,
}

impl Maker {
    pub fn mesh(&mut self, mesh: &MeshData, map: DAffine3) -> &mut Self {
        let data = self.assets.insert(postcard::to_stdvec(mesh).unwrap());
        self.add(Shape::Mesh { data }, map)
    }

    pub fn add(&mut self, kind: Shape, map: DAffine3) -> &mut Self {
        let transform = (map != DAffine3::IDENTITY).then(|| matrix(map));
        self.objects.push(Object { transform, ..shape(kind, self.objects.len() as u32 % 3) });
        self
    }

    pub fn compile(&self) -> Scene {
        Scene::compile_around(&frame(self.objects.clone()), &self.assets, DVec3::ZERO).unwrap()
    }
}

/// One of every kind of shape, plain and transformed, many times over, at random places.
pub fn everything(seed: u64, count: usize) -> Maker {
    let mut random = Random(seed);
    let mut maker = Maker::default();
    let ball = ball(12, 16, 0.1);
    for i in 0..count {
        let (center, radius) = (random.point() * 4.0, 0.1 + random.unit() * 0.5);
        let kind = match i % 8 {
            0 => Shape::Sphere { center: center.into(), radius },
            1 => Shape::Box { min: center.into(), max: (center + DVec3::new(random.unit(), random.unit(), random.unit()) + 0.01).into() },
            2 => Shape::Disc { center: center.into(), normal: random.direction().into(), radius },
            3 if i == 3 => Shape::Plane { point: [0.0, -4.0, 0.0], normal: random.direction().into() },
            4 => {
                let edge = |random: &mut Random| (random.direction() * (0.1 + random.unit())).into();
                Shape::Rectangle { corner: center.into(), edge_u: edge(&mut random), edge_v: edge(&mut random) }
            }
            5 => {
                let to = center + random.direction() * (0.1 + random.unit());
                Shape::Cylinder { from: center.into(), to: to.into(), radius, capped: i % 2 == 0 }
            }
            6 => {
                let to = center + random.direction() * (0.1 + random.unit());
                let to_radius = if random.bits().is_multiple_of(2) { 0.0 } else { random.unit() };
                Shape::Cone { from: center.into(), to: to.into(), radius, to_radius, capped: random.bits().is_multiple_of(2) }
            }
            _ => {
                maker.mesh(&ball, placement(&mut random));
                continue;
            }
        };
        let map = if i % 3 == 0 { DAffine3::IDENTITY } else { placement(&mut random) };
        maker.add(kind, map);
    }
    maker
}

/// An invertible map: rotated, sheared, unevenly scaled, half of them mirrored.
pub fn placement(random: &mut Random) -> DAffine3 {
    loop {
        let linear = DMat3::from_cols(random.point(), random.point(), random.point());
        if linear.determinant().abs() > 0.05 {
            return DAffine3::from_mat3_translation(linear, random.point() * 3.0);
        }
    }
}

/// Rays of all kinds that a frame asks for: through the camera, then off what they meet.
pub fn rays_of(scene: &Scene, count: usize) -> Vec<Ray> {
    let mut random = Random(7);
    let mut rays = Vec::with_capacity(count);
    while rays.len() < count {
        let mut ray = scene.camera.ray(random.unit() * 1024.0, random.unit() * 768.0, DVec2::ZERO);
        for _ in 0..4 {
            rays.push(ray);
            let Some(surface) = scene.closest(&ray) else { break };
            ray = surface.spawn(random.direction());
        }
    }
    rays.truncate(count);
    rays
}
