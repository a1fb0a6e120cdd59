//! Models at their places: read once each, and shown as often as the scene says, with their lights.

use std::rc::Rc;

use glam::{DAffine3, DVec3};

use super::{
    error::CompileError,
    geometry::Transform,
    place::{Placer, Result},
};
use crate::{
    assets::{self, ModelLight, ModelLightKind, ModelMaterial},
    description::{self, MaterialId, Model, SourceId},
    material::{Material, ModelSurface},
};

/// A model that has been read: its meshes, and where its materials begin.
pub(super) struct PlacedModel {
    /// Index of each of its meshes in the geometry; `None` where it has no triangles.
    meshes: Vec<Option<u32>>,
    /// Index in the scene of each mesh's material.
    materials: Vec<u32>,
    lights: Vec<ModelLight>,
    instances: Vec<assets::Instance>,
}

impl<'a> Placer<'a> {
    pub(super) fn model(&mut self, model: &'a Model, material: Option<MaterialId>, transform: Transform, source: SourceId) -> Result<()> {
        let known = self.models.iter().find(|(known, _)| *known == model).map(|(_, placed)| Rc::clone(placed));
        let placed = match known {
            Some(placed) => placed,
            None => {
                let placed = Rc::new(self.read_model(model, source)?);
                self.models.push((model, Rc::clone(&placed)));
                placed
            }
        };
        self.lights.extend(placed.lights.iter().map(|light| placed_light(light, &transform.to_world, source)));
        for instance in &placed.instances {
            let Some(mesh) = placed.meshes[instance.mesh] else { continue };
            let Some(transform) = Transform::new(transform.to_world * instance.transform) else {
                let message = "a part of the model is scaled to nothing and left out".into();
                self.warn(source, message);
                continue;
            };
            let material = material.unwrap_or(placed.materials[instance.mesh]);
            self.instance(mesh, material, transform, source)?;
        }
        Ok(())
    }

    fn read_model(&mut self, model: &Model, source: SourceId) -> Result<PlacedModel> {
        let loaded = assets::load(model, self.assets).map_err(|error| CompileError::asset(source, error))?;
        let (first_material, first_texture) = (self.materials.len() as u32, self.textures.len() as u32);
        for material in &loaded.materials {
            self.materials.push(Material::from_model(material, &loaded.textures, first_texture, self.tables.as_mut()));
        }
        self.textures.extend(loaded.textures);
        let undrawn = self.tables.is_none().then(|| undrawn(&loaded.materials, &loaded.meshes));
        for message in loaded.warnings.into_iter().chain(undrawn.into_iter().flatten()) {
            self.warn(source, message);
        }
        let materials = loaded.meshes.iter().map(|mesh| first_material + mesh.material as u32).collect();
        let mut meshes = Vec::with_capacity(loaded.meshes.len());
        for mesh in loaded.meshes {
            meshes.push((!mesh.triangles.is_empty()).then(|| self.add_mesh(mesh)));
        }
        Ok(PlacedModel { meshes, materials, lights: loaded.lights, instances: loaded.instances })
    }
}

/// A light of a model that stands in the scene as `to_world` says.
fn placed_light(light: &ModelLight, to_world: &DAffine3, source: SourceId) -> description::Light {
    let place = |position: DVec3| to_world.transform_point3(position).to_array();
    let turn = |direction: DVec3| to_world.transform_vector3(direction).to_array();
    match light.kind {
        ModelLightKind::Point { position } => {
            let falloff = description::Falloff::InverseSquare;
            description::Light::Point { position: place(position), intensity: light.strength, falloff, source }
        }
        ModelLightKind::Directional { direction } => {
            description::Light::Directional { direction: turn(direction), irradiance: light.strength, angle: 0.0, source }
        }
        ModelLightKind::Spot { position, direction, inner, outer } => description::Light::Spot {
            position: place(position),
            direction: turn(direction),
            intensity: light.strength,
            inner: inner.to_degrees(),
            outer: outer.to_degrees(),
            source,
        },
    }
}

/// What is read of the materials that meshes have, but not drawn by those who do not follow all light.
fn undrawn(materials: &[ModelMaterial], meshes: &[assets::Mesh]) -> Vec<String> {
    let mut used = vec![false; materials.len()];
    meshes.iter().for_each(|mesh| used[mesh.material] = true);
    let mut warnings = assets::Warnings::default();
    for (material, _) in materials.iter().zip(used).filter(|(_, used)| *used) {
        let mut warn = |text: &str| warnings.object("material", format!("{:?}", material.name), text);
        ModelSurface::undrawn(material).for_each(&mut warn);
    }
    warnings.into_texts()
}
