//! What cannot be compiled names its object.

use super::*;
use crate::scene::CompileError;

const HERE: SourceId = SourceId(42);

fn error_of(object: Object) -> CompileError {
    let object = Object { source: HERE, ..object };
    Scene::compile(&frame(vec![sphere(DVec3::ZERO, 1.0, 0), object]), &MemoryAssets::default()).unwrap_err()
}

fn message_of(object: Object) -> String {
    let error = error_of(object);
    assert_eq!(error.source, HERE, "{error}");
    error.message
}

fn placed(rows: Matrix) -> Object {
    Object { transform: Some(rows), ..sphere(DVec3::ZERO, 1.0, 0) }
}

#[test]
fn transforms_that_flatten_or_are_not_numbers_name_the_object() {
    let flat = message_of(placed([[1.0, 0.0, 0.0, 0.0], [0.0, 0.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]));
    assert_eq!(flat, "the object's transform cannot be inverted: it flattens the object");
    let nan = message_of(placed([[1.0, 0.0, 0.0, f64::NAN], [0.0, 1.0, 0.0, 0.0], [0.0, 0.0, 1.0, 0.0]]));
    assert_eq!(nan, "the object's transform is not finite");
    assert!(error_of(placed([[0.0; 4]; 3])).help.is_some());
}

#[test]
fn impossible_shapes_name_the_object() {
    assert_eq!(message_of(sphere(DVec3::ZERO, 0.0, 0)), "the sphere's radius must be above 0, not 0");
    assert_eq!(message_of(sphere(DVec3::ZERO, f64::NAN, 0)), "the sphere's radius must be above 0, not NaN");
    assert_eq!(message_of(sphere(DVec3::new(0.0, f64::INFINITY, 0.0), 1.0, 0)), "the sphere's center is not finite");
    assert_eq!(message_of(shape(Shape::Plane { point: [0.0; 3], normal: [0.0; 3] }, 0)), "the plane's normal is 0");
    assert_eq!(
        message_of(shape(Shape::Box { min: [0.0; 3], max: [1.0, 0.0, 1.0] }, 0)),
        "the box's max must be above its min in every coordinate"
    );
    assert_eq!(
        message_of(shape(Shape::Disc { center: [0.0; 3], normal: [0.0, 1.0, 0.0], radius: -1.0 }, 0)),
        "the disc's radius must be above 0, not -1"
    );
    let rectangle = |edge_u, edge_v| message_of(shape(Shape::Rectangle { corner: [1.0; 3], edge_u, edge_v }, 0));
    assert_eq!(rectangle([0.0; 3], [0.0, 1.0, 0.0]), "the rectangle's edge_u is 0");
    assert_eq!(rectangle([1.0, 0.0, 0.0], [f64::NAN; 3]), "the rectangle's edge_v is not finite");
    assert_eq!(rectangle([0.1, 0.2, 0.3], [0.1 * 3.0, 0.2 * 3.0, 0.3 * 3.0]), "the rectangle's edge_u and edge_v are parallel");
    let cylinder = |to, radius| message_of(shape(Shape::Cylinder { from: [0.0, 1.0, 0.0], to, radius, capped: true }, 0));
    assert_eq!(cylinder([0.0; 3], f64::NAN), "the cylinder's radius must be above 0, not NaN");
    assert_eq!(cylinder([0.0, 1.0, 0.0], 1.0), "the cylinder's from and to are the same point");
    assert_eq!(cylinder([0.0, f64::INFINITY, 0.0], 1.0), "the cylinder's to is not finite");
    let long = Shape::Cylinder { from: [-1e308; 3], to: [1e308; 3], radius: 1.0, capped: true };
    assert_eq!(message_of(shape(long, 0)), "the cylinder's length is not finite");
    assert_eq!(cylinder([0.0, 1e80, 0.0], 1.0), "the object reaches farther than 1e75 from the middle of the world");
    let cone = |radius, to_radius| message_of(shape(Shape::Cone { from: [0.0; 3], to: [1.0; 3], radius, to_radius, capped: true }, 0));
    assert_eq!(cone(-1.0, 0.0), "the cone's radius and to_radius must be 0 or above, and not both 0: they are -1 and 0");
    assert_eq!(cone(0.0, 0.0), "the cone's radius and to_radius must be 0 or above, and not both 0: they are 0 and 0");
    assert_eq!(cone(1.0, f64::INFINITY), "the cone's radius and to_radius must be 0 or above, and not both 0: they are 1 and inf");
    assert_eq!(message_of(sphere(DVec3::ZERO, 1.0, 17)), "material 17 does not exist");
}

#[test]
fn missing_damaged_and_wrong_meshes_name_the_object() {
    let compile_mesh = |bytes: Vec<u8>| {
        let mut assets = MemoryAssets::default();
        let data = assets.insert(bytes);
        let object = Object { source: HERE, ..shape(Shape::Mesh { data }, 0) };
        let error = Scene::compile(&frame(vec![object]), &assets).unwrap_err();
        assert_eq!(error.source, HERE);
        error.message
    };
    let coded = |mesh: &MeshData| postcard::to_stdvec(mesh).unwrap();
    let good = ball(4, 4, 0.0);
    let mut bytes = coded(&good);
    bytes.truncate(20);
    assert!(compile_mesh(bytes).starts_with("the mesh's data is damaged"));
    let mut beyond = good.clone();
    beyond.triangles[3][1] = 99;
    assert_eq!(compile_mesh(coded(&beyond)), "triangle 4 of the mesh names a vertex beyond the 14 that there are");
    let mut nan = good.clone();
    nan.positions[2][0] = f32::NAN;
    assert_eq!(compile_mesh(coded(&nan)), "position 3 of the mesh is not finite");
    let few = MeshData { normals: vec![[0.0, 1.0, 0.0]], ..good };
    assert_eq!(compile_mesh(coded(&few)), "the mesh has 1 normals for 14 vertices");
    assert_eq!(compile_mesh(coded(&MeshData::default())), "the mesh has no triangles");
    let absent = message_of(shape(Shape::Mesh { data: crate::description::AssetId([7; 32]) }, 0));
    assert!(absent.starts_with("the mesh's data (0707"), "{absent}");
}

#[test]
fn groups_that_show_themselves_are_refused() {
    let cycle = Object { kind: ObjectKind::Instance { group: 0 }, ..sphere(DVec3::ZERO, 1.0, 0) };
    assert_eq!(message_of(cycle), "an instance shows a group that does not stand before its own");
}

/// Forty groups, each of which shows the one before it twice, come to 2^40 times the first.
#[test]
fn groups_that_multiply_beyond_all_bounds_are_refused_before_they_are_unfolded() {
    let doubled = |first: Vec<Object>| {
        let mut frame = frame(vec![]);
        frame.scene.groups = vec![Group { objects: first }];
        for group in 0..40 {
            let twice = Object { kind: ObjectKind::Instance { group }, source: HERE, ..sphere(DVec3::ZERO, 1.0, 0) };
            frame.scene.groups.push(Group { objects: vec![twice.clone(), twice] });
        }
        frame.scene.root = 40;
        Scene::compile(&frame, &MemoryAssets::default()).map(|scene| scene.bounds())
    };
    let error = doubled(vec![sphere(DVec3::ZERO, 1.0, 0)]).unwrap_err();
    assert!(error.message.contains("objects once its groups are unfolded"), "{error}");
    assert_eq!(error.source, HERE);
    assert_eq!(doubled(vec![]).unwrap(), None);
}

#[test]
fn films_and_cameras_are_checked() {
    let mut empty = frame(vec![]);
    empty.film.width = 0;
    let error = Scene::compile(&empty, &MemoryAssets::default()).unwrap_err();
    assert_eq!(error.message, "the film is 0 x 768 pixels; each side must be 1 to 65536");
    let mut blind = frame(vec![]);
    blind.camera = Camera::pinhole([0.0; 3], [0.0; 3], [0.0, 1.0, 0.0], 40.0);
    let error = Scene::compile(&blind, &MemoryAssets::default()).unwrap_err();
    assert_eq!(error.message, "the camera's look_at must differ from its eye");
}

#[test]
fn an_empty_scene_is_a_scene() {
    let scene = compile(vec![]);
    let ray = scene.camera.ray(512.0, 384.0, DVec2::ZERO);
    assert_eq!(scene.closest(&ray), None);
    assert!(!scene.any(&ray, |_, _| true));
    assert_eq!(scene.bounds(), None);
}
