//! Environments against quadrature and closed forms.

use super::*;

/// Numbers in [0, 1) that look random: SplitMix64 (Steele, Lea, Flood, "Fast Splittable Pseudorandom Number Generators", 2014).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ self.0 >> 30).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ z >> 27).wrapping_mul(0x94D0_49BB_1331_11EB);
        ((z ^ z >> 31) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn pair(&mut self) -> DVec2 {
        DVec2::new(self.next(), self.next())
    }
}

const LAST: f64 = 1.0 - f64::EPSILON / 2.0;

/// The direction of image coordinates, written down anew.
fn towards(u: f64, v: f64) -> DVec3 {
    let (longitude, polar) = (TAU * (u - 0.5), PI * v);
    DVec3::new(sin(polar) * sin(longitude), cos(polar), -sin(polar) * cos(longitude))
}

fn image(width: u32, height: u32, of: impl Fn(u32, u32) -> [f32; 3]) -> Vec<[f32; 3]> {
    (0..height).flat_map(|y| (0..width).map(move |x| (x, y))).map(|(x, y)| of(x, y)).collect()
}

/// Of very different pixels, a third of them black.
fn mixed(width: u32, height: u32, to_world: DMat3) -> ImageEnvironment {
    let pixel = |x: u32, y: u32| {
        let mut random = Random(u64::from(x * 1000 + y));
        let strength = if random.next() < 0.33 { 0.0 } else { crate::math::exp(8.0 * random.next()) };
        [0; 3].map(|_| (strength * random.next()) as f32)
    };
    ImageEnvironment::new(width, height, image(width, height, pixel), to_world, 0.5).unwrap()
}

/// Sum over the sphere of `f` times solid angle, with `fine` x `fine` points in each cell of a grid.
fn integral(columns: usize, rows: usize, fine: usize, to_world: DMat3, f: impl Fn(DVec3) -> DVec3) -> DVec3 {
    let (across, down) = (columns * fine, rows * fine);
    let mut sum = DVec3::ZERO;
    for y in 0..down {
        let at = |v: f64| v / down as f64;
        let band = TAU * (cos(PI * at(y as f64)) - cos(PI * at(y as f64 + 1.0))) / across as f64;
        for x in 0..across {
            sum += f(to_world * towards((x as f64 + 0.5) / across as f64, at(y as f64 + 0.5))) * band;
        }
    }
    sum
}

fn tilted() -> DMat3 {
    let (t, b) = crate::math::orthonormal_basis(DVec3::new(0.3, -0.5, 0.8).normalize());
    DMat3::from_cols(t, b, t.cross(b)) * turned(33.0)
}

fn is_near(a: DVec3, b: DVec3, relative: f64) -> bool {
    (a - b).abs().max_element() <= relative * b.abs().max_element()
}

#[test]
fn the_middle_of_the_image_lies_at_minus_z_and_right_is_right() {
    let coordinates = image(256, 128, |x, y| [(x as f32 + 0.5) / 256.0, (y as f32 + 0.5) / 128.0, 1.0]);
    let of = |degrees| Environment::Image(ImageEnvironment::new(256, 128, coordinates.clone(), turned(degrees), 2.0).unwrap());
    let straight = of(0.0);
    for (direction, u, v) in [
        (DVec3::NEG_Z, 0.5, 0.5),
        (DVec3::X, 0.75, 0.5),
        (DVec3::NEG_X, 0.25, 0.5),
        (DVec3::new(0.0, 1.0, -1.0), 0.5, 0.25),
        (DVec3::new(1.0, -1.0, 0.0), 0.75, 0.75),
        (DVec3::new(1.0, 0.0, 1.0), 0.875, 0.5),
        (DVec3::new(-1.0, 0.0, 1.0), 0.125, 0.5),
    ] {
        let expected = DVec3::new(2.0 * u, 2.0 * v, 2.0);
        assert!((straight.radiance(direction.normalize()) - expected).length() < 1e-6, "{direction}");
    }
    // Half a pixel from the poles nothing changes any more; behind, the last column goes over into the first one.
    assert!((straight.radiance(DVec3::Y).y - 1.0 / 128.0).abs() < 1e-6 && (straight.radiance(DVec3::NEG_Y).y - 255.0 / 128.0).abs() < 1e-6);
    assert!((straight.radiance(DVec3::Z).x - 1.0).abs() < 1e-6, "the mean of first and last column");
    // Turned to the left by a right angle, and by 30 degrees.
    assert!((of(90.0).radiance(DVec3::NEG_X) - DVec3::new(1.0, 1.0, 2.0)).length() < 1e-6);
    assert!((of(30.0).radiance(DVec3::NEG_Z).x - 2.0 * (0.5 + 30.0 / 360.0)).abs() < 1e-6);
}

#[test]
fn pixels_are_met_at_their_centres_and_interpolated_between_them() {
    let environment = mixed(13, 7, DMat3::IDENTITY);
    let centre = |x: u32, y: u32| environment.radiance(towards((f64::from(x) + 0.5) / 13.0, (f64::from(y) + 0.5) / 7.0));
    for (x, y) in (0..7).flat_map(|y| (0..13).map(move |x| (x, y))) {
        let pixel = environment.pixel(x, y) * 0.5;
        assert!(is_near(centre(x as u32, y as u32), pixel, 1e-9) || pixel == DVec3::ZERO);
    }
    let between = environment.radiance(towards(3.0 / 13.0, 2.0 / 7.0));
    assert!(is_near(between, (centre(2, 1) + centre(3, 1) + centre(2, 2) + centre(3, 2)) / 4.0, 1e-9));
    assert!(is_near(environment.radiance(towards(0.0, 1.5 / 7.0)), (centre(0, 1) + centre(12, 1)) / 2.0, 1e-9));
}

#[test]
fn the_density_integrates_to_1() {
    for (width, height) in [(13, 7), (1, 1), (2, 1), (1, 5), (64, 32)] {
        let environment = mixed(width, height, tilted());
        let sum = integral(width as usize, height as usize, 3, tilted(), |d| DVec3::splat(environment.pdf(d))).x;
        assert!((sum - 1.0).abs() < 1e-12, "{width} x {height}: {sum}");
    }
    let constant = Environment::Constant(DVec3::ONE);
    assert!((integral(10, 10, 1, DMat3::IDENTITY, |d| DVec3::splat(constant.pdf(d))).x - 1.0).abs() < 1e-12);
}

/// Pearson's test: 400,000 directions in bins of equal solid angle that have nothing to do with the cells.
fn chi_square(environment: &Environment) {
    const BINS: (usize, usize) = (20, 10);
    const SAMPLES: usize = 400_000;
    let bin = |d: DVec3| {
        let x = ((atan2(d.x, d.y) / TAU + 0.5) * BINS.0 as f64) as usize;
        let y = ((d.z * 0.5 + 0.5) * BINS.1 as f64) as usize;
        y.min(BINS.1 - 1) * BINS.0 + x.min(BINS.0 - 1)
    };
    let (mut expected, mut counts, mut random) = ([0.0; 200], [0.0; 200], Random(7));
    let fine = 1200;
    for i in 0..fine * fine {
        let (a, z) = (((i % fine) as f64 + 0.5) / fine as f64 * TAU - PI, ((i / fine) as f64 + 0.5) / fine as f64 * 2.0 - 1.0);
        let (sin, cos) = sin_cos(a);
        let level = (1.0 - z * z).sqrt();
        let direction = DVec3::new(sin * level, cos * level, z);
        expected[bin(direction)] += environment.pdf(direction) * 4.0 * PI * SAMPLES as f64 / (fine * fine) as f64;
    }
    for _ in 0..SAMPLES {
        let (direction, _, _) = environment.sample(random.pair()).unwrap();
        counts[bin(direction)] += 1.0;
    }
    let statistic: f64 = expected.iter().zip(counts).filter(|(e, _)| **e > 5.0).map(|(e, c)| (c - e) * (c - e) / e).sum();
    let freedom = expected.iter().filter(|e| **e > 5.0).count() as f64 - 1.0;
    assert!(freedom > 50.0 && statistic < freedom + 4.0 * (2.0 * freedom).sqrt(), "{statistic} of {freedom}");
}

#[test]
fn samples_follow_the_density() {
    chi_square(&Environment::Image(mixed(13, 7, tilted())));
    chi_square(&Environment::Image(mixed(64, 32, DMat3::IDENTITY)));
    chi_square(&Environment::Constant(DVec3::ONE));
}

#[test]
fn a_sample_tells_the_radiance_and_density_of_its_direction() {
    let environment = Environment::Image(mixed(64, 32, tilted()));
    let (mut random, mut at_edges) = (Random(3), 0);
    for _ in 0..20_000 {
        let (direction, radiance, pdf) = environment.sample(random.pair()).unwrap();
        assert!((direction.length() - 1.0).abs() < 1e-14 && (radiance - environment.radiance(direction)).length() < 1e-6 && pdf > 0.0);
        at_edges += u32::from((environment.pdf(direction) - pdf).abs() > 1e-9 * pdf);
    }
    assert_eq!(at_edges, 0);
}

#[test]
fn the_mean_is_that_of_quadrature_and_of_samples() {
    for (width, height) in [(13, 7), (1, 1), (3, 1), (1, 5), (64, 32)] {
        let image = mixed(width, height, tilted());
        let mean = integral(width as usize, height as usize, 40, tilted(), |d| image.radiance(d)) / (4.0 * PI);
        let environment = Environment::Image(image);
        assert!(is_near(environment.mean_radiance(), mean, 1e-4), "{width} x {height}");
        let (mut random, mut sum, n) = (Random(9), DVec3::ZERO, 40_000);
        for _ in 0..n {
            let (_, radiance, pdf) = environment.sample(random.pair()).unwrap();
            sum += radiance / pdf;
        }
        assert!(is_near(sum / (f64::from(n) * 4.0 * PI), mean, 0.02), "{width} x {height}");
    }
    let constant = Environment::Constant(DVec3::new(1.0, 2.0, 3.0));
    assert_eq!(constant.mean_radiance(), DVec3::new(1.0, 2.0, 3.0));
}

/// Under radiance a + b (d . y), a surface of normal n receives pi a + 2/3 pi b (n . y).
#[test]
fn irradiance_has_its_closed_form() {
    let pixel = |_, y| {
        let towards_y = cos(PI * (f64::from(y) + 0.5) / 128.0);
        [1.0 + towards_y as f32, 2.0, 0.5 - 0.5 * towards_y as f32]
    };
    let environment = Environment::Image(ImageEnvironment::new(256, 128, image(256, 128, pixel), turned(20.0), 1.0).unwrap());
    let mut random = Random(1);
    for normal in [DVec3::Y, DVec3::X, DVec3::new(1.0, -2.0, 0.5).normalize()] {
        let (mut sum, n) = (DVec3::ZERO, 400_000);
        for _ in 0..n {
            let (direction, radiance, pdf) = environment.sample(random.pair()).unwrap();
            sum += radiance * (normal.dot(direction).max(0.0) / pdf);
        }
        let expected = DVec3::new(PI + 2.0 / 3.0 * PI * normal.y, TAU, 0.5 * PI - PI / 3.0 * normal.y);
        assert!(is_near(sum / f64::from(n), expected, 0.01), "{} for {expected}", sum / f64::from(n));
    }
}

/// A sun of one pixel that outshines all the rest: nearly every sample goes there, in proportion, and the rest is seen nevertheless.
#[test]
fn a_sun_of_one_pixel_is_found() {
    let sun = |x, y| if (x, y) == (300, 60) { [1e12; 3] } else { [1.0; 3] };
    let environment = Environment::Image(ImageEnvironment::new(512, 256, image(512, 256, sun), DMat3::IDENTITY, 1.0).unwrap());
    let towards_sun = towards(300.5 / 512.0, 60.5 / 256.0);
    let mut random = Random(2);
    for _ in 0..1000 {
        let (direction, radiance, pdf) = environment.sample(random.pair()).unwrap();
        assert!(direction.dot(towards_sun) > cos(2.0 * PI / 256.0));
        assert!(radiance.x > 0.0 && pdf > 1.0);
    }
    for _ in 0..1000 {
        let anywhere = on_sphere(TAU * random.next(), 1.0 - 2.0 * random.next());
        assert!(environment.pdf(anywhere) > 0.0);
    }
}

#[test]
fn wherever_light_comes_from_there_may_be_a_sample() {
    let strengths = [0.0, 0.0, 0.0, 0.0, 0.0, 1e-45, 1.0, f32::MAX];
    let pixel = |x: u32, y: u32| [0, 1, 2].map(|c| strengths[(Random(u64::from(x * 64 + y * 4 + c)).next() * 8.0) as usize]);
    let environment = ImageEnvironment::new(32, 16, image(32, 16, pixel), DMat3::IDENTITY, 1.0).unwrap();
    let (mut lit, mut dark) = (0, 0);
    for y in 0..16 * 5 {
        for x in 0..32 * 5 {
            let direction = towards((f64::from(x) + 0.5) / 160.0, (f64::from(y) + 0.5) / 80.0);
            let (shines, found) = (environment.radiance(direction) != DVec3::ZERO, environment.pdf(direction) > 0.0);
            assert!(found || !shines);
            lit += u32::from(shines);
            dark += u32::from(!found);
        }
    }
    assert!(lit > 1000 && dark < 9000, "{lit} {dark}");
}

#[test]
fn the_ends_of_the_samples_are_finite() {
    for environment in [mixed(13, 7, tilted()), mixed(1, 1, DMat3::IDENTITY), mixed(64, 32, DMat3::IDENTITY)].map(Environment::Image) {
        for u in [0.0, 0.5, LAST].iter().flat_map(|x| [0.0, 0.5, LAST].map(|y| DVec2::new(*x, y))) {
            let (direction, radiance, pdf) = environment.sample(u).unwrap();
            assert!((direction.length() - 1.0).abs() < 1e-14 && radiance.is_finite() && pdf > 0.0 && pdf.is_finite(), "{u}");
        }
        for direction in [DVec3::X, DVec3::Y, DVec3::Z].iter().flat_map(|d| [*d, -*d]) {
            assert!(environment.radiance(direction).is_finite() && environment.pdf(direction).is_finite());
        }
    }
}

#[test]
fn nothing_is_sampled_in_the_dark() {
    let black = |scale| ImageEnvironment::new(4, 2, vec![[if scale == 0.0 { 1.0 } else { 0.0 }; 3]; 8], DMat3::IDENTITY, scale).unwrap();
    for environment in [Environment::Constant(DVec3::ZERO), Environment::Image(black(1.0)), Environment::Image(black(0.0))] {
        assert!(environment.sample(DVec2::splat(0.5)).is_none());
        assert_eq!((environment.pdf(DVec3::X), environment.mean_radiance()), (0.0, DVec3::ZERO));
    }
}

#[test]
fn images_without_meaning_are_refused() {
    let of = |pixels: Vec<[f32; 3]>, to_world, scale| ImageEnvironment::new(4, 2, pixels, to_world, scale).map(|_| ()).unwrap_err();
    for wrong in [-1.0, f32::NAN, f32::INFINITY] {
        let mut pixels = vec![[1.0; 3]; 8];
        pixels[6][1] = wrong;
        assert!(of(pixels, DMat3::IDENTITY, 1.0).contains("pixel (2, 1)"));
    }
    assert!(of(vec![[1.0; 3]; 7], DMat3::IDENTITY, 1.0).contains("4 x 2 pixels cannot have 7"));
    for scale in [-1.0, f64::NAN, f64::INFINITY, 1e39] {
        assert!(of(vec![[1.0; 3]; 8], DMat3::IDENTITY, scale).contains("scale"));
    }
    for matrix in [DMat3::IDENTITY * 2.0, DMat3::from_diagonal(DVec3::new(-1.0, 1.0, 1.0)), DMat3::NAN] {
        assert!(of(vec![[1.0; 3]; 8], matrix, 1.0).contains("rotation"));
    }
    assert!(ImageEnvironment::new(0, 0, vec![], DMat3::IDENTITY, 1.0).is_err());
}
