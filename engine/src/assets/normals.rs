//! Vertex normals: those of files made unit, and those that files leave out.

use std::collections::HashMap;

use glam::DVec3;

use super::Mesh;

/// Cosine of the angle between two triangles beyond which an edge stays sharp: 60 degrees, and a hair more for hexagonal prisms.
const CREASE: f64 = 0.499;

/// Triangles around a point up to which sharp edges are looked for, in time that grows with their square; beyond, the point is smooth.
const MAX_AROUND: usize = 1024;

/// How a triangle joins its neighbours where a file gives no normals.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Smoothing {
    /// Smoothly, except over edges sharper than 60 degrees.
    Auto,
    /// Not at all.
    Flat,
    /// Smoothly with triangles of the same group.
    Group(u32),
}

/// Makes the normals of a mesh unit. Those without direction become their vertex's mean triangle normal; returns how many these were.
pub(super) fn normalize(mesh: &mut Mesh) -> usize {
    let mut bad = 0;
    for normal in &mut mesh.normals {
        *normal = unit(DVec3::from_array(normal.map(f64::from))).unwrap_or_else(|| {
            bad += 1;
            [0.0; 3]
        });
    }
    if bad > 0 {
        let mut sums = vec![DVec3::ZERO; mesh.positions.len()];
        for triangle in &mesh.triangles {
            let area = area(triangle.map(|index| mesh.positions[index as usize]));
            triangle.iter().for_each(|&index| sums[index as usize] += area);
        }
        for (normal, sum) in mesh.normals.iter_mut().zip(sums).filter(|(normal, _)| **normal == [0.0; 3]) {
            *normal = unit(sum).unwrap_or([0.0, 0.0, 1.0]);
        }
    }
    bad
}

/// A normal for every corner of every triangle: the mean of its neighbours around the point, weighted by area, as far as `smoothing` (one
/// a triangle) lets them join. Vertices at the same place are one point, whatever their numbers.
pub(super) fn generate(positions: &[[f32; 3]], triangles: &[[u32; 3]], smoothing: &[Smoothing]) -> Vec<[[f32; 3]; 3]> {
    let points = weld(positions);
    let areas: Vec<DVec3> = triangles.iter().map(|triangle| area(triangle.map(|index| positions[index as usize]))).collect();
    let sides: Vec<DVec3> = areas.iter().map(|area| area.normalize_or_zero()).collect();
    let around = Around::new(&points, triangles);
    let join = |a: usize, b: usize, crowd: usize| match (smoothing[a], smoothing[b]) {
        // A triangle without area has no side that an edge could be sharp against.
        (Smoothing::Auto, Smoothing::Auto) => crowd > MAX_AROUND || sides[a] == DVec3::ZERO || sides[a].dot(sides[b]) >= CREASE,
        (Smoothing::Group(a), Smoothing::Group(b)) => a == b,
        _ => false,
    };
    let mut sums: HashMap<u32, [f32; 3]> = HashMap::new();
    let mut corner = |triangle: usize, index: u32| {
        let point = points[index as usize];
        let neighbours = around.triangles(point);
        let crowd = neighbours.len();
        let sum =
            |sum: DVec3, &neighbour: &u32| if join(triangle, neighbour as usize, crowd) { sum + areas[neighbour as usize] } else { sum };
        let normal = || neighbours.iter().fold(DVec3::ZERO, sum);
        match smoothing[triangle] {
            // In a crowd all join: one sum will do, or a fan of n triangles would take n * n steps.
            Smoothing::Auto if crowd > MAX_AROUND => *sums.entry(point).or_insert_with(|| unit(normal()).unwrap_or([0.0, 0.0, 1.0])),
            Smoothing::Flat => unit(areas[triangle]).unwrap_or([0.0, 0.0, 1.0]),
            _ => unit(normal()).or_else(|| unit(areas[triangle])).unwrap_or([0.0, 0.0, 1.0]),
        }
    };
    triangles.iter().enumerate().map(|(number, triangle)| triangle.map(|index| corner(number, index))).collect()
}

/// Half the cross product of two edges: the triangle's area along its normal (up to a factor that is the same for all).
fn area(corners: [[f32; 3]; 3]) -> DVec3 {
    let [a, b, c] = corners.map(|corner| DVec3::from_array(corner.map(f64::from)));
    (b - a).cross(c - a)
}

/// A vector of length 1; `None` for one that has no direction.
pub(super) fn unit(v: DVec3) -> Option<[f32; 3]> {
    let length = v.length();
    (length > 0.0 && length.is_finite()).then(|| (v / length).to_array().map(|x| x as f32))
}

/// The number of the point of every vertex.
fn weld(positions: &[[f32; 3]]) -> Vec<u32> {
    let mut points = HashMap::with_capacity(positions.len());
    // Adding 0 makes the two zeros one.
    let key = |position: &[f32; 3]| position.map(|x| (x + 0.0).to_bits());
    positions.iter().zip(0..).map(|(position, vertex)| *points.entry(key(position)).or_insert(vertex)).collect()
}

/// The triangles around every point, in their order.
struct Around {
    starts: Vec<u32>,
    triangles: Vec<u32>,
}

impl Around {
    fn new(points: &[u32], triangles: &[[u32; 3]]) -> Self {
        let mut starts = vec![0u32; points.len() + 1];
        let corners =
            || triangles.iter().zip(0u32..).flat_map(|(triangle, number)| triangle.map(|index| (points[index as usize] as usize, number)));
        corners().for_each(|(point, _)| starts[point + 1] += 1);
        (0..points.len()).for_each(|point| starts[point + 1] += starts[point]);
        let mut ends = starts.clone();
        let mut list = vec![0; 3 * triangles.len()];
        for (point, number) in corners() {
            list[ends[point] as usize] = number;
            ends[point] += 1;
        }
        Self { starts, triangles: list }
    }

    fn triangles(&self, point: u32) -> &[u32] {
        let point = point as usize;
        &self.triangles[self.starts[point] as usize..self.starts[point + 1] as usize]
    }
}
