//! Numbers from one end of what can be told to the other.

use std::f64::consts::FRAC_1_PI;

use tessera_engine::description::{Material, Render, Rgb, Shape};
use tessera_tests::stage::{Stage, diffuse, ground, lamp, path, point, rectangle, sphere};

use super::{assert_exactly, assert_is};

fn whitted() -> Render {
    Render::Whitted { max_depth: 4, transparent_shadows: false, min_weight: 0.0 }
}

/// A wall between two rooms, one with a light of 1e30, one with a light of 1e-30.
#[test]
fn a_giant_light_and_a_tiny_one_are_each_right() {
    let wall = Shape::Box { min: [-0.1, -1.0, -50.0], max: [0.1, 50.0, 50.0] };
    let stage = Stage::new().with(ground(), diffuse([0.5; 3])).with(wall, diffuse([0.5; 3]));
    let stage = stage.lit(point([-2.0, 2.0, 0.0], [1e30; 3])).lit(point([2.0, 2.0, 0.0], [1e-30; 3]));
    for (x, intensity) in [(-2.0, f64::from(1e30_f32)), (2.0, f64::from(1e-30_f32))] {
        let seen = stage.seen([x, 1.0, 1.0], [x, 0.0, 0.0], whitted(), 1);
        assert_exactly("room", seen, [0.5 * FRAC_1_PI * intensity / 4.0; 3]);
    }
}

/// Lengths have no unit either: a lamp of any size, seen from as far in proportion, lights alike.
#[test]
fn lengths_have_no_unit() {
    let radiance: Rgb = [4.0, 2.0, 1.0];
    for scale in [1e-12, 1e-6, 1e6, 1e12] {
        let lamps = [
            sphere([0.0, scale, 0.0], 0.5 * scale),
            Shape::Disc { center: [0.0, scale, 0.0], normal: [0.0, -1.0, 0.0], radius: scale / 3f64.sqrt() },
        ];
        for shape in lamps {
            let floor = rectangle([-9.0 * scale, 0.0, 9.0 * scale], [18.0 * scale, 0.0, 0.0], [0.0, 0.0, -18.0 * scale]);
            let stage = Stage::new().with(floor, diffuse([0.5; 3])).with(shape, lamp(radiance));
            let seen = stage.seen([0.0, 0.3 * scale, 3.0 * scale], [0.0; 3], path(3), 64);
            assert_is(&format!("scale {scale:e}"), seen, radiance.map(|x| f64::from(x) * 0.125));
        }
    }
}

/// What has no area or no power takes no part, and spoils nothing.
#[test]
fn lamps_without_area_or_power_are_nothing() {
    let radiance: Rgb = [4.0, 2.0, 1.0];
    let dark = Material::Emitter { radiance: [0.0; 3], texture: None, two_sided: true };
    let mut stage = Stage::new().with(ground(), diffuse([0.5; 3])).with(sphere([0.0, 1.0, 0.0], 0.5), lamp(radiance));
    stage = stage.with(sphere([3.0, 1.0, 0.0], 0.5), dark).lit(point([1.0, 2.0, 0.0], [0.0; 3]));
    stage = stage.with_mesh(&[[2.0, 1.0, 0.0], [2.0, 1.0, 0.0], [3.0, 1.0, 0.0], [2.5, 1.0, 0.0]], &[[0, 1, 2], [1, 2, 3]], lamp([1e9; 3]));
    let seen = stage.seen([0.0, 0.3, 3.0], [0.0; 3], path(2), 64);
    assert_is("lamp", seen, radiance.map(|x| f64::from(x) * 0.125));
}
