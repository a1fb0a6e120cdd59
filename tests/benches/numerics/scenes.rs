//! Scenes of the cases, and how they are asked.

use std::f64::consts::{PI, TAU};

use glam::{DAffine3, DMat3, DVec3, Vec3};
use tessera_engine::{
    description::{
        Aovs, Camera, Film, Filter, Frame, Group, Material, Matrix, MemoryAssets, MeshData, Object, ObjectKind, Quality, Render,
        Scene as Description, Shape, SourceId,
    },
    scene::{Hit, Scene, Tracer, Work},
    shape::Ray,
};

use super::trial::{Random, bits};

/// Objects and the assets that they need.
#[derive(Clone, Default)]
pub struct World {
    /// In the order of their numbers.
    pub objects: Vec<Object>,
    /// Meshes, coded.
    pub assets: MemoryAssets,
}

impl World {
    /// One shape.
    pub fn of(shape: Shape, map: DAffine3) -> Self {
        Self::default().with(shape, map)
    }

    /// One mesh.
    pub fn of_mesh(mesh: &MeshData, map: DAffine3) -> Self {
        Self::default().with_mesh(mesh, map)
    }

    /// Adds a shape, of a material that stands for its number.
    pub fn with(mut self, shape: Shape, map: DAffine3) -> Self {
        let transform = (map != DAffine3::IDENTITY).then(|| matrix(map));
        let material = self.objects.len() as u32 % 3;
        self.objects.push(Object { kind: ObjectKind::Shape { shape, material }, transform, source: SourceId::default() });
        self
    }

    /// The same for a mesh.
    pub fn with_mesh(mut self, mesh: &MeshData, map: DAffine3) -> Self {
        let data = self.assets.insert(postcard::to_stdvec(mesh).expect("plain data is coded"));
        self.with(Shape::Mesh { data }, map)
    }

    /// The scene, which is one that can be compiled.
    pub fn compile(&self) -> Scene {
        Scene::compile_around(&frame(self.objects.clone()), &self.assets, DVec3::ZERO).expect("a scene that can be compiled")
    }
}

/// A small frame of these objects, seen from their front.
pub fn frame(objects: Vec<Object>) -> Frame {
    let diffuse = Material::Diffuse { reflectance: [0.5; 3], texture: None };
    let mirror = Material::Mirror { reflectance: [0.9; 3] };
    let glass = Material::smooth_glass(1.5, [1.0; 3]);
    Frame {
        scene: Description { materials: vec![diffuse, mirror, glass], groups: vec![Group { objects }], ..Default::default() },
        camera: Camera::pinhole([0.0, 3.5, 11.0], [0.0, 0.8, 0.0], [0.0, 1.0, 0.0], 45.0),
        film: Film { width: 96, height: 72, filter: Filter::Box },
        render: Render::Raycast,
        quality: Quality::of(1),
        seed: 0,
        aovs: Aovs::NONE,
    }
}

/// A map in row-major order.
pub fn matrix(map: DAffine3) -> Matrix {
    let rows = map.matrix3.transpose().to_cols_array_2d();
    std::array::from_fn(|i| [rows[i][0], rows[i][1], rows[i][2], map.translation[i]])
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

/// A closed, bumpy ball about 0, counter-clockwise from outside.
pub fn ball(rows: u32, columns: u32, bumps: f64) -> MeshData {
    let at = |row: u32, column: u32| {
        let (theta, phi) = (PI * f64::from(row) / f64::from(rows), TAU * f64::from(column) / f64::from(columns));
        let radius = 1.0 + bumps * (7.0 * theta).sin() * (5.0 * phi).cos() * theta.sin();
        (DVec3::new(theta.sin() * phi.sin(), theta.cos(), theta.sin() * phi.cos()) * radius).as_vec3().to_array()
    };
    let last = 1 + (rows - 1) * columns;
    let index = |row: u32, column: u32| match row {
        0 => 0,
        _ if row == rows => last,
        _ => 1 + (row - 1) * columns + column % columns,
    };
    let inner = (1..rows).flat_map(|row| (0..columns).map(move |column| at(row, column)));
    let positions = std::iter::once(at(0, 0)).chain(inner).chain([at(rows, 0)]).collect();
    let quads = (0..rows).flat_map(|row| (0..columns).map(move |column| (row, column)));
    let triangles = quads
        .flat_map(|(row, column)| {
            let [a, b, c, d] = [index(row, column), index(row + 1, column), index(row + 1, column + 1), index(row, column + 1)];
            [[a, b, c], [a, c, d]]
        })
        .filter(|t| t[0] != t[1] && t[1] != t[2] && t[2] != t[0])
        .collect();
    MeshData { positions, triangles, ..Default::default() }
}

/// The mesh scaled, then moved, and rounded.
pub fn moved(mesh: &MeshData, scale: f64, by: DVec3) -> MeshData {
    let place = |p: &[f32; 3]| (Vec3::from(*p).as_dvec3() * scale + by).as_vec3().to_array();
    MeshData { positions: mesh.positions.iter().map(place).collect(), ..mesh.clone() }
}

/// The vertices of a triangle.
pub fn corners(mesh: &MeshData, triangle: usize) -> [DVec3; 3] {
    mesh.triangles[triangle].map(|i| Vec3::from(mesh.positions[i as usize]).as_dvec3())
}

/// A ray from one point towards another.
pub fn towards(origin: DVec3, target: DVec3) -> Ray {
    Ray::new(origin, (target - origin).normalize())
}

/// All that can be asked about a ray.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Answer {
    /// Of the ray alone, and of the ray in a stream.
    pub hits: [Option<Hit>; 2],
    /// Whether anything is there, by the same two.
    pub any: [bool; 2],
}

impl Answer {
    /// Whether all ways to ask lead to the same.
    pub fn agrees(&self) -> bool {
        let [single, streamed] = self.hits;
        single == streamed && self.any == [single.is_some(); 2]
    }

    /// Whether something was met, however one asks.
    pub fn is_met(&self) -> bool {
        self.hits[0].is_some() && self.agrees()
    }

    /// Whether nothing was met, however one asks.
    pub fn is_missed(&self) -> bool {
        self.hits[0].is_none() && self.agrees()
    }

    /// For a replay.
    pub fn told(&self, ray: &Ray) -> String {
        format!("{}: {self:?}", bits(ray))
    }
}

/// Asks everything about all rays.
pub fn ask(scene: &Scene, rays: &[Ray]) -> Vec<Answer> {
    struct Asking<'r>(&'r [Ray]);
    impl Work for Asking<'_> {
        type Output = Vec<Answer>;

        #[inline(always)]
        fn run(self, scene: impl Tracer) -> Vec<Answer> {
            let single = |ray| Answer { hits: [scene.hit(ray), None], any: [scene.any(ray, |_, _| true), false] };
            let mut answers: Vec<Answer> = self.0.iter().map(single).collect();
            scene.hits(self.0, |ray, hit| answers[ray].hits[1] = hit);
            scene.any_of(self.0, |_| None, |_, _, _| true, |ray, is_met| answers[ray].any[1] = is_met);
            answers
        }
    }
    scene.run(Asking(rays))
}

/// How often each ray crosses anything: alone, and in a stream.
pub fn crossings(scene: &Scene, rays: &[Ray]) -> Vec<[u32; 2]> {
    struct Counting<'r>(&'r [Ray]);
    impl Work for Counting<'_> {
        type Output = Vec<[u32; 2]>;

        #[inline(always)]
        fn run(self, scene: impl Tracer) -> Vec<[u32; 2]> {
            let mut counts = vec![[0; 2]; self.0.len()];
            for (ray, count) in self.0.iter().zip(&mut counts) {
                scene.any(ray, |_, _| {
                    count[0] += 1;
                    false
                });
            }
            let count = |ray: usize, _: u32, _: &_| {
                counts[ray][1] += 1;
                false
            };
            scene.any_of(self.0, |_| None, count, |_, _| {});
            counts
        }
    }
    scene.run(Counting(rays))
}
