//! The metallic-roughness model of files (glTF 2.0, appendix B, and its extensions), compiled: from textures to the numbers at one point.

use glam::{DVec2, DVec3};

use super::{metallic_roughness::Parameters, rgb};
use crate::{
    assets::{Anisotropy, Clearcoat, ModelMaterial, Sheen, Specular, Transmission, Volume},
    math::{ln, sin_cos},
    shape::Surface,
    texture::Texture,
};

/// Index of refraction that stands for a surface that reflects all light.
const REFLECTS_ALL: f64 = 1e4;

/// A material of a file with its textures, which are numbers of the scene's.
#[derive(Clone, Debug, PartialEq)]
pub struct ModelSurface {
    material: ModelMaterial,
    first_texture: usize,
    /// Cosine and sine of the rotation of its anisotropy.
    turn: DVec2,
}

impl ModelSurface {
    /// Of a material whose textures begin at `first_texture` of the scene's.
    pub fn new(material: &ModelMaterial, first_texture: u32) -> Self {
        let (sin, cos) = sin_cos(material.anisotropy.map_or(0.0, |anisotropy| anisotropy.rotation.into()));
        Self { material: material.clone(), first_texture: first_texture as usize, turn: DVec2::new(cos, sin) }
    }

    /// Whether a texture is looked up for any of it.
    pub fn is_textured(&self) -> bool {
        self.material.textures().next().is_some()
    }

    /// Whether light may go on in single directions from all of it: it is nowhere rough, and either metal or clear.
    pub fn may_gather(&self) -> bool {
        let material = &self.material;
        let clear = material.transmission.is_some_and(|transmission| transmission.factor == 1.0);
        material.roughness == 0.0 && (material.metallic == 1.0 || clear)
    }

    /// Absorption per unit of length in the world, of what the surface encloses (`KHR_materials_volume`: the light that is left after a distance is
    /// `attenuation_color^(distance / attenuation_distance)`); `None` if it is thin or lets no light in.
    pub fn absorption(&self) -> Option<DVec3> {
        let volume = self.material.volume.filter(|_| self.material.transmission.is_some())?;
        // Black after some way is black at once, as far as numbers can tell.
        let of = |color: f32| -ln(f64::from(color).max(1e-30)) / f64::from(volume.attenuation_distance);
        let [r, g, b] = volume.attenuation_color;
        Some(DVec3::new(of(r), of(g), of(b)).max(DVec3::ZERO))
    }

    /// The numbers at a point of the surface, vertex colour included, and the direction along which reflections are stretched: a unit vector in the frame of tangent and
    /// bitangent.
    #[inline]
    pub fn at(&self, textures: &[Texture], surface: &Surface) -> (Parameters, DVec2) {
        let look = |texture: Option<usize>| match texture.and_then(|texture| textures.get(self.first_texture + texture)) {
            Some(texture) => texture.at(surface.uvs()),
            None => [1.0; 4],
        };
        let color = |factor: [f32; 3], texture: Option<usize>| {
            let [r, g, b, _] = look(texture);
            rgb(factor) * rgb([r, g, b])
        };
        let scalar = |factor: f32, texture: Option<usize>, channel: usize| f64::from(factor) * f64::from(look(texture)[channel]);
        let material = &self.material;
        let [r, g, b, _] = material.base_color;
        let [vertex_r, vertex_g, vertex_b, _] = surface.color;
        let [_, rough, metal, _] = look(material.metallic_roughness_texture);
        let Specular { factor, texture, color: tint, color_texture } = material.specular;
        let mut point = Parameters {
            base_color: color([r, g, b], material.base_color_texture) * rgb([vertex_r, vertex_g, vertex_b]),
            metallic: f64::from(material.metallic) * f64::from(metal),
            roughness: f64::from(material.roughness) * f64::from(rough),
            ior: if material.ior == 0.0 { REFLECTS_ALL } else { material.ior.into() },
            specular: scalar(factor, texture, 3),
            specular_color: color(tint, color_texture),
            clearcoat: 0.0,
            clearcoat_roughness: 0.0,
            sheen_color: DVec3::ZERO,
            sheen_roughness: 0.0,
            anisotropy: 0.0,
            transmission: 0.0,
            volume: material.volume.is_some(),
        };
        if let Some(Clearcoat { factor, texture, roughness, roughness_texture, .. }) = material.clearcoat {
            (point.clearcoat, point.clearcoat_roughness) = (scalar(factor, texture, 0), scalar(roughness, roughness_texture, 1));
        }
        if let Some(Sheen { color: tint, color_texture, roughness, roughness_texture }) = material.sheen {
            (point.sheen_color, point.sheen_roughness) = (color(tint, color_texture), scalar(roughness, roughness_texture, 3));
        }
        if let Some(Transmission { factor, texture }) = material.transmission {
            point.transmission = scalar(factor, texture, 0);
        }
        let mut direction = DVec2::X;
        if let Some(Anisotropy { strength, texture, .. }) = material.anisotropy {
            point.anisotropy = strength.into();
            if texture.is_some() {
                let [x, y, share, _] = look(texture).map(f64::from);
                direction = DVec2::new(2.0 * x - 1.0, 2.0 * y - 1.0).try_normalize().unwrap_or(DVec2::X);
                point.anisotropy *= share;
            }
            let turn = self.turn;
            direction = DVec2::new(direction.x * turn.x - direction.y * turn.y, direction.x * turn.y + direction.y * turn.x);
        }
        (point, direction)
    }

    /// What of it simpler integrators do not draw.
    pub fn undrawn(material: &ModelMaterial) -> impl Iterator<Item = &'static str> {
        let metal = material.metallic > 0.0;
        let thick = |volume: &Volume| volume.attenuation_color != [1.0; 3] && volume.attenuation_distance.is_finite();
        let list = [
            (metal, "metal is not modelled; drawn diffuse in its base colour"),
            (!metal && material.roughness < 1.0 && material.specular.factor > 0.0, "gloss is not modelled; drawn diffuse"),
            (material.transmission.is_some(), "refraction (KHR_materials_transmission) is not modelled; drawn diffuse"),
            (
                material.transmission.is_some() && material.volume.as_ref().is_some_and(thick),
                "absorption (KHR_materials_volume) is not modelled",
            ),
            (material.clearcoat.is_some(), "clear coats (KHR_materials_clearcoat) are not modelled"),
            (material.sheen.is_some(), "sheen (KHR_materials_sheen) is not modelled"),
            (
                material.alpha == crate::assets::AlphaMode::Blend,
                "alpha blending is not modelled; cut away where it is less than half opaque",
            ),
        ];
        let lit = !material.unlit;
        list.into_iter().filter(move |(is_so, text)| *is_so && (lit || text.starts_with("alpha"))).map(|(_, text)| text)
    }
}
