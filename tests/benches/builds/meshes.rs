//! Meshes that builders of trees fear, each of about a given number of triangles.

use std::f32::consts::TAU;

use glam::Vec3;
use tessera_engine::description::MeshData;

/// What a mesh is called, and how it is made.
pub type Maker = (&'static str, fn(usize) -> MeshData);

/// What the others are compared with.
pub const BENIGN: Maker = ("waves", waves);

/// All meshes that are feared.
pub const FEARED: [Maker; 22] = [
    ("identical", |count| soup(count, |_, _| [Vec3::ZERO, Vec3::X, Vec3::Y])),
    ("points", |count| soup(count, |_, _| [Vec3::ONE; 3])),
    ("hundredfold", |count| soup(count, |i, _| triangle(&mut Numbers::new(i / 100), 0.01))),
    ("shells", |count| soup(count, |i, _| octant(i % 8, 1.0 + (i / 8) as f32 * 1e-3))),
    ("corner", |count| soup(count, |i, _| octant(0, 1.0 + i as f32 * 1e-3))),
    ("concentric", |count| soup(count, |i, _| [-Vec3::ONE, Vec3::ONE, Vec3::new(1.0, -1.0, 0.0)].map(|p| p * (1.0 + i as f32 * 1e-4)))),
    ("shrinking", |count| soup(count, |i, n| octant(i % 8, (-80.0 * i as f32 / n as f32).exp()))),
    ("nests", |count| soup(count, |i, _| octant(0, 1e-6 * (1 + i % 1000) as f32).map(|p| p + Numbers::new(i / 1000).point()))),
    ("slivers", |count| soup(count, |i, _| sliver(&mut Numbers::new(i), 1e-5))),
    ("bundle", |count| soup(count, |i, _| [Vec3::ZERO, Vec3::ONE, Vec3::ONE].map(|p| p + Numbers::new(i).point() * 0.01))),
    ("sheaf", |count| soup(count, |i, _| [Vec3::ZERO, Vec3::ONE, Vec3::ONE * 1.001].map(|p| p + Numbers::new(i).point() * 0.2))),
    ("fan", |count| soup(count, fan)),
    ("huge", |count| soup(count, |i, _| triangle(&mut Numbers::new(i), 1.0))),
    ("soup", |count| soup(count, |i, _| triangle(&mut Numbers::new(i), 0.01))),
    ("giant", |count| with(waves(count), 1)),
    ("giants", |count| with(waves(count), count / 20)),
    ("diagonals", |count| soup(count, |i, n| [Vec3::ZERO, Vec3::ONE, Vec3::ONE].map(|p| p + Vec3::X * (i as f32 / n as f32)))),
    ("extreme", |count| scaled(waves(count), |i| if i % 2 == 0 { 1e38 } else { 1e-38 })),
    ("denormal", |count| scaled(waves(count), |_| 1e-42)),
    ("far clusters", |count| soup(count, |i, _| triangle(&mut Numbers::new(i), 1e-3).map(|p| p + Vec3::X * 1e6 * (i % 2) as f32))),
    ("lines", |count| soup(count, line)),
    ("teapot in a stadium", |count| soup(count, stadium)),
];

/// A wavy square.
pub fn waves(count: usize) -> MeshData {
    let side = ((count / 2) as f64).sqrt().round() as u32;
    let place = |i: u32| i as f32 / side as f32;
    let height = |x: f32, y: f32| 0.1 * (9.0 * x).sin() * (7.0 * y).cos();
    let row = |j: u32| (0..=side).map(move |i| [place(i), place(j), height(place(i), place(j))]);
    let square = |i: u32, j: u32| {
        let (a, b) = (j * (side + 1) + i, (j + 1) * (side + 1) + i);
        [[a, a + 1, b + 1], [a, b + 1, b]]
    };
    MeshData {
        positions: (0..=side).flat_map(row).collect(),
        triangles: (0..side).flat_map(|j| (0..side).flat_map(move |i| square(i, j))).collect(),
        ..MeshData::default()
    }
}

/// Triangles that share no vertices; each is made of its number and of how many there are.
fn soup(count: usize, make: impl Fn(usize, usize) -> [Vec3; 3]) -> MeshData {
    MeshData {
        positions: (0..count).flat_map(|i| make(i, count)).map(Vec3::into).collect(),
        triangles: (0..count as u32).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect(),
        ..MeshData::default()
    }
}

/// A face of an octahedron.
fn octant(octant: usize, size: f32) -> [Vec3; 3] {
    let side = |bit: usize| if octant & bit == 0 { size } else { -size };
    [Vec3::X * side(1), Vec3::Y * side(2), Vec3::Z * side(4)]
}

fn triangle(numbers: &mut Numbers, size: f32) -> [Vec3; 3] {
    let middle = numbers.point();
    [(); 3].map(|()| middle + numbers.point() * size)
}

fn sliver(numbers: &mut Numbers, width: f32) -> [Vec3; 3] {
    let (from, along) = (numbers.point(), numbers.point() * 0.1);
    [from, from + along, from + along + numbers.point() * width]
}

/// A disc of long thin triangles about one corner, in a plane along no axis.
fn fan(i: usize, count: usize) -> [Vec3; 3] {
    let rim = |i: usize| {
        let (sin, cos) = (TAU * i as f32 / count as f32).sin_cos();
        Vec3::new(1.0, -1.0, 0.0) * cos + Vec3::new(1.0, 1.0, -2.0) * sin
    };
    [Vec3::ZERO, rim(i), rim(i + 1)]
}

/// Triangles of one plane, each twice as long as their distance, in rows.
fn line(i: usize, _: usize) -> [Vec3; 3] {
    let (x, y) = ((i % 1000) as f32, (i / 1000) as f32);
    [Vec3::new(x, y, 0.0), Vec3::new(x + 2.0, y, 0.0), Vec3::new(x + 1.0, y + 0.5, 0.0)]
}

/// A small ball of small triangles; every hundredth belongs to the stands.
fn stadium(i: usize, _: usize) -> [Vec3; 3] {
    let mut numbers = Numbers::new(i);
    let (radius, size) = if i.is_multiple_of(100) { (1e3, 100.0) } else { (1.0, 0.01) };
    let middle = numbers.point().normalize_or(Vec3::X) * radius;
    [(); 3].map(|()| middle + numbers.point() * size)
}

/// A mesh and some triangles that reach across it.
fn with(mut mesh: MeshData, giants: usize) -> MeshData {
    for i in 0..giants {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(triangle(&mut Numbers::new(i), 3.0).map(<[f32; 3]>::from));
        mesh.triangles.push([first, first + 1, first + 2]);
    }
    mesh
}

/// A mesh, each of its vertices scaled by a factor of its own.
fn scaled(mut mesh: MeshData, factor: impl Fn(usize) -> f32) -> MeshData {
    mesh.positions.iter_mut().enumerate().for_each(|(i, p)| *p = p.map(|x| x * factor(i)));
    mesh
}

/// Random numbers of a number (Steele et al., "Fast Splittable Pseudorandom Number Generators", 2014).
struct Numbers(u64);

impl Numbers {
    fn new(seed: usize) -> Self {
        Self(seed as u64)
    }

    /// In [-1, 1).
    fn unit(&mut self) -> f32 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let x = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let x = (x ^ (x >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((x ^ (x >> 31)) >> 40) as f32 / (1 << 23) as f32 - 1.0
    }

    fn point(&mut self) -> Vec3 {
        Vec3::new(self.unit(), self.unit(), self.unit())
    }
}
