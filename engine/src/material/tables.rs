//! Tables that materials share, made when the first of them asks.

use std::{collections::BTreeMap, ops::RangeInclusive, sync::Arc};

use super::{
    energy::{Albedo, DielectricAlbedo},
    sheen::SheenAlbedo,
};

/// Albedos by what they are of, numbers by their bits.
#[derive(Debug, Default)]
pub struct SharedTables {
    fixed: BTreeMap<[u64; 2], Arc<Albedo>>,
    fixed_dielectric: BTreeMap<[u64; 2], Arc<DielectricAlbedo>>,
    over_roughness: Option<Arc<Albedo>>,
    dielectric_over_roughness: BTreeMap<u64, Arc<DielectricAlbedo>>,
    stretched: BTreeMap<[u64; 4], Arc<Albedo>>,
    dielectric_stretched: BTreeMap<[u64; 5], Arc<DielectricAlbedo>>,
    sheen: Option<Arc<SheenAlbedo>>,
}

impl SharedTables {
    /// Of facets of one roughness.
    pub fn fixed(&mut self, alpha: [f64; 2]) -> Arc<Albedo> {
        let make = || Arc::new(Albedo::fixed(alpha));
        Arc::clone(self.fixed.entry(alpha.map(f64::to_bits)).or_insert_with(make))
    }

    /// Of facets of a dielectric of one roughness.
    pub fn fixed_dielectric(&mut self, eta: f64, alpha: f64) -> Arc<DielectricAlbedo> {
        let make = || Arc::new(DielectricAlbedo::fixed(eta, [alpha; 2]));
        Arc::clone(self.fixed_dielectric.entry([eta, alpha].map(f64::to_bits)).or_insert_with(make))
    }

    /// Of facets of any roughness.
    pub fn over_roughness(&mut self) -> Arc<Albedo> {
        Arc::clone(self.over_roughness.get_or_insert_with(|| Arc::new(Albedo::over_roughness())))
    }

    /// Of facets of a dielectric of any roughness.
    pub fn dielectric_over_roughness(&mut self, eta: f64) -> Arc<DielectricAlbedo> {
        let make = || Arc::new(DielectricAlbedo::over_roughness(eta));
        Arc::clone(self.dielectric_over_roughness.entry(eta.to_bits()).or_insert_with(make))
    }

    /// Of anisotropic facets of these roughnesses and strengths.
    pub fn stretched(&mut self, roughness: &RangeInclusive<f64>, strength: &RangeInclusive<f64>) -> Arc<Albedo> {
        let make = || Arc::new(Albedo::stretched(roughness, strength));
        let key = [roughness.start(), roughness.end(), strength.start(), strength.end()].map(|x| x.to_bits());
        Arc::clone(self.stretched.entry(key).or_insert_with(make))
    }

    /// Of anisotropic facets of a dielectric.
    pub fn dielectric_stretched(
        &mut self,
        eta: f64,
        roughness: &RangeInclusive<f64>,
        strength: &RangeInclusive<f64>,
    ) -> Arc<DielectricAlbedo> {
        let make = || Arc::new(DielectricAlbedo::stretched(eta, roughness, strength));
        let key = [&eta, roughness.start(), roughness.end(), strength.start(), strength.end()].map(|x| x.to_bits());
        Arc::clone(self.dielectric_stretched.entry(key).or_insert_with(make))
    }

    /// Of fibres.
    pub fn sheen(&mut self) -> Arc<SheenAlbedo> {
        Arc::clone(self.sheen.get_or_insert_with(|| Arc::new(SheenAlbedo::new())))
    }
}
