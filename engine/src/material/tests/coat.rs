//! Clear coats with a normal of their own.

use super::*;

fn tilts() -> [DVec3; 3] {
    [DVec3::new(0.2, -0.1, 1.0), DVec3::new(-0.6, 0.3, 1.0), DVec3::new(0.0, 2.0, 1.0)].map(DVec3::normalize)
}

fn model(p: Parameters) -> MetallicRoughness<'static> {
    MetallicRoughness::new(&p, Tables { facets: &ALBEDO, coat: Some(&ALBEDO), sheen: Some(&SHEEN), glass: None })
}

fn coated(roughness: f64) -> Parameters {
    let color = DVec3::new(0.9, 0.5, 0.2);
    Parameters { clearcoat: 0.8, clearcoat_roughness: roughness, base_color: color, metallic: 0.3, roughness: 0.5, ..Parameters::default() }
}

fn directions() -> impl Iterator<Item = (DVec3, DVec3)> {
    let mut state = 7;
    let mut direction = move || {
        let (z, phi) = (random(&mut state), 2.0 * PI * random(&mut state));
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * phi.cos(), r * phi.sin(), z)
    };
    std::iter::from_fn(move || Some((direction(), direction()))).take(2000)
}

#[test]
fn a_coat_that_faces_where_its_base_does_is_no_other_coat() {
    for roughness in [0.3, 0.7] {
        let plain = model(coated(roughness));
        let same = plain.with_coat_normal(DVec3::Z);
        for (a, b) in directions() {
            let ((value, pdf), (same_value, same_pdf)) = (plain.evaluate(a, b), same.evaluate(a, b));
            assert!((value - same_value).abs().max_element() <= 1e-12 * value.max_element() && (pdf - same_pdf).abs() <= 1e-12 * pdf);
        }
    }
}

/// The coat alone, by cosines with its own normal, and what is below it, by those with the base's.
#[test]
fn coat_and_base_are_reciprocal_each_with_its_own_normal() {
    for (tilt, roughness) in tilts().into_iter().flat_map(|tilt| [0.3, 0.8].map(|roughness| (tilt, roughness))) {
        let (p, mut bright) = (coated(roughness), 0);
        let whole = model(p).with_coat_normal(tilt);
        let coat = model(Parameters { base_color: DVec3::ZERO, specular: 0.0, metallic: 0.0, ..p }).with_coat_normal(tilt);
        for (a, b) in directions() {
            let of_coat = |o: DVec3, i: DVec3| coat.evaluate(o, i).0;
            let of_base = |o: DVec3, i: DVec3| whole.evaluate(o, i).0 - of_coat(o, i);
            let [forth, back] = [(a, b), (b, a)].map(|(o, i)| of_coat(o, i) / i.dot(tilt).abs());
            assert!((forth - back).abs().max_element() <= 1e-6 * forth.max_element(), "{forth} {back}");
            bright += usize::from(forth.max_element() > 0.01);
            let [forth, back] = [(a, b), (b, a)].map(|(o, i)| of_base(o, i) / i.z);
            assert!((forth - back).abs().max_element() <= 1e-6 * (1.0 + forth.max_element()), "{forth} {back}");
            if a.dot(tilt) <= 0.0 || b.dot(tilt) <= 0.0 {
                assert_eq!(of_coat(a, b), DVec3::ZERO, "the coat is seen from behind");
            }
        }
        assert!(bright > 30, "{bright}");
    }
}

/// By quadrature over the hemisphere, so that densities do not matter.
#[test]
fn coats_of_any_normal_make_no_light() {
    for tilt in tilts() {
        let whole = model(Parameters { base_color: DVec3::ONE, clearcoat: 1.0, ..coated(0.5) }).with_coat_normal(tilt);
        for wo in views().into_iter().filter(|wo| wo.z > 0.0) {
            const STEPS: u32 = 150;
            let mut sum = DVec3::ZERO;
            for at in 0..STEPS * STEPS {
                let (z, phi) =
                    ((f64::from(at / STEPS) + 0.5) / f64::from(STEPS), 2.0 * PI * (f64::from(at % STEPS) + 0.5) / f64::from(STEPS));
                let r = (1.0 - z * z).sqrt();
                sum += whole.evaluate(wo, DVec3::new(r * phi.cos(), r * phi.sin(), z)).0 * (2.0 * PI / f64::from(STEPS * STEPS));
            }
            assert!(sum.max_element() < 1.002, "{sum} leaves along {wo} under {tilt}");
        }
    }
}
