//! Irradiance by closed forms: what an emitter of known shape gives a surface.

use std::f64::consts::FRAC_1_PI;

use glam::DVec3;
use tessera_engine::description::{Light, Material, MeshData, Render, Rgb, Shape, SourceId};
use tessera_tests::stage::{Stage, diffuse, directional, ground, lamberts_polygon, lamp, path, point, rectangle, sphere};

use super::{assert_exactly, assert_is};

const ALBEDO: Rgb = [0.5, 0.25, 0.75];
const RADIANCE: Rgb = [4.0, 2.0, 1.0];
const EYE: [f64; 3] = [0.0, 0.3, 3.0];

/// Stretched so little, an emitter looks the same, but the sampler does not know its shape: only scattered rays find it.
const HIDDEN: [f64; 3] = [1.0 + 1e-9, 1.0, 1.0];

fn shown(share: f64) -> [f64; 3] {
    [0, 1, 2].map(|channel| f64::from(ALBEDO[channel]) * f64::from(RADIANCE[channel]) * share)
}

fn stage() -> Stage {
    Stage::new().with(ground(), diffuse(ALBEDO))
}

/// Scattered radiance is `albedo L (r / d)^2 cos` as long as all of the sphere stands above the horizon.
#[test]
fn a_sphere_lights_a_plane_by_the_square_of_radius_over_distance() {
    for (radius, distance, tilt) in
        [(0.5, 1.0, 0.0_f64), (0.01, 1.0, 0.5), (0.9, 1.0, 0.0), (1e-4, 1.0, 1.0), (0.3, 1.0, 1.2), (3e4, 1e8, 0.3)]
    {
        let shape = sphere([distance * tilt.sin(), distance * tilt.cos(), 0.0], radius);
        let expected = shown((radius / distance).powi(2) * tilt.cos());
        let seen = stage().with(shape, lamp(RADIANCE)).seen(EYE, [0.0; 3], path(2), 64);
        assert_is(&format!("sphere {radius} at {distance}, tilted by {tilt}"), seen, expected);
    }
}

/// A disc that faces the plane, seen from below a point at `beside` from its axis.
fn disc_share(radius: f64, height: f64, beside: f64) -> f64 {
    let (r2, h2, a2) = (radius * radius, height * height, beside * beside);
    0.5 * (1.0 - (h2 + a2 - r2) / ((h2 + a2 + r2).powi(2) - 4.0 * a2 * r2).sqrt())
}

#[test]
fn a_disc_lights_a_plane_by_its_form_factor() {
    for (radius, height, beside) in [(0.5, 1.0, 0.0), (0.3, 0.5, 0.6), (2.0, 1.5, 0.0)] {
        let shape = Shape::Disc { center: [beside, height, 0.0], normal: [0.0, -1.0, 0.0], radius };
        let seen = stage().with(shape, lamp(RADIANCE)).seen(EYE, [0.0; 3], path(2), 256);
        assert_is(&format!("disc {radius} at {height}, {beside} beside"), seen, shown(disc_share(radius, height, beside)));
    }
}

#[test]
fn polygons_light_a_plane_by_lamberts_formula() {
    let corners = |corner: DVec3, u: DVec3, v: DVec3| [corner, corner + u, corner + u + v, corner + v];
    let cases = [
        ("square overhead", [-0.5, 1.0, -0.5], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]),
        ("long strip", [-4.0, 0.5, 0.2], [8.0, 0.0, 0.0], [0.0, 0.0, 0.1]),
        ("upright wall", [-1.0, 0.25, -1.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]),
        ("skewed and tilted", [-0.5, 1.0, -0.5], [1.0, 0.5, 0.0], [0.5, 0.25, 1.0]),
        ("tiny", [0.3, 1.0, -0.5], [1e-4, 0.0, 0.0], [0.0, 0.0, 1e-4]),
    ];
    for (what, corner, u, v) in cases {
        let points = corners(corner.into(), u.into(), v.into());
        let expected = shown(FRAC_1_PI * lamberts_polygon(DVec3::ZERO, DVec3::Y, &points));
        let seen = stage().with(rectangle(corner, u, v), lamp(RADIANCE)).seen(EYE, [0.0; 3], path(2), 256);
        assert_is(what, seen, expected);
        let positions = points.map(|point| point.as_vec3().to_array());
        let seen = stage().with_mesh(&positions, &[[0, 1, 2], [0, 2, 3]], lamp(RADIANCE)).seen(EYE, [0.0; 3], path(2), 256);
        let rounded = positions.map(|point| DVec3::from(point.map(f64::from)));
        assert_is(&format!("{what}, as a mesh"), seen, shown(FRAC_1_PI * lamberts_polygon(DVec3::ZERO, DVec3::Y, &rounded)));
    }
}

/// Three faces of a box see the point, and each is a polygon of its own.
#[test]
fn a_box_lights_a_plane_by_the_faces_that_are_seen() {
    let (min, max) = (DVec3::new(0.3, 0.4, -1.2), DVec3::new(0.9, 1.1, -0.4));
    let at = |x: f64, y: f64, z: f64| DVec3::new(x, y, z);
    let left = [at(min.x, min.y, min.z), at(min.x, max.y, min.z), at(min.x, max.y, max.z), at(min.x, min.y, max.z)];
    let below = [at(min.x, min.y, min.z), at(max.x, min.y, min.z), at(max.x, min.y, max.z), at(min.x, min.y, max.z)];
    let front = [at(min.x, min.y, max.z), at(max.x, min.y, max.z), at(max.x, max.y, max.z), at(min.x, max.y, max.z)];
    let share: f64 = [left, below, front].iter().map(|face| lamberts_polygon(DVec3::ZERO, DVec3::Y, face)).sum();
    let shape = Shape::Box { min: min.to_array(), max: max.to_array() };
    let seen = stage().with(shape, lamp(RADIANCE)).seen(EYE, [0.0; 3], path(2), 1024);
    assert_is("box", seen, shown(FRAC_1_PI * share));
}

/// The same closed forms where the sampler may not choose points on the emitter.
#[test]
fn scattered_rays_alone_find_the_same_light() {
    let shape = sphere([0.0, 1.0, 0.0], 0.5);
    let seen = stage().with_stretched(shape, lamp(RADIANCE), HIDDEN).seen(EYE, [0.0; 3], path(2), 1024);
    assert_is("hidden sphere", seen, shown(0.25));
    let shape = Shape::Disc { center: [0.6, 0.5, 0.0], normal: [0.0, -1.0, 0.0], radius: 0.3 };
    let seen = stage().with_stretched(shape, lamp(RADIANCE), HIDDEN).seen(EYE, [0.0; 3], path(2), 2048);
    assert_is("hidden disc", seen, shown(disc_share(0.3, 0.5, 0.6)));
}

/// An infinite plate that shines covers the whole sky of a parallel one, wherever that is.
#[test]
fn parallel_plates_give_what_they_have() {
    let plate = Shape::Plane { point: [0.0, 2.0, 0.0], normal: [0.0, -1.0, 0.0] };
    let seen = stage().with(plate, lamp(RADIANCE)).seen([0.0, 0.5, 1.0], [0.0; 3], path(2), 16);
    assert_exactly("plates", seen, shown(1.0));
}

#[test]
fn lights_without_extent_follow_cosine_and_distance() {
    let (d, cos) = (DVec3::new(1.0, 2.0, -0.5).length(), 2.0 / DVec3::new(1.0, 2.0, -0.5).length());
    let seen = stage().lit(point([1.0, 2.0, -0.5], RADIANCE)).seen(EYE, [0.0; 3], path(2), 1);
    assert_exactly("point", seen, shown(FRAC_1_PI * cos / (d * d)));
    let seen = stage().lit(directional([-1.0, -2.0, 0.5], RADIANCE, 0.0)).seen(EYE, [0.0; 3], path(2), 1);
    assert_exactly("directional", seen, shown(FRAC_1_PI * cos));
    // The middle of the smooth border by cosine, where the share is a half.
    let (inner, outer) = (20.0_f64, 40.0_f64);
    let middle = 0.5 * (inner.to_radians().cos() + outer.to_radians().cos());
    for (away, share) in [(1.0, 1.0), (middle, 0.5), (0.7, 0.0)] {
        let direction = [f64::sqrt(1.0 - away * away), -away, 0.0];
        let spot = Light::Spot { position: [0.0, 2.0, 0.0], direction, intensity: RADIANCE, inner, outer, source: SourceId::default() };
        let seen = stage().lit(spot).seen(EYE, [0.0; 3], path(2), 1);
        assert_exactly("spot", seen, shown(FRAC_1_PI * share / 4.0));
    }
}

/// However wide the sun is, a surface that faces it receives the irradiance that was asked for.
#[test]
fn a_sun_with_extent_gives_the_irradiance_that_was_asked_for() {
    for angle in [0.533, 10.0, 90.0] {
        let seen = stage().lit(directional([0.0, -1.0, 0.0], RADIANCE, angle)).seen(EYE, [0.0; 3], path(2), 256);
        assert_is(&format!("sun of {angle} degrees"), seen, shown(FRAC_1_PI));
    }
}

/// An emitter that fills a pixel shows its radiance, on the side that shines, and reflects nothing.
#[test]
fn emitters_show_their_radiance() {
    let shape = || rectangle([-1.0, -1.0, 0.0], [2.0, 0.0, 0.0], [0.0, 2.0, 0.0]);
    let front = [0.3, 0.2, 2.0];
    let back = [0.3, 0.2, -2.0];
    let one = Stage::new().with(shape(), lamp([17.0, 12.0, 4.0])).lit(point(front, [1.0; 3])).lit(point(back, [1.0; 3]));
    assert_exactly("front", one.seen(front, [0.0; 3], path(5), 1), [17.0, 12.0, 4.0]);
    assert_exactly("back", one.seen(back, [0.0; 3], path(5), 1), [0.0; 3]);
    let both = Material::Emitter { radiance: [17.0, 12.0, 4.0], texture: None, two_sided: true };
    assert_exactly("both", Stage::new().with(shape(), both).seen(back, [0.0; 3], path(5), 1), [17.0, 12.0, 4.0]);
}

/// A lamp lights what lies before it alone, unless it is two-sided.
#[test]
fn the_back_of_a_lamp_lights_nothing() {
    let up = || rectangle([-0.5, 1.0, -0.5], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]);
    assert_exactly("back", stage().with(up(), lamp(RADIANCE)).seen(EYE, [0.0; 3], path(2), 64), [0.0; 3]);
    let both = Material::Emitter { radiance: RADIANCE, texture: None, two_sided: true };
    let corners = [[-0.5, 1.0, -0.5], [0.5, 1.0, -0.5], [0.5, 1.0, 0.5], [-0.5, 1.0, 0.5]].map(DVec3::from);
    let expected = shown(FRAC_1_PI * lamberts_polygon(DVec3::ZERO, DVec3::Y, &corners));
    assert_is("both", stage().with(up(), both).seen(EYE, [0.0; 3], path(2), 256), expected);
}

/// Seen from outside, light from within glass is thinned by the squared index: `L (1 - F) / eta^2` straight on.
#[test]
fn light_from_within_glass_is_thinned_by_the_squared_index() {
    let glass = Material::smooth_glass(1.5, [1.0; 3]);
    let inside = rectangle([-0.5, -0.5, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let stage = Stage::new().with(Shape::Box { min: [-1.0; 3], max: [1.0; 3] }, glass).with(inside, lamp(RADIANCE));
    let share = 0.96 / (1.5 * 1.5);
    assert_is("within glass", stage.seen([0.0, 0.0, 3.0], [0.0; 3], path(2 + 1), 64), RADIANCE.map(|x| f64::from(x) * share));
}

/// A light behind a surface that a shading normal sees must not shine through, neither where it is looked at nor where a ray meets it.
#[test]
fn no_light_leaks_through_a_surface_by_its_shading_normals() {
    let mesh = |tilt: f32| MeshData {
        positions: vec![[-1.0, 0.0, -1.0], [-1.0, 0.0, 1.0], [1.0, 0.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        normals: vec![[(1.0 - tilt * tilt).sqrt(), tilt, 0.0]; 3],
        uvs: Vec::new(),
    };
    let from = |light: [f64; 3], render| {
        Stage::new().with_data(&mesh(0.6), diffuse(ALBEDO)).lit(point(light, RADIANCE)).seen([0.0, 2.0, 0.5], [0.0; 3], render, 1)
    };
    for render in [path(2), Render::Whitted { max_depth: 2, transparent_shadows: false, min_weight: 0.0 }] {
        assert_exactly("behind", from([2.0, -1.0, 0.0], render.clone()), [0.0; 3]);
        let cos = DVec3::new(2.0, 1.0, 0.0).normalize().dot(DVec3::new(0.8, 0.6, 0.0));
        assert_exactly("before", from([2.0, 1.0, 0.0], render), shown(FRAC_1_PI * cos / 5.0));
    }
    let below = rectangle([0.5, -0.5, -1.0], [0.0, 0.0, 2.0], [1.0, 0.0, 0.0]);
    let seen = Stage::new().with_data(&mesh(0.6), diffuse(ALBEDO)).with(below, lamp(RADIANCE)).seen([0.0, 2.0, 0.5], [0.0; 3], path(2), 64);
    assert_exactly("rays", seen, [0.0; 3]);
}
