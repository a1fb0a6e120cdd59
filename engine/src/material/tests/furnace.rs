//! White materials in a furnace: no light is lost or made, at any angle.

use super::*;

/// A white model, and the same without its wide lobe (what facets reflect to each other, or a base), if that can be taken away.
struct White {
    name: String,
    bsdf: Bsdf<'static>,
    single: Option<Bsdf<'static>>,
    /// Index of the inside, where it differs from the outside.
    eta: Option<f64>,
    anisotropic: bool,
}

fn white_metal(alpha: [f64; 2], albedo: &'static Albedo) -> White {
    let white = |albedo| metal(Fresnel::Constant(DVec3::ONE), alpha, albedo);
    White {
        name: format!("metal {alpha:?}"),
        bsdf: white(Some(albedo)),
        single: Some(white(None)),
        eta: None,
        anisotropic: alpha[0] != alpha[1],
    }
}

/// All models that give back what single scattering lacks.
fn white_models() -> Vec<White> {
    let mut models = Vec::new();
    for alpha in [1e-8, 1e-5, 1e-4, 1e-3, 0.01, 0.04, 0.09, 0.2, 0.45, 1.0] {
        models.push(white_metal([alpha; 2], Box::leak(Box::new(Albedo::fixed([alpha; 2])))));
        models.push(white_metal([alpha; 2], &ALBEDO));
    }
    for alpha in [[0.5, 0.1], [0.05, 0.6], [1.0, 0.1], [0.3, 0.2], [0.01, 1e-3], [0.3, 1e-2]] {
        models.push(white_metal(alpha, Box::leak(Box::new(Albedo::fixed(alpha)))));
    }
    for eta in [1.0 + 2e-5, 1.0001, 1.001, 1.01, 1.33, 1.5, 2.4] {
        for alpha in [1e-4, 1e-3, 5e-3, 0.04, 0.3, 1.0] {
            let single = Some(glass(eta, alpha, false));
            models.push(White {
                name: format!("glass {eta} {alpha}"),
                bsdf: glass(eta, alpha, true),
                single,
                eta: Some(eta),
                anisotropic: false,
            });
            let albedo = &*Box::leak(Box::new(DielectricAlbedo::fixed(eta, [alpha; 2])));
            let of = |base| Bsdf::Plastic(Plastic::new(base, DVec3::ONE, [alpha; 2], albedo));
            models.push(White {
                name: format!("plastic {eta} {alpha}"),
                bsdf: of(DVec3::ONE),
                single: Some(of(DVec3::ZERO)),
                eta: None,
                anisotropic: false,
            });
        }
    }
    for alpha in [1e-3, 0.02, 0.3, 0.75] {
        let of = |albedo| Bsdf::Dielectric(Dielectric::new(1.5, DVec3::ONE, DVec3::ONE, [alpha; 2], albedo));
        models.push(White {
            name: format!("glass, table {alpha}"),
            bsdf: of(Some(&*GLASS)),
            single: Some(of(None)),
            eta: Some(1.5),
            anisotropic: false,
        });
    }
    let tables = Tables { facets: &ALBEDO, coat: Some(&ALBEDO), sheen: None, glass: Some(&*GLASS) };
    for roughness in [0.0, 0.4, 0.7, 1.0] {
        let plain = Parameters { roughness, ..Parameters::default() };
        let mut add = |name, p| {
            let bsdf = Bsdf::MetallicRoughness(Box::leak(Box::new(MetallicRoughness::new(&p, tables))));
            models.push(White {
                name: format!("gltf {name} {roughness}"),
                bsdf,
                single: None,
                eta: p.volume.then_some(1.5),
                anisotropic: false,
            });
        };
        add("opaque", plain);
        add("metal", Parameters { metallic: 1.0, ..plain });
        add("thin", Parameters { transmission: 1.0, ..plain });
        add("volume", Parameters { transmission: 1.0, volume: true, ..plain });
    }
    models
}

impl White {
    /// Light that leaves along `wo` where the same light arrives from everywhere: single scattering by its samples, of which none weighs more than
    /// 1; the wide lobe, which for smooth surfaces arrives from the last grazing angles alone, by midpoints.
    fn furnace(&self, wo: DVec3, count: u32) -> f64 {
        let Some(single) = &self.single else { return furnace(&self.bsdf, wo, count).x };
        let (turns, steps) = if self.anisotropic { (24, 100) } else { (1, 400) };
        let mut sum = furnace(single, wo, count).x;
        if self.bsdf.is_specular() {
            return sum;
        }
        for side in [1.0, -1.0].into_iter().filter(|side| self.eta.is_some() || side * wo.z > 0.0) {
            for at in 0..turns * steps {
                let (turn, v) = (f64::from(at / steps) + 0.5, (f64::from(at % steps) + 0.5) / f64::from(steps));
                // Dense at grazing angles, and where x is seen and where y is.
                let (z, t) = (v.powi(6), turn / f64::from(turns));
                let (phi, r) = (0.5 * PI * t * t * (3.0 - 2.0 * t), (1.0 - z * z).sqrt());
                let wi = DVec3::new(r * phi.cos(), r * phi.sin(), z * side);
                let again = self.bsdf.evaluate(wo, wi).0.x - single.evaluate(wo, wi).0.x;
                let weight = 2.0 * PI * 6.0 * v.powi(5) * 6.0 * t * (1.0 - t) / f64::from(turns * steps);
                let eta = self.eta.unwrap_or(1.0);
                let eta2 = if side * wo.z > 0.0 {
                    1.0
                } else if wo.z > 0.0 {
                    eta * eta
                } else {
                    1.0 / (eta * eta)
                };
                sum += again * eta2 * if turns == 1 { weight / 1.5 } else { weight };
            }
        }
        sum
    }
}

/// An error by few samples; what looks wrong is looked at more closely.
fn closely(times: usize, limit: f64, error: impl Fn(u32) -> f64) -> f64 {
    let counts = [1 << 13, 1 << 15, 1 << 18, 1 << 21].into_iter().take(times);
    counts.fold(1.0, |last: f64, count| if last.abs() >= 0.7 * limit { error(count) } else { last })
}

/// What is white vanishes in an even light, at all angles.
#[test]
fn white_materials_vanish_in_a_furnace() {
    let mut failures = Failures::default();
    let views = [0.0, 0.66, 0.95, 0.9999, 1.0 - 1e-7].map(|sin: f64| {
        let cos = ((1.0 - sin) * (1.0 + sin)).sqrt();
        DVec3::new(0.8 * sin, 0.6 * sin, cos)
    });
    for model in white_models() {
        // About where total reflection begins.
        let critical = model.eta.map(|eta| (1.0 - 1.0 / (eta * eta)).sqrt());
        let about = critical.into_iter().flat_map(|cos| [0.5, 0.9, 0.97, 1.0, 1.03, 1.1, 1.5].map(|by| (cos * by).min(1.0)));
        let about = about.map(|cos| DVec3::new(0.8 * (1.0 - cos * cos).sqrt(), 0.6 * (1.0 - cos * cos).sqrt(), cos));
        let views: Vec<_> = views.into_iter().chain(about).collect();
        for wo in views.iter().copied().chain(views.iter().filter(|_| model.eta.is_some()).map(|wo| -*wo)) {
            let limit = 1e-3;
            // Where all is sampled, few samples by the wide lobe weigh much.
            let error = closely(if model.single.is_some() { 3 } else { 4 }, limit, |count| model.furnace(wo, count) - 1.0);
            failures.check(error.abs() < limit, || format!("{}: {error:+.1e} along {wo}", model.name));
        }
    }
}

/// Anisotropic facets as glTF tells them: of one roughness and strength, or of those that textures tell.
#[test]
fn white_anisotropic_models_vanish_in_a_furnace() {
    let mut failures = Failures::default();
    let views = [1.0, 0.6, 0.2, 0.01].into_iter().flat_map(|z: f64| [0.0, 0.3, 1.4].map(|phi: f64| (z, phi)));
    let views: Vec<_> = views.map(|(z, phi)| DVec3::new((1.0 - z * z).sqrt() * phi.cos(), (1.0 - z * z).sqrt() * phi.sin(), z)).collect();
    for (roughness, anisotropy) in [(0.4, 0.8), (0.05, 0.63), (0.73, 0.37), (0.13, 0.21), (0.1, 0.57), (0.33, 0.06)] {
        let (fixed, glass) = (
            Albedo::stretched(&(roughness..=roughness), &(anisotropy..=anisotropy)),
            DielectricAlbedo::stretched(1.5, &(roughness..=roughness), &(anisotropy..=anisotropy)),
        );
        for (facets, glass, limit) in [(&fixed, &glass, 2e-3), (&*STRETCHED, &*STRETCHED_GLASS, 8e-3)] {
            let tables = Tables { facets, coat: None, sheen: None, glass: Some(glass) };
            let plain = Parameters { roughness, anisotropy, ..Parameters::default() };
            for (name, p) in [
                ("opaque", plain),
                ("metal", Parameters { metallic: 1.0, ..plain }),
                ("thin", Parameters { transmission: 1.0, ..plain }),
                ("volume", Parameters { transmission: 1.0, volume: true, ..plain }),
            ] {
                let bsdf = Bsdf::MetallicRoughness(Box::leak(Box::new(MetallicRoughness::new(&p, tables))));
                for wo in &views {
                    let error = closely(4, limit, |count| furnace(&bsdf, *wo, count).x - 1.0);
                    failures
                        .check(error.abs() < limit, || format!("{name} {roughness} {anisotropy}: {error:+.1e} along {wo}, limit {limit}"));
                }
            }
        }
    }
}
