//! Files made by hand, in code: what they say is known exactly.

mod damage;
pub(crate) mod glb;
mod gltf;
mod materials;
mod obj;
mod ply;
mod polygon;
mod real;

use std::io::Cursor;

use glam::DVec3;

use super::{AssetError, LoadedModel, check_promises, load};
use crate::description::{MemoryAssets, Model, ModelFormat};

/// Loads a model whose parts are given by name.
fn load_with(format: ModelFormat, file: &[u8], parts: &[(&str, &[u8])]) -> Result<LoadedModel, AssetError> {
    let mut assets = MemoryAssets::default();
    let file = assets.insert(file.to_vec());
    let parts = parts.iter().map(|(name, bytes)| ((*name).to_owned(), assets.insert(bytes.to_vec()))).collect();
    load(&Model { format, file, parts }, &assets)
}

/// The message and the way out, as a user meets them.
fn failure(result: Result<LoadedModel, AssetError>) -> String {
    let AssetError { message, help } = result.expect_err("an error is expected");
    help.map_or(message.clone(), |help| format!("{message}\n  help: {help}"))
}

/// Every triangle in model coordinates, each turned so that its lowest corner comes first, all in order: independent of how a file numbers them.
fn triangles(model: &LoadedModel) -> Vec<[[f64; 3]; 3]> {
    let mut triangles = Vec::new();
    for instance in &model.instances {
        let mesh = &model.meshes[instance.mesh];
        for triangle in &mesh.triangles {
            let place = |index: u32| instance.transform.transform_point3(DVec3::from_array(mesh.positions[index as usize].map(f64::from)));
            let mut corners = triangle.map(|index| place(index).to_array());
            let lowest = (0..3).min_by(|&a, &b| corners[a].partial_cmp(&corners[b]).unwrap()).unwrap();
            corners.rotate_left(lowest);
            triangles.push(corners);
        }
    }
    triangles.sort_by(|a, b| a.partial_cmp(b).unwrap());
    triangles
}

/// A PNG of 2 x 2 pixels: red, green, blue, and white that is half transparent.
fn small_png() -> Vec<u8> {
    let pixels = vec![255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255, 255, 255, 255, 128];
    let image = image::RgbaImage::from_raw(2, 2, pixels).unwrap();
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// The corners of a unit cube at the origin and its six faces, counter-clockwise from outside.
const CUBE_CORNERS: [[f32; 3]; 8] =
    [[0., 0., 0.], [1., 0., 0.], [1., 1., 0.], [0., 1., 0.], [0., 0., 1.], [1., 0., 1.], [1., 1., 1.], [0., 1., 1.]];
const CUBE_FACES: [[u32; 4]; 6] = [[0, 3, 2, 1], [4, 5, 6, 7], [0, 1, 5, 4], [2, 3, 7, 6], [1, 2, 6, 5], [0, 4, 7, 3]];

/// The cube's triangles: each face as a fan.
fn cube_triangles() -> Vec<[u32; 3]> {
    CUBE_FACES.iter().flat_map(|&[a, b, c, d]| [[a, b, c], [a, c, d]]).collect()
}
