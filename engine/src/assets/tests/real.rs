//! Models that others made: looked for in the folder that `TESSERA_MODELS` names, skipped where it is not set.

use std::path::Path;

use glam::DVec3;

use super::check_promises;
use crate::{
    assets::{LoadedModel, load, model_format, model_references, part_references},
    description::{MemoryAssets, Model},
};

/// Collects a model and its parts as a client does.
pub fn collect(file: &Path) -> (Model, MemoryAssets) {
    let mut assets = MemoryAssets::default();
    let bytes = std::fs::read(file).unwrap();
    let format = model_format(file.to_str().unwrap()).unwrap();
    let mut names = model_references(format, &bytes).unwrap();
    let mut parts = Vec::new();
    while let Some(name) = names.pop() {
        let bytes = std::fs::read(file.with_file_name(&name)).unwrap();
        names.extend(part_references(&name, &bytes).unwrap());
        parts.push((name, assets.insert(bytes)));
    }
    parts.sort();
    (Model { format, file: assets.insert(bytes), parts }, assets)
}

fn bounds(model: &LoadedModel) -> [DVec3; 2] {
    let mut bounds = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    for instance in &model.instances {
        for &position in &model.meshes[instance.mesh].positions {
            let point = instance.transform.transform_point3(DVec3::from_array(position.map(f64::from)));
            bounds = [bounds[0].min(point), bounds[1].max(point)];
        }
    }
    bounds
}

fn triangles(model: &LoadedModel) -> usize {
    model.instances.iter().map(|instance| model.meshes[instance.mesh].triangles.len()).sum()
}

/// Triangles of well-known models, as another reader of theirs counts them; without those that name a vertex twice, of which the engine has 11,154.
const KNOWN: [(&str, usize); 6] = [
    ("2CylinderEngine.glb", 121_496 - 11_154),
    ("BoxTextured.glb", 12),
    ("CesiumMilkTruck.glb", 3624),
    ("Duck.glb", 4212),
    ("stanford-bunny.obj", 69_451),
    ("teapot.obj", 6320),
];

#[test]
fn models_that_others_made() {
    let Ok(folder) = std::env::var("TESSERA_MODELS") else {
        println!("skipped: TESSERA_MODELS names no folder of models");
        return;
    };
    for entry in std::fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if model_format(path.to_str().unwrap()).is_none() {
            continue;
        }
        let (model, assets) = collect(&path);
        let loaded = load(&model, &assets).unwrap_or_else(|error| panic!("{}: {error}", path.display()));
        check_promises(&loaded);
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        println!(
            "{name}: {} meshes, {} instances, {} triangles, {} materials, {} textures, {:?}, {:?}",
            loaded.meshes.len(),
            loaded.instances.len(),
            triangles(&loaded),
            loaded.materials.len(),
            loaded.textures.len(),
            bounds(&loaded),
            loaded.warnings
        );
        if let Some((_, known)) = KNOWN.iter().find(|(known, _)| *known == name) {
            assert_eq!(triangles(&loaded), *known, "{name}");
        }
    }
}
