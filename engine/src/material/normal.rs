//! Normal maps: small bumps that only shading sees.

use glam::DVec3;

use crate::{assets, shape::Surface, texture::Texture};

/// A normal map (glTF 2.0, section 3.9.3, `normalTexture`).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// Index of the compiled texture: directions in the frame of tangent, bitangent and normal, from [-1, 1] as linear colours in [0, 1].
    pub texture: u32,
    /// Multiplies x and y.
    pub scale: f64,
}

impl NormalMap {
    /// Of a material whose textures begin at `first_texture` of the scene's.
    pub fn new(map: &assets::NormalMap, first_texture: u32) -> Self {
        Self { texture: first_texture + map.texture as u32, scale: map.scale.into() }
    }

    /// The unit normal that it puts in place of the shading normal; `None` where the surface has no tangents.
    #[inline]
    pub fn normal(&self, textures: &[Texture], surface: &Surface) -> Option<DVec3> {
        let (tangent, bitangent) = surface.tangents_across(surface.ns)?;
        let [x, y, z, _] = textures[self.texture as usize].at(surface.uvs()).map(|x| 2.0 * f64::from(x) - 1.0);
        let normal = (tangent * x + bitangent * y) * self.scale + surface.ns * z;
        normal.try_normalize()
    }
}

/// Which way a clear coat faces.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum CoatNormal {
    /// As the base does.
    #[default]
    Base,
    /// As the mesh does, whatever bumps the base has.
    Mesh,
    /// By bumps of its own.
    Mapped(NormalMap),
}

impl CoatNormal {
    /// Of a material whose textures begin at `first_texture` of the scene's (`KHR_materials_clearcoat`: without a map of its own the coat has no bumps).
    pub fn of(material: &assets::ModelMaterial, first_texture: u32) -> Self {
        match material.clearcoat.map(|coat| coat.normal) {
            Some(Some(map)) => Self::Mapped(NormalMap::new(&map, first_texture)),
            Some(None) if material.normal.is_some() => Self::Mesh,
            _ => Self::Base,
        }
    }
}
