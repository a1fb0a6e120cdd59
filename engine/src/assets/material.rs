//! What the meshes of a model are made of: glTF's metallic-roughness model and its extensions, to which other formats are brought.
//!
//! Textures are indices into [`super::LoadedModel::textures`]; each multiplies the factor beside it.

use crate::description;

/// The surface of a mesh. Vertex colours multiply its base colour.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelMaterial {
    /// The file's name for it, or its number there.
    pub name: String,
    /// Linear Rec. 709 and opacity, each in [0, 1].
    pub base_color: [f32; 4],
    /// Colour and opacity.
    pub base_color_texture: Option<usize>,
    /// How much of it is a metal, in [0, 1].
    pub metallic: f32,
    /// Perceptual roughness, in [0, 1]: microfacets have `alpha = roughness^2`.
    pub roughness: f32,
    /// Roughness in green, metal in blue.
    pub metallic_roughness_texture: Option<usize>,
    /// Small bumps.
    pub normal: Option<NormalMap>,
    /// Light that it gives off by itself.
    pub emission: ModelEmission,
    /// Where it is absent.
    pub alpha: AlphaMode,
    /// Whether the back of its triangles is seen too.
    pub double_sided: bool,
    /// Whether it is drawn in its base colour, whatever the light is (`KHR_materials_unlit`).
    pub unlit: bool,
    /// Index of refraction, at least 1; or 0, which stands for a surface that reflects all light (`KHR_materials_ior`).
    pub ior: f32,
    /// Reflection of what is no metal (`KHR_materials_specular`).
    pub specular: Specular,
    /// Light that is refracted into what is no metal (`KHR_materials_transmission`).
    pub transmission: Option<Transmission>,
    /// What fills the inside of a surface that transmits light (`KHR_materials_volume`); `None`: its walls are thin.
    pub volume: Option<Volume>,
    /// A coat of varnish (`KHR_materials_clearcoat`).
    pub clearcoat: Option<Clearcoat>,
    /// Fibres on top (`KHR_materials_sheen`).
    pub sheen: Option<Sheen>,
    /// Roughness that depends on the direction (`KHR_materials_anisotropy`).
    pub anisotropy: Option<Anisotropy>,
}

/// What opacity means.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum AlphaMode {
    /// Nothing: the surface is opaque.
    #[default]
    Opaque,
    /// The surface is cut away where opacity is below this; finite.
    Mask(f32),
    /// It is the share of the surface that is there.
    Blend,
}

/// A normal map: of directions in the frame of tangent, bitangent and normal, each component from [-1, 1] as a colour in [0, 1].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct NormalMap {
    /// The directions, linear.
    pub texture: usize,
    /// Multiplies x and y; finite.
    pub scale: f32,
}

/// Light that a surface gives off by itself.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct ModelEmission {
    /// Radiance, finite and at least 0.
    pub radiance: [f32; 3],
    /// Its colour.
    pub texture: Option<usize>,
}

/// Reflection of what is no metal. At normal incidence it is `factor * min(((ior - 1) / (ior + 1))^2 * color, 1)`, at grazing angles `factor`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Specular {
    /// In [0, 1].
    pub factor: f32,
    /// The factor, in alpha.
    pub texture: Option<usize>,
    /// Finite, at least 0.
    pub color: [f32; 3],
    /// The colour.
    pub color_texture: Option<usize>,
}

impl Default for Specular {
    fn default() -> Self {
        Self { factor: 1.0, texture: None, color: [1.0; 3], color_texture: None }
    }
}

/// Light that is refracted, not scattered below the surface; tinted by the base colour.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Transmission {
    /// The share of it, in (0, 1].
    pub factor: f32,
    /// The factor, in red.
    pub texture: Option<usize>,
}

/// A homogeneous inside that absorbs light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Volume {
    /// Above 0, finite, in the mesh's units. A path tracer finds the thickness by itself.
    pub thickness: f32,
    /// The thickness, in green.
    pub thickness_texture: Option<usize>,
    /// Distance in the world at which white light has become [`Self::attenuation_color`]; above 0, may be infinite.
    pub attenuation_distance: f32,
    /// In [0, 1].
    pub attenuation_color: [f32; 3],
}

/// A clear coat of index of refraction 1.5.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Clearcoat {
    /// The share of it, in (0, 1].
    pub factor: f32,
    /// The factor, in red.
    pub texture: Option<usize>,
    /// Perceptual, in [0, 1].
    pub roughness: f32,
    /// The roughness, in green.
    pub roughness_texture: Option<usize>,
    /// Bumps of the coat; without, it follows the mesh itself, whatever the base has.
    pub normal: Option<NormalMap>,
}

/// Light that fibres scatter towards grazing angles.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sheen {
    /// In [0, 1], not all 0.
    pub color: [f32; 3],
    /// The colour.
    pub color_texture: Option<usize>,
    /// Perceptual, in [0, 1].
    pub roughness: f32,
    /// The roughness, in alpha.
    pub roughness_texture: Option<usize>,
}

/// Roughness along the tangent: `alpha_t = mix(alpha, 1, strength^2)`, across it `alpha_b = alpha`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Anisotropy {
    /// In (0, 1].
    pub strength: f32,
    /// Radians counter-clockwise from the mesh's tangent, finite.
    pub rotation: f32,
    /// A direction in red and green, from [-1, 1] as colours in [0, 1], that the rotation turns; the strength in blue.
    pub texture: Option<usize>,
}

impl ModelMaterial {
    /// What glTF takes where it says nothing else.
    pub(super) fn new(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            base_color: [1.0; 4],
            base_color_texture: None,
            metallic: 1.0,
            roughness: 1.0,
            metallic_roughness_texture: None,
            normal: None,
            emission: ModelEmission::default(),
            alpha: AlphaMode::Opaque,
            double_sided: false,
            unlit: false,
            ior: 1.5,
            specular: Specular::default(),
            transmission: None,
            volume: None,
            clearcoat: None,
            sheen: None,
            anisotropy: None,
        }
    }

    /// Lambertian grey without texture.
    pub(super) fn matte(name: &str, grey: f32, double_sided: bool) -> Self {
        let specular = Specular { factor: 0.0, ..Specular::default() };
        Self { base_color: [grey, grey, grey, 1.0], metallic: 0.0, specular, double_sided, ..Self::new(name) }
    }

    /// All textures that it looks up.
    pub fn textures(&self) -> impl Iterator<Item = usize> {
        let (coat, sheen) = (self.clearcoat, self.sheen);
        let normals = [self.normal, coat.and_then(|coat| coat.normal)];
        let colors = [
            self.base_color_texture,
            self.metallic_roughness_texture,
            self.emission.texture,
            self.specular.texture,
            self.specular.color_texture,
            self.transmission.and_then(|transmission| transmission.texture),
            self.volume.and_then(|volume| volume.thickness_texture),
            coat.and_then(|coat| coat.texture),
            coat.and_then(|coat| coat.roughness_texture),
            sheen.and_then(|sheen| sheen.color_texture),
            sheen.and_then(|sheen| sheen.roughness_texture),
            self.anisotropy.and_then(|anisotropy| anisotropy.texture),
        ];
        colors.into_iter().chain(normals.map(|map| map.map(|map| map.texture))).flatten()
    }

    /// Whether its look depends on the direction of tangents.
    pub fn needs_tangents(&self) -> bool {
        self.normal.is_some() || self.anisotropy.is_some() || self.clearcoat.is_some_and(|coat| coat.normal.is_some())
    }
}

impl From<&description::MetallicRoughness> for ModelMaterial {
    /// With the description's textures.
    fn from(from: &description::MetallicRoughness) -> Self {
        let texture = |id: Option<description::TextureId>| id.map(|id| id as usize);
        let bumps = |bumps: &description::Bumps| NormalMap { texture: bumps.texture as usize, scale: bumps.scale };
        let [r, g, b] = from.base_color;
        let (specular, sheen, coat) = (from.specular, from.sheen_color, from.clearcoat);
        Self {
            base_color: [r, g, b, 1.0],
            base_color_texture: texture(from.base_color_texture),
            metallic: from.metallic,
            roughness: from.roughness,
            metallic_roughness_texture: texture(from.metallic_roughness_texture),
            normal: from.normal.as_ref().map(bumps),
            emission: ModelEmission { radiance: from.emissive, texture: texture(from.emissive_texture) },
            double_sided: true,
            ior: from.ior,
            specular: Specular { factor: specular, color: from.specular_color, ..Specular::default() },
            transmission: (from.transmission > 0.0).then_some(Transmission { factor: from.transmission, texture: None }),
            volume: from.volume.as_ref().map(|volume| Volume {
                thickness: 1.0,
                thickness_texture: None,
                attenuation_distance: volume.distance,
                attenuation_color: volume.color,
            }),
            clearcoat: (coat > 0.0).then(|| Clearcoat {
                factor: coat,
                texture: None,
                roughness: from.clearcoat_roughness,
                roughness_texture: None,
                normal: from.clearcoat_normal.as_ref().map(bumps),
            }),
            sheen: (sheen != [0.0; 3]).then_some(Sheen {
                color: sheen,
                color_texture: None,
                roughness: from.sheen_roughness,
                roughness_texture: None,
            }),
            anisotropy: (from.anisotropy > 0.0).then_some(Anisotropy {
                strength: from.anisotropy,
                rotation: from.anisotropy_rotation,
                texture: None,
            }),
            ..Self::new("of the scene")
        }
    }
}
