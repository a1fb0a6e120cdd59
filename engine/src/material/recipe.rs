//! From a material and a point of its surface to the BSDF there.

use std::{ops::RangeInclusive, sync::Arc};

use glam::{DVec2, DVec3};

use super::{
    Bsdf, Material, Medium, ModelSurface, SharedTables,
    conductor::{Conductor, Fresnel},
    diffuse::Diffuse,
    energy::{Albedo, DielectricAlbedo},
    metallic_roughness::{MetallicRoughness, Tables},
    microfacet::SMOOTH_ALPHA,
    mirror::Mirror,
    plastic::Plastic,
    refractive::Dielectric,
    rgb,
    rough_diffuse::RoughDiffuse,
    sheen::SheenAlbedo,
};
use crate::{
    assets::ModelMaterial,
    description::{self, Material as Description},
    shape::Surface,
    texture::Texture,
};

/// How a material's surface scatters light, but for what textures say.
#[derive(Clone, Debug, PartialEq)]
pub enum Recipe {
    /// Not at all.
    Nothing,
    /// It lets all light pass: the border of a medium.
    Boundary {
        /// What fills the inside.
        interior: Option<Medium>,
    },
    /// As Lambert's law says.
    Diffuse {
        /// Albedo, multiplied by `texture` where there is one.
        reflectance: DVec3,
        /// Index of the compiled texture.
        texture: Option<u32>,
    },
    /// As rough stone or clay does.
    RoughDiffuse {
        /// Albedo of the smooth surface, multiplied by `texture` where there is one.
        reflectance: DVec3,
        /// Index of the compiled texture.
        texture: Option<u32>,
        /// In [0, 1].
        roughness: f64,
    },
    /// As a mirror.
    Mirror(Mirror),
    /// As a metal.
    Metal {
        /// What its facets reflect.
        fresnel: Fresnel,
        /// Roughness of the microfacets along the tangent and across it.
        alpha: [f64; 2],
        /// What facets reflect once, where the rest is kept.
        albedo: Option<Arc<Albedo>>,
    },
    /// As a dielectric.
    Glass(Glass),
    /// As a dielectric coat over Lambert's law.
    Plastic {
        /// Albedo of the base, multiplied by `texture` where there is one.
        reflectance: DVec3,
        /// Index of the compiled texture.
        texture: Option<u32>,
        /// Roughness of the coat's microfacets.
        alpha: f64,
        /// What the coat reflects and refracts once.
        albedo: Arc<DielectricAlbedo>,
    },
    /// As glTF's metallic-roughness model.
    Model(Box<ModelRecipe>),
}

/// A material of a file, with what it takes to scatter light.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelRecipe {
    surface: Arc<ModelSurface>,
    facets: Arc<Albedo>,
    coat: Option<Arc<Albedo>>,
    sheen: Option<Arc<SheenAlbedo>>,
    glass: Option<Arc<DielectricAlbedo>>,
    /// Index of refraction, if light goes through it into a volume.
    ior: Option<f64>,
    interior: Option<Medium>,
}

impl ModelRecipe {
    /// The BSDF at a point, with something of this index of refraction outside, and the direction of the tangent along which it is smoother.
    pub fn at(&self, outside: f64, textures: &[Texture], surface: &Surface) -> (MetallicRoughness<'_>, DVec2) {
        let (mut parameters, direction) = self.surface.at(textures, surface);
        if self.ior.is_some() {
            parameters.ior /= outside;
        }
        let glass = self.glass.as_deref().filter(|_| outside == 1.0);
        let tables = Tables { facets: &self.facets, coat: self.coat.as_deref(), sheen: self.sheen.as_deref(), glass };
        (MetallicRoughness::new(&parameters, tables), direction)
    }

    /// Index of refraction of the inside, if there is one.
    pub fn ior(&self) -> Option<f64> {
        self.ior
    }
}

/// A dielectric and what is inside.
#[derive(Clone, Debug, PartialEq)]
pub struct Glass {
    /// Index of refraction.
    ior: f64,
    /// Multiplies what is reflected.
    reflectance: DVec3,
    /// Multiplies what is refracted.
    transmittance: DVec3,
    /// Roughness of the microfacets.
    alpha: f64,
    /// What facets reflect and refract once in empty space, where the rest is kept.
    albedo: Option<Arc<DielectricAlbedo>>,
    interior: Option<Medium>,
    priority: u8,
}

impl Glass {
    /// The interface with something of this index of refraction outside.
    #[inline(always)]
    pub fn beside(&self, outside: f64) -> Dielectric<'_> {
        let albedo = self.albedo.as_deref().filter(|_| outside == 1.0);
        Dielectric::new(self.ior / outside, self.reflectance, self.transmittance, [self.alpha; 2], albedo)
    }
}

impl Recipe {
    /// Of a material of the description.
    pub fn of(material: &Description, tables: &mut SharedTables) -> Self {
        match material {
            Description::Diffuse { reflectance, texture } => Self::Diffuse { reflectance: rgb(*reflectance), texture: *texture },
            Description::Mirror { reflectance } => Self::Mirror(Mirror { reflectance: rgb(*reflectance) }),
            Description::Metal { fresnel, roughness, multiple_scattering } => {
                let alpha = roughness.map(|roughness| roughness * roughness);
                let rough = alpha.iter().any(|alpha| *alpha > SMOOTH_ALPHA);
                let albedo = (*multiple_scattering && rough).then(|| tables.fixed(alpha));
                Self::Metal { fresnel: compiled(fresnel), alpha, albedo }
            }
            Description::Glass { ior, reflectance, transmittance, roughness, multiple_scattering, interior, priority } => {
                let alpha = roughness * roughness;
                let albedo = (*multiple_scattering && alpha > SMOOTH_ALPHA).then(|| tables.fixed_dielectric(*ior, alpha));
                let (reflectance, transmittance) = (rgb(*reflectance), rgb(*transmittance));
                let interior = interior.as_ref().and_then(Medium::compile);
                Self::Glass(Glass { ior: *ior, reflectance, transmittance, alpha, albedo, interior, priority: *priority })
            }
            Description::RoughDiffuse { reflectance, texture, roughness } => {
                Self::RoughDiffuse { reflectance: rgb(*reflectance), texture: *texture, roughness: *roughness }
            }
            Description::Plastic { reflectance, texture, ior, roughness } => {
                let alpha = roughness * roughness;
                let albedo = tables.fixed_dielectric(*ior, alpha);
                Self::Plastic { reflectance: rgb(*reflectance), texture: *texture, alpha, albedo }
            }
            // The model is told by [`Self::of_model`].
            Description::Emitter { .. } | Description::MetallicRoughness(_) => Self::Nothing,
            Description::Boundary { interior } => Self::Boundary { interior: Medium::compile(interior) },
        }
    }

    /// Of a material of a file, whose textures begin at `first_texture` of the scene's.
    pub fn of_model(material: &ModelMaterial, surface: &Arc<ModelSurface>, first_texture: u32, tables: &mut SharedTables) -> Self {
        let layers = material.transmission.is_some() || material.clearcoat.is_some() || material.sheen.is_some();
        if material.metallic == 0.0 && material.specular.factor == 0.0 && !layers {
            let [r, g, b, _] = material.base_color;
            let texture = material.base_color_texture.map(|texture| first_texture + texture as u32);
            return Self::Diffuse { reflectance: rgb([r, g, b]), texture };
        }
        let encloses = material.transmission.is_some() && material.volume.is_some() && material.metallic < 1.0;
        let ior = encloses.then(|| f64::from(material.ior).max(1.0));
        let facets = facets(material);
        let rough = material.roughness > 0.0 || facets.is_some();
        let glass = ior.filter(|_| rough).map(|ior| match &facets {
            Some((roughness, strength)) => tables.dielectric_stretched(ior, roughness, strength),
            None => tables.dielectric_over_roughness(ior),
        });
        Self::Model(Box::new(ModelRecipe {
            surface: Arc::clone(surface),
            facets: match &facets {
                Some((roughness, strength)) => tables.stretched(roughness, strength),
                None => tables.over_roughness(),
            },
            coat: material.clearcoat.is_some().then(|| tables.over_roughness()),
            sheen: material.sheen.is_some().then(|| tables.sheen()),
            glass,
            ior,
            interior: ior.and_then(|_| surface.absorption()).and_then(Medium::absorbing),
        }))
    }

    /// The BSDF at a point, in empty space, but for those of files.
    #[inline(always)]
    pub fn bsdf(&self, material: &Material, textures: &[Texture], surface: &Surface) -> Bsdf<'_> {
        match self {
            Self::Nothing | Self::Boundary { .. } | Self::Model(_) => Bsdf::Diffuse(Diffuse { reflectance: DVec3::ZERO }),
            Self::Diffuse { reflectance, texture } => {
                Bsdf::Diffuse(Diffuse { reflectance: colored(*reflectance, *texture, material, textures, surface) })
            }
            Self::RoughDiffuse { reflectance, texture, roughness } => {
                Bsdf::RoughDiffuse(RoughDiffuse::new(colored(*reflectance, *texture, material, textures, surface), *roughness))
            }
            Self::Mirror(mirror) => Bsdf::Mirror(*mirror),
            Self::Plastic { reflectance, texture, alpha, albedo } => {
                let base = colored(*reflectance, *texture, material, textures, surface);
                Bsdf::Plastic(Plastic::new(base, DVec3::ONE, [*alpha; 2], albedo))
            }
            Self::Metal { fresnel, alpha, albedo } => Bsdf::Conductor(Conductor::new(*fresnel, *alpha, albedo.as_deref())),
            Self::Glass(glass) => Bsdf::Dielectric(glass.beside(1.0)),
        }
    }

    /// Whether light goes through the surface into something.
    #[inline]
    pub fn has_inside(&self) -> bool {
        match self {
            Self::Boundary { .. } | Self::Glass(_) => true,
            Self::Model(model) => model.ior.is_some(),
            _ => false,
        }
    }

    /// Whether light that falls on the surface may be gathered elsewhere: most of it goes on in single directions.
    pub fn gathers(&self) -> bool {
        match self {
            Self::Mirror(_) => true,
            Self::Metal { alpha, .. } => alpha.iter().all(|alpha| *alpha < SMOOTH_ALPHA),
            Self::Glass(glass) => glass.alpha < SMOOTH_ALPHA,
            Self::Model(model) => model.surface.may_gather(),
            Self::Nothing | Self::Boundary { .. } | Self::Diffuse { .. } | Self::RoughDiffuse { .. } | Self::Plastic { .. } => false,
        }
    }

    /// What is behind the surface, if that is not empty.
    #[inline]
    pub fn interior(&self) -> Option<&Medium> {
        match self {
            Self::Boundary { interior } | Self::Glass(Glass { interior, .. }) => interior.as_ref(),
            Self::Model(model) => model.interior.as_ref(),
            _ => None,
        }
    }

    /// Which of several that overlap is there: the highest.
    #[inline]
    pub fn priority(&self) -> u8 {
        if let Self::Glass(glass) = self { glass.priority } else { 0 }
    }

    /// Index of refraction of the inside.
    #[inline]
    pub fn ior(&self) -> f64 {
        match self {
            Self::Glass(glass) => glass.ior,
            Self::Model(model) => model.ior.unwrap_or(1.0),
            _ => 1.0,
        }
    }
}

/// Roughnesses and strengths of anisotropy that a material may have, unless it is isotropic.
fn facets(material: &ModelMaterial) -> Option<(RangeInclusive<f64>, RangeInclusive<f64>)> {
    let range = |factor: f32, texture: Option<usize>| if texture.is_some() { 0.0..=factor.into() } else { factor.into()..=factor.into() };
    let anisotropy = material.anisotropy.filter(|anisotropy| anisotropy.strength > 0.0)?;
    let roughness = range(material.roughness, material.metallic_roughness_texture);
    Some((roughness, range(anisotropy.strength, anisotropy.texture)))
}

/// A colour, multiplied by a texture and by vertex colours, where there are such.
#[inline(always)]
fn colored(color: DVec3, texture: Option<u32>, material: &Material, textures: &[Texture], surface: &Surface) -> DVec3 {
    let mut color = color;
    if let Some(texture) = texture {
        let [r, g, b, _] = textures[texture as usize].at(surface.uvs());
        color *= rgb([r, g, b]);
    }
    if material.color_from_vertices {
        let [r, g, b, _] = surface.color;
        color *= rgb([r, g, b]);
    }
    color
}

fn compiled(fresnel: &description::Fresnel) -> Fresnel {
    match fresnel {
        description::Fresnel::Index { eta, k } => Fresnel::index(rgb(*eta), rgb(*k)),
        description::Fresnel::Schlick(color) => Fresnel::Schlick(rgb(*color)),
        description::Fresnel::Constant(color) => Fresnel::Constant(rgb(*color)),
    }
}
