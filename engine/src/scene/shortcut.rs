//! Shortcuts: what a scene does not ask for is not computed.

use super::Scene;
use crate::description::Render;

/// A way in which a scene can be rendered with less work than the general one. All give the same pixels, down to the last bit; which ones a scene takes is read off it when it is compiled.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Shortcut {
    /// Nothing fills space: paths run in code that keeps no account of it, and rays to lights end at the first thing in their way.
    NoMedia,
    /// Textures are not asked for: hits on a surface without any have no texture coordinates and no footprints.
    NoTextures,
    /// Meshes are there wherever their triangles are: hits on them are taken without a look at their alpha and side.
    Opaque,
    /// Spheres are few: rays from the camera and to lights that stand somewhere find them by their outlines.
    Outlines,
}

impl Shortcut {
    /// All of them.
    pub const ALL: [Self; 4] = [Self::NoMedia, Self::NoTextures, Self::Opaque, Self::Outlines];

    /// What is not done, in words.
    pub fn name(self) -> &'static str {
        match self {
            Self::NoMedia => "no media",
            Self::NoTextures => "no textures",
            Self::Opaque => "opaque meshes",
            Self::Outlines => "outlines of spheres",
        }
    }
}

impl Scene {
    /// Whether rendering takes a shortcut, somewhere at least.
    pub fn takes(&self, shortcut: Shortcut) -> bool {
        let geometry = &self.geometry;
        match shortcut {
            Shortcut::NoMedia => matches!(self.render, Render::Path { .. }) && !self.media,
            Shortcut::NoTextures => self.materials.iter().any(|material| !material.has_coordinates),
            Shortcut::Opaque => geometry.instances.iter().any(|instance| !instance.shape.masked),
            Shortcut::Outlines => geometry.from_eye.is_some() || geometry.from_lights.iter().any(Option::is_some),
        }
    }

    /// Closes a shortcut, so that rendering goes the general way: for those who compare both, or measure what it gains.
    pub fn close(&mut self, shortcut: Shortcut) {
        let geometry = &mut self.geometry;
        match shortcut {
            Shortcut::NoMedia => self.media = true,
            Shortcut::NoTextures => {
                for material in &mut self.materials {
                    (material.has_coordinates, material.filtered) = (true, true);
                }
            }
            Shortcut::Opaque => geometry.instances.iter_mut().for_each(|instance| instance.shape.masked = true),
            Shortcut::Outlines => {
                geometry.from_eye = None;
                geometry.from_lights.iter_mut().for_each(|pencil| *pencil = None);
            }
        }
    }
}
