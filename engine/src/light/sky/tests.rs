//! Skies against closed forms, measured formulas and brute force.

use super::*;
use crate::{
    light::environment::{Environment, ImageEnvironment},
    math::{acos, exp, ln, pow},
};

/// Optical depth of molecules straight up.
const MOLECULES: DVec3 = DVec3::new(5.802e-3 * 8.0, 13.558e-3 * 8.0, 33.1e-3 * 8.0);

/// The sun at an elevation and a longitude (degrees; from -z towards +x).
fn at(elevation: f64, longitude: f64, turbidity: f64) -> SunSky {
    let ((up, level), (right, ahead)) = (sin_cos(elevation.to_radians()), sin_cos(longitude.to_radians()));
    SunSky { sun_direction: DVec3::new(level * right, up, -level * ahead), turbidity, ground_albedo: DVec3::splat(0.3) }
}

fn environment(sky: &SunSky, height: u32) -> Environment {
    let (width, height, pixels) = sky.sky(height);
    Environment::Image(ImageEnvironment::new(width, height, pixels, glam::DMat3::IDENTITY, 1.0).unwrap())
}

fn towards(elevation: f64, longitude: f64) -> DVec3 {
    at(elevation, longitude, 2.0).sun_direction
}

fn luminance(color: DVec3) -> f64 {
    color.dot(DVec3::new(0.2126, 0.7152, 0.0722))
}

/// Irradiance of level ground by the sky's image and by the sun.
fn irradiance(sky: &SunSky) -> (DVec3, DVec3) {
    let (width, height, pixels) = sky.sky(64);
    let mut sum = DVec3::ZERO;
    for (i, pixel) in pixels.iter().take((width * height / 2) as usize).enumerate() {
        let polar = PI * ((i / width as usize) as f64 + 0.5) / f64::from(height);
        let solid_angle = sin(polar) * PI / f64::from(height) * TAU / f64::from(width);
        sum += DVec3::from_array(pixel.map(f64::from)) * (cos(polar) * solid_angle);
    }
    let (sun, radius) = sky.sun();
    (sum, sun * (TAU * (1.0 - cos(radius.to_radians()))) * sky.sun_direction.y.max(0.0))
}

#[test]
fn the_zenith_is_blue_by_day_and_it_is_red_around_a_setting_sun() {
    for turbidity in [1.7, 2.0, 3.0] {
        let zenith = environment(&at(40.0, 0.0, turbidity), 64).radiance(DVec3::Y);
        assert!(zenith.z > 1.2 * zenith.y && zenith.y > 1.2 * zenith.x, "{zenith}");
        assert!((0.02..0.3).contains(&luminance(zenith)), "{zenith}");
        let evening = environment(&at(1.5, 0.0, turbidity), 128);
        let (near, opposite) = (evening.radiance(towards(2.5, 3.0)), evening.radiance(towards(40.0, 180.0)));
        assert!(near.x > 2.0 * near.y && near.y > 2.0 * near.z, "{near}");
        assert!(near.x > 5.0 * opposite.x && opposite.z > opposite.x, "{opposite}");
    }
}

/// Straight up, depths have closed forms.
#[test]
fn the_sun_in_the_zenith_shines_through_the_depth_of_all_air() {
    for turbidity in [1.7, 3.0, 10.0] {
        let (sun, radius) = at(90.0, 0.0, turbidity).sun();
        let through = sun * (TAU * (1.0 - cos(radius.to_radians())) / PI);
        let aerosol = [680.0, 550.0, 440.0].map(|nm| (turbidity - 1.0) * MOLECULES.y * pow(nm / 550.0, -1.3));
        let depth = MOLECULES + DVec3::from(aerosol) + DVec3::new(0.650e-3, 1.881e-3, 0.085e-3) * 15.0;
        let expected = DVec3::from_array(depth.to_array().map(|depth| exp(-depth)));
        assert!((through - expected).abs().max_element() < 1e-3, "{through}, not {expected}");
    }
}

/// Kasten, Young, "Revised Optical Air Mass Tables and Approximation Formula", Applied Optics 28(22), 1989. It knows of refraction, which
/// matters near the horizon alone.
#[test]
fn air_mass_is_that_of_kasten_and_young() {
    let atmosphere = Atmosphere::of_molecules();
    for (elevation, tolerance) in
        [(90.0, 0.003), (60.0, 0.003), (30.0, 0.003), (20.0, 0.005), (10.0, 0.01), (5.0, 0.02), (2.0, 0.05), (0.5, 0.1)]
    {
        let up: f64 = sin(f64::to_radians(elevation));
        let expected = 1.0 / (up + 0.50572 * pow(elevation + 6.07995, -1.6364));
        let depth = -ln(atmosphere.sunlight(0.0, up).y) / MOLECULES.y;
        assert!((depth / expected - 1.0).abs() < tolerance, "{elevation}: {depth}, not {expected}");
    }
}

/// Eddington's approximation for a plane layer that scatters all light evenly: of the irradiance at its top, what passes is (2/3 + m + (2/3
/// - m) exp(-t / m)) / (4/3 + t), for depth t and cosine m of the sun's angle. Light that is scattered more than once must be in it.
#[test]
fn pure_air_passes_as_much_light_as_a_layer_that_scatters_and_absorbs_nothing() {
    let atmosphere = Atmosphere::of_molecules();
    for elevation in [90.0, 60.0, 40.0, 25.0] {
        let sun = towards(elevation, 0.0);
        let (mut sky, rows) = (DVec3::ZERO, 60);
        for row in 0..rows {
            let polar = |row: f64| FRAC_PI_2 * row / f64::from(rows);
            let (lower, upper) = (sin(polar(f64::from(row) + 1.0)), sin(polar(f64::from(row))));
            let radiance = Picture::new(&atmosphere, sun, 64).row(polar(f64::from(row) + 0.5), &mut vec![]) / 64.0;
            sky += radiance * (PI * (lower * lower - upper * upper));
        }
        let passed = (sky / (PI * sun.y) + atmosphere.sunlight(0.0, sun.y)).to_array();
        for (passed, depth) in passed.into_iter().zip(MOLECULES.to_array()) {
            let expected = (2.0 / 3.0 + sun.y + (2.0 / 3.0 - sun.y) * exp(-depth / sun.y)) / (4.0 / 3.0 + depth);
            assert!((passed - expected).abs() < 0.02, "{elevation}, depth {depth}: {passed}, not {expected}");
        }
    }
}

/// Light scattered once by pure air, by 1000 even steps, each with the depth towards the sun in 1000 steps.
#[test]
fn light_that_is_scattered_once_is_that_of_brute_force() {
    let atmosphere = Atmosphere::of_molecules();
    let altitude = |p: DVec3| p.length() - 6360.0;
    let density = |p: DVec3| exp(-altitude(p) / 8.0);
    let to_top = |p: DVec3, d: DVec3| {
        let along = p.dot(d);
        (along * along - p.length_squared() + 6460.0 * 6460.0).sqrt() - along
    };
    let column = |p: DVec3, d: DVec3| {
        let step = to_top(p, d) / 1000.0;
        (0..1000).map(|i| density(p + d * (step * (f64::from(i) + 0.5)))).sum::<f64>() * step
    };
    let eye = DVec3::Y * 6360.0;
    for (sun, view) in [(60.0, 80.0), (60.0, 10.0), (10.0, 30.0), (3.0, 3.0)].map(|(a, b)| (towards(a, 0.0), towards(b, 70.0))) {
        let (length, mut air, mut expected) = (to_top(eye, view), 0.0, 0.0);
        let step = length / 1000.0;
        for i in 0..1000 {
            let here = eye + view * (step * (f64::from(i) + 0.5));
            let more = density(here) * step;
            expected += more * 13.558e-3 * exp(-13.558e-3 * (air + 0.5 * more + column(here, sun)));
            air += more;
        }
        let scattered = atmosphere.scattered(view.y, sun.y, view.dot(sun)).rayleigh.y;
        assert!((scattered / expected - 1.0).abs() < 0.01, "{sun} {view}: {scattered}, not {expected}");
    }
}

#[test]
fn a_clear_sky_gives_a_plausible_share_of_the_light() {
    for elevation in [50.0, 70.0, 90.0] {
        for turbidity in [1.7, 2.3] {
            let (sky, sun) = irradiance(&at(elevation, 30.0, turbidity));
            let share = luminance(sky) / luminance(sky + sun);
            assert!((0.1..0.25).contains(&share), "{elevation}, {turbidity}: {share}");
        }
    }
    let share = |turbidity| {
        let (sky, sun) = irradiance(&at(60.0, 0.0, turbidity));
        luminance(sky) / luminance(sky + sun)
    };
    assert!(share(2.0) < share(4.0) && share(4.0) < share(8.0), "haze spreads light");
}

#[test]
fn the_ground_reflects_what_it_receives() {
    let sky = SunSky { ground_albedo: DVec3::new(0.1, 0.5, 0.9), ..at(35.0, 0.0, 3.0) };
    let (above, sun) = irradiance(&sky);
    let ground = environment(&sky, 64).radiance(towards(-50.0, 120.0));
    let expected = (above + sun) * sky.ground_albedo / PI;
    assert!(((ground - expected) / expected).abs().max_element() < 1e-3, "{ground}, not {expected}");
}

#[test]
fn the_sky_is_brightest_at_the_sun_and_symmetric_about_its_meridian() {
    for longitude in [0.0, 45.0, -112.5] {
        let (width, height, pixels) = at(30.0, longitude, 3.0).sky(64);
        let (brightest, _) = pixels.iter().enumerate().max_by(|(_, a), (_, b)| a[1].total_cmp(&b[1])).unwrap();
        let (x, y) = ((brightest % 128) as f64 + 0.5, (brightest / 128) as f64 + 0.5);
        let direction = towards(90.0 - y / 64.0 * 180.0, x / 128.0 * 360.0 - 180.0);
        assert!(acos(direction.dot(towards(30.0, longitude)).min(1.0)).to_degrees() < 5.0);
        // The sun stands between two columns.
        let right = ((0.5 + longitude / 360.0) * f64::from(width)) as u32;
        for (y, step) in (0..height).flat_map(|y| (0..width / 2).map(move |step| (y, step))) {
            let pixel = |x: u32| pixels[(y * width + x % width) as usize];
            let (a, b) = (pixel(right + step), pixel(right + width - 1 - step));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() <= 1e-6 * a.abs()), "{longitude}: {a:?} {b:?}");
        }
    }
}

#[test]
fn light_fades_in_the_evening_and_nothing_is_ever_invalid() {
    let mut before = f64::INFINITY;
    for elevation in [90.0, 40.0, 10.0, 2.0, 0.2, 0.0, -0.2, -0.5, -3.0, -8.0, -15.0, -40.0, -90.0] {
        let sky = at(elevation, 77.0, 2.5);
        let (above, sun) = irradiance(&sky);
        assert!((above + sun).is_finite() && above.min_element() >= 0.0, "{elevation}");
        let light = luminance(above + sun);
        assert!(light < before || light == 0.0, "{elevation}: {light} after {before}");
        assert_eq!(luminance(sun) > 0.0, elevation > 0.0);
        before = light;
    }
    let strange = SunSky { sun_direction: DVec3::NAN, turbidity: f64::NAN, ground_albedo: DVec3::new(f64::NAN, 7.0, -1.0) };
    let high = SunSky { sun_direction: DVec3::ZERO, turbidity: 1e9, ..strange };
    let far = SunSky { sun_direction: DVec3::new(0.0, -1e300, f64::MAX), ..strange };
    let half = SunSky { sun_direction: DVec3::new(f64::NAN, 1.0, 0.0), ..strange };
    for (sky, height) in [(strange, 0), (high, 2), (far, 3), (half, 7)] {
        let (width, height, pixels) = sky.sky(height);
        assert!(pixels.len() == (width * height) as usize && width == 2 * height && height >= 2);
        assert!(pixels.iter().flatten().all(|c| c.is_finite() && *c >= 0.0) && sky.sun().0.is_finite());
    }
}
