use glam::{DMat3, DVec2, DVec3, swizzles::Vec2Swizzles as _};

use super::*;
use crate::{
    light::{Environment, ImageEnvironment, LightSampler},
    sampling::{Sampler, uniform_sphere},
};

/// Points in order, spread evenly.
fn numbers(count: u64) -> impl Iterator<Item = (f64, DVec2)> {
    (0..count).map(|index| Sampler::new(1, (0, 0), index)).map(|sampler| (sampler.one(0), sampler.pair(0)))
}

#[test]
fn the_octahedron_is_a_map_of_the_sphere_with_the_density_that_it_tells() {
    let mut steradians = 0.0;
    for (_, place) in numbers(1 << 16) {
        let (direction, evenly) = folded(place);
        let (back, same) = unfolded(direction);
        assert!((direction.length() - 1.0).abs() < 1e-15 && back.distance(place) < 1e-14, "{place}");
        assert!((evenly / same - 1.0).abs() < 1e-13);
        steradians += 1.0 / evenly;
    }
    let sphere = 4.0 * std::f64::consts::PI;
    assert!((steradians / f64::from(1 << 16) / sphere - 1.0).abs() < 1e-4, "{steradians}");
}

#[test]
fn squares_choose_points_as_often_as_they_say() {
    let cluster = |(_, u): (f64, DVec2)| (DVec2::new(0.3, 0.6) + u * u * 0.25, 0.5 + u.x);
    let mut squares = Squares::default();
    squares.add(vec![(DVec2::splat(0.5), 1.0)]);
    let first = squares.add(numbers(200).map(cluster).collect());
    let (mut found, mut told) = ([0.0; 64], [0.0; 64]);
    let cell = |point: DVec2| (point.y * 8.0) as usize * 8 + (point.x * 8.0) as usize;
    let share = 1.0 / f64::from(1 << 16);
    for (_, u) in numbers(1 << 16) {
        let (point, density) = squares.sample(first, u);
        assert!((density / squares.pdf(first, point) - 1.0).abs() < 1e-12);
        found[cell(point)] += share;
        told[cell(u)] += squares.pdf(first, u) * share;
    }
    let most = found.iter().copied().fold(0.0, f64::max);
    assert!(most > 0.1, "nothing was learnt: {most}");
    for (found, told) in found.iter().zip(told) {
        assert!((found - told).abs() < 2e-3, "{found} {told}");
    }
}

/// Light of two casters on a floor: from a small lens above, and from a mirror far away or, below it, one whose rays have yet to meet.
fn photons(beyond: f64) -> Vec<Photon> {
    let photon = |(pick, u): (f64, DVec2)| {
        let point = DVec3::new(u.x, 0.0, u.y) * 0.5;
        let lens = pick < 0.7;
        let from = if lens { DVec3::new(0.2, 1.0, 0.3) } else { DVec3::new(0.3, beyond, 0.1) };
        let side = if lens || beyond > 0.0 { 1.0 } else { -1.0 };
        let towards = ((from - point) * side).normalize();
        let towards = (towards + uniform_sphere(u.yx()) * 0.2).normalize();
        Photon { point, towards, flux: 1.0 + pick, caster: (u32::from(lens), 0), begin: Begin::default() }
    };
    numbers(3000).map(photon).collect()
}

#[test]
fn directions_are_proposed_as_often_as_the_density_says() {
    for beyond in [5.0, 1e6, -3.0] {
        let photons = photons(beyond);
        let caustics = Caustics::new(&photons);
        for point in [DVec3::new(0.1, 0.0, 0.3), DVec3::new(0.26, 0.0, 0.24), DVec3::new(0.4, 0.01, 0.45)] {
            let region = caustics.at(point).unwrap();
            // All there are, and those of half the sphere.
            let (mut whole, mut half) = (0.0, 0.0);
            let share = 1.0 / f64::from(1 << 18);
            for (_, u) in numbers(1 << 18) {
                let (direction, evenly) = folded(u);
                let part = region.pdf(direction) * share / evenly;
                whole += part;
                half += if direction.x > 0.0 { part } else { 0.0 };
            }
            assert!((whole - 1.0).abs() < 0.02, "{beyond} {point}: {whole}");
            let mut proposed = 0.0;
            for (pick, u) in numbers(1 << 14) {
                let (direction, density) = region.sample(pick, u);
                assert!((density / region.pdf(direction) - 1.0).abs() < 1e-9);
                proposed += if direction.x > 0.0 { 1.0 / f64::from(1 << 14) } else { 0.0 };
            }
            assert!((proposed - half).abs() < 0.02, "{beyond} {point}: {proposed} {half}");
        }
        // Where light comes from is proposed far more often than by chance.
        let told = |photon: &Photon| caustics.at(photon.point).unwrap().pdf(photon.towards);
        let mean = photons.iter().map(told).sum::<f64>() / photons.len() as f64;
        assert!(mean > 3.0, "{beyond}: {mean}");
    }
}

#[test]
fn nothing_is_proposed_where_no_light_was_gathered() {
    let caustics = Caustics::new(&photons(5.0));
    assert!(caustics.at(DVec3::new(0.2, 1.0, 0.2)).is_none());
    assert!(caustics.at(DVec3::new(3.0, 0.0, 0.2)).is_none());
    assert!(Caustics::new(&[]).at(DVec3::ZERO).is_none());
    // All at one point.
    let one = Photon { point: DVec3::ONE, ..photons(5.0)[0] };
    assert!(Caustics::new(&[one; 1000]).at(DVec3::ONE).is_some());
}

/// Nine tenths of all light fall on a quarter of the floor; a little falls on one point beside it, of which nothing is known.
#[test]
fn regions_know_how_bright_they_are_in_proportion_to_others() {
    let spread = |(_, u): (f64, DVec2)| {
        let x = if u.x < 0.9 { u.x / 0.9 * 0.25 } else { 1.0 + (u.x - 0.9) * 7.5 };
        Photon { point: DVec3::new(x, 0.0, u.y), flux: 1.0, ..photons(5.0)[0] }
    };
    let beside = Photon { point: DVec3::new(9.0, 0.0, 0.0), flux: 1e-9, ..photons(5.0)[0] };
    let all: Vec<Photon> = numbers(1 << 14).map(spread).chain(std::iter::repeat_n(beside, 1000)).collect();
    let caustics = Caustics::new(&all);
    let mean = |from: f64| {
        let at = |u: f64| caustics.at(DVec3::new(from + u * 0.2, 0.0, 0.5)).unwrap().brilliance();
        (1..8).map(|i| at(f64::from(i) / 8.0)).sum::<f64>() / 7.0
    };
    let dim = (0.1_f64 / 0.75 / (0.9 / 0.25)).sqrt();
    assert!((mean(0.0) - 1.0).abs() < 0.1, "{}", mean(0.0));
    assert!((mean(1.2) / dim - 1.0).abs() < 0.1, "{} {dim}", mean(1.2));
    assert_eq!(caustics.at(DVec3::new(9.0, 0.0, 0.0)).unwrap().brilliance(), 0.0);
}

/// Of an image of a dim sky with a bright spot, photons come from there alone; of one without, none are sent.
#[test]
fn only_bright_places_of_an_image_send_photons() {
    let image = |spot: f32| {
        let pixels = (0..32 * 16).map(|at| if at == 5 * 32 + 9 { [spot; 3] } else { [1.0; 3] }).collect();
        Environment::Image(ImageEnvironment::new(32, 16, pixels, DMat3::IDENTITY, 1.0).unwrap())
    };
    let ball = Bounds { min: DVec3::NEG_ONE, max: DVec3::ONE };
    let (dim, bright) = (image(8.0), image(8000.0));
    let lights = LightSampler::new(Vec::new(), &[], &dim);
    assert!(Sources::new(&lights, &dim, vec![ball], ball).is_none());
    let sources = Sources::new(&lights, &bright, vec![ball], ball).unwrap();
    let photons: Vec<_> = (0..1000).filter_map(|number| sources.depart(&Sampler::new(0, (0, 0), number))).collect();
    assert!(photons.len() > 500, "{}", photons.len());
    let least = 16.0 * bright.mean_radiance().x;
    assert!(photons.iter().all(|photon| bright.radiance(-photon.direction).x > 0.999 * least));
}
