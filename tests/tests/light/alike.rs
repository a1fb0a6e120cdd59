//! The same light told in another way: another integrator, another kind of light, another seed, samples taken in two runs, another unit.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use tessera_engine::{
    description::{Camera, Environment, Film, Filter, Fresnel, Light, Material, Render, Rgb, Shape, SourceId},
    part::{PairwiseSum, Rect, SampleRange},
};
use tessera_tests::{
    seeds,
    stage::{Stage, diffuse, directional, ground, lamp, path, point, rectangle, sphere},
    statistics::{SIGNIFICANCE, sidak},
};

use super::assert_alike;

fn camera() -> Camera {
    Camera::pinhole([0.0, 2.0, 6.0], [0.0, 0.7, 0.0], [0.0, 1.0, 0.0], 45.0)
}

fn film(filter: Filter) -> Film {
    Film { width: 48, height: 32, filter }
}

const ONE: SampleRange = SampleRange { first: 0, count: 1 };

fn diffuse_things() -> Stage {
    Stage::new()
        .with(ground(), diffuse([0.5, 0.6, 0.7]))
        .with(sphere([-1.0, 0.7, 0.0], 0.7), diffuse([0.9, 0.2, 0.1]))
        .with(Shape::Box { min: [0.3, 0.0, -0.5], max: [1.3, 1.2, 0.5] }, diffuse([0.1, 0.8, 0.3]))
        .with(sphere([0.6, 0.3, 1.5], 0.3), diffuse([0.2, 0.2, 0.9]))
}

/// Of one light that stands somewhere and one infinitely far away nothing is left to chance: a path of two rays is what Whitted's ray tracing computes, to rounding.
#[test]
fn two_rays_of_a_path_are_whitteds() {
    let spot = Light::Spot {
        position: [2.0, 5.0, 3.0],
        direction: [-0.4, -1.0, -0.5],
        intensity: [30.0, 25.0, 20.0],
        inner: 5.0,
        outer: 25.0,
        source: SourceId::default(),
    };
    let sun = || directional([1.0, -2.0, -0.5], [1.0, 0.9, 0.8], 0.0);
    let lights = [vec![point([-2.0, 4.0, 3.0], [40.0, 30.0, 20.0])], vec![sun()], vec![spot, sun()]];
    for lights in lights {
        let stage = lights.into_iter().fold(diffuse_things(), Stage::lit);
        let pixels = |render| seeds::picture(&stage.compiled(camera(), film(Filter::Point), render), ONE);
        let whitted = pixels(Render::Whitted { max_depth: 8, transparent_shadows: false, min_weight: 0.0 });
        let (mut lit, mut shadow) = (0, 0);
        for (a, b) in pixels(path(2)).iter().zip(&whitted) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs()), "{a:?} is not {b:?}");
            if *b == [0.0; 3] {
                shadow += 1
            } else {
                lit += 1
            };
        }
        assert!(lit > 100 && shadow > 20, "{lit} pixels lit, {shadow} in shadow: nothing to see");
    }
}

/// A room in which all that is there plays a part.
fn room() -> Stage {
    diffuse_things()
        .with(rectangle([-0.8, 2.6, -0.8], [1.6, 0.0, 0.0], [0.0, 0.0, 1.6]), lamp([4.0, 3.5, 3.0]))
        .with(sphere([-0.3, 0.4, 1.2], 0.4), Material::smooth_glass(1.5, [0.9, 1.0, 0.95]))
        .within([0.1, 0.15, 0.2])
}

/// Two halves of 16 seeds, pixel by pixel: none may differ by more than chance allows.
#[test]
fn seeds_differ_by_chance_alone() {
    let mut scene = room().compiled(camera(), film(Filter::Box), path(6));
    let (a, b) = (seeds::pictures(&mut scene, 0..8, 32), seeds::pictures(&mut scene, 8..16, 32));
    let mut lowest: f64 = 1.0;
    for (x, y) in (0..32).flat_map(|y| (0..48).map(move |x| (x, y))) {
        for channel in 0..3 {
            let rect = Rect { x, y, width: 1, height: 1 };
            lowest = lowest.min(a.mean(rect, channel).compared(b.mean(rect, channel)).1);
        }
    }
    println!("lowest p {lowest:.2e}");
    assert!(lowest >= sidak(SIGNIFICANCE, 48 * 32 * 3));
    assert_alike("whole", a.all(), b.all());
}

/// Parts of 64 samples each, added by the tree that all samples are added by, are 4096 at once: the bits of single precision that parts are rounded to are all that is lost.
#[test]
fn samples_taken_in_runs_are_those_taken_at_once() {
    let film = Film { width: 8, height: 6, filter: Filter::Box };
    let scene = room().compiled(camera(), film, path(6));
    let whole = seeds::picture(&scene, SampleRange { first: 0, count: 4096 });
    let mut sums = vec![PairwiseSum::default(); whole.len()];
    for run in 0..64 {
        let part = seeds::picture(&scene, SampleRange { first: 64 * run, count: 64 });
        sums.iter_mut().zip(part).for_each(|(sum, pixel)| sum.push(DVec3::from(pixel.map(f64::from))));
    }
    for (sum, whole) in sums.iter().zip(&whole) {
        let (mean, whole) = (sum.total() / 64.0, DVec3::from(whole.map(f64::from)));
        assert!(((mean - whole) / whole).abs().max_element() < 1.2e-7, "{mean} is not {whole}");
    }
}

fn rough(roughness: f64) -> Material {
    Material::Metal { fresnel: Fresnel::Schlick([0.9, 0.6, 0.3]), roughness: [roughness; 2], multiple_scattering: true }
}

/// An image of one colour is sampled, a constant sky is not: they look alike.
#[test]
fn an_image_of_one_colour_is_a_constant_sky() {
    let sky: Rgb = [0.5, 1.0, 0.25];
    for material in [diffuse([0.5, 0.75, 1.0]), rough(0.4), rough(0.8)] {
        let things = Stage::new().with(ground(), material).with(sphere([0.0, 1.0, -1.2], 1.0), diffuse([0.8, 0.4, 0.2]));
        let seen = |stage: Stage| stage.seen([0.0, 1.5, 1.2], [0.1, 0.0, 0.0], path(5), 256);
        assert_alike("sky", seen(things.clone().within_image(32, 16, |_, _| sky)), seen(things.within(sky)));
    }
}

/// One bright pixel of an image is a sun: its irradiance is the integral of the interpolated pixel, here by quadrature.
#[test]
fn a_bright_pixel_is_a_sun() {
    let (width, height, column, row) = (128_usize, 64_usize, 32_usize, 12_usize);
    let bright: Rgb = [4096.0, 2048.0, 1024.0];
    let (mut irradiance, mut flux, mut towards) = (0.0, 0.0, DVec3::ZERO);
    const STEPS: u32 = 400;
    for (i, j) in (0..STEPS).flat_map(|i| (0..STEPS).map(move |j| (i, j))) {
        let [x, y] = [i, j].map(|i| 2.0 * (f64::from(i) + 0.5) / f64::from(STEPS) - 1.0);
        let weight = (1.0 - x.abs()) * (1.0 - y.abs());
        let (longitude, polar) = (
            std::f64::consts::TAU * ((column as f64 + 0.5 + x) / width as f64 - 0.5),
            std::f64::consts::PI * (row as f64 + 0.5 + y) / height as f64,
        );
        let area = polar.sin() * std::f64::consts::TAU * std::f64::consts::PI / (width * height) as f64 * (2.0 / f64::from(STEPS)).powi(2);
        let direction = DVec3::new(longitude.sin() * polar.sin(), polar.cos(), -longitude.cos() * polar.sin());
        irradiance += weight * area * polar.cos();
        flux += weight * area;
        towards += direction * weight * area;
    }
    let image = || Stage::new().within_image(width, height, |x, y| if (x, y) == (column, row) { bright } else { [0.0; 3] });
    let plane = |stage: Stage| stage.with(ground(), diffuse([0.5; 3])).seen([0.0, 1.0, 2.0], [0.1, 0.0, 0.0], path(2), 256);
    super::assert_is("pixel", plane(image()), bright.map(|x| f64::from(x) * 0.5 * FRAC_1_PI * irradiance));
    // A sun of the same irradiance and nearly the same extent, on a surface that is rough enough not to tell their shapes.
    let sun = directional((-towards).to_array(), bright.map(|x| x * flux as f32), 3.2);
    for material in [diffuse([0.5; 3]), rough(0.9)] {
        let thing =
            |stage: Stage| stage.with(sphere([0.0; 3], 1.0), material.clone()).seen([-3.0, 2.0, 1.0], [-0.7, 0.6, 0.3], path(4), 256);
        for (a, b) in thing(image()).into_iter().zip(thing(Stage::new().lit(sun.clone()))) {
            let (ratio, error) = (a.mean / b.mean, (a.variance + b.variance).sqrt() / b.mean);
            println!("{ratio:.5} +- {error:.5}");
            assert!((ratio - 1.0).abs() < 2e-3 + 4.0 * error && error < 2e-3, "{ratio} +- {error}");
        }
    }
}

/// Lights that are 2^k times as strong give 2^k times the picture, bit for bit.
#[test]
fn lights_have_no_unit() {
    let scaled = |power: i32| {
        let factor = 2f32.powi(power);
        let times = |color: Rgb| color.map(|x| x * factor);
        let stage = room()
            .with(sphere([2.0, 2.0, 1.0], 0.25), lamp(times([8.0, 7.0, 6.0])))
            .with_mesh(&[[-2.0, 0.5, 1.0], [-2.0, 1.0, 1.0], [-1.8, 0.5, 1.5]], &[[0, 1, 2]], lamp(times([5.0, 7.0, 9.0])))
            .lit(point([1.0, 3.0, 2.0], times([3.0, 2.0, 1.0])))
            .lit(directional([1.0, -2.0, -0.5], times([1.0, 0.9, 0.8]), 2.0));
        let mut stage = stage;
        for material in &mut stage.scene.materials {
            if let Material::Emitter { radiance, .. } = material
                && *radiance == [4.0, 3.5, 3.0]
            {
                *radiance = times(*radiance);
            }
        }
        stage.scene.background = Environment::Constant(times([0.1, 0.15, 0.2]));
        let scene = stage.compiled(camera(), film(Filter::Box), Render::Path { max_depth: 8, roulette_depth: 3, smooth_terminator: false });
        let pixels = seeds::picture(&scene, SampleRange { first: 0, count: 4 });
        pixels.iter().flatten().map(|x| (x / factor).to_bits()).collect::<Vec<_>>()
    };
    let expected = scaled(0);
    for power in [-60, -7, 30, 100] {
        assert!(scaled(power) == expected, "2^{power}");
    }
}

/// Glass of the same index as what is around it is not there.
#[test]
fn glass_without_an_index_vanishes() {
    let checker = Material::Diffuse { reflectance: [1.0; 3], texture: Some(0) };
    let things = || {
        let mut stage = Stage::new().with(ground(), checker.clone()).lit(point([0.0, 6.0, -6.0], [40.0, 30.0, 20.0]));
        stage.scene.textures.push(tessera_engine::description::Texture::Checker { even: [0.8; 3], odd: [0.2; 3], size: 0.25 });
        stage.within_image(16, 8, |x, y| [0.0, (x % 4) as f32, (y % 4) as f32])
    };
    // Between the eye and what it sees, off the way of the light.
    let hidden = things().with(sphere([0.0, 1.4, 3.5], 0.5), Material::smooth_glass(1.0, [1.0; 3]));
    for render in [Render::Whitted { max_depth: 8, transparent_shadows: false, min_weight: 0.0 }, path(4)] {
        let pixels = |stage: &Stage| {
            let mut stage = stage.clone();
            if matches!(render, Render::Path { .. }) {
                // Nothing that is left to chance.
                stage.scene.background = Environment::Constant([0.5, 0.25, 1.0]);
                stage.scene.materials[0] = lamp([1.0, 2.0, 3.0]);
            }
            seeds::picture(&stage.compiled(camera(), film(Filter::Point), render.clone()), ONE)
        };
        for (a, b) in pixels(&hidden).iter().zip(pixels(&things())) {
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * b.abs()), "{a:?} is not {b:?}");
        }
    }
    // What is lit through it, where rays alone find the lamp.
    let lit = |stage: Stage| {
        let stage = stage
            .with(ground(), diffuse([0.5; 3]))
            .with(rectangle([-1.0, 2.0, -1.0], [2.0, 0.0, 0.0], [0.0, 0.0, 2.0]), lamp([3.0, 2.0, 1.0]));
        stage.seen([0.0, 0.5, 3.0], [0.0; 3], path(6), 512)
    };
    let through = Stage::new().with(sphere([0.0, 1.0, 0.0], 0.5), Material::smooth_glass(1.0, [1.0; 3]));
    assert_alike("lit through it", lit(through), lit(Stage::new()));
}

/// The filter's weights, which are negative in part, show at an edge: with Mitchell and Netravali's cubic, a step overshoots by what its integral says.
#[test]
fn an_edge_shows_the_filters_integral() {
    let cubic = |x: f64| {
        let x = x.abs();
        let [b, c] = [1.0 / 3.0; 2];
        let polynomial: [f64; 4] = if x < 1.0 {
            [12.0 - 9.0 * b - 6.0 * c, -18.0 + 12.0 * b + 6.0 * c, 0.0, 6.0 - 2.0 * b]
        } else if x < 2.0 {
            [-b - 6.0 * c, 6.0 * b + 30.0 * c, -12.0 * b - 48.0 * c, 8.0 * b + 24.0 * c]
        } else {
            [0.0; 4]
        };
        polynomial.iter().fold(0.0, |sum, factor| sum * x + factor) / 6.0
    };
    let above =
        |edge: f64| (0..40_000).map(|i| -2.0 + f64::from(i) * 1e-4 + 5e-5).filter(|x| *x > edge).map(|x| cubic(x) * 1e-4).sum::<f64>();
    // Eight columns of a scene unit, seen straight on; from x = 0 on it is bright.
    let (columns, rows) = (8, 512);
    let camera = Camera::Orthographic { eye: [0.0, 0.0, 1.0], look_at: [0.0; 3], up: [0.0, 1.0, 0.0], width: f64::from(columns) };
    let bright = Stage::new().with(rectangle([0.0, -1e4, 0.0], [1e4, 0.0, 0.0], [0.0, 2e4, 0.0]), lamp([2.0, 3.0, 5.0])).within([1.0; 3]);
    let mut scene = bright.compiled(camera, Film { width: columns, height: rows, filter: Filter::Mitchell }, path(1));
    let pictures = seeds::pictures(&mut scene, 0..4, 64);
    for column in 0..columns {
        let share = above(-(f64::from(column) + 0.5 - 4.0));
        let seen = [0, 1, 2].map(|channel| pictures.mean(Rect { x: column, y: 0, width: 1, height: rows }, channel));
        super::assert_is(&format!("column {column}"), seen, [1.0, 2.0, 4.0].map(|step| 1.0 + step * share));
    }
}
