//! Many lights, and what chooses between them: together they give what each gives alone, and a lamp that may be chosen gives what scattered rays find of it.

use tessera_engine::description::{Fresnel, Light, Material, Render, Rgb, Shape, SourceId};
use tessera_tests::{
    stage::{Stage, diffuse, directional, ground, lamp, path, point, rectangle, sphere},
    statistics::Estimate,
};

use super::assert_alike;

const EYE: [f64; 3] = [0.0, 1.0, 2.5];
const HIDDEN: [f64; 3] = [1.0, 1.0 + 1e-9, 1.0];

fn metal(roughness: f64) -> Material {
    Material::Metal { fresnel: Fresnel::Schlick([0.9, 0.6, 0.3]), roughness: [roughness; 2], multiple_scattering: true }
}

fn frosted() -> Material {
    let (reflectance, transmittance) = ([1.0, 0.9, 0.8], [0.7, 0.8, 0.9]);
    Material::Glass { ior: 1.5, reflectance, transmittance, roughness: 0.6, multiple_scattering: true, interior: None, priority: 0 }
}

/// Adds lights of one kind to a scene, times a factor: where that is 0, their bodies stand there all the same, and block what others send.
type Add = fn(Stage, f32) -> Stage;

fn times(radiance: Rgb, factor: f32) -> Rgb {
    radiance.map(|x| x * factor)
}

/// Lights of every kind.
const KINDS: [(&str, Add); 9] = [
    ("sphere", |stage, f| stage.with(sphere([1.0, 1.5, 0.0], 0.4), lamp(times([4.0, 3.0, 2.0], f)))),
    ("two spheres", |stage, f| {
        let stage = stage.with(sphere([-3.0, 1.0, 1.0], 0.3), lamp(times([4.0, 1.0, 2.0], f)));
        stage.with(sphere([3.0, 1.0, 2.0], 0.1), lamp(times([40.0, 30.0, 2.0], f)))
    }),
    ("rectangle", |stage, f| stage.with(rectangle([-1.5, 1.2, -1.0], [0.5, 0.2, 0.0], [0.0, 0.0, 1.0]), lamp(times([1.0, 5.0, 3.0], f)))),
    ("skewed", |stage, f| stage.with(rectangle([-0.3, 2.0, -1.0], [0.8, 0.2, 0.0], [0.3, 0.0, 1.0]), lamp(times([3.0, 1.0, 2.0], f)))),
    ("disc", |stage, f| {
        let shape = Shape::Disc { center: [0.0, 0.6, -1.5], normal: [0.0, -0.2, 1.0], radius: 0.5 };
        stage.with(shape, lamp(times([2.0, 2.0, 6.0], f)))
    }),
    ("mesh", |stage, f| {
        let positions = [[1.5, 0.3, -1.0], [1.5, 1.3, -1.0], [1.2, 0.3, 0.0], [1.2, 1.3, 0.0]];
        let material = Material::Emitter { radiance: times([5.0, 1.0, 1.0], f), texture: None, two_sided: true };
        stage.with_mesh(&positions, &[[0, 1, 2], [1, 3, 2]], material)
    }),
    ("point and spot", |stage, f| {
        let (position, direction, intensity) = ([0.5, 3.0, 1.0], [-0.2, -1.0, -0.3], times([3.0, 6.0, 3.0], f));
        let spot = Light::Spot { position, direction, intensity, inner: 10.0, outer: 50.0, source: SourceId::default() };
        stage.lit(point([-1.0, 2.0, 0.5], times([2.0, 1.0, 3.0], f))).lit(spot)
    }),
    ("suns", |stage, f| {
        let stage = stage.lit(directional([0.5, -1.0, -0.7], times([0.5, 0.4, 0.3], f), 0.0));
        stage.lit(directional([-0.5, -1.0, -0.7], times([0.2, 0.4, 0.6], f), 20.0))
    }),
    ("image", |stage, f| {
        let pixel = |x: usize, y: usize| if y < 4 { [(x % 8) as f32 * 0.125, 0.25, 0.5 * (x % 2) as f32] } else { [0.125; 3] };
        stage.within_image(16, 8, |x, y| times(pixel(x, y), f))
    }),
];

/// Light adds up, whatever chooses which light is looked at.
#[test]
fn lights_together_give_what_each_gives_alone() {
    for (what, material) in
        [("diffuse", diffuse([0.5, 0.6, 0.7])), ("metal 0.3", metal(0.3)), ("metal 0.7", metal(0.7)), ("glass", frosted())]
    {
        let seen = |shines: &dyn Fn(usize) -> bool| {
            let thing = Stage::new().with(ground(), material.clone());
            let lit = KINDS.iter().enumerate().fold(thing, |stage, (i, (_, add))| add(stage, f32::from(u8::from(shines(i)))));
            lit.seen(EYE, [0.0; 3], path(2), 512)
        };
        let together = seen(&|_| true);
        let alone: Vec<_> = (0..KINDS.len()).map(|one| seen(&|i| i == one)).collect();
        for (kind, seen) in KINDS.iter().zip(&alone) {
            println!("{what}, {}: {:.6} +- {:.6}", kind.0, seen[0].mean, seen[0].error());
        }
        let sum = [0, 1, 2].map(|channel| Estimate::sum(alone.iter().map(|seen| seen[channel])));
        assert_alike(what, together, sum);
    }
}

/// On surfaces that reflect much in few directions and on ones that do not, weights of both ways to find a lamp add up to one.
#[test]
fn lamps_that_may_be_chosen_give_what_rays_find_of_them() {
    let shapes = [
        ("sphere", sphere([0.4, 1.0, -2.0], 0.7)),
        ("disc", Shape::Disc { center: [0.4, 1.0, -2.0], normal: [0.0, -0.2, 1.0], radius: 0.8 }),
    ];
    for (what, shape) in shapes {
        for material in [metal(0.2), metal(0.5), frosted(), diffuse([0.8, 0.5, 0.2])] {
            let thing = || Stage::new().with(ground(), material.clone());
            let seen = |stage: Stage, samples| stage.seen(EYE, [0.0; 3], path(2), samples);
            let chosen = seen(thing().with(shape.clone(), lamp([4.0, 2.0, 1.0])), 256);
            let found = seen(thing().with_stretched(shape.clone(), lamp([4.0, 2.0, 1.0]), HIDDEN), 2048);
            assert_alike(what, chosen, found);
        }
    }
}

/// Over several reflections, with rough metal and glass, and with roulette.
#[test]
fn a_room_is_the_same_by_chosen_lamps_and_by_rays() {
    let room = |hidden: bool, render: Render| {
        let stage = Stage::new()
            .with(Shape::Box { min: [-2.0, 0.0, -2.0], max: [2.0, 3.0, 3.0] }, diffuse([0.6, 0.5, 0.7]))
            .with(sphere([-0.9, 0.6, -0.3], 0.6), metal(0.4))
            .with(sphere([0.9, 0.6, -0.3], 0.6), frosted())
            .with(Shape::Box { min: [-0.2, 0.0, -1.0], max: [0.2, 1.5, -0.6] }, diffuse([0.2, 0.8, 0.4]));
        let (shape, radiance) = (Shape::Disc { center: [0.3, 2.9, -0.4], normal: [0.0, -1.0, 0.0], radius: 0.9 }, lamp([4.0, 3.0, 2.0]));
        let stage = if hidden { stage.with_stretched(shape, radiance, HIDDEN) } else { stage.with(shape, radiance) };
        let samples = if hidden { 512 } else { 256 };
        [[0.0, 0.0, 0.4], [-0.6, 0.9, 0.1], [-2.0, 1.4, -0.5]].map(|target| stage.seen(EYE, target, render.clone(), samples))
    };
    for render in [path(4), Render::Path { max_depth: 24, roulette_depth: 2, smooth_terminator: false }] {
        for (place, (chosen, found)) in room(false, render.clone()).into_iter().zip(room(true, render)).enumerate() {
            assert_alike(&format!("room, place {place}"), chosen, found);
        }
    }
}

/// Ten thousand lamps that cover what one lamp covers cost at most twice its standard error.
#[test]
fn ten_thousand_lamps_are_hardly_noisier_than_one() {
    const SIDE: u32 = 100;
    let (corner, size, radiance): (f64, f64, Rgb) = (-2.0, 4.0, [1.0, 0.75, 0.5]);
    let thing = || Stage::new().with(ground(), diffuse([0.5; 3]));
    let cells = || (0..SIDE * SIDE).map(|i| [i % SIDE, i / SIDE].map(|k| corner + size * f64::from(k) / f64::from(SIDE)));
    let cell = size / f64::from(SIDE);
    let tiles =
        cells().fold(thing(), |stage, [x, z]| stage.with(rectangle([x, 1.5, z], [cell, 0.0, 0.0], [0.0, 0.0, cell]), lamp(radiance)));
    let one = thing().with(rectangle([corner, 1.5, corner], [size, 0.0, 0.0], [0.0, 0.0, size]), lamp(radiance));
    // Points at the middle of each, of the same power: radiance times area is intensity straight on, and pi times that goes to all sides.
    let intensity = radiance.map(|x| x * 0.25 * (cell * cell) as f32);
    let points = cells().fold(thing(), |stage, [x, z]| stage.lit(point([x + 0.5 * cell, 1.5, z + 0.5 * cell], intensity)));
    let seen = |stage: &Stage| stage.seen([0.0, 0.5, 2.0], [0.3, 0.0, 0.1], path(2), 1);
    let noise = |seen: [Estimate; 3]| seen[0].error() / seen[0].mean * 32.0;
    let (tiles, one, points) = (seen(&tiles), seen(&one), seen(&points));
    println!("relative deviation of a sample: one lamp {:.3}, tiles {:.3}, points {:.3}", noise(one), noise(tiles), noise(points));
    assert!(tiles[0].compared(one[0]).1 > 1e-4, "tiles {:?}, one {:?}", tiles[0], one[0]);
    for many in [tiles, points] {
        assert!(noise(many) <= 2.0 * noise(one), "{} where one lamp has {}", noise(many), noise(one));
    }
}
