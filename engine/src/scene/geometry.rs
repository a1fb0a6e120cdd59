//! All shapes of a scene, in tables by kind, and the tree over them.

use glam::{DAffine3, DMat3, DVec2, DVec3, Vec2, Vec3, Vec4};

use crate::{
    accel::{LeafRule, MOST_LISTED_SPHERES, MeshHit, Pencil, Simd, SphereList, Tree, Triangles},
    light::Light,
    math::{UNIT, max_abs},
    shape::{Bounds, Cuboid, Disc, Other, Plane, Ray, Sphere, triangle::geometric_normal},
    texture::Coordinates,
};

/// A shape in world coordinates.
#[derive(Clone, Copy, Debug)]
pub struct Placed<S> {
    pub shape: S,
    /// Place in the order of the scene: of equal distances, the lower wins.
    pub object: u32,
    pub material: u32,
}

/// An invertible affine map with what error bounds need.
#[derive(Clone, Copy, Debug)]
pub struct Transform {
    pub to_world: DAffine3,
    pub to_object: DAffine3,
}

/// A finite shape under a map that does not leave it the same kind of shape.
#[derive(Clone, Copy, Debug)]
pub enum LocalShape {
    Sphere(Sphere),
    Cuboid(Cuboid),
    Disc(Disc),
    Other(Other),
}

/// A transformed shape.
#[derive(Clone, Copy, Debug)]
pub struct Transformed {
    pub shape: LocalShape,
    pub transform: Transform,
}

/// A mesh at a place.
#[derive(Clone, Copy, Debug)]
pub struct Instance {
    pub mesh: u32,
    pub transform: Transform,
    /// Whether its place is one that only moves.
    pub moves: bool,
    /// Whether hits must be asked if the surface is there: it has an alpha mask, or no back.
    pub masked: bool,
}

/// Triangles and what they carry.
#[derive(Debug)]
pub struct Mesh {
    pub triangles: Triangles,
    /// For instances that do not stand in the tree of the world; `None` where there are none.
    pub tree: Option<Tree>,
    pub normals: Vec<[f32; 3]>,
    pub uvs: Vec<[f32; 2]>,
    pub second_uvs: Vec<[f32; 2]>,
    /// Unit tangents or 0, and the side of the bitangent.
    pub tangents: Vec<[f32; 4]>,
    pub colors: Vec<[f32; 4]>,
}

/// Which table a leaf of the world's tree refers to that is no pack of triangles; stands above the index in a reference.
pub mod kind {
    pub const SPHERE: u32 = 0;
    pub const CUBOID: u32 = 1;
    pub const DISC: u32 = 2;
    pub const TRANSFORMED: u32 = 3;
    pub const MESH: u32 = 4;
    /// Planes stand outside the tree.
    pub const PLANE: u32 = 5;
    pub const OTHER: u32 = 6;
    /// Bits of the index.
    pub const SHIFT: u32 = 27;
    pub const INDEX: u32 = (1 << SHIFT) - 1;
}

/// All shapes of a scene.
#[derive(Debug)]
pub struct Geometry {
    /// Where the world's origin is.
    pub origin: DVec3,
    pub planes: Vec<Placed<Plane>>,
    pub spheres: Vec<Placed<Sphere>>,
    pub cuboids: Vec<Placed<Cuboid>>,
    pub discs: Vec<Placed<Disc>>,
    pub others: Vec<Placed<Other>>,
    pub transformed: Vec<Placed<Transformed>>,
    pub instances: Vec<Placed<Instance>>,
    /// How many of these, the first, stand in the tree of the world triangle by triangle.
    pub grounded: usize,
    pub meshes: Vec<Mesh>,
    /// All spheres, where they are few: they stand outside the tree then.
    pub list: Option<SphereList>,
    /// Those spheres as the camera sees them.
    pub from_eye: Option<Pencil>,
    /// As each light sees those that may cast a shadow; `None` for a light without a place.
    pub from_lights: Vec<Option<Pencil>>,
    pub tree: Option<Tree>,
    pub bounds: Option<Bounds>,
    pub simd: Simd,
}

impl Geometry {
    /// Builds all trees, and prepares spheres, where they are few, for rays from the eye and towards lights. `is_clear` tells materials that cast no shadow.
    pub fn finish(&mut self, eye: Option<DVec3>, lights: &[Light], is_clear: impl Fn(u32) -> bool) {
        self.spheres.sort_by_key(|sphere| is_clear(sphere.material));
        let spheres: Vec<Sphere> = self.spheres.iter().map(|s| s.shape).collect();
        let few = !spheres.is_empty() && spheres.len() <= MOST_LISTED_SPHERES;
        self.list = few.then(|| SphereList::new(&spheres));
        self.from_eye = eye.filter(|_| few).map(|eye| Pencil::new(eye, &spheres));
        let blockers = &spheres[..self.spheres.partition_point(|sphere| !is_clear(sphere.material))];
        self.from_lights = lights.iter().map(|light| light.position().filter(|_| few).map(|place| Pencil::new(place, blockers))).collect();
        self.plant(LeafRule::MEASURED);
    }
}

impl LocalShape {
    /// The box around it.
    pub fn bounds(&self) -> Bounds {
        match self {
            Self::Sphere(shape) => shape.bounds(),
            Self::Cuboid(shape) => shape.bounds(),
            Self::Disc(shape) => shape.bounds(),
            Self::Other(shape) => shape.bounds(),
        }
    }
}

impl Instance {
    /// A ray in the mesh's coordinates, where there are no listed spheres; `t` keeps its meaning.
    #[inline(always)]
    pub fn of_ray(&self, ray: &Ray) -> Ray {
        let to_object = &self.transform.to_object;
        if self.moves {
            // The same bits.
            Ray { origin: ray.origin + to_object.translation, leaves: 0, ..*ray }
        } else {
            ray.transformed(to_object)
        }
    }
}

impl Transform {
    /// `None` if the map is not finite or cannot be inverted.
    pub fn new(to_world: DAffine3) -> Option<Self> {
        let to_object = to_world.inverse();
        let transform = Self { to_world, to_object };
        let usable = to_world.is_finite() && to_object.is_finite() && transform.growths().iter().all(|growth| *growth > 0.0);
        usable.then_some(transform)
    }

    /// Whether it neither turns nor scales.
    pub fn moves(&self) -> bool {
        self.to_world.matrix3 == DMat3::IDENTITY
    }

    /// Whether all that it does is to move the origin to a place.
    pub fn only_moves_to(&self, origin: DVec3) -> bool {
        self.moves() && self.to_world.translation == origin
    }

    /// Largest factors by which a vector's largest component grows on the way to the object, and back.
    #[inline(always)]
    pub fn growths(&self) -> [f64; 2] {
        [&self.to_object, &self.to_world].map(|map| {
            let DMat3 { x_axis, y_axis, z_axis } = map.matrix3;
            max_abs(x_axis.abs() + y_axis.abs() + z_axis.abs())
        })
    }

    /// The box around the image of a box.
    pub fn bounds(&self, bounds: Bounds) -> Bounds {
        Bounds::of(bounds.corners().map(|corner| self.to_world.transform_point3(corner)))
    }

    /// A box around the image of a mesh: that of its box, as far as images of the boxes in it reach, which are smaller by far where it is turned (Arvo, "Transforming
    /// Axis-Aligned Bounding Boxes", Graphics Gems, 1990).
    pub fn bounds_of(&self, mesh: &Mesh) -> Bounds {
        let whole = self.bounds(mesh.triangles.bounds());
        let DAffine3 { matrix3, translation } = self.to_world;
        let sizes = DMat3::from_cols(matrix3.x_axis.abs(), matrix3.y_axis.abs(), matrix3.z_axis.abs());
        let mut outline = Bounds::EMPTY;
        let add = |Bounds { min, max }: Bounds| {
            let (middle, reach) = (matrix3 * ((min + max) * 0.5) + translation, sizes * ((max - min) * 0.5));
            outline = outline.union(Bounds { min: middle - reach, max: middle + reach });
        };
        if let Some(tree) = &mesh.tree {
            tree.outline(add);
        }
        let is_empty = outline == Bounds::EMPTY;
        if is_empty { whole } else { Bounds { min: whole.min.max(outline.min), max: whole.max.min(outline.max) } }
    }

    /// A bound on the coordinates of the image of a box.
    pub fn reach(&self, bounds: Bounds) -> f64 {
        let [_, growth] = self.growths();
        growth * max_abs(bounds.min).max(max_abs(bounds.max)) + max_abs(self.to_world.translation)
    }

    /// A unit normal in the world (by the inverse transpose).
    #[inline]
    pub fn normal(&self, n: DVec3) -> DVec3 {
        (self.to_object.matrix3.transpose() * n).normalize()
    }

    /// Bound on the error of a point in the world that is wrong by `error` in the object's coordinates, and on what the way back into these
    /// coordinates adds when a ray starts there.
    #[inline]
    pub fn error(&self, error: f64, object: DVec3, world: DVec3) -> f64 {
        let [to_object, to_world] = self.growths();
        let back = to_object * max_abs(world) + max_abs(self.to_object.translation);
        16.0 * UNIT * (max_abs(world) + max_abs(self.to_world.translation) + to_world * (max_abs(object) + back)) + to_world * error
    }
}

/// A point of a mesh in the mesh's own coordinates.
pub struct MeshPoint {
    pub position: DVec3,
    pub error: f64,
    pub ng: DVec3,
    /// Interpolated normal of any length; `ng` where there is none.
    pub ns: DVec3,
}

impl Mesh {
    /// The surface at a hit.
    #[inline]
    pub fn point(&self, hit: &MeshHit) -> MeshPoint {
        let vertices = self.triangles.vertices(hit.triangle);
        let [a, b, c] = vertices;
        let weights = [1.0 - hit.at.b1 - hit.at.b2, hit.at.b1, hit.at.b2];
        let position = a * weights[0] + b * weights[1] + c * weights[2];
        let size = max_abs(a).max(max_abs(b)).max(max_abs(c));
        let ng = geometric_normal(vertices);
        let ns = if self.normals.is_empty() { ng } else { self.interpolate(hit, |i| Vec3::from(self.normals[i]).as_dvec3()) };
        MeshPoint { position, error: 16.0 * UNIT * size, ng, ns }
    }

    /// Both sets of texture coordinates at a hit; 0 where there are none.
    pub fn uvs_at(&self, hit: &MeshHit) -> [DVec2; 2] {
        [&self.uvs, &self.second_uvs].map(|uvs| match uvs.is_empty() {
            true => DVec2::ZERO,
            false => self.interpolate(hit, |i| Vec2::from(uvs[i]).as_dvec2()),
        })
    }

    /// Both sets of texture coordinates at a vertex; 0 where there are none.
    pub fn uvs_of(&self, vertex: usize) -> [DVec2; 2] {
        [&self.uvs, &self.second_uvs].map(|uvs| uvs.get(vertex).map_or(DVec2::ZERO, |uv| Vec2::from(*uv).as_dvec2()))
    }

    /// Along u of a texture with these coordinates, and to the upper side of its image, of any length; 0 where nothing tells them. Vertices have them,
    /// or else they are those of the triangle (Akenine-Moeller et al., "Real-Time Rendering", 4th ed., 16.3).
    pub fn tangents_at(&self, hit: &MeshHit, normal: DVec3, coordinates: &Coordinates) -> [DVec3; 2] {
        if !self.tangents.is_empty() {
            let tangent = self.interpolate(hit, |i| Vec4::from(self.tangents[i]).as_dvec4());
            if tangent.truncate() != DVec3::ZERO {
                return [tangent.truncate(), normal.cross(tangent.truncate()) * tangent.w];
            }
        }
        let [a, b, c] = self.triangles.vertices(hit.triangle);
        let [uv_a, uv_b, uv_c] = self.triangles.indices(hit.triangle).map(|i| coordinates.of(self.uvs_of(i)));
        let ([to_b, to_c], [uv_to_b, uv_to_c]) = ([b - a, c - a], [uv_b - uv_a, uv_c - uv_a]);
        // Of the determinant only the sign matters; v runs downwards.
        let determinant = uv_to_b.x * uv_to_c.y - uv_to_b.y * uv_to_c.x;
        let sign = if determinant == 0.0 { 0.0 } else { determinant.signum() };
        [(to_b * uv_to_c.y - to_c * uv_to_b.y) * sign, (to_b * uv_to_c.x - to_c * uv_to_b.x) * sign]
    }

    /// Colour and opacity at a hit; 1 where there are none.
    pub fn color(&self, hit: &MeshHit) -> [f32; 4] {
        if self.colors.is_empty() { [1.0; 4] } else { self.interpolate(hit, |i| Vec4::from(self.colors[i]).as_dvec4()).as_vec4().into() }
    }

    fn interpolate<V: std::ops::Add<Output = V> + std::ops::Mul<f64, Output = V>>(&self, hit: &MeshHit, at: impl Fn(usize) -> V) -> V {
        let [a, b, c] = self.triangles.indices(hit.triangle);
        at(a) * (1.0 - hit.at.b1 - hit.at.b2) + at(b) * hit.at.b1 + at(c) * hit.at.b2
    }

    /// Memory in bytes.
    pub fn bytes(&self) -> usize {
        let carried = size_of_val(&*self.normals)
            + size_of_val(&*self.uvs)
            + size_of_val(&*self.second_uvs)
            + size_of_val(&*self.tangents)
            + size_of_val(&*self.colors);
        self.triangles.bytes() + self.tree.as_ref().map_or(0, Tree::bytes) + carried
    }
}
