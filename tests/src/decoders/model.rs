//! Models: glTF, OBJ with MTL, PLY.

use tessera_engine::{
    assets::{check_promises, load, model_references, part_references},
    description::{MemoryAssets, Model, ModelFormat},
};

/// A model of one triangle whose materials stand in `a.mtl`.
const WITH_MTL: &[u8] = b"mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1\nusemtl a\nf 1/1 2/1 3/1\n";

/// The smallest PNG: one white pixel.
pub(super) const PNG: &[u8] = include_bytes!("../../fuzz/seeds/image_png/white");

/// `.glb` or `.gltf`.
pub fn gltf(bytes: &[u8]) -> bool {
    read(ModelFormat::Gltf, bytes, b"")
}

/// `.obj`, beside which there are materials.
pub fn obj(bytes: &[u8]) -> bool {
    read(ModelFormat::Obj, bytes, b"newmtl a\nKd 1 0.5 0\nmap_Kd a.png\nd 0.5\nnewmtl b\nTr 0.25\n")
}

/// `.mtl`
pub fn mtl(bytes: &[u8]) -> bool {
    part_references("a.mtl", bytes).is_ok() & read(ModelFormat::Obj, WITH_MTL, bytes)
}

/// `.ply`
pub fn ply(bytes: &[u8]) -> bool {
    read(ModelFormat::Ply, bytes, b"")
}

/// Reads a model beside which there are `a.mtl` and `a.png`. What its file refers to stays in its folder.
fn read(format: ModelFormat, bytes: &[u8], mtl: &[u8]) -> bool {
    for name in model_references(format, bytes).into_iter().chain(part_references("a.mtl", mtl)).flatten() {
        assert!(!name.starts_with('/') && name.split('/').all(|step| step != ".."), "{name:?} leaves the model's folder");
    }
    let mut assets = MemoryAssets::default();
    let file = assets.insert(bytes.to_vec());
    let parts = [("a.mtl", mtl), ("a.png", PNG)].map(|(name, bytes)| (name.to_owned(), assets.insert(bytes.to_vec())));
    let model = load(&Model { format, file, parts: parts.into() }, &assets);
    model.inspect(check_promises).is_ok()
}
