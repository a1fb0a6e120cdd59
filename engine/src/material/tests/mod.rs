//! What every model must hold: tested against quadrature and statistics, generically.

mod coat;
mod furnace;

use std::{f64::consts::PI, sync::LazyLock};

use glam::{DVec2, DVec3};

use super::{
    bsdf::{Bsdf, Scattered},
    conductor::{Conductor, Fresnel},
    diffuse::Diffuse,
    energy::{Albedo, DielectricAlbedo},
    metallic_roughness::{MetallicRoughness, Parameters, Tables},
    microfacet::SMOOTH_ALPHA,
    mirror::Mirror,
    plastic::Plastic,
    refractive::Dielectric,
    rough_diffuse::RoughDiffuse,
    sheen::SheenAlbedo,
};

/// One model with parameters.
struct Case {
    name: String,
    bsdf: Bsdf<'static>,
    /// Whether the furnace gives 1: no part of the light is lost.
    white: bool,
    /// Whether lobes are wide enough for quadrature over the sphere.
    wide: bool,
}

static ALBEDO: LazyLock<Albedo> = LazyLock::new(Albedo::over_roughness);

static STRETCHED: LazyLock<Albedo> = LazyLock::new(|| Albedo::stretched(&(0.0..=1.0), &(0.0..=1.0)));
static STRETCHED_GLASS: LazyLock<DielectricAlbedo> = LazyLock::new(|| DielectricAlbedo::stretched(1.5, &(0.0..=1.0), &(0.0..=1.0)));
static GLASS: LazyLock<DielectricAlbedo> = LazyLock::new(|| DielectricAlbedo::over_roughness(1.5));
static SHEEN: LazyLock<SheenAlbedo> = LazyLock::new(SheenAlbedo::new);

fn metal(f: Fresnel, alpha: [f64; 2], albedo: Option<&'static Albedo>) -> Bsdf<'static> {
    Bsdf::Conductor(Conductor::new(f, alpha, albedo))
}

fn glass(eta: f64, alpha: f64, albedo: bool) -> Bsdf<'static> {
    let albedo = albedo.then(|| &*Box::leak(Box::new(DielectricAlbedo::fixed(eta, [alpha; 2]))));
    Bsdf::Dielectric(Dielectric::new(eta, DVec3::ONE, DVec3::ONE, [alpha; 2], albedo))
}

static CASES: LazyLock<Vec<Case>> = LazyLock::new(|| {
    let mut cases = Vec::new();
    let mut add = |name: String, bsdf, white, wide| cases.push(Case { name, bsdf, white, wide });
    let color = DVec3::new(0.9, 0.5, 0.2);
    add("diffuse".into(), Bsdf::Diffuse(Diffuse { reflectance: DVec3::ONE }), true, true);
    add("mirror".into(), Bsdf::Mirror(Mirror { reflectance: DVec3::ONE }), true, true);
    let gold = Fresnel::index(DVec3::new(0.14, 0.37, 1.44), DVec3::new(3.98, 2.38, 1.60));
    for alpha in [[0.0, 0.0], [1e-4, 1e-4], [0.1, 0.1], [0.5, 0.5], [1.0, 1.0], [0.5, 0.1]] {
        let wide = alpha[0] >= 0.1 || alpha[0] == 0.0;
        add(format!("gold {alpha:?}"), metal(gold, alpha, None), false, wide);
        add(format!("schlick {alpha:?}"), metal(Fresnel::Schlick(color), alpha, None), false, false);
        let fixed = &*Box::leak(Box::new(Albedo::fixed(alpha)));
        add(format!("white {alpha:?}"), metal(Fresnel::Constant(DVec3::ONE), alpha, Some(fixed)), true, wide);
        add(format!("gold* {alpha:?}"), metal(gold, alpha, Some(fixed)), false, false);
        if alpha[0] != alpha[1] {
            continue;
        }
        add(format!("white, table {alpha:?}"), metal(Fresnel::Schlick(DVec3::ONE), alpha, Some(&ALBEDO)), true, false);
    }
    for eta in [1.0, 1.01, 1.5, 0.7, 4.0] {
        for alpha in [0.0, 1e-4, 0.1, 0.3, 1.0] {
            let wide = alpha == 0.0 || alpha >= 0.1 && (eta == 1.5 || eta == 0.7);
            add(format!("glass {eta} {alpha}"), glass(eta, alpha, false), alpha == 0.0, wide);
            add(format!("glass* {eta} {alpha}"), glass(eta, alpha, true), true, wide);
        }
    }
    for roughness in [0.0, 0.3, 1.0] {
        add(format!("rough diffuse {roughness}"), Bsdf::RoughDiffuse(RoughDiffuse::new(DVec3::ONE, roughness)), true, true);
        add(format!("coloured rough diffuse {roughness}"), Bsdf::RoughDiffuse(RoughDiffuse::new(color, roughness)), false, true);
    }
    for eta in [1.0, 1.5, 2.5] {
        for alpha in [0.0, 1e-3, 0.1, 0.4, 1.0] {
            let albedo = &*Box::leak(Box::new(DielectricAlbedo::fixed(eta, [alpha; 2])));
            let plastic = |reflectance| Bsdf::Plastic(Plastic::new(reflectance, DVec3::ONE, [alpha; 2], albedo));
            add(format!("plastic {eta} {alpha}"), plastic(DVec3::ONE), true, false);
            add(format!("coloured plastic {eta} {alpha}"), plastic(color), false, alpha != 1e-3 && eta == 1.5);
        }
    }
    let gltf = |p: Parameters| {
        let anisotropic = p.anisotropy > 0.0;
        let (facets, glass) = if anisotropic { (&*STRETCHED, &*STRETCHED_GLASS) } else { (&*ALBEDO, &*GLASS) };
        let tables = Tables { facets, coat: Some(&ALBEDO), sheen: Some(&SHEEN), glass: p.volume.then_some(glass) };
        Bsdf::MetallicRoughness(Box::leak(Box::new(MetallicRoughness::new(&p, tables))))
    };
    let plain = Parameters::default();
    for roughness in [0.0, 0.35, 1.0] {
        let (p, wide) = (Parameters { roughness, ..plain }, roughness == 0.35);
        add(format!("gltf {roughness}"), gltf(p), true, false);
        add(format!("gltf metal {roughness}"), gltf(Parameters { metallic: 1.0, ..p }), true, false);
        add(format!("gltf thin {roughness}"), gltf(Parameters { transmission: 1.0, ..p }), true, false);
        add(format!("gltf half thin {roughness}"), gltf(Parameters { transmission: 0.5, metallic: 0.3, ..p }), true, wide);
        add(format!("gltf volume {roughness}"), gltf(Parameters { transmission: 1.0, volume: true, ..p }), true, false);
        add(
            format!("gltf coat {roughness}"),
            gltf(Parameters { clearcoat: 1.0, clearcoat_roughness: 0.4, base_color: color, ..p }),
            false,
            true,
        );
        let of =
            |p: Parameters| MetallicRoughness::new(&p, Tables { facets: &ALBEDO, coat: Some(&ALBEDO), sheen: Some(&SHEEN), glass: None });
        for (name, of_coat) in [("", 0.4), ("smooth ", 0.0)] {
            let tilted = of(Parameters { clearcoat: 0.9, clearcoat_roughness: of_coat, metallic: 0.5, ..p });
            let tilted = Box::leak(Box::new(tilted.with_coat_normal(DVec3::new(-0.5, 0.2, 1.0).normalize())));
            add(format!("gltf {name}tilted coat {roughness}"), Bsdf::MetallicRoughness(tilted), false, wide && of_coat > 0.0);
        }
        add(format!("gltf smooth coat {roughness}"), gltf(Parameters { clearcoat: 1.0, metallic: 1.0, ..p }), false, false);
        add(format!("gltf sheen {roughness}"), gltf(Parameters { sheen_color: DVec3::ONE, sheen_roughness: 0.4, ..p }), false, false);
        add(format!("gltf rough sheen {roughness}"), gltf(Parameters { sheen_color: color, sheen_roughness: 1.0, ..p }), false, wide);
        let stretched = Parameters { anisotropy: 0.6, ..p };
        add(format!("gltf stretched {roughness}"), gltf(stretched), true, wide);
        add(format!("gltf stretched metal {roughness}"), gltf(Parameters { metallic: 1.0, ..stretched }), true, false);
        let all = Parameters {
            base_color: color,
            metallic: 0.2,
            ior: 1.8,
            specular: 0.8,
            specular_color: DVec3::new(1.0, 0.5, 2.0),
            ..stretched
        };
        let all =
            Parameters { clearcoat: 0.7, clearcoat_roughness: 0.3, sheen_color: color, sheen_roughness: 0.6, transmission: 0.4, ..all };
        add(format!("gltf all {roughness}"), gltf(all), false, wide);
        add(format!("gltf all volume {roughness}"), gltf(Parameters { volume: true, ior: 1.5, ..all }), false, wide);
    }
    add("tinted glass".into(), Bsdf::Dielectric(Dielectric::new(1.5, color, DVec3::X, [0.3; 2], None)), false, true);
    cases
});

/// Directions above and below the surface, at random, along and against it.
fn views() -> Vec<DVec3> {
    [(0.0, 0.0), (0.3, 0.8), (0.7, 2.5), (0.9, 4.0), (0.995, 0.5), (0.99995, 1.3)]
        .into_iter()
        .flat_map(|(sin, phi): (f64, f64)| {
            let cos = (1.0 - sin * sin).sqrt();
            [1.0, -1.0].map(|side| DVec3::new(sin * phi.cos(), sin * phi.sin(), cos * side))
        })
        .collect()
}

/// Failures of all cases, told together.
#[derive(Default)]
struct Failures(Vec<String>);

impl Failures {
    fn check(&mut self, holds: bool, what: impl FnOnce() -> String) {
        if !holds {
            self.0.push(what());
        }
    }
}

impl Drop for Failures {
    fn drop(&mut self) {
        let shown = self.0.iter().take(40).map(|line| format!("{line}\n")).collect::<String>();
        assert!(self.0.is_empty() || std::thread::panicking(), "{} failures:\n{shown}", self.0.len());
    }
}

/// The sequence of Weyl and Roberts in three dimensions.
fn points(count: u32) -> impl Iterator<Item = (f64, DVec2)> {
    (0..count).map(|n| {
        let at = |step: f64| (0.5 + step * f64::from(n)).fract();
        (at(0.819_172_513_396_164_5), DVec2::new(at(0.671_043_606_703_789_3), at(0.549_700_477_901_970_3)))
    })
}

fn random(state: &mut u64) -> f64 {
    *state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
    let mut z = *state;
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    ((z ^ (z >> 31)) >> 11) as f64 / (1u64 << 53) as f64
}

/// Light that leaves along `wo` where the same light arrives from everywhere, but for the compression of radiance.
fn furnace(bsdf: &Bsdf, wo: DVec3, count: u32) -> DVec3 {
    let leaving = |s: Scattered| s.weight * s.eta2;
    points(count).map(|(pick, u)| bsdf.sample(wo, pick, u).map_or(DVec3::ZERO, leaving)).sum::<DVec3>() / f64::from(count)
}

#[test]
fn no_light_is_lost_or_made_in_a_furnace() {
    let mut failures = Failures::default();
    for case in CASES.iter() {
        for wo in views() {
            let below = matches!(case.bsdf, Bsdf::Dielectric(_) | Bsdf::MetallicRoughness(_));
            if wo.z < 0.0 && !below {
                continue;
            }
            let leaves = furnace(&case.bsdf, wo, 6_000);
            failures.check(leaves.max_element() <= 1.015, || format!("{}: {leaves} leaves along {wo}", case.name));
            failures.check(!case.white || leaves.min_element() >= 0.98, || format!("{}: {leaves} leaves along {wo}", case.name));
        }
    }
}

#[test]
fn samples_are_worth_what_evaluation_says() {
    let mut failures = Failures::default();
    let mut state = 1;
    for case in CASES.iter() {
        for wo in views() {
            for _ in 0..200 {
                let (pick, u) = (random(&mut state), DVec2::new(random(&mut state), random(&mut state)));
                let Some(s) = case.bsdf.sample(wo, pick, u) else { continue };
                failures.check((s.wi.length() - 1.0).abs() < 1e-9 && s.transmitted == (s.wi.z * wo.z < 0.0), || {
                    format!("{}: {s:?}", case.name)
                });
                if !s.specular {
                    let (value, pdf) = case.bsdf.evaluate(wo, s.wi);
                    failures.check((pdf / s.pdf - 1.0).abs() < 1e-4, || format!("{}: {pdf} is not {s:?} for {wo}", case.name));
                    failures.check((s.weight * s.pdf - value).abs().max_element() <= 1e-4 * value.max_element(), || {
                        format!("{}: {value} of {s:?}", case.name)
                    });
                }
            }
        }
    }
}

#[test]
fn models_are_reciprocal() {
    let mut failures = Failures::default();
    let mut state = 2;
    // Of those two parts are reciprocal, each with its own cosine.
    for case in CASES.iter().filter(|case| !case.name.contains("tilted coat")) {
        for _ in 0..2000 {
            let mut direction = || {
                let z = 2.0 * random(&mut state) - 1.0;
                let (phi, r) = (2.0 * PI * random(&mut state), (1.0 - z * z).sqrt());
                DVec3::new(r * phi.cos(), r * phi.sin(), z)
            };
            let (a, b) = (direction(), direction());
            let eta: f64 = match case.name.split(' ').collect::<Vec<_>>()[..] {
                ["glass" | "glass*", eta, _] => eta.parse().unwrap(),
                ["tinted", "glass"] | ["gltf", .., "volume", _] => 1.5,
                _ => 1.0,
            };
            let squared = |w: DVec3| if w.z > 0.0 { 1.0 } else { eta * eta };
            let forth = case.bsdf.evaluate(a, b).0 / b.z.abs() * squared(b);
            let back = case.bsdf.evaluate(b, a).0 / a.z.abs() * squared(a);
            failures.check((forth - back).abs().max_element() <= 1e-5 * forth.max_element(), || {
                format!("{}: {forth} forth, {back} back, {a} {b}", case.name)
            });
        }
    }
}

#[test]
fn extreme_numbers_stay_finite() {
    let mut failures = Failures::default();
    let ends = [0.0, 0.5, 1.0 - f64::EPSILON / 2.0];
    let mut views = views();
    views.extend([0.0, -0.0, 1e-9, -1e-9, 1e-300, 1.0, -1.0].map(|z: f64| DVec3::new((1.0 - z * z).sqrt(), 0.0, z)));
    for case in CASES.iter() {
        for &wo in &views {
            for at in 0..27 {
                let (pick, x, y) = (ends[at / 9], ends[at / 3 % 3], ends[at % 3]);
                let Some(s) = case.bsdf.sample(wo, pick, DVec2::new(x, y)) else { continue };
                failures
                    .check(s.wi.is_finite() && s.weight.is_finite() && s.weight.min_element() >= 0.0, || format!("{}: {s:?}", case.name));
                failures.check(s.pdf.is_finite() && s.pdf > 0.0, || format!("{}: {s:?} {wo}", case.name));
            }
            for &wi in &views {
                let (value, pdf) = case.bsdf.evaluate(wo, wi);
                failures.check(value.is_finite() && value.min_element() >= 0.0 && pdf.is_finite() && pdf >= 0.0, || {
                    format!("{}: {wo} {wi} {value} {pdf}", case.name)
                });
            }
        }
    }
}

/// Bins of the chi-square test, over the cosine and the azimuth, and steps of a quadrature within each.
const BINS: (usize, usize) = (20, 20);
const STEPS: usize = 16;

/// The density, integrated over each bin.
fn expected(bsdf: &Bsdf, wo: DVec3) -> Vec<f64> {
    let mut bins = vec![0.0; BINS.0 * BINS.1];
    let steps = (BINS.0 * STEPS, BINS.1 * STEPS);
    for at in 0..steps.0 * steps.1 {
        let (row, column) = (at / steps.1, at % steps.1);
        // Bins are even in the angle; those at the poles are the finest.
        let theta = PI * (row as f64 + 0.5) / steps.0 as f64;
        let z = theta.cos();
        let (phi, r) = (2.0 * PI * (column as f64 + 0.5) / steps.1 as f64, (1.0 - z * z).sqrt());
        let (_, pdf) = bsdf.evaluate(wo, DVec3::new(r * phi.cos(), r * phi.sin(), z));
        bins[row / STEPS * BINS.1 + column / STEPS] += pdf * 2.0 * PI * PI * theta.sin() / (steps.0 * steps.1) as f64;
    }
    bins
}

#[test]
fn samples_follow_their_density() {
    let mut failures = Failures::default();
    let views: Vec<_> = views().into_iter().skip(3).step_by(3).collect();
    let wide: Vec<_> = CASES.iter().filter(|case| case.wide && !case.bsdf.is_specular()).collect();
    // Sidak: all tests together fail by chance with probability 0.01; 3.9 and more is the quantile of the normal distribution.
    let tests = (wide.len() * views.len()) as f64;
    let quantile = (2.0 * (tests / 0.01).ln()).sqrt();
    let mut state = 3;
    for case in wide {
        for &wo in &views {
            const COUNT: u32 = 25_000;
            let mut seen = vec![0.0; BINS.0 * BINS.1];
            for _ in 0..COUNT {
                let (pick, u) = (random(&mut state), DVec2::new(random(&mut state), random(&mut state)));
                if let Some(s) = case.bsdf.sample(wo, pick, u).filter(|s| !s.specular) {
                    let row = (s.wi.z.clamp(-1.0, 1.0).acos() / PI * BINS.0 as f64) as usize;
                    let column = (s.wi.y.atan2(s.wi.x) / (2.0 * PI)).rem_euclid(1.0) * BINS.1 as f64;
                    seen[row.min(BINS.0 - 1) * BINS.1 + (column as usize).min(BINS.1 - 1)] += 1.0;
                }
            }
            let mut pooled = (0.0, 0.0);
            let (mut chi2, mut freedom) = (0.0_f64, 0.0_f64);
            for (seen, expected) in seen.into_iter().zip(expected(&case.bsdf, wo)) {
                pooled = (pooled.0 + seen, pooled.1 + expected * f64::from(COUNT));
                if pooled.1 >= 8.0 {
                    chi2 += (pooled.0 - pooled.1) * (pooled.0 - pooled.1) / pooled.1;
                    freedom += 1.0;
                    pooled = (0.0, 0.0);
                }
            }
            // Wilson and Hilferty: the cube root of chi-square over its freedom is nearly normal.
            let spread = 2.0 / (9.0 * freedom);
            let limit = freedom * (1.0 - spread + quantile * spread.sqrt()).powi(3);
            failures.check(chi2 <= limit, || format!("{}: chi-square {chi2} of {freedom} above {limit} for {wo}", case.name));
        }
    }
}

/// Roughness falls until the lobe becomes specular: at that step, all reflections stay within a cone of 0.06 degrees but for one in ten thousand,
/// and their light is the same within 0.5 %.
#[test]
fn the_step_to_a_smooth_surface_is_not_seen() {
    let mut failures = Failures::default();
    let gold = Fresnel::index(DVec3::new(0.14, 0.37, 1.44), DVec3::new(3.98, 2.38, 1.60));
    let models: [fn(Fresnel, f64) -> Bsdf<'static>; 2] = [|gold, alpha| metal(gold, [alpha; 2], None), |_, alpha| glass(1.5, alpha, false)];
    for (model, wo) in models.iter().flat_map(|model| views().into_iter().map(move |wo| (model, wo))).filter(|(_, wo)| wo.z.abs() > 0.01) {
        let (rough, smooth) = (model(gold, SMOOTH_ALPHA), model(gold, SMOOTH_ALPHA.next_down()));
        failures.check(!rough.is_specular() && smooth.is_specular(), || "the step is elsewhere".into());
        let (a, b) = (furnace(&rough, wo, 10_000), furnace(&smooth, wo, 10_000));
        failures.check((a / b - 1.0).abs().max_element() < 5e-3, || format!("{a} and {b} leave along {wo}"));
        let far = |(pick, u)| {
            let (a, b) = (rough.sample(wo, pick, u), smooth.sample(wo, pick, u));
            a.zip(b).is_none_or(|(a, b)| a.transmitted == b.transmitted && (a.wi - b.wi).length() > 2.0 * 0.06_f64.to_radians())
        };
        let count = points(10_000).filter(|&point| far(point)).count();
        failures.check(count <= 20, || format!("{count} samples go elsewhere for {wo}"));
    }
    for alpha in [1e-6, 1e-8, 1e-16, 0.0] {
        failures.check(models.iter().all(|model| model(gold, alpha).is_specular()), || format!("{alpha} is not smooth"));
    }
}

#[test]
fn smooth_dielectrics_of_any_index_keep_all_light() {
    let mut failures = Failures::default();
    for exponent in -40..=40 {
        let eta = 10f64.powf(f64::from(exponent) / 10.0);
        for wo in views() {
            let (r, t) = (
                glass(eta, 0.0, false).sample(wo, 0.0, DVec2::ZERO),
                glass(eta, 0.0, false).sample(wo, 1.0 - f64::EPSILON / 2.0, DVec2::ZERO),
            );
            let share = |s: Option<Scattered>| s.map_or(0.0, |s| s.weight.x * s.eta2 * s.pdf);
            let sum = if r == t { share(r) } else { share(r) + share(t) };
            failures.check((sum - 1.0).abs() < 1e-6, || format!("{sum} leaves along {wo} for {eta}"));
        }
    }
    let through = glass(1.0, 0.3, false).sample(views()[3], 0.7, DVec2::ZERO);
    failures.check(through.is_some_and(|s| s.wi == -views()[3] && s.weight == DVec3::ONE), || format!("{through:?}"));
}
