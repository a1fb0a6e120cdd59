//! What fills space: absorption and scattering by closed forms, and glass in glass.

use tessera_engine::description::{Material, Medium, Render, Rgb, Shape};
use tessera_tests::{
    stage::{Stage, diffuse, lamp, path, point, rectangle, sphere},
    statistics::Estimate,
};

use super::{assert_alike, assert_exactly, assert_is};

const SKY: Rgb = [1.0, 2.0, 0.5];

fn sky(share: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|channel| f64::from(SKY[channel]) * share[channel])
}

fn medium(absorption: Rgb, scattering: Rgb, anisotropy: f64) -> Medium {
    Medium { absorption, scattering, anisotropy }
}

fn boundary(interior: Medium) -> Material {
    Material::Boundary { interior }
}

/// Glass with something inside.
fn filled(ior: f64, interior: Option<Medium>, priority: u8) -> Material {
    Material::Glass { ior, reflectance: [1.0; 3], transmittance: [1.0; 3], roughness: 0.0, multiple_scattering: true, interior, priority }
}

const CUBE: Shape = Shape::Box { min: [-1.0; 3], max: [1.0; 3] };
const EYE: [f64; 3] = [0.0, 0.0, 5.0];
const ABSORPTION: Rgb = [0.25, 0.5, 1.0];

fn beer(length: f64) -> [f64; 3] {
    ABSORPTION.map(|absorption| (-f64::from(absorption) * length).exp())
}

#[test]
fn what_absorbs_dims_by_beer_and_lamberts_law() {
    let cube = || Stage::new().with(CUBE, boundary(medium(ABSORPTION, [0.0; 3], 0.0))).within(SKY);
    assert_exactly("through a cube", cube().seen(EYE, [0.0; 3], path(2), 4), sky(beer(2.0)));
    assert_exactly("from inside", cube().seen([0.0, 0.0, 0.5], [0.0; 3], path(2), 4), sky(beer(1.5)));
    assert_exactly("borders are no rays", cube().seen(EYE, [0.0; 3], path(1), 4), sky(beer(2.0)));
    // Two cubes that overlap by a half: there the medium is there once.
    let twice = cube().with(Shape::Box { min: [-1.0, -1.0, -2.0], max: [1.0, 1.0, 0.0] }, boundary(medium(ABSORPTION, [0.0; 3], 0.0)));
    assert_exactly("two that overlap", twice.seen(EYE, [0.0; 3], path(2), 4), sky(beer(3.0)));
    // Glass that bends nothing.
    let ball = Stage::new().with(sphere([0.0; 3], 1.0), filled(1.0, Some(medium(ABSORPTION, [0.0; 3], 0.0)), 0)).within(SKY);
    assert_exactly("through a ball", ball.seen(EYE, [0.0; 3], path(8), 4), sky(beer(2.0)));
}

#[test]
fn fog_dims_what_shines_and_what_is_lit() {
    let mut stage = Stage::new().with(rectangle([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]), lamp([1.0; 3]));
    stage.scene.medium = Some(medium(ABSORPTION, [0.0; 3], 0.0));
    assert_exactly("a lamp in fog", stage.seen(EYE, [0.0; 3], path(3), 4), beer(5.0));
    // A white square, lit by a point light 2 before it, seen from 5 away: radiance I / (pi r^2).
    let mut stage = Stage::new().with(rectangle([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]), diffuse([1.0; 3]));
    stage = stage.lit(point([0.0, 0.0, 2.0], [1.0; 3]));
    stage.scene.medium = Some(medium(ABSORPTION, [0.0; 3], 0.0));
    let lit = beer(7.0).map(|share| share / (4.0 * std::f64::consts::PI));
    assert_exactly("a surface in fog", stage.seen([0.001, 0.0, 5.0], [0.0; 3], path(2), 4), lit);
}

/// A light behind smoke: rays towards it are followed through the borders.
#[test]
fn shadow_rays_go_through_borders() {
    let smoke = boundary(medium(ABSORPTION, [0.0; 3], 0.0));
    let floor = rectangle([-9.0, -9.0, 0.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
    let slab = Shape::Box { min: [-9.0, -9.0, 1.0], max: [9.0, 9.0, 1.5] };
    let stage = Stage::new().with(floor, diffuse([1.0; 3])).with(slab, smoke).lit(point([0.0, 0.0, 2.0], [1.0; 3]));
    // From below the smoke, so that it is crossed by the light alone.
    let expected = beer(0.5).map(|share| share / (4.0 * std::f64::consts::PI));
    assert_exactly("smoke before a light", stage.seen([0.0, 1e-3, 0.9], [0.0; 3], path(2), 4), expected);
    // The same of a lamp that rays may find in both ways, against one that is met by chance alone.
    let smoke = || boundary(medium(ABSORPTION, [0.1; 3], 0.3));
    let slab = || Shape::Box { min: [-9.0, -9.0, 1.0], max: [9.0, 9.0, 1.5] };
    let seen = |stretch: [f64; 3]| -> [Estimate; 3] {
        Stage::new()
            .with(rectangle([-9.0, -9.0, 0.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]), diffuse([1.0; 3]))
            .with(slab(), smoke())
            .with_stretched(sphere([0.0, 0.0, 3.0], 1.0), lamp([4.0; 3]), stretch)
            .seen([0.0, 1e-3, 0.9], [0.0; 3], path(12), 1024)
    };
    assert_alike("a lamp behind smoke", seen([1.0; 3]), seen([1.0 + 1e-9, 1.0, 1.0]));
}

/// Light gets through one after the other with chances of their own: `exp(-s (a + b))` of it, though each is left to chance.
#[test]
fn clouds_one_behind_the_other_are_independent() {
    let cloud = |z: f64| (Shape::Box { min: [-1.0, -1.0, z], max: [1.0, 1.0, z + 1.0] }, boundary(medium([0.0; 3], [0.6; 3], 0.0)));
    let mut stage = Stage::new().within(SKY);
    for z in [-1.5, 0.0, 1.5] {
        let (shape, material) = cloud(z);
        stage = stage.with(shape, material);
    }
    // Chains of one ray: what is scattered is left out.
    let seen = stage.seen(EYE, [0.0; 3], path(1), 4096);
    assert_is("three clouds", seen, sky([(-1.8_f64).exp(); 3]));
}

/// A lamp within glass, behind a ball of lower priority that cannot be seen: rays to the lamp are not stopped by it.
#[test]
fn what_cannot_be_seen_casts_no_shadow() {
    let stage = || {
        Stage::new()
            .with(Shape::Box { min: [-9.0, -9.0, -9.0], max: [9.0, 9.0, 9.0] }, filled(1.5, None, 1))
            .with(rectangle([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]), diffuse([0.5; 3]))
            .with(sphere([0.0, 0.0, 4.0], 0.5), lamp([8.0, 4.0, 2.0]))
    };
    let hidden = stage().with(sphere([0.0, 0.0, 2.0], 0.7), filled(1.2, None, 0));
    let (eye, target) = ([2.0, 0.5, 1.0], [0.1, 0.2, 0.0]);
    assert_alike("a hidden ball", hidden.seen(eye, target, path(2), 256), stage().seen(eye, target, path(2), 256));
}

/// What scatters and absorbs nothing is not seen in an even sky, however it scatters.
#[test]
fn white_smoke_is_not_seen_in_an_even_sky() {
    for anisotropy in [-0.7, 0.0, 0.9] {
        let smoke = boundary(medium([0.0; 3], [1.0, 1.25, 1.5], anisotropy));
        let seen = Stage::new().with(CUBE, smoke).within(SKY).seen(EYE, [0.1, 0.2, 0.0], path(10_000), 1024);
        assert_is(&format!("smoke of anisotropy {anisotropy}"), seen, sky([1.0; 3]));
    }
    let milk = filled(1.33, Some(medium([0.0; 3], [2.0; 3], 0.5)), 0);
    let seen = Stage::new().with(sphere([0.0; 3], 1.0), milk).within(SKY).seen(
        EYE,
        [0.2, 0.3, 0.0],
        Render::Path { max_depth: 100_000, roulette_depth: 5, smooth_terminator: false },
        1024,
    );
    assert_is("a ball of milk", seen, sky([1.0; 3]));
}

/// Light that is scattered once in fog of albedo w under an even sky: `w (1 - exp(-t))` of it is added to what comes through.
#[test]
fn single_scattering_is_the_albedo_of_what_does_not_get_through() {
    let (absorption, scattering) = ([0.3, 0.1, 0.6], [0.2, 0.4, 0.3]);
    // Chains of two rays: from the eye to where light is scattered, and from there out, dimmed on the way: little in a sheet of thickness 2e-4, seen along it for a length of 1.
    let thin = Shape::Box { min: [-0.5, -1e-4, -1e6], max: [0.5, 1e-4, 1e6] };
    let stage = Stage::new().with(thin, boundary(medium(absorption, scattering, 0.0))).within(SKY);
    let seen = stage.seen([5.0, 0.0, 0.0], [0.0; 3], path(2), 1024);
    let expected = [0, 1, 2].map(|channel| {
        let (absorbed, scattered) = (f64::from(absorption[channel]), f64::from(scattering[channel]));
        let (extinct, albedo) = (absorbed + scattered, scattered / (absorbed + scattered));
        // The way out of a slab of half the thickness h: exp(-e h / |cos|) on average over directions, 1 - e h (1 - gamma - ln(e h)) to first order.
        let depth = extinct * 1e-4;
        let out = 1.0 - depth * (1.0 - 0.577_215_664_901_532_9 - depth.ln());
        (-extinct).exp() + albedo * (1.0 - (-extinct).exp()) * out
    });
    assert_is("a thin sheet of fog", seen, sky(expected));
}

/// Of glass in glass of the same index and a lower priority nothing is seen but the outer ball.
#[test]
fn glass_within_glass_of_the_same_index_is_not_seen() {
    let outer =
        || Stage::new().with(sphere([0.0; 3], 1.0), filled(1.5, None, 1)).with(sphere([0.0, -3.0, 0.0], 1.5), lamp([1.0; 3])).within(SKY);
    let both = outer().with(sphere([0.1, 0.1, 0.2], 0.5), filled(1.5, None, 0));
    let (eye, target) = ([0.3, 0.5, 5.0], [0.2, 0.3, 0.0]);
    assert_alike("a ball in a ball", both.seen(eye, target, path(64), 256), outer().seen(eye, target, path(64), 256));
}

/// A drink in a glass: with an overlap by a hair's breadth, and priority to the glass, the borders are those of glass and drink; straight on, each reflects by Fresnel's formula.
#[test]
fn liquid_that_overlaps_its_glass_is_a_stack_of_interfaces() {
    let fresnel = |a: f64, b: f64| ((a - b) / (a + b)).powi(2);
    let (glass, water) = (1.5, 1.33);
    // Air, glass, water, black: all that is seen is what the borders reflect, once each, of a white sky.
    for overlap in [2.0_f64.powi(-20), -(2.0_f64.powi(-20))] {
        let stage = Stage::new()
            .with(Shape::Box { min: [-9.0, -9.0, -1.0], max: [9.0, 9.0, 0.0] }, filled(glass, None, 1))
            .with(Shape::Box { min: [-9.0, -9.0, -3.0], max: [9.0, 9.0, -1.0 + overlap] }, filled(water, None, 0))
            .with(rectangle([-9.0, -9.0, -2.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]), diffuse([0.0; 3]))
            .within(SKY);
        let seen = stage.seen(EYE, [0.0; 3], path(64), 4096);
        // Two plane borders, with all reflections to and fro.
        let stack = |r: f64, s: f64| r + (1.0 - r) * (1.0 - r) * s / (1.0 - r * s);
        let outer = fresnel(1.0, glass);
        let inner = if overlap < 0.0 {
            // A gap of air between them, with its own two borders.
            stack(fresnel(glass, 1.0), fresnel(1.0, water))
        } else {
            fresnel(glass, water)
        };
        assert_is(&format!("overlap {overlap:e}"), seen, sky([stack(outer, inner); 3]));
    }
}
