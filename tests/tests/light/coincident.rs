//! Glass and what fills it, face on face: borders are those of the two, and whoever goes through is inside of nothing behind.

use tessera_engine::description::{Material, Medium, Rgb, Shape};
use tessera_tests::{
    stage::{Stage, diffuse, lamp, path, point, rectangle, sphere},
    statistics::Estimate,
};

use super::{assert_alike, assert_exactly, assert_is};

const SKY: Rgb = [1.0, 2.0, 0.5];
const EYE: [f64; 3] = [0.0, 0.0, 5.0];
const GLASS: f64 = 1.5;
const WATER: f64 = 1.33;

fn filled(ior: f64, priority: u8) -> Material {
    absorbing(ior, priority, 0.0)
}

fn absorbing(ior: f64, priority: u8, absorption: f32) -> Material {
    let interior = (absorption > 0.0).then_some(Medium { absorption: [absorption; 3], scattering: [0.0; 3], anisotropy: 0.0 });
    Material::Glass { ior, reflectance: [1.0; 3], transmittance: [1.0; 3], roughness: 0.0, multiple_scattering: true, interior, priority }
}

fn slab(from: f64, to: f64) -> Shape {
    Shape::Box { min: [-9.0, -9.0, from], max: [9.0, 9.0, to] }
}

fn times(share: f64) -> [f64; 3] {
    SKY.map(|radiance| f64::from(radiance) * share)
}

fn fresnel(a: f64, b: f64) -> f64 {
    ((a - b) / (a + b)).powi(2)
}

/// What plane borders reflect that lie behind one another, straight on, with all ways to and fro.
fn stack(reflectances: &[f64]) -> f64 {
    reflectances.iter().rev().fold(0.0, |behind, r| r + (1.0 - r) * (1.0 - r) * behind / (1.0 - r * behind))
}

/// Seen from above, and from below, in each order of the objects, whatever makes the slabs: boxes, meshes, boxes that are turned.
#[test]
fn water_on_glass_without_a_gap_is_a_stack_of_three_borders() {
    type Add = fn(Stage, f64, f64, Material) -> Stage;
    let plain: Add = |stage, from, to, material| stage.with(slab(from, to), material);
    let stretched: Add = |stage, from, to, material| stage.with_stretched(slab(from, to), material, [1.0, 1.25, 1.0]);
    let mesh: Add = |stage, from, to, material| {
        let corners: Vec<[f32; 3]> = (0..8_u32)
            .map(|i| {
                [if i & 1 == 0 { -9.0 } else { 9.0 }, if i & 2 == 0 { -9.0 } else { 9.0 }, if i & 4 == 0 { from as f32 } else { to as f32 }]
            })
            .collect();
        let sides = [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]];
        let triangles: Vec<[u32; 3]> = sides.iter().flat_map(|[a, b, c, d]| [[*a, *b, *c], [*a, *c, *d]]).collect();
        stage.with_mesh(&corners, &triangles, material)
    };
    let black = |z: f64| rectangle([-9.0, -9.0, z], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
    let both = [(-1.0, 0.0, filled(GLASS, 1)), (-3.0, -1.0, filled(WATER, 0))];
    let expected = [stack(&[fresnel(1.0, GLASS), fresnel(GLASS, WATER)]), stack(&[fresnel(1.0, WATER), fresnel(WATER, GLASS)])];
    for (what, adds) in [("boxes", [plain; 2]), ("meshes", [mesh; 2]), ("box and mesh", [plain, mesh]), ("stretched", [stretched, plain])] {
        for order in [[0, 1], [1, 0]] {
            let things = |z: f64| {
                let stage = order.iter().fold(Stage::new(), |stage, &i| {
                    let (from, to, material) = both[i].clone();
                    adds[i](stage, from, to, material)
                });
                stage.with(black(z), diffuse([0.0; 3])).within(SKY)
            };
            // A black sheet within the second of them swallows what gets there.
            for (side, (eye, sheet)) in [(5.0, -2.0), (-9.0, -0.5)].into_iter().enumerate() {
                // Known to less than 0.1 %.
                let seen = things(sheet).seen([0.1, 0.2, eye], [0.1, 0.2, 0.0], path(64), 1 << 11);
                assert!(seen.iter().all(|seen| seen.error() < 1e-3 * seen.mean));
                assert_is(&format!("{what} in the order {order:?}, from side {side}"), seen, times(expected[side]));
            }
        }
    }
}

/// All that comes through glass, water and glass, or is reflected, in an even sky; and what absorbs absorbs over its own length, and not behind.
#[test]
fn who_has_gone_through_is_inside_of_nothing() {
    let three = |absorption: f32| {
        let stage = Stage::new().with(slab(-1.0, 0.0), filled(GLASS, 1)).with(slab(-3.0, -1.0), absorbing(WATER, 0, absorption));
        stage.with(slab(-4.0, -3.0), filled(GLASS, 1)).within(SKY)
    };
    assert_is("clear", three(0.0).seen([0.3, 0.2, 5.0], [0.0; 3], path(200), 64), times(1.0));
    // Nothing is bent or reflected: what is left is the way through the water, straight on.
    let index_one = |absorption: f32| {
        let stage = Stage::new().with(slab(-1.0, 0.0), filled(1.0, 2)).with(slab(-3.0, -1.0), absorbing(1.0, 1, absorption));
        stage.with(slab(-4.0, -3.0), absorbing(1.0, 3, 2.0 * absorption)).within(SKY)
    };
    assert_exactly("absorbing", index_one(0.25).seen(EYE, [0.0; 3], path(64), 16), times((-1.0_f64).exp()));
    // A mile behind them it is as dark as just behind: no absorption goes on.
    let mut far = index_one(0.25).with(rectangle([-9.0, -9.0, -500.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]), lamp([1.0; 3]));
    far.scene.background = tessera_engine::description::Environment::Constant([0.0; 3]);
    assert_exactly("far behind", far.seen(EYE, [0.0; 3], path(64), 16), [(-1.0_f64).exp(); 3]);
}

/// A ball of water that fills a hollow of the same radius in glass, as one ball within another of the same place: the outer border alone shows.
#[test]
fn equal_balls_in_one_place_are_the_one_of_higher_priority() {
    let thing =
        || Stage::new().with(sphere([0.0; 3], 1.0), filled(GLASS, 1)).with(sphere([0.0, -3.0, 0.0], 1.5), lamp([1.0; 3])).within(SKY);
    let both = thing().with(sphere([0.0; 3], 1.0), filled(WATER, 0));
    let (eye, target) = ([0.3, 0.5, 5.0], [0.2, 0.3, 0.0]);
    let seen = |stage: &Stage| -> [Estimate; 3] { stage.seen(eye, target, path(64), 256) };
    assert_alike("two balls", seen(&both), seen(&thing()));
    // Blocks of one glass that touch are one block.
    let halves = Stage::new().with(slab(-1.0, 0.0), filled(GLASS, 0)).with(slab(-3.0, -1.0), filled(GLASS, 0)).within(SKY);
    let whole = Stage::new().with(slab(-3.0, 0.0), filled(GLASS, 0)).within(SKY);
    let sheet = |stage: Stage| stage.with(rectangle([-9.0, -9.0, -5.0], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]), diffuse([0.2, 0.5, 0.1]));
    assert_alike("two halves", sheet(halves).seen(eye, target, path(64), 256), sheet(whole).seen(eye, target, path(64), 256));
}

/// A camera within the water, and the light of a lamp that comes through both to a floor there: rays towards lights go through faces as others do.
#[test]
fn a_camera_within_knows_where_it_is() {
    let stage = |absorption: f32| {
        let both = Stage::new().with(slab(-1.0, 0.0), filled(1.0, 2)).with(slab(-3.0, -1.0), absorbing(1.0, 1, absorption));
        both.with(rectangle([-9.0, -9.0, -2.5], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]), diffuse([0.5; 3]))
            .with(slab(-4.0, -3.0), filled(1.0, 2))
    };
    let up = stage(0.25).within(SKY).seen([0.0, 0.0, -2.0], EYE, path(8), 16);
    assert_exactly("upwards", up, times((-0.25_f64).exp()));
    // Smoke on smoke, before a white floor and its light: 1 of the light's way through the one, 1.5 through the other, and 0.5 of the eye's.
    let smoke =
        |absorption: f32| Material::Boundary { interior: Medium { absorption: [absorption; 3], scattering: [0.0; 3], anisotropy: 0.0 } };
    let floor = rectangle([-9.0, -9.0, -2.5], [18.0, 0.0, 0.0], [0.0, 18.0, 0.0]);
    let both = Stage::new().with(slab(-1.0, 0.0), smoke(0.5)).with(slab(-3.0, -1.0), smoke(0.25)).with(floor, diffuse([1.0; 3]));
    let seen = both.lit(point([0.0, 0.0, 0.5], [9.0; 3])).seen([0.0, 1e-4, -2.0], [0.0, 0.0, -2.5], path(2), 4);
    assert_exactly("a floor under smoke", seen, [(-1.0_f64).exp() / std::f64::consts::PI; 3]);
}
