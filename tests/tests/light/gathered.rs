//! Light that glass and mirrors gather, which rays hardly find by chance: by closed forms, and as chance finds it where it can.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use tessera_engine::description::{Light, Material, Medium, Rgb, Shape};
use tessera_tests::stage::{Stage, diffuse, directional, ground, lamberts_polygon, lamp, path, rectangle, sphere};

use super::{assert_alike, assert_is};

const ALBEDO: Rgb = [0.5, 0.25, 0.75];
const RADIANCE: Rgb = [400.0, 200.0, 100.0];
const EYE: [f64; 3] = [0.0, 0.3, 3.0];

fn stage() -> Stage {
    Stage::new().with(ground(), diffuse(ALBEDO))
}

fn glass(interior: Option<Medium>) -> Material {
    let (reflectance, transmittance) = ([1.0; 3], [1.0; 3]);
    Material::Glass { ior: 1.5, reflectance, transmittance, roughness: 0.0, multiple_scattering: true, interior, priority: 0 }
}

/// Of a sun straight above, four rays find what two borders let through and the glass between does not swallow.
#[test]
fn a_sun_shines_through_a_pane() {
    let sun: Light = directional([0.0, -1.0, 0.0], RADIANCE, 0.5);
    // So large that it reflects next to nothing of the ground beside it, on which the sun shines unhindered.
    let pane = Shape::Box { min: [-300.0, 1.0, -300.0], max: [300.0, 1.5, 300.0] };
    let reflected = (0.5_f64 / 2.5).powi(2);
    let absorption: Rgb = [0.25, 0.5, 1.0];
    for (what, interior) in [("clear", None), ("coloured", Some(Medium { absorption, scattering: [0.0; 3], anisotropy: 0.0 }))] {
        let left = |channel: usize| if interior.is_some() { (-0.5 * f64::from(absorption[channel])).exp() } else { 1.0 };
        let through = |channel| (1.0 - reflected).powi(2) * left(channel);
        let expected = [0, 1, 2].map(|at| f64::from(ALBEDO[at]) * FRAC_1_PI * f64::from(RADIANCE[at]) * through(at));
        let seen = stage().with(pane.clone(), glass(interior)).lit(sun.clone()).seen(EYE, [0.0; 3], path(4), 1024);
        assert_is(&format!("{what} pane"), seen, expected);
    }
}

/// A lamp of a finger's size that looks up to a mirror: its image hangs as far above the mirror.
#[test]
fn a_mirror_shows_the_ground_a_lamp_that_looks_away() {
    let scene = stage()
        .with(rectangle([0.45, 1.0, 0.05], [0.1, 0.0, 0.0], [0.0, 0.0, -0.1]), lamp(RADIANCE))
        .with(rectangle([-3.0, 2.0, 3.0], [6.0, 0.0, 0.0], [0.0, 0.0, -6.0]), Material::Mirror { reflectance: [0.9, 0.8, 0.7] });
    let image = [(0.45, 0.05), (0.55, 0.05), (0.55, -0.05), (0.45, -0.05)].map(|(x, z)| DVec3::new(x, 3.0, z));
    let share = FRAC_1_PI * lamberts_polygon(DVec3::ZERO, DVec3::Y, &image);
    let expected = [0, 1, 2].map(|at| f64::from(ALBEDO[at]) * f64::from(RADIANCE[at]) * [0.9, 0.8, 0.7][at] * share);
    assert_is("mirror", scene.seen(EYE, [0.0; 3], path(3), 1024), expected);
}

/// Of a lamp whose shape no one knows, no photons are sent: only chance finds it.
#[test]
fn a_lens_gathers_as_much_light_as_chance_finds() {
    let scene = || stage().with(sphere([0.0, 1.0, 0.0], 0.5), glass(None));
    let bulb = || sphere([0.3, 3.0, 0.0], 0.4);
    let known = scene().with(bulb(), lamp(RADIANCE)).seen(EYE, [0.0; 3], path(6), 512);
    let unknown = scene().with_stretched(bulb(), lamp(RADIANCE), [1.0 + 1e-9, 1.0, 1.0]).seen(EYE, [0.0; 3], path(6), 4096);
    assert_alike("lens", known, unknown);
}
