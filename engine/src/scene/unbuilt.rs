//! Scenes before their trees are built.

use glam::DVec3;

use super::{Inside, Scene, Statistics, Warning, joint::may_touch};
use crate::{
    description::Render,
    material::{Material, Recipe},
};

/// A frame that has been checked and whose assets are read: enough to know what is wrong with it and how large it is, without the time that building it takes.
#[derive(Debug)]
pub struct Unbuilt(pub(super) Scene);

impl Unbuilt {
    /// Lowest and highest coordinates, in the world, of all finite things.
    pub fn bounds(&self) -> Option<(DVec3, DVec3)> {
        self.0.bounds()
    }

    /// What a user should know, each once.
    pub fn warnings(&self) -> &[Warning] {
        &self.0.warnings
    }

    /// Builds its trees.
    pub fn build(self) -> Scene {
        let Self(mut scene) = self;
        let transparent = matches!(scene.render, Render::Whitted { transparent_shadows: true, .. });
        let materials = &scene.materials;
        let casts_no_shadow = |material: u32| transparent && materials[material as usize].passes_all_light();
        let eye = scene.camera.rays_start_at_eye().then(|| scene.camera.eye());
        scene.geometry.finish(eye, &scene.lights, casts_no_shadow);
        let has_insides = scene.materials.iter().any(|material| material.recipe.has_inside());
        if has_insides && matches!(scene.render, Render::Path { .. }) {
            let boxes = scene.geometry.boxes(|material| scene.materials[material as usize].recipe.has_inside());
            scene.may_touch = may_touch(boxes);
            scene.around_eye = Inside::of(&scene, scene.camera.eye());
        }
        scene.media = scene.may_touch || scene.medium.is_some() || scene.materials.iter().any(fills_space);
        scene.statistics = Statistics::of(&scene.geometry);
        scene
    }
}

/// Whether what has this surface fills space, or may have a border that does not show.
fn fills_space(Material { recipe, .. }: &Material) -> bool {
    recipe.interior().is_some() || recipe.priority() > 0 || matches!(recipe, Recipe::Boundary { .. })
}
