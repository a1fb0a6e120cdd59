//! Cameras against closed forms.

use super::*;
use crate::description::Filter;
use description::Camera::{Orthographic, Panoramic, Perspective};

/// For cameras that have no lens.
const ANY: DVec2 = DVec2::new(0.3, 0.8);

fn film(width: u32, height: u32) -> Film {
    Film { width, height, filter: Filter::Box }
}

fn looking(eye: [f64; 3], look_at: [f64; 3], horizontal_fov: f64) -> description::Camera {
    description::Camera::Perspective { eye, look_at, up: [0.0, 1.0, 0.0], horizontal_fov, lens_radius: 0.0, focus_distance: 1.0 }
}

/// With a field of view of 90 degrees the film at distance 1 reaches from -1 to 1; rows go down, square pixels.
#[test]
fn film_coordinates_map_to_directions_by_the_closed_form() {
    let camera = Camera::compile(&looking([0.0; 3], [0.0, 0.0, -5.0], 90.0), &film(8, 4)).unwrap();
    for (x, y, expected) in [
        (4.0, 2.0, DVec3::new(0.0, 0.0, -1.0)),
        (0.0, 0.0, DVec3::new(-1.0, 0.5, -1.0)),
        (8.0, 0.0, DVec3::new(1.0, 0.5, -1.0)),
        (8.0, 4.0, DVec3::new(1.0, -0.5, -1.0)),
        (0.5, 2.5, DVec3::new(-0.875, -0.125, -1.0)),
    ] {
        let ray = camera.ray(x, y, ANY);
        assert!((ray.direction - expected.normalize()).length() < 1e-15, "({x}, {y}): {ray:?}");
        assert_eq!((ray.origin, ray.t_max), (DVec3::ZERO, f64::INFINITY));
    }
}

#[test]
fn the_field_of_view_is_the_horizontal_one() {
    let camera = Camera::compile(&looking([1.0, 2.0, 3.0], [4.0, 2.5, 1.0], 40.0), &film(300, 900)).unwrap();
    let (left, right) = (camera.ray(0.0, 450.0, ANY).direction, camera.ray(300.0, 450.0, ANY).direction);
    assert!((crate::math::acos(left.dot(right)).to_degrees() - 40.0).abs() < 1e-12);
    let middle = camera.ray(150.0, 450.0, ANY);
    assert!((middle.direction - DVec3::new(3.0, 0.5, -2.0).normalize()).length() < 1e-15);
}

#[test]
fn settings_that_show_nothing_are_refused() {
    let of = |camera| Camera::compile(&camera, &film(4, 4));
    assert!(of(looking([0.0; 3], [0.0; 3], 40.0)).unwrap_err().contains("look_at must differ"));
    assert!(of(looking([0.0; 3], [0.0, 3.0, 0.0], 40.0)).unwrap_err().contains("parallel"));
    assert!(of(looking([0.0; 3], [0.0, 0.0, f64::NAN], 40.0)).unwrap_err().contains("finite"));
    for fov in [0.0, 180.0, -1.0, f64::NAN] {
        assert!(of(looking([0.0; 3], [0.0, 0.0, 1.0], fov)).unwrap_err().contains("between 0 and 180"));
    }
}

/// Where a point falls on the film, in units of its width and height; the inverse of [`Camera::ray`], solved here by Cramer's rule.
fn projected(camera: &Camera, point: DVec3, width: f64, height: f64) -> (f64, f64) {
    let Projection::Pinhole(Plane { corner, right, down }) = camera.projection else { panic!("no pinhole") };
    let towards = point - camera.eye;
    let (a, b, c) = (right, down, -towards);
    let determinant = a.dot(b.cross(c));
    let solve = |x: DVec3, y: DVec3, z: DVec3| x.dot(y.cross(z)) / determinant;
    let scale = solve(a, b, -corner);
    assert!(scale > 0.0, "in front of the camera");
    (solve(-corner, b, c) / width, solve(a, -corner, c) / height)
}

#[test]
fn framing_keeps_every_corner_in_view_and_fills_the_film() {
    let boxes = [
        (DVec3::ZERO, DVec3::ONE),
        (DVec3::new(-1e-6, 0.0, 0.0), DVec3::splat(1e-6)),
        (DVec3::new(1e6, -4.0, 3.0), DVec3::new(1e6 + 900.0, 2.0, 4.0)),
        (DVec3::new(-3.0, 0.0, 1.0), DVec3::new(-3.0, 50.0, 1.5)),
        (DVec3::new(0.0, 0.0, -70.0), DVec3::new(1.0, 1.0, 70.0)),
    ];
    for (min, max) in boxes {
        for (width, height) in [(1024, 768), (300, 900), (1920, 400)] {
            let bounds = Bounds { min, max };
            let (w, h) = (f64::from(width), f64::from(height));
            let camera = Camera::compile(&frame_all(bounds, w / h), &film(width, height)).unwrap();
            let corners = bounds.corners().map(|corner| projected(&camera, corner, w, h));
            let reach = corners.iter().map(|(x, y)| (x - 0.5).abs().max((y - 0.5).abs())).fold(0.0, f64::max);
            assert!(reach < 0.5, "{bounds:?} on {width} x {height} reaches {reach}");
            assert!(reach > 0.44, "{bounds:?} on {width} x {height} reaches {reach} only");
        }
    }
}

const EYE: DVec3 = DVec3::new(1.0, 2.0, 3.0);
const LOOK_AT: DVec3 = DVec3::new(4.0, 2.5, 1.0);

fn lens(radius: f64, focus: f64) -> Result<Camera, String> {
    let (eye, look_at, up) = (EYE.into(), LOOK_AT.into(), [0.1, 1.0, 0.2]);
    let camera = Perspective { eye, look_at, up, horizontal_fov: 40.0, lens_radius: radius, focus_distance: focus };
    Camera::compile(&camera, &film(300, 200))
}

fn grid(n: u32) -> impl Iterator<Item = DVec2> {
    (0..n * n).map(move |i| DVec2::new(f64::from(i % n), f64::from(i / n)) / f64::from(n))
}

/// Where a ray meets the plane at a distance along the axis of view.
fn at_depth(ray: &Ray, depth: f64) -> DVec3 {
    let forward = (LOOK_AT - EYE).normalize();
    ray.at((depth - (ray.origin - EYE).dot(forward)) / ray.direction.dot(forward))
}

#[test]
fn without_a_lens_nothing_depends_on_its_sample_and_rays_start_at_the_eye() {
    let camera = lens(0.0, 7.0).unwrap();
    assert!(!camera.needs_lens() && camera.rays_start_at_eye());
    for (film, sample) in grid(7).zip(grid(7)) {
        let ray = camera.ray(film.x * 300.0, film.y * 200.0, sample);
        assert_eq!((ray, ray.origin), (camera.ray(film.x * 300.0, film.y * 200.0, DVec2::ZERO), camera.eye()));
    }
}

#[test]
fn points_of_the_plane_in_focus_fall_on_one_point_of_the_film_through_all_of_the_lens() {
    let (pinhole, camera) = (lens(0.0, 7.0).unwrap(), lens(0.25, 7.0).unwrap());
    assert!(camera.needs_lens() && !camera.rays_start_at_eye());
    let mut farthest: f64 = 0.0;
    for film in grid(5).map(|film| film * DVec2::new(300.0, 200.0)) {
        let sharp = at_depth(&pinhole.ray(film.x, film.y, ANY), 7.0);
        for sample in grid(9).chain([DVec2::splat(1.0 - f64::EPSILON / 2.0)]) {
            let ray = camera.ray(film.x, film.y, sample);
            assert!((at_depth(&ray, 7.0) - sharp).length() < 1e-14 * 7.0, "{film} {sample}");
            assert!((ray.direction.length() - 1.0).abs() < 1e-15);
            let offset = ray.origin - EYE;
            assert!(offset.dot((LOOK_AT - EYE).normalize()).abs() < 1e-15, "the lens is parallel to the film");
            farthest = farthest.max(offset.length());
        }
    }
    assert!((farthest - 0.25).abs() < 1e-15, "{farthest}");
}

/// Through each point of the lens's rim, the point of the film that sees a point of the world. At a fixed depth, what is seen is affine in film
/// coordinates: three rays tell it.
#[test]
fn the_circle_of_confusion_is_that_of_the_thin_lens() {
    let (radius, focus) = (0.25, 7.0);
    let (camera, pinhole) = (lens(radius, focus).unwrap(), lens(0.0, focus).unwrap());
    for depth in [2.0, 5.0, 7.0, 20.0, 1e4] {
        let point = at_depth(&pinhole.ray(170.0, 60.0, ANY), depth);
        let seen = |lens: DVec2| {
            let at = |x, y| at_depth(&camera.ray(x, y, lens), depth);
            let (zero, x, y) = (at(0.0, 0.0), at(1.0, 0.0), at(0.0, 1.0));
            let (x, y, wanted) = (x - zero, y - zero, point - zero);
            DVec2::new(wanted.dot(x) / x.length_squared(), wanted.dot(y) / y.length_squared())
        };
        // Opposite points of the rim: the ends of the sample's square.
        let diameter = [DVec2::new(0.0, 0.5), DVec2::new(0.5, 0.0), DVec2::new(0.0, 0.0)].map(|a| (seen(a) - seen(1.0 - a)).length());
        // Diameter of the lens times f |z - s| / (z (s - f)), on a film at distance f s / (s - f) that shows the field of view; any f will do.
        for f in [0.05, 1.0] {
            let behind = f * focus / (focus - f);
            let confusion = 2.0 * radius * f * (depth - focus).abs() / (depth * (focus - f));
            let pixel = 2.0 * tan(20f64.to_radians()) * behind / 300.0;
            for diameter in diameter {
                assert!((diameter - confusion / pixel).abs() < 1e-9, "{depth}: {diameter}, not {}", confusion / pixel);
            }
        }
    }
}

/// Even: as many samples as its share of the area fall in each ring and sector.
#[test]
fn the_lens_is_sampled_evenly() {
    let points: Vec<_> = grid(400).map(|u| concentric_disc(u + 0.5 / 400.0)).collect();
    let share = |of: &dyn Fn(&DVec2) -> bool| points.iter().filter(|p| of(p)).count() as f64 / points.len() as f64;
    assert!(points.iter().all(|p| p.length() <= 1.0));
    for radius in [0.1, 0.3, 0.5, 0.8, 0.95] {
        assert!((share(&|p| p.length() < radius) - radius * radius).abs() < 0.005);
    }
    for step in 1..12 {
        let angle = f64::from(step) * TAU / 12.0;
        assert!((share(&|p| crate::math::atan2(p.y, p.x) + PI < angle) - angle / TAU).abs() < 0.005);
    }
}

#[test]
fn orthographic_rays_are_parallel_and_evenly_spaced() {
    let camera = Orthographic { eye: EYE.into(), look_at: LOOK_AT.into(), up: [0.0, 1.0, 0.0], width: 6.0 };
    let camera = Camera::compile(&camera, &film(300, 200)).unwrap();
    assert!(!camera.needs_lens() && !camera.rays_start_at_eye());
    let (forward, middle) = ((LOOK_AT - EYE).normalize(), camera.ray(150.0, 100.0, ANY));
    assert!((middle.origin - EYE).length() < 1e-15 && (middle.direction - forward).length() < 1e-15);
    let (right, down) = (forward.cross(DVec3::Y).normalize(), forward.cross(forward.cross(DVec3::Y).normalize()));
    for film in grid(6) {
        let ray = camera.ray(film.x * 300.0, film.y * 200.0, ANY);
        let expected = EYE + right * (6.0 * (film.x - 0.5)) + down * (4.0 * (film.y - 0.5));
        assert!((ray.origin - expected).length() < 1e-14 && ray.direction == middle.direction, "{film}");
    }
    assert_eq!(camera.moved(DVec3::X).ray(1.0, 2.0, ANY).origin, camera.eye + DVec3::X + (camera.ray(1.0, 2.0, ANY).origin - EYE));
}

#[test]
fn a_panorama_shows_what_is_ahead_in_its_middle_and_what_is_right_to_the_right() {
    let camera = Panoramic { eye: EYE.into(), look_at: (EYE - DVec3::Z * 3.0).into(), up: [0.0, 1.0, 0.0] };
    let camera = Camera::compile(&camera, &film(400, 200)).unwrap();
    assert!(!camera.needs_lens() && camera.rays_start_at_eye());
    let diagonal = 0.5f64.sqrt();
    for (x, y, expected) in [
        (200.0, 100.0, DVec3::NEG_Z),
        (300.0, 100.0, DVec3::X),
        (100.0, 100.0, DVec3::NEG_X),
        (0.0, 100.0, DVec3::Z),
        (400.0, 100.0, DVec3::Z),
        (77.0, 0.0, DVec3::Y),
        (77.0, 200.0, DVec3::NEG_Y),
        (250.0, 100.0, DVec3::new(diagonal, 0.0, -diagonal)),
        (200.0, 50.0, DVec3::new(0.0, diagonal, -diagonal)),
        (300.0, 150.0, DVec3::new(diagonal, -diagonal, 0.0)),
    ] {
        let ray = camera.ray(x, y, ANY);
        assert!((ray.direction - expected).length() < 1e-15 && ray.origin == EYE, "({x}, {y}): {ray:?}");
    }
}

#[test]
fn lenses_and_widths_without_meaning_are_refused() {
    for radius in [-0.1, f64::NAN, f64::INFINITY, 1e76] {
        assert!(lens(radius, 7.0).unwrap_err().contains("lens_radius must lie"));
    }
    for focus in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(lens(0.1, focus).unwrap_err().contains("focus_distance must be finite"));
    }
    for focus in [1e-310, 1e-80] {
        assert!(lens(0.1, focus).unwrap_err().contains("too small"));
    }
    for width in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let camera = Orthographic { eye: [0.0; 3], look_at: [1.0; 3], up: [0.0, 1.0, 0.0], width };
        assert!(Camera::compile(&camera, &film(4, 4)).unwrap_err().contains("width must lie"));
    }
    for (radius, focus) in [(1e75, 1.0), (1e-300, 1e-300), (1e75, f64::MAX), (5e-324, 1e-300)] {
        let ray = lens(radius, focus).unwrap().ray(3.0, 4.0, DVec2::ZERO);
        assert!(ray.origin.is_finite() && (ray.direction.length() - 1.0).abs() < 1e-15, "{radius} {focus} {ray:?}");
    }
}

/// All bits of the first release's pinhole, and those of one ray.
#[test]
fn the_bits_of_the_pinhole_are_these() {
    let camera = lens(0.0, 1.0).unwrap();
    let bits = |x, y| camera.ray(x, y, ANY).direction.to_array().map(f64::to_bits);
    assert_eq!(bits(12.5, 150.25), [4_603_557_232_110_147_395, 4_590_874_602_119_227_584, 13_828_727_853_860_524_852]);
    let pixels = (0..300).flat_map(|x| (0..200).map(move |y| (f64::from(x) + 0.37, f64::from(y) + 0.61)));
    let mixed =
        pixels.flat_map(|(x, y)| bits(x, y)).fold(0u64, |hash, bits| (hash.rotate_left(5) ^ bits).wrapping_mul(0x9E37_79B9_7F4A_7C15));
    assert_eq!(mixed, 16_409_708_271_256_499_596);
}
