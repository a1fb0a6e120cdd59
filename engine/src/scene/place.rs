//! Objects at their places in the world: groups unfolded, transforms applied, meshes and models read once each.

use std::{collections::BTreeMap, rc::Rc};

use glam::{DAffine3, DMat3, DVec3};

use super::{
    error::{CompileError, Warning},
    geometry::{Geometry, Instance, LocalShape, Mesh, Placed, Transform, Transformed, kind},
    models::PlacedModel,
};
use crate::{
    accel::{Simd, Triangles},
    assets,
    description::{self, AssetId, AssetSource, GroupId, MaterialId, Matrix, MeshData, Model, Object, ObjectKind, Shape, SourceId},
    material::{Material, SharedTables},
    math::max_abs,
    shape::{Bounds, Cone, Cuboid, Disc, Other, Plane, Rectangle, Sphere},
    texture::Texture,
};

pub(super) type Result<T> = std::result::Result<T, CompileError>;

/// Largest coordinate of anything that is placed: squares of distances, and products of these, stay numbers.
pub(super) const FARTHEST: f64 = 1e75;

/// Deepest nesting of groups.
const DEEPEST: usize = 64;

/// Fills a scene's tables.
pub struct Placer<'a> {
    scene: &'a description::Scene,
    pub(super) assets: &'a dyn AssetSource,
    script_meshes: BTreeMap<AssetId, u32>,
    pub(super) models: Vec<(&'a Model, Rc<PlacedModel>)>,
    objects: u32,
    /// Objects of each group and of those within it: groups of groups come to more than time allows before memory ends.
    unfolded: Vec<u64>,
    /// The tables.
    pub materials: Vec<Material>,
    /// See `materials`.
    pub textures: Vec<Texture>,
    /// See `materials`.
    pub geometry: Geometry,
    /// The lights of models, in the scene's coordinates.
    pub lights: Vec<description::Light>,
    /// What a user should know.
    pub warnings: Vec<Warning>,
    /// What materials share; `None` for those to whom light is simple.
    pub(super) tables: Option<SharedTables>,
}

impl<'a> Placer<'a> {
    /// Begins with the description's own materials and textures; `origin` is where the world's is.
    pub fn new(
        scene: &'a description::Scene,
        origin: DVec3,
        assets: &'a dyn AssetSource,
        materials: Vec<Material>,
        textures: Vec<Texture>,
        tables: Option<SharedTables>,
    ) -> Self {
        let geometry = Geometry {
            origin,
            planes: Vec::new(),
            spheres: Vec::new(),
            cuboids: Vec::new(),
            discs: Vec::new(),
            others: Vec::new(),
            transformed: Vec::new(),
            instances: Vec::new(),
            grounded: 0,
            meshes: Vec::new(),
            list: None,
            from_eye: None,
            from_lights: Vec::new(),
            tree: None,
            bounds: None,
            simd: Simd::detect(),
        };
        Self {
            scene,
            assets,
            script_meshes: BTreeMap::new(),
            models: Vec::new(),
            objects: 0,
            unfolded: unfolded(scene),
            materials,
            textures,
            geometry,
            lights: Vec::new(),
            warnings: Vec::new(),
            tables,
        }
    }

    /// Places the world.
    pub fn place(mut self) -> Result<Self> {
        if self.scene.root as usize >= self.scene.groups.len() {
            return Err(CompileError::new(SourceId::default(), "the scene has no root group"));
        }
        self.group(self.scene.root, DAffine3::from_translation(self.geometry.origin), 0)?;
        self.geometry.ground();
        Ok(self)
    }

    fn group(&mut self, group: GroupId, place: DAffine3, depth: usize) -> Result<()> {
        let scene = self.scene;
        for object in &scene.groups[group as usize].objects {
            let to_world = match &object.transform {
                Some(matrix) => place * affine(matrix),
                None => place,
            };
            let transform = Transform::new(to_world).ok_or_else(|| not_invertible(object))?;
            self.object(group, object, transform, depth)?;
        }
        Ok(())
    }

    fn object(&mut self, group: GroupId, object: &'a Object, transform: Transform, depth: usize) -> Result<()> {
        match &object.kind {
            ObjectKind::Shape { shape, material } => {
                self.check_material(*material, object.source)?;
                self.shape(shape, *material, transform, object.source)
            }
            ObjectKind::Model { model, material } => {
                if let Some(material) = material {
                    self.check_material(*material, object.source)?;
                }
                self.model(model, *material, transform, object.source)
            }
            ObjectKind::Instance { group: inner } => {
                if *inner >= group {
                    return Err(CompileError::new(object.source, "an instance shows a group that does not stand before its own"));
                }
                if depth == DEEPEST {
                    return Err(CompileError::new(object.source, format!("groups are nested more than {DEEPEST} deep")));
                }
                match self.unfolded[*inner as usize] {
                    0 => Ok(()),
                    count if count > u64::from(kind::INDEX) => Err(too_many(object.source)),
                    _ => self.group(*inner, transform.to_world, depth + 1),
                }
            }
        }
    }

    fn check_material(&self, material: MaterialId, source: SourceId) -> Result<()> {
        let known = (material as usize) < self.scene.materials.len();
        if known { Ok(()) } else { Err(CompileError::new(source, format!("material {material} does not exist"))) }
    }

    fn shape(&mut self, shape: &Shape, material: MaterialId, transform: Transform, source: SourceId) -> Result<()> {
        let wrong = |message: &str| Err(CompileError::new(source, message));
        match *shape {
            Shape::Sphere { center, radius } => {
                let center = finite(center, "the sphere's center", source)?;
                if !(radius > 0.0 && radius.is_finite()) {
                    return wrong(&format!("the sphere's radius must be above 0, not {radius}"));
                }
                self.solid(LocalShape::Sphere(Sphere { center, radius }), material, transform, source)
            }
            Shape::Plane { point, normal } => {
                let point = finite(point, "the plane's point", source)?;
                check_reach(transform.reach(Bounds::of([point])), source)?;
                let plane = Plane::new(point, unit(normal, "the plane's normal", source)?);
                let object = self.next_object(source)?;
                let shape = plane.transformed(&transform.to_world, &transform.to_object);
                self.geometry.planes.push(Placed { shape, object, material });
                Ok(())
            }
            Shape::Box { min, max } => {
                let (min, max) = (finite(min, "the box's min", source)?, finite(max, "the box's max", source)?);
                if !min.cmplt(max).all() {
                    return wrong("the box's max must be above its min in every coordinate");
                }
                self.solid(LocalShape::Cuboid(Cuboid { min, max }), material, transform, source)
            }
            Shape::Disc { center, normal, radius } => {
                let center = finite(center, "the disc's center", source)?;
                let normal = unit(normal, "the disc's normal", source)?;
                if !(radius > 0.0 && radius.is_finite()) {
                    return wrong(&format!("the disc's radius must be above 0, not {radius}"));
                }
                self.solid(LocalShape::Disc(Disc { center, normal, radius }), material, transform, source)
            }
            Shape::Mesh { data } => {
                let mesh = match self.script_meshes.get(&data) {
                    Some(mesh) => *mesh,
                    None => {
                        let mesh = self.read_mesh(data, source)?;
                        self.script_meshes.insert(data, mesh);
                        mesh
                    }
                };
                self.instance(mesh, material, transform, source)
            }
            Shape::Rectangle { corner, edge_u, edge_v } => {
                self.solid(LocalShape::Other(Other::Rectangle(rectangle(corner, [edge_u, edge_v], source)?)), material, transform, source)
            }
            Shape::Cylinder { from, to, radius, capped } => {
                let cylinder = cylinder([from, to], radius, capped, source)?;
                self.solid(LocalShape::Other(Other::Cone(cylinder)), material, transform, source)
            }
            Shape::Cone { from, to, radius, to_radius, capped } => {
                let cone = cone("cone", [from, to], [radius, to_radius], capped, source)?;
                self.solid(LocalShape::Other(Other::Cone(cone)), material, transform, source)
            }
        }
    }

    /// A finite shape: moved and scaled evenly it stays what it is, else it keeps its transform.
    fn solid(&mut self, shape: LocalShape, material: u32, transform: Transform, source: SourceId) -> Result<()> {
        let object = self.next_object(source)?;
        check_reach(transform.reach(shape.bounds()), source)?;
        let DAffine3 { matrix3, translation } = transform.to_world;
        let scale = matrix3.x_axis.x;
        let geometry = &mut self.geometry;
        if !(scale > 0.0 && matrix3 == DMat3::from_diagonal(DVec3::splat(scale))) {
            geometry.transformed.push(Placed { shape: Transformed { shape, transform }, object, material });
            return Ok(());
        }
        let moved = |p: DVec3| p * scale + translation;
        match shape {
            LocalShape::Sphere(Sphere { center, radius }) => {
                geometry.spheres.push(Placed { shape: Sphere { center: moved(center), radius: radius * scale }, object, material });
            }
            LocalShape::Cuboid(Cuboid { min, max }) => {
                geometry.cuboids.push(Placed { shape: Cuboid { min: moved(min), max: moved(max) }, object, material });
            }
            LocalShape::Disc(Disc { center, normal, radius }) => {
                geometry.discs.push(Placed { shape: Disc { center: moved(center), normal, radius: radius * scale }, object, material });
            }
            LocalShape::Other(other) => {
                geometry.others.push(Placed { shape: other.moved(scale, translation), object, material });
            }
        }
        Ok(())
    }

    pub(super) fn instance(&mut self, mesh: u32, material: u32, transform: Transform, source: SourceId) -> Result<()> {
        let object = self.next_object(source)?;
        check_reach(transform.reach(self.geometry.meshes[mesh as usize].triangles.bounds()), source)?;
        let surface = &self.materials[material as usize];
        let masked = surface.is_masked() || !surface.double_sided;
        self.geometry.instances.push(Placed { shape: Instance { mesh, moves: transform.moves(), transform, masked }, object, material });
        Ok(())
    }

    fn read_mesh(&mut self, id: AssetId, source: SourceId) -> Result<u32> {
        let wrong = |message: String| CompileError::new(source, message);
        let bytes = self.assets.bytes(id).ok_or_else(|| wrong(format!("the mesh's data ({id}) is not here")))?;
        let data: MeshData = postcard::from_bytes(&bytes).map_err(|error| wrong(format!("the mesh's data is damaged: {error}")))?;
        check_mesh(&data).map_err(wrong)?;
        let MeshData { positions, triangles, normals, uvs } = data;
        Ok(self.add_mesh(assets::Mesh { positions, triangles, normals, uvs, ..assets::Mesh::default() }))
    }

    pub(super) fn add_mesh(&mut self, mesh: assets::Mesh) -> u32 {
        let assets::Mesh { positions, triangles, normals, uvs, second_uvs, tangents, colors, .. } = mesh;
        let triangles = Triangles::new(positions, triangles);
        self.geometry.meshes.push(Mesh { triangles, tree: None, normals, uvs, second_uvs, tangents, colors });
        self.geometry.meshes.len() as u32 - 1
    }

    fn next_object(&mut self, source: SourceId) -> Result<u32> {
        if self.objects == kind::INDEX {
            return Err(too_many(source));
        }
        self.objects += 1;
        Ok(self.objects - 1)
    }

    pub(super) fn warn(&mut self, source: SourceId, message: String) {
        let warning = Warning { source, message };
        if !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }
}

/// How many objects each group comes to, without those that stand in files.
fn unfolded(scene: &description::Scene) -> Vec<u64> {
    let mut counts: Vec<u64> = Vec::with_capacity(scene.groups.len());
    for group in &scene.groups {
        let count = |object: &Object| match object.kind {
            ObjectKind::Instance { group } => counts.get(group as usize).copied().unwrap_or(0),
            _ => 1,
        };
        counts.push(group.objects.iter().map(count).fold(0, u64::saturating_add));
    }
    counts
}

fn affine(rows: &Matrix) -> DAffine3 {
    let [x, y, z] = rows;
    let columns = DMat3::from_cols(DVec3::new(x[0], y[0], z[0]), DVec3::new(x[1], y[1], z[1]), DVec3::new(x[2], y[2], z[2]));
    DAffine3::from_mat3_translation(columns, DVec3::new(x[3], y[3], z[3]))
}

fn too_many(source: SourceId) -> CompileError {
    let error = CompileError::new(source, format!("the scene has more than {} objects once its groups are unfolded", kind::INDEX));
    error.with_help("join objects that never move apart into one mesh")
}

fn not_invertible(object: &Object) -> CompileError {
    let finite = object.transform.is_none_or(|rows| rows.iter().flatten().all(|x| x.is_finite()));
    let what =
        if finite { "the object's transform cannot be inverted: it flattens the object" } else { "the object's transform is not finite" };
    CompileError::new(object.source, what).with_help("check for a scale of 0, or for a division by 0")
}

fn check_reach(reach: f64, source: SourceId) -> Result<()> {
    if reach.is_nan() || reach > FARTHEST {
        return Err(CompileError::new(source, format!("the object reaches farther than {FARTHEST:e} from the middle of the world")));
    }
    Ok(())
}

fn finite(v: [f64; 3], what: &str, source: SourceId) -> Result<DVec3> {
    let v = DVec3::from(v);
    if v.is_finite() { Ok(v) } else { Err(CompileError::new(source, format!("{what} is not finite"))) }
}

/// A vector that has a direction.
fn direction(v: [f64; 3], what: &str, source: SourceId) -> Result<DVec3> {
    let v = finite(v, what, source)?;
    if v != DVec3::ZERO { Ok(v) } else { Err(CompileError::new(source, format!("{what} is 0"))) }
}

/// The same, made a unit vector.
fn unit(v: [f64; 3], what: &str, source: SourceId) -> Result<DVec3> {
    let v = direction(v, what, source)?;
    Ok((v / max_abs(v)).normalize())
}

fn rectangle(corner: [f64; 3], [u, v]: [[f64; 3]; 2], source: SourceId) -> Result<Rectangle> {
    let corner = finite(corner, "the rectangle's corner", source)?;
    let (u, v) = (direction(u, "the rectangle's edge_u", source)?, direction(v, "the rectangle's edge_v", source)?);
    Rectangle::new(corner, u, v).ok_or_else(|| CompileError::new(source, "the rectangle's edge_u and edge_v are parallel"))
}

fn cylinder(ends: [[f64; 3]; 2], radius: f64, capped: bool, source: SourceId) -> Result<Cone> {
    if !(radius > 0.0 && radius.is_finite()) {
        return Err(CompileError::new(source, format!("the cylinder's radius must be above 0, not {radius}")));
    }
    cone("cylinder", ends, [radius; 2], capped, source)
}

/// A cone, or a cylinder whose radius has been checked.
fn cone(what: &str, [from, to]: [[f64; 3]; 2], radii: [f64; 2], capped: bool, source: SourceId) -> Result<Cone> {
    let wrong = |message: String| CompileError::new(source, message);
    let (from, to) = (finite(from, &format!("the {what}'s from"), source)?, finite(to, &format!("the {what}'s to"), source)?);
    let between = std::array::from_fn(|i| to[i] - from[i]);
    finite(between, &format!("the {what}'s length"), source)?;
    let [radius, to_radius] = radii;
    if !(radii.iter().all(|radius| *radius >= 0.0 && radius.is_finite()) && radius + to_radius > 0.0) {
        let message = format!("the {what}'s radius and to_radius must be 0 or above, and not both 0: they are {radius} and {to_radius}");
        return Err(wrong(message));
    }
    Cone::new([from, to], radii, capped).ok_or_else(|| wrong(format!("the {what}'s from and to are the same point")))
}

fn check_mesh(data: &MeshData) -> std::result::Result<(), String> {
    let vertices = data.positions.len();
    if data.triangles.is_empty() {
        return Err("the mesh has no triangles".into());
    }
    if let Some(at) = data.positions.iter().position(|p| !p.iter().all(|x| x.is_finite())) {
        return Err(format!("position {} of the mesh is not finite", at + 1));
    }
    if let Some(at) = data.triangles.iter().position(|t| t.iter().any(|i| *i as usize >= vertices)) {
        return Err(format!("triangle {} of the mesh names a vertex beyond the {vertices} that there are", at + 1));
    }
    for (name, count) in [("normals", data.normals.len()), ("uvs", data.uvs.len())] {
        if count != 0 && count != vertices {
            return Err(format!("the mesh has {count} {name} for {vertices} vertices"));
        }
    }
    Ok(())
}
