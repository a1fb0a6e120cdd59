//! From rough to smooth: where facets end and mirrors begin, nothing is to be seen.

use tessera_engine::description::{Fresnel, Material};
use tessera_tests::{
    stage::{Stage, path, rectangle, sphere},
    statistics::Estimate,
};

/// Surroundings in which nothing changes quickly: from 1/2 to 2, in steps that Radiance's format can hold.
fn smooth() -> Stage {
    Stage::new().within_image(64, 32, |x, y| {
        let wave = |at: usize, of: usize| 0.5 - 0.5 * (std::f32::consts::TAU * at as f32 / of as f32).cos();
        let held = |value: f32| (value * 64.0).round() / 64.0;
        [held(0.5 + 1.5 * wave(x, 64)), held(0.5 + 1.5 * wave(2 * y + 1, 128)), 1.0]
    })
}

fn metal(roughness: f64) -> Material {
    Material::Metal { fresnel: Fresnel::Schlick([0.9, 0.6, 0.3]), roughness: [roughness; 2], multiple_scattering: true }
}

fn glass(roughness: f64) -> Material {
    let multiple_scattering = true;
    Material::Glass {
        ior: 1.5,
        reflectance: [1.0; 3],
        transmittance: [1.0; 3],
        roughness,
        multiple_scattering,
        interior: None,
        priority: 0,
    }
}

/// What a ball, or a plate, of a roughness shows.
fn seen(material: fn(f64) -> Material, roughness: f64) -> [[Estimate; 3]; 2] {
    let ball = smooth().with(sphere([0.0; 3], 1.0), material(roughness));
    let plate = smooth().with(rectangle([-9.0, 0.0, 9.0], [18.0, 0.0, 0.0], [0.0, 0.0, -18.0]), material(roughness));
    [ball.seen([3.0, 1.0, 3.0], [0.3, 0.2, 0.2], path(6), 64), plate.seen([1.0, 2.0, 3.0], [0.0; 3], path(2), 64)]
}

/// From a roughness of 1e-1 down to 1e-8, each step is small, and the last one, into what is smooth by definition, is less than 0.5 %.
#[test]
fn the_step_from_the_finest_facets_to_a_mirror_is_not_seen() {
    for (what, material) in [("metal", metal as fn(f64) -> Material), ("glass", glass)] {
        let smooth = seen(material, 0.0);
        // What is compared are facets, down to where they end.
        assert!(seen(material, 1e-2).iter().flatten().all(|rough| rough.variance > 0.0));
        for exponent in 1..=8 {
            for factor in [1.0, 0.5] {
                let roughness = factor * 10f64.powi(-exponent);
                for (thing, (rough, smooth)) in seen(material, roughness).into_iter().zip(smooth).enumerate() {
                    for (channel, (rough, smooth)) in rough.into_iter().zip(smooth).enumerate() {
                        let step = (rough.mean - smooth.mean).abs() / smooth.mean;
                        // What facets of this roughness blur is in proportion to their slopes' variance, alpha^2 = roughness^4.
                        let blur = 40.0 * roughness.powi(4);
                        let noise = 4.0 * (rough.variance + smooth.variance).sqrt() / smooth.mean;
                        println!("{what} {thing}, roughness {roughness:e}, channel {channel}: {step:.2e}, noise {noise:.1e}");
                        assert!(noise < 2.5e-3, "{what}: too little is known, {noise}");
                        assert!(
                            step <= 0.0025 + blur + noise,
                            "{what} {thing} of roughness {roughness:e} differs from a smooth one by {step}"
                        );
                    }
                }
            }
        }
    }
}
