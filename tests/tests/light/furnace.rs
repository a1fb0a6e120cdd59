//! Light that is scattered many times: furnaces, cavities, and long chains of mirrors.

use tessera_engine::{
    description::{Camera, Film, Filter, Fresnel, Material, Render, Rgb, Shape},
    part::SampleRange,
};
use tessera_tests::{
    seeds,
    stage::{Stage, diffuse, ground, lamp, path, point, rectangle, sphere},
};

use super::{assert_alike, assert_exactly, assert_is};

const SKY: Rgb = [1.0, 2.0, 0.5];

fn sky(share: f64) -> [f64; 3] {
    SKY.map(|x| f64::from(x) * share)
}

fn metal(roughness: f64) -> Material {
    Material::Metal { fresnel: Fresnel::Constant([1.0; 3]), roughness: [roughness; 2], multiple_scattering: true }
}

fn glass(ior: f64, roughness: f64) -> Material {
    Material::Glass {
        ior,
        reflectance: [1.0; 3],
        transmittance: [1.0; 3],
        roughness,
        multiple_scattering: true,
        interior: None,
        priority: 0,
    }
}

/// Beside the middle, so that normals and directions are no special ones.
fn across_a_sphere(material: Material, render: Render, samples: u64) -> [tessera_tests::statistics::Estimate; 3] {
    Stage::new().with(sphere([0.0; 3], 1.0), material).within(SKY).seen([0.2, 0.3, 3.0], [0.4, 0.35, 0.0], render, samples)
}

#[test]
fn what_is_convex_shows_its_albedo_of_an_even_sky() {
    let seen = across_a_sphere(diffuse([0.75, 0.5, 0.25]), path(100), 4);
    assert_exactly("diffuse", seen, [0.75, 1.0, 0.125]);
    assert_exactly("mirror", across_a_sphere(Material::Mirror { reflectance: [0.75, 0.5, 0.25] }, path(100), 4), [0.75, 1.0, 0.125]);
}

/// White surfaces lose nothing and add nothing: no shape shows in an even sky.
#[test]
fn what_is_white_is_not_seen_in_an_even_sky() {
    let valley = Stage::new()
        .with(ground(), diffuse([1.0; 3]))
        .with(Shape::Box { min: [-1.0, 0.0, -1.0], max: [-0.5, 1.0, 1.0] }, diffuse([1.0; 3]))
        .with(Shape::Box { min: [0.5, 0.0, -1.0], max: [1.0, 1.0, 1.0] }, Material::Mirror { reflectance: [1.0; 3] })
        .within(SKY);
    assert_exactly("valley", valley.seen([0.2, 3.0, 0.3], [0.1, 0.0, 0.0], path(100_000), 4), sky(1.0));
    for render in [path(1000), Render::Path { max_depth: 1000, roulette_depth: 2, smooth_terminator: false }] {
        assert_is("smooth glass", across_a_sphere(glass(1.5, 0.0), render.clone(), 256), sky(1.0));
    }
}

/// Rough metals and glass keep what their facets send to each other, but by tables: they may be off by a thousandth.
#[test]
fn what_is_rough_and_white_is_hardly_seen_in_an_even_sky() {
    let mut wrong = Vec::new();
    for roughness in [0.01, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.8, 1.0] {
        for (what, material) in [("metal", metal(roughness)), ("glass", glass(1.5, roughness))] {
            let seen = across_a_sphere(material, Render::Path { max_depth: 1000, roulette_depth: 2, smooth_terminator: false }, 256)[0];
            let (off, error) = (seen.mean / f64::from(SKY[0]) - 1.0, seen.error() / f64::from(SKY[0]));
            let found = format!("{what} of roughness {roughness}: {:+.3} % +- {:.3} %", 100.0 * off, 100.0 * error);
            println!("{found}");
            if off.abs() >= 1e-3 + 4.0 * error || error > 2e-3 {
                wrong.push(found);
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

/// Chains that end by chance show in the mean what chains that never do show: also where the same surface chooses between reflection and refraction.
#[test]
fn roulette_changes_nothing_but_noise() {
    let colored = |roughness| {
        let (reflectance, transmittance) = ([0.4, 0.5, 0.6], [0.9, 0.7, 0.8]);
        Material::Glass { ior: 2.0, reflectance, transmittance, roughness, multiple_scattering: true, interior: None, priority: 0 }
    };
    let gilded = Material::Metal { fresnel: Fresnel::Schlick([0.9, 0.6, 0.3]), roughness: [0.7; 2], multiple_scattering: true };
    for (what, material) in [("smooth glass", colored(0.0)), ("rough glass", colored(0.5)), ("metal", gilded)] {
        // From below comes another light than from above, so that it matters where a chain goes.
        let seen = |render| {
            let floor = rectangle([-9.0, -1.5, 9.0], [18.0, 0.0, 0.0], [0.0, 0.0, -18.0]);
            let stage = Stage::new().with(sphere([0.0; 3], 1.0), material.clone()).with(floor, diffuse([0.3, 0.2, 0.1])).within(SKY);
            stage.seen([0.2, 0.9, 3.0], [0.4, 0.35, 0.0], render, 512)
        };
        let never = seen(path(60));
        assert_alike(what, seen(Render::Path { max_depth: 60, roulette_depth: 1, smooth_terminator: false }), never);
    }
}

/// Within a white sphere of albedo rho with a lamp of radius r in its middle, every point sees the lamp under the share F = r^2 and itself everywhere else: `B = rho (F L + (1 - F) B)`.
#[test]
fn a_cavity_adds_up_all_its_reflections() {
    let (radius, albedo, radiance) = (0.25_f64, [0.5_f32, 0.75, 0.25], [8.0_f32, 4.0, 2.0]);
    let expected = [0, 1, 2].map(|channel| {
        let (share, rho) = (radius * radius, f64::from(albedo[channel]));
        rho * share * f64::from(radiance[channel]) / (1.0 - rho * (1.0 - share))
    });
    let cavity = |hidden: bool| {
        let stage = Stage::new().with(sphere([0.0; 3], 1.0), diffuse(albedo));
        let shape = sphere([0.0; 3], radius);
        if hidden { stage.with_stretched(shape, lamp(radiance), [1.0 + 1e-9, 1.0, 1.0]) } else { stage.with(shape, lamp(radiance)) }
    };
    for (render, samples) in [(path(200), 64), (Render::Path { max_depth: 200, roulette_depth: 1, smooth_terminator: false }, 256)] {
        let seen = cavity(false).seen([0.6, 0.1, 0.0], [0.9, 0.2, 0.1], render.clone(), samples);
        assert_is("cavity", seen, expected);
        assert_is("cavity, hidden lamp", cavity(true).seen([0.6, 0.1, 0.0], [0.9, 0.2, 0.1], render, 4 * samples), expected);
    }
    // A chain of three rays shows the lamp, what it lights, and what that lights.
    let share = radius * radius;
    let two = [0, 1, 2].map(|channel| {
        let (rho, direct) = (f64::from(albedo[channel]), share * f64::from(radiance[channel]));
        rho * direct * (1.0 + rho * (1.0 - share))
    });
    assert_is("cavity, three rays", cavity(false).seen([0.6, 0.1, 0.0], [0.9, 0.2, 0.1], path(3), 64), two);
}

/// What one pixel shows.
fn one(stage: &Stage, eye: [f64; 3], look_at: [f64; 3], render: Render) -> [f32; 3] {
    let camera = Camera::pinhole(eye, look_at, [0.1, 1.0, 0.2], 30.0);
    let scene = stage.compiled(camera, Film { width: 1, height: 1, filter: Filter::Point }, render);
    seeds::picture(&scene, SampleRange { first: 0, count: 1 })[0]
}

/// Every reflection in a sphere of albedo rho around a point light brings the same light again: `L = E / pi rho / (1 - rho)`, here a thousand reflections' worth. A chain of 100,000 rays
/// has left out e^-100 of it.
#[test]
fn a_cavity_of_reflectance_0_999_is_a_thousand_times_as_bright() {
    let rho = 0.999_f32;
    let intensity = std::f32::consts::PI;
    let stage = Stage::new().with(sphere([0.0; 3], 1.0), diffuse([rho; 3])).lit(point([0.0; 3], [intensity; 3]));
    let expected = f64::from(intensity) / std::f64::consts::PI * f64::from(rho) / (1.0 - f64::from(rho));
    let [found, ..] = one(&stage, [0.5, 0.1, 0.0], [1.0, 0.3, 0.2], path(100_000));
    println!("{found} is {expected}");
    assert!((f64::from(found) / expected - 1.0).abs() < 1e-6, "{found} is not {expected}");
}

/// A ray between parallel mirrors drifts to a lamp after a known number of reflections, each by 0.9999; one ray less, and it is not there yet.
#[test]
fn a_chain_of_fifty_thousand_mirrors_loses_what_it_must() {
    let (reflections, rho) = (50_000_u32, 0.9999_f32);
    let mirror = Material::Mirror { reflectance: [rho; 3] };
    let slab = |y: f64| Shape::Plane { point: [0.0, y, 0.0], normal: [0.0, -y, 0.0] };
    let end = Shape::Plane { point: [1.0, 0.0, 0.0], normal: [-1.0, 0.0, 0.0] };
    let stage = Stage::new().with(slab(1.0), mirror.clone()).with(slab(-1.0), mirror).with(end, lamp([3.0, 2.0, 1.0]));
    // From the middle to x = 1 in as many times 2 upwards.
    let drift = 1.0 / (2.0 * f64::from(reflections));
    let seen = |rays| one(&stage, [0.0; 3], [drift, 1.0, 0.0], path(rays));
    let share = (f64::from(rho).ln() * f64::from(reflections)).exp();
    for (found, radiance) in seen(reflections + 1).into_iter().zip([3.0, 2.0, 1.0]) {
        println!("{found} is {}", radiance * share);
        assert!((f64::from(found) / (radiance * share) - 1.0).abs() < 1e-6);
    }
    assert_eq!(seen(reflections), [0.0; 3]);
}

/// Depth 1 shows what shines, 2 what is lit, 3 what that lights.
#[test]
fn depth_counts_rays_from_the_camera_on() {
    let roof = rectangle([-5.0, 1.0, -5.0], [10.0, 0.0, 0.0], [0.0, 0.0, 10.0]);
    let stage = Stage::new()
        .with(ground(), Material::Mirror { reflectance: [0.5; 3] })
        .with(roof, diffuse([1.0; 3]))
        .lit(point([0.0, 2.0, 0.0], [1.0; 3]));
    let dark = |rays| stage.seen([0.0, 0.5, 0.0], [0.1, 0.0, 0.0], path(rays), 1);
    for rays in 1..4 {
        // The light stands behind the roof.
        assert_exactly("dark", dark(rays), [0.0; 3]);
    }
    let lit = Stage::new()
        .with(ground(), Material::Mirror { reflectance: [0.5; 3] })
        .with(rectangle([-5.0, 1.0, -5.0], [10.0, 0.0, 0.0], [0.0, 0.0, 10.0]), diffuse([1.0; 3]))
        .lit(point([0.4, 0.5, 0.0], [std::f32::consts::PI; 3]));
    // From (0, 0.5) down to (0.1, 0), up to (0.3, 1).
    let squared = 0.01 + 0.25;
    let expected = 0.5 * (0.5 / f64::sqrt(squared)) / squared;
    assert_exactly("two rays", lit.seen([0.0, 0.5, 0.0], [0.1, 0.0, 0.0], path(2), 1), [0.0; 3]);
    assert_exactly("three rays", lit.seen([0.0, 0.5, 0.0], [0.1, 0.0, 0.0], path(3), 1), [expected; 3]);
}
