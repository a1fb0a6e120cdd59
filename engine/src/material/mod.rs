//! Materials, compiled: how a surface scatters and emits light, and where it is cut away.

mod bsdf;
mod conductor;
pub mod dielectric;
mod diffuse;
mod energy;
mod gloss;
mod ideal;
mod local;
mod medium;
mod metallic_roughness;
pub mod metals;
mod microfacet;
mod mirror;
mod model;
mod normal;
mod plastic;
mod recipe;
mod refractive;
mod rough_diffuse;
mod sheen;
mod stretched;
mod table;
mod tables;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use glam::DVec3;

pub use self::{
    bsdf::{Bsdf, Scattered},
    ideal::Ideal,
    medium::{Medium, Travel},
    metallic_roughness::MetallicRoughness,
    model::ModelSurface,
    normal::{CoatNormal, NormalMap},
    recipe::{Glass, Recipe},
    tables::SharedTables,
};

use crate::{
    assets::{AlphaMode, ModelMaterial},
    description::{self, Rgb},
    texture::{Coordinates, Texture},
};

/// A compiled material.
#[derive(Clone, Debug, PartialEq)]
pub struct Material {
    /// What simple models of light make of it.
    pub ideal: Ideal,
    /// How the surface scatters light.
    pub recipe: Recipe,
    /// What it gives off by itself.
    pub emission: Option<Emission>,
    /// The surface is absent where its alpha (`base_alpha` times the texture's) is below this (glTF's alpha mode `MASK`).
    pub alpha_cutoff: Option<f32>,
    /// Whether alpha is the share of the surface that is there (glTF's alpha mode `BLEND`), for those who can tell more than there from not there.
    pub blends: bool,
    /// Alpha of the material, in [0, 1].
    pub base_alpha: f32,
    /// Whether the surface is there when seen from behind (glTF's `doubleSided`).
    pub double_sided: bool,
    /// Whether the vertex colours of a mesh multiply the reflectance (glTF's `COLOR_0`).
    pub color_from_vertices: bool,
    /// Bumps.
    pub normal_map: Option<NormalMap>,
    /// Which way its clear coat faces.
    pub coat_normal: CoatNormal,
    /// The coordinates along which tangents lie, if it asks for tangents.
    pub tangents: Option<Coordinates>,
    /// Whether one of its textures asks what a pixel of the film covers.
    pub filtered: bool,
    /// Whether hits on it have texture coordinates.
    pub has_coordinates: bool,
    /// All that a model's file says of it.
    pub model: Option<Arc<ModelSurface>>,
}

/// What a surface gives off by itself, the same in all directions.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Emission {
    /// Radiance.
    pub radiance: DVec3,
    /// Index of a compiled texture that multiplies it.
    pub texture: Option<u32>,
    /// Whether it shines on the side that the normal does not point to, too.
    pub two_sided: bool,
    /// Whether vertex colours multiply it.
    pub color_from_vertices: bool,
    /// Whether rays are sent to it; otherwise it is met by chance.
    pub is_light: bool,
}

impl Emission {
    /// As given, all over the surface.
    pub fn even(radiance: DVec3, texture: Option<u32>, two_sided: bool) -> Self {
        Self { radiance, texture, two_sided, color_from_vertices: false, is_light: true }
    }
}

impl Material {
    /// Prepares a material of the description; texture indices stay what they are, of these compiled textures. Without `tables`, for those to whom light is as simple as to
    /// [`Ideal`].
    pub fn compile(material: &description::Material, textures: &[Texture], tables: Option<&mut SharedTables>) -> Self {
        if let description::Material::MetallicRoughness(model) = material {
            return Self::from_model(&ModelMaterial::from(&**model), textures, 0, tables);
        }
        let emission = match material {
            description::Material::Emitter { radiance, texture, two_sided } if radiance.iter().any(|x| *x > 0.0) => {
                Some(Emission::even(rgb(*radiance), *texture, *two_sided))
            }
            _ => None,
        };
        let (ideal, recipe) = (Ideal::of(material), tables.map_or(Recipe::Nothing, |tables| Recipe::of(material, tables)));
        let texture = ideal.texture().or(emission.and_then(|emission| emission.texture));
        Self {
            ideal,
            recipe,
            emission,
            alpha_cutoff: None,
            blends: false,
            base_alpha: 1.0,
            double_sided: true,
            color_from_vertices: false,
            normal_map: None,
            coat_normal: CoatNormal::Base,
            tangents: is_brushed(material).then(Coordinates::default),
            filtered: texture.and_then(|texture| textures.get(texture as usize)).is_some_and(Texture::is_filtered),
            has_coordinates: true,
            model: None,
        }
    }

    /// Prepares a material of a model file with these textures, which begin at index `first_texture` of the scene's.
    ///
    /// Unlit surfaces shine in their base colour where light is followed, and are diffuse elsewhere.
    pub fn from_model(material: &ModelMaterial, textures: &[Texture], first_texture: u32, tables: Option<&mut SharedTables>) -> Self {
        let [r, g, b, alpha] = material.base_color;
        let of_scene = |texture: Option<usize>| texture.map(|index| first_texture + index as u32);
        let (reflectance, texture) = (rgb([r, g, b]), of_scene(material.base_color_texture));
        let two_sided = material.double_sided;
        let emission = match material.unlit {
            true => Emission { color_from_vertices: true, is_light: false, ..Emission::even(reflectance, texture, two_sided) },
            false => Emission::even(rgb(material.emission.radiance), of_scene(material.emission.texture), two_sided),
        };
        let lit = !material.unlit;
        let model = lit.then(|| Arc::new(ModelSurface::new(material, first_texture)));
        let recipe = match (tables, &model) {
            (Some(tables), Some(model)) => Recipe::of_model(material, model, first_texture, tables),
            _ => Recipe::Nothing,
        };
        Self {
            ideal: Ideal::Diffuse { reflectance, texture },
            recipe,
            emission: (emission.radiance != DVec3::ZERO).then_some(emission),
            alpha_cutoff: match material.alpha {
                AlphaMode::Opaque => None,
                AlphaMode::Mask(cutoff) => Some(cutoff),
                AlphaMode::Blend => Some(0.5),
            },
            blends: material.alpha == AlphaMode::Blend,
            base_alpha: alpha,
            double_sided: material.double_sided,
            color_from_vertices: true,
            normal_map: material.normal.as_ref().filter(|_| lit).map(|map| NormalMap::new(map, first_texture)),
            coat_normal: if lit { CoatNormal::of(material, first_texture) } else { CoatNormal::Base },
            tangents: tangents(material, textures).filter(|_| lit),
            filtered: material.textures().any(|texture| textures.get(texture).is_some_and(Texture::is_filtered)),
            has_coordinates: true,
            model,
        }
    }

    /// Whether it asks for texture coordinates.
    #[inline]
    pub fn is_textured(&self) -> bool {
        self.ideal.texture().is_some()
            || self.emission.is_some_and(|emission| emission.texture.is_some())
            || self.model.as_ref().is_some_and(|model| model.is_textured())
    }

    /// Texture of the reflectance, where there is one.
    #[inline]
    pub fn texture(&self) -> Option<u32> {
        self.ideal.texture()
    }

    /// Whether what goes through the surface is not dimmed, but for what it reflects.
    pub fn passes_all_light(&self) -> bool {
        matches!(self.ideal, Ideal::Glass { transmittance: DVec3::ONE, .. })
    }

    /// Whether the surface may be absent somewhere, so that a hit must be asked for its alpha.
    #[inline]
    pub fn is_masked(&self) -> bool {
        self.alpha_cutoff.is_some()
    }
}

/// Whether its look depends on the direction of tangents.
fn is_brushed(material: &description::Material) -> bool {
    matches!(material, description::Material::Metal { roughness: [along, across], .. } if along != across)
}

/// The coordinates of the first texture that tangents matter to; the mesh's first where none does.
fn tangents(material: &ModelMaterial, textures: &[Texture]) -> Option<Coordinates> {
    let normal = material.normal.or(material.clearcoat.and_then(|coat| coat.normal)).map(|map| map.texture);
    let texture = normal.or(material.anisotropy.and_then(|anisotropy| anisotropy.texture));
    material
        .needs_tangents()
        .then(|| texture.and_then(|texture| textures.get(texture)).map_or(Coordinates::default(), Texture::coordinates))
}

/// A colour of the description in the engine's own precision.
pub(crate) fn rgb(color: Rgb) -> DVec3 {
    DVec3::new(color[0].into(), color[1].into(), color[2].into())
}
