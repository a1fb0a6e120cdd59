//! Which surfaces of a scene shine.

use glam::{DMat3, DVec2, DVec3};

use super::geometry::{Geometry, LocalShape, Mesh, Transform};
use crate::{
    light::{Area, Emitter},
    material::{Emission, Material, rgb},
    shape::{Cuboid, Disc, Other, Rectangle, Sphere},
    texture::Texture,
};

/// All surfaces that shine and whose points can be chosen at random, and how many objects shine of which that is not so: rays have to find those by themselves.
pub fn emitters(geometry: &Geometry, materials: &[Material], textures: &[Texture]) -> (Vec<Emitter>, usize) {
    let mut found = Found { materials, emitters: Vec::new(), left_out: 0 };
    geometry.spheres.iter().for_each(|s| found.sphere(s.material, s.object, s.shape));
    geometry.discs.iter().for_each(|d| found.disc(d.material, d.object, d.shape));
    geometry.cuboids.iter().for_each(|c| found.cuboid(c.material, c.object, &c.shape, None));
    geometry.others.iter().for_each(|other| match &other.shape {
        Other::Rectangle(rectangle) => found.rectangle(other.material, other.object, rectangle, None),
        Other::Cone(_) => found.none(other.material),
    });
    for placed in &geometry.transformed {
        let (material, object, transform) = (placed.material, placed.object, &placed.shape.transform);
        match &placed.shape.shape {
            LocalShape::Sphere(sphere) => match even_scale(transform) {
                Some(scale) => {
                    let center = transform.to_world.transform_point3(sphere.center);
                    found.sphere(material, object, Sphere { center, radius: sphere.radius * scale });
                }
                None => found.none(material),
            },
            LocalShape::Disc(disc) => match even_scale(transform) {
                Some(scale) => {
                    let center = transform.to_world.transform_point3(disc.center);
                    found.disc(material, object, Disc { center, normal: transform.normal(disc.normal), radius: disc.radius * scale });
                }
                None => found.none(material),
            },
            LocalShape::Cuboid(cuboid) => found.cuboid(material, object, cuboid, Some(transform)),
            LocalShape::Other(Other::Rectangle(rectangle)) => found.rectangle(material, object, rectangle, Some(transform)),
            LocalShape::Other(Other::Cone(_)) => found.none(material),
        }
    }
    for placed in &geometry.instances {
        let Some(emission) = materials[placed.material as usize].emission.filter(|emission| emission.is_light) else { continue };
        let mesh = &geometry.meshes[placed.shape.mesh as usize];
        let transform = &placed.shape.transform;
        for triangle in 0..mesh.triangles.count() as u32 {
            let [a, b, c] = mesh.triangles.vertices(triangle).map(|p| transform.to_world.transform_point3(p));
            let area = Area::Triangle { corner: a, edges: [b - a, c - a] };
            let radiance = match emission.texture {
                Some(texture) => emission.radiance * mean(&textures[texture as usize], mesh, triangle),
                None => emission.radiance,
            };
            found.add_of(placed.material, radiance, area, is_mirrored(transform), placed.object, triangle);
        }
    }
    (found.emitters, found.left_out)
}

struct Found<'a> {
    materials: &'a [Material],
    emitters: Vec<Emitter>,
    left_out: usize,
}

impl Found<'_> {
    fn none(&mut self, material: u32) {
        self.left_out += usize::from(self.materials[material as usize].emission.is_some());
    }

    fn sphere(&mut self, material: u32, object: u32, sphere: Sphere) {
        self.add(material, Area::Sphere(sphere), false, object, 0);
    }

    fn disc(&mut self, material: u32, object: u32, disc: Disc) {
        self.add(material, Area::Disc(disc), false, object, 0);
    }

    fn rectangle(&mut self, material: u32, object: u32, rectangle: &Rectangle, transform: Option<&Transform>) {
        let (corner, edges) = (rectangle.corner(), rectangle.edges());
        self.parallelogram(material, corner, edges, transform, object, 0);
    }

    fn cuboid(&mut self, material: u32, object: u32, cuboid: &Cuboid, transform: Option<&Transform>) {
        if self.materials[material as usize].emission.is_none() {
            return;
        }
        let size = cuboid.max - cuboid.min;
        for face in 0..6 {
            let axis = face as usize / 2;
            let mut edges = [DVec3::ZERO; 2];
            // In this order their product points along the axis; the lower face looks the other way.
            let (u, v) = if face % 2 == 1 { ((axis + 1) % 3, (axis + 2) % 3) } else { ((axis + 2) % 3, (axis + 1) % 3) };
            (edges[0][u], edges[1][v]) = (size[u], size[v]);
            let mut corner = cuboid.min;
            corner[axis] = if face % 2 == 1 { cuboid.max[axis] } else { cuboid.min[axis] };
            self.parallelogram(material, corner, edges, transform, object, face);
        }
    }

    fn parallelogram(&mut self, material: u32, corner: DVec3, edges: [DVec3; 2], to_world: Option<&Transform>, object: u32, part: u32) {
        let (corner, [u, v], mirrored) = match to_world {
            Some(transform) => {
                let edges = edges.map(|edge| transform.to_world.transform_vector3(edge));
                (transform.to_world.transform_point3(corner), edges, is_mirrored(transform))
            }
            None => (corner, edges, false),
        };
        self.add(material, Area::Parallelogram { corner, edges: [u, v] }, mirrored, object, part);
    }

    fn add(&mut self, material: u32, area: Area, mirrored: bool, object: u32, part: u32) {
        if let Some(Emission { radiance, .. }) = self.materials[material as usize].emission {
            self.add_of(material, radiance, area, mirrored, object, part);
        }
    }

    /// The same with a mean radiance of its own.
    fn add_of(&mut self, material: u32, radiance: DVec3, area: Area, mirrored: bool, object: u32, part: u32) {
        let material = &self.materials[material as usize];
        let Some(Emission { texture, two_sided, is_light: true, .. }) = material.emission else { return };
        let Some(emitter) = Emitter::new(area, radiance, two_sided, object, part) else { return };
        let mut emitter = if mirrored { emitter.turned() } else { emitter };
        emitter.textured = texture.is_some() || material.is_masked() || !material.double_sided;
        self.emitters.push(emitter);
    }
}

/// About the mean colour of a texture on a triangle: of the middles of 16 smaller triangles. Where it is black, only rays that go there by chance find what
/// light there may be.
fn mean(texture: &Texture, mesh: &Mesh, triangle: u32) -> DVec3 {
    const STEPS: u32 = 4;
    let corners = mesh.triangles.indices(triangle).map(|vertex| mesh.uvs_of(vertex));
    let at = |weights: [f64; 3]| -> [DVec2; 2] {
        std::array::from_fn(|set| corners[0][set] * weights[0] + corners[1][set] * weights[1] + corners[2][set] * weights[2])
    };
    let mut sum = DVec3::ZERO;
    for row in 0..STEPS {
        // Triangles that stand upright, and those between that stand on their head.
        for column in 0..2 * (STEPS - row) - 1 {
            let shift = if column % 2 == 0 { 1.0 / 3.0 } else { 2.0 / 3.0 };
            let (b, c) = ((f64::from(column / 2) + shift) / f64::from(STEPS), (f64::from(row) + shift) / f64::from(STEPS));
            let [r, g, b, _] = texture.at(at([1.0 - b - c, b, c]).into());
            sum += rgb([r, g, b]);
        }
    }
    sum / f64::from(STEPS * STEPS)
}

/// Whether it turns what is left into what is right: edges then span a normal on the other side than that of the surface.
fn is_mirrored(transform: &Transform) -> bool {
    transform.to_world.matrix3.determinant() < 0.0
}

/// The scale of a map that turns, moves and scales the same in all directions, as near as rounding can tell.
fn even_scale(transform: &Transform) -> Option<f64> {
    let DMat3 { x_axis, y_axis, z_axis } = transform.to_world.matrix3;
    let squared = x_axis.length_squared();
    let close = |a: f64, b: f64| (a - b).abs() <= 1e-12 * squared;
    let is_even = close(y_axis.length_squared(), squared)
        && close(z_axis.length_squared(), squared)
        && [x_axis.dot(y_axis), y_axis.dot(z_axis), z_axis.dot(x_axis)].into_iter().all(|dot| close(dot, 0.0));
    is_even.then(|| squared.sqrt())
}
