//! The border between light and shadow on coarse meshes with smooth normals, against the surface that they stand for.

use glam::DVec3;
use tessera_engine::{
    description::{Camera, Film, Filter, MeshData, Render},
    part::SampleRange,
};
use tessera_tests::{
    seeds,
    stage::{Stage, diffuse, directional, sphere},
};

const SIDE: u32 = 256;

/// Where the sun stands: to the right of the camera, which looks along -z.
const SUN: DVec3 = DVec3::new(0.96, 0.2, 0.2);

/// A ball of 24 x 12 squares, with the normals of the sphere.
fn ball() -> MeshData {
    const U: u32 = 24;
    const V: u32 = 12;
    let mut mesh = MeshData::default();
    for (row, column) in (0..=V).flat_map(|row| (0..U).map(move |column| (row, column))) {
        let (theta, phi) = (std::f32::consts::PI * row as f32 / V as f32, std::f32::consts::TAU * column as f32 / U as f32);
        let at = [theta.sin() * phi.cos(), theta.cos(), theta.sin() * phi.sin()];
        mesh.positions.push(at);
        mesh.normals.push(at);
    }
    for (row, column) in (0..V).flat_map(|row| (0..U).map(move |column| (row, column))) {
        let at = |row: u32, column: u32| row * U + column % U;
        let [a, b, c, d] = [at(row, column), at(row, column + 1), at(row + 1, column), at(row + 1, column + 1)];
        mesh.triangles.extend([[a, b, c], [b, d, c]]);
    }
    mesh
}

fn render(smooth_terminator: bool) -> Render {
    Render::Path { max_depth: 2, roulette_depth: 2, smooth_terminator }
}

fn picture(stage: &Stage, smooth_terminator: bool) -> Vec<[f32; 3]> {
    let camera = Camera::Orthographic { eye: [0.0, 0.0, 5.0], look_at: [0.0; 3], up: [0.0, 1.0, 0.0], width: 2.0 };
    let film = Film { width: SIDE, height: SIDE, filter: Filter::Point };
    seeds::picture(&stage.compiled(camera, film, render(smooth_terminator)), SampleRange { first: 0, count: 1 })
}

fn lit(stage: Stage) -> Stage {
    stage.lit(directional((-SUN).into(), [std::f32::consts::PI; 3], 0.0))
}

/// Mean error near the terminator, where the cosine on the true sphere is within a fifth of 0, away from the ball's outline.
fn error(ours: &[[f32; 3]], sphere: &[[f32; 3]]) -> f64 {
    let (mut sum, mut count) = (0.0, 0);
    for (index, (ours, sphere)) in (0_u32..).zip(ours.iter().zip(sphere)) {
        let [x, y] = [index % SIDE, index / SIDE].map(|at| (f64::from(at) + 0.5) / f64::from(SIDE) * 2.0 - 1.0);
        let above = 1.0 - x * x - y * y;
        if above > 0.1 && DVec3::new(x, -y, above.sqrt()).dot(SUN.normalize()).abs() < 0.2 {
            sum += f64::from(ours[0] - sphere[0]).abs();
            count += 1;
        }
    }
    assert!(count > 2000, "{count} pixels are no band");
    sum / f64::from(count)
}

#[test]
fn coarse_balls_are_lit_like_the_spheres_that_they_stand_for() {
    let stage = |thing: &dyn Fn(Stage) -> Stage| lit(thing(Stage::new()));
    let coarse = stage(&|stage| stage.with_data(&ball(), diffuse([1.0; 3])));
    let truth = picture(&stage(&|stage| stage.with(sphere([0.0; 3], 1.0), diffuse([1.0; 3]))), false);
    let (without, with) = (error(&picture(&coarse, false), &truth), error(&picture(&coarse, true), &truth));
    println!("mean error near the terminator: {without:.5} without, {with:.5} with the correction");
    assert!(without > 5.0 * with, "{without} without the correction, {with} with it");
}

/// What has no vertex normals is as it was, to the bit; and nothing shines through what stands between.
#[test]
fn only_meshes_with_normals_are_taken_for_smooth() {
    let flat = MeshData { normals: Vec::new(), ..ball() };
    let stage = lit(Stage::new().with_data(&flat, diffuse([1.0; 3])).with(sphere([0.3, 0.3, 0.9], 0.3), diffuse([0.5; 3])));
    assert!(picture(&stage, false) == picture(&stage, true));
    // A blind between sun and ball.
    let blind = tessera_tests::stage::rectangle((SUN * 3.0 - DVec3::new(-1.0, 5.0, 5.0)).into(), [-2.0, 10.0, 0.0], [0.0, 0.0, 10.0]);
    let dark = lit(Stage::new().with_data(&ball(), diffuse([1.0; 3])).with(blind, diffuse([0.0; 3])));
    assert!(picture(&dark, true).iter().all(|pixel| *pixel == [0.0; 3]), "light goes through a wall");
}

/// A ball between two others in an even sky: surfaces that scatter all light do not show, whatever they are taken for.
#[test]
fn a_white_ball_in_an_even_sky_keeps_its_brightness() {
    let stage = Stage::new().with_data(&ball(), diffuse([1.0; 3])).within([1.0; 3]);
    let pixels = picture(&stage, true);
    assert!(
        pixels.iter().flatten().all(|number| (number - 1.0).abs() < 1e-5),
        "{:?}",
        pixels.iter().flatten().copied().fold(1.0, f32::min)
    );
}
