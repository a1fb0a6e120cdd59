//! Numbers from one end of what can be told to the other.

use std::{f64::consts::FRAC_1_PI, hint::black_box};

use tessera_engine::{
    description::{Camera, Film, Filter, Material, Render, Rgb, Shape},
    part::SampleRange,
};
use tessera_tests::{
    seeds,
    stage::{Stage, diffuse, ground, lamp, path, point, rectangle, sphere},
};

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

/// Two mirrors that leave 1e-38 of the light, before a floor that 1e38 falls on: chains end by chance at the second, without error in the mean.
#[test]
fn what_carries_next_to_nothing_ends_by_chance_without_bias() {
    let mirror = |y: f64, z: f64| {
        (rectangle([-1.0, y, z], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]), Material::Mirror { reflectance: [1e-19, 2e-19, 1e-20] })
    };
    let [(low, faint), (high, _)] = [mirror(0.0, -1.0), mirror(2.0, 1.0)];
    // Down to (0, 0, 0), up to (0, 2, 2), down to (0, -2, 6), where the floor's light is.
    let floor = Shape::Plane { point: [0.0, -2.0, 0.0], normal: [0.0, 1.0, 0.0] };
    let stage =
        Stage::new().with(low, faint.clone()).with(high, faint).with(floor, diffuse([0.5; 3])).lit(point([0.0, 0.0, 6.0], [1e38; 3]));
    let render = Render::Path { max_depth: 4, roulette_depth: 2, smooth_terminator: false };
    let seen = stage.seen([0.0, 1.0, -1.0], [0.0; 3], render, 1 << 8);
    let light = 0.5 * FRAC_1_PI * f64::from(1e38_f32) / 4.0;
    assert_is("two faint mirrors", seen, [1e-19_f32, 2e-19, 1e-20].map(|share| light * f64::from(share).powi(2)));
}

/// Radiance and what of it is scattered as single precision holds it with the fewest bits: the picture is that of a scene brighter by a power of two, but for the last bit that there is.
#[test]
fn the_smallest_numbers_are_kept() {
    let tiny = 2f32.powi(-130);
    let stage = |unit: f32| {
        let room = Stage::new()
            .with(ground(), diffuse([0.5, 0.25, 0.75]))
            .with(sphere([0.0, 1.0, 0.0], 0.5), lamp([unit, 0.75 * unit, 0.5 * unit]));
        let glass = Material::smooth_glass(1.5, [1.0; 3]);
        room.with(sphere([1.0, 0.5, 0.5], 0.5), glass).lit(point([-1.0, 1.0, 0.0], [unit; 3])).within([0.0, 0.125 * unit, 0.25 * unit])
    };
    for render in [path(6), whitted()] {
        let film = Film { width: 64, height: 48, filter: Filter::Box };
        let picture = |unit: f32| {
            let scene = stage(unit).compiled(
                Camera::pinhole([0.0, 1.0, 4.0], [0.0, 0.5, 0.0], [0.0, 1.0, 0.0], 50.0),
                film.clone(),
                render.clone(),
            );
            seeds::picture(&scene, SampleRange { first: 0, count: 16 })
        };
        let (faint, bright) = (picture(tiny), picture(1.0));
        let mut subnormal = 0;
        for (faint, bright) in faint.iter().flatten().zip(bright.iter().flatten()) {
            subnormal += u32::from(faint.is_subnormal());
            let error = (f64::from(*faint) - f64::from(*bright) * f64::from(tiny)).abs();
            assert!(error <= 2f64.powi(-149), "{faint:e} is not {bright:e} * 2^-130");
        }
        // The sphere is lit too: no number of the picture is a normal one, and nearly all are above 0.
        assert!(subnormal > 7_000, "only {subnormal} of 9216 numbers are subnormal");
    }
    // Nor has anything told the processor to take them for 0.
    assert!(black_box(f32::MIN_POSITIVE) * black_box(0.5) > 0.0 && black_box(f64::MIN_POSITIVE) * black_box(0.5) > 0.0);
}
