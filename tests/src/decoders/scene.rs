//! What a node compiles: a frame's description and a script's mesh, both from whoever may submit.

use std::sync::atomic::AtomicBool;

use tessera_engine::{
    description::{AssetId, Frame, Group, MemoryAssets, MeshData, Model, ModelFormat, Object, ObjectKind, Render, Shape, SourceId},
    part::{Rect, SampleRange, render},
    scene::Scene,
};

use super::{model::PNG, wire::message};
use crate::s1;

/// A script's mesh that is there for frames that name it.
pub fn triangle() -> Vec<u8> {
    let corners = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    postcard::to_stdvec(&MeshData { positions: corners, triangles: vec![[0, 1, 2]], ..MeshData::default() }).unwrap()
}

/// An OBJ file that is there for frames that name it.
pub const OBJ: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// A frame's description.
pub fn frame(bytes: &[u8]) -> bool {
    message::<Frame>(bytes).is_some_and(|frame| compiles(&frame))
}

/// A mesh that a script made, before the camera.
pub fn mesh(bytes: &[u8]) -> bool {
    let data = AssetId::of(bytes);
    let object =
        Object { kind: ObjectKind::Shape { shape: Shape::Mesh { data }, material: 0 }, transform: None, source: SourceId::default() };
    let mut frame = s1::frame(8, 6);
    frame.scene.groups = vec![Group { objects: vec![object] }];
    frame.scene.root = 0;
    traces(&frame, &[bytes])
}

/// Compiles a frame, and renders a little of it where it compiles: the pixels are such as pictures may have.
pub(super) fn compiles(frame: &Frame) -> bool {
    traces(frame, &[&triangle(), OBJ, PNG])
}

fn traces(frame: &Frame, files: &[&[u8]]) -> bool {
    let mut assets = MemoryAssets::default();
    for file in files {
        assets.insert(file.to_vec());
    }
    let Ok(scene) = Scene::compile(frame, &assets) else { return false };
    if matches!(frame.render, Render::Whitted { max_depth: 9.., .. }) {
        return true; // it may take for ever, and the farm knows what to do with parts that do
    }
    let rect = Rect { x: frame.film.width / 2, y: frame.film.height / 2, width: 1, height: 1 };
    let part = render(&scene, rect, SampleRange { first: 0, count: 1 }, &AtomicBool::new(false)).expect("nobody cancels it");
    assert!(part.pixels.as_flattened().iter().all(|x| x.is_finite() && *x >= 0.0), "{:?}", part.pixels);
    true
}

/// A model of that OBJ file.
pub fn model() -> Model {
    Model { format: ModelFormat::Obj, file: AssetId::of(OBJ), parts: Vec::new() }
}
