//! What MTL files say of gloss, brought to the metallic-roughness model: Phong's numbers by convention, and the format's PBR extension (Clara.io's
//! `Pr`, `Pm`, `Pc`, `Pcr`), which counts where both are given.

use super::{Clearcoat, ModelMaterial, Specular, mesh::fraction};

/// The largest index of refraction.
const MAX_IOR: f32 = 1e4;

/// The numbers, where they are given; all finite.
#[derive(Default)]
pub(super) struct Gloss {
    /// Ks.
    specular: Option<[f32; 3]>,
    /// Ns.
    exponent: Option<f32>,
    /// Ni.
    ior: Option<f32>,
    /// illum.
    model: Option<f32>,
    /// Pr.
    roughness: Option<f32>,
    /// Pm.
    metallic: Option<f32>,
    /// Pc.
    clearcoat: Option<f32>,
    /// Pcr.
    clearcoat_roughness: Option<f32>,
}

impl Gloss {
    /// A statement's numbers.
    pub fn read(&mut self, keyword: &str, numbers: &[f32]) {
        let Some(&first) = numbers.first() else { return };
        match keyword {
            "Ks" => self.specular = Some(if let [r, g, b, ..] = *numbers { [r, g, b] } else { [first; 3] }),
            "Ns" => self.exponent = Some(first),
            "Ni" => self.ior = Some(first),
            "illum" => self.model = Some(first),
            "Pr" => self.roughness = Some(first),
            "Pm" => self.metallic = Some(first),
            "Pc" => self.clearcoat = Some(first),
            "Pcr" => self.clearcoat_roughness = Some(first),
            _ => {}
        }
    }

    /// Whether the file asks for refraction: models 4, 6, 7 and 9.
    pub fn is_clear(&self) -> bool {
        self.model.is_some_and(|model| [4.0, 6.0, 7.0, 9.0].contains(&model))
    }

    /// Gives a matte material its gloss.
    pub fn polish(&self, material: &mut ModelMaterial) {
        material.ior = self.ior.unwrap_or(1.5).clamp(1.0, MAX_IOR);
        material.metallic = fraction(self.metallic.unwrap_or(0.0));
        let is_pbr = self.roughness.is_some() || self.metallic.is_some();
        material.roughness = fraction(self.roughness.unwrap_or_else(|| self.exponent.map_or(1.0, roughness)));
        let has_gloss = self.model.is_none_or(|model| model >= 2.0);
        match self.specular.filter(|color| color.iter().any(|&x| x > 0.0)).filter(|_| has_gloss) {
            // Exporters write the usual reflection of dielectrics, 4 % straight on, as Ks 0.5.
            Some(color) => material.specular = Specular { factor: 1.0, color: color.map(|x| 2.0 * fraction(x)), ..Specular::default() },
            None if is_pbr => material.specular = Specular::default(),
            None => {}
        }
        let factor = fraction(self.clearcoat.unwrap_or(0.0));
        let coat = Clearcoat {
            factor,
            texture: None,
            roughness: fraction(self.clearcoat_roughness.unwrap_or(0.0)),
            roughness_texture: None,
            normal: None,
        };
        material.clearcoat = (factor > 0.0).then_some(coat);
    }
}

/// Perceptual roughness of a highlight of Phong's exponent: `alpha^2 = 2 / (n + 2)` (Walter et al., "Microfacet Models for Refraction through Rough Surfaces", 2007, section 5.2).
fn roughness(exponent: f32) -> f32 {
    (2.0 / (exponent.max(0.0) + 2.0)).sqrt().sqrt()
}
