//! The engine's Whitted ray tracing on scene S1, against a second tracer that was written from the scene's definition alone, and, where it is
//! at hand, against the image of POV-Ray.

use std::{env, path::PathBuf, sync::atomic::AtomicBool};

use glam::DVec3;
use tessera_engine::{
    description::MemoryAssets,
    film::Film,
    output,
    part::{self, Rect, SampleRange},
    scene::Scene,
};
use tessera_tests::s1::{self, Ball, Kind};

const WIDTH: u32 = 1024;
const HEIGHT: u32 = 768;

/// Largest chain of rays: children of level 7 are not traced.
const LAST_LEVEL: u32 = 7;

/// Children of this weight or less are not traced.
const BAILOUT: f64 = 1.0 / 255.0;

/// Rays start this far from where they were born.
const EPSILON: f64 = 1e-9;

/// The slow tracer: no tree, no material model, no camera but that of the definition.
struct Slow {
    balls: Vec<Ball>,
}

/// What a ray of the slow tracer meets.
enum Hit<'a> {
    Floor,
    Ball(&'a Ball),
}

impl Slow {
    fn pixel(&self, column: u32, row: u32) -> DVec3 {
        let [eye, target] = s1::CAMERA.map(DVec3::from);
        let forward = (target - eye).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let pixel = 2.0 * 22.5_f64.to_radians().tan() / f64::from(WIDTH);
        let x = (f64::from(column) + 0.5 - f64::from(WIDTH) / 2.0) * pixel;
        let y = (f64::from(HEIGHT) / 2.0 - f64::from(row) - 0.5) * pixel;
        self.trace(eye, (forward + right * x + up * y).normalize(), 0, 1.0)
    }

    fn trace(&self, origin: DVec3, direction: DVec3, level: u32, weight: f64) -> DVec3 {
        if level > LAST_LEVEL || weight <= BAILOUT {
            return DVec3::ZERO;
        }
        let Some((t, hit)) = self.nearest(origin, direction) else { return s1::BACKGROUND.into() };
        let point = origin + direction * t;
        let child = |direction: DVec3, share: f64| share * self.trace(point + direction * EPSILON, direction, level + 1, weight * share);
        let Hit::Ball(ball) = hit else {
            let even = (point.x.floor() + point.z.floor()).rem_euclid(2.0) == 0.0;
            return self.lit(point, DVec3::Y, DVec3::splat(s1::FLOOR[usize::from(!even)]));
        };
        let normal = (point - DVec3::from(ball.center)) / ball.radius;
        match ball.kind {
            Kind::Diffuse(albedo) => self.lit(point, normal, albedo.into()),
            Kind::Mirror => child(mirrored(direction, normal), 0.9),
            Kind::Glass => {
                let outside = direction.dot(normal) < 0.0;
                let (normal, from, to) = if outside { (normal, 1.0, 1.5) } else { (-normal, 1.5, 1.0) };
                let cos = -direction.dot(normal);
                let sin = (1.0 - cos * cos).max(0.0).sqrt() * from / to;
                if sin >= 1.0 {
                    return child(mirrored(direction, normal), 1.0);
                }
                let cos_in = (1.0 - sin * sin).sqrt();
                let s = (from * cos - to * cos_in) / (from * cos + to * cos_in);
                let p = (from * cos_in - to * cos) / (from * cos_in + to * cos);
                let fresnel = (s * s + p * p) / 2.0;
                let bent = direction * (from / to) + normal * (cos * from / to - cos_in);
                child(mirrored(direction, normal), fresnel) + child(bent, 1.0 - fresnel)
            }
        }
    }

    fn lit(&self, point: DVec3, normal: DVec3, albedo: DVec3) -> DVec3 {
        let mut light = DVec3::ZERO;
        for (position, color) in s1::LIGHTS {
            let to_light = DVec3::from(position) - point;
            let distance = to_light.length();
            let direction = to_light / distance;
            let opaque = |ball: &&Ball| ball.kind != Kind::Glass;
            let shadowed = || self.balls.iter().filter(opaque).any(|ball| meet(ball, point, direction).is_some_and(|t| t < distance));
            let cos = normal.dot(direction);
            if cos > 0.0 && !shadowed() {
                light += DVec3::from(color) * cos;
            }
        }
        albedo * light
    }

    fn nearest(&self, origin: DVec3, direction: DVec3) -> Option<(f64, Hit<'_>)> {
        let floor = -origin.y / direction.y;
        let floor = (floor > EPSILON && floor.is_finite()).then_some((floor, Hit::Floor));
        let balls = self.balls.iter().filter_map(|ball| Some((meet(ball, origin, direction)?, Hit::Ball(ball))));
        balls.chain(floor).min_by(|a, b| a.0.total_cmp(&b.0))
    }
}

fn mirrored(direction: DVec3, normal: DVec3) -> DVec3 {
    (direction - normal * 2.0 * direction.dot(normal)).normalize()
}

/// Where a ray enters a sphere, or leaves it if it starts inside.
fn meet(ball: &Ball, origin: DVec3, direction: DVec3) -> Option<f64> {
    let to_center = DVec3::from(ball.center) - origin;
    let along = to_center.dot(direction);
    let half = ball.radius * ball.radius - (to_center - direction * along).length_squared();
    if half < 0.0 {
        return None;
    }
    [along - half.sqrt(), along + half.sqrt()].into_iter().find(|&t| t > EPSILON)
}

fn render() -> Film {
    let frame = s1::frame(WIDTH, HEIGHT);
    let scene = Scene::compile(&frame, &MemoryAssets::default()).unwrap();
    let rect = Rect { x: 0, y: 0, width: WIDTH, height: HEIGHT };
    let part = part::render(&scene, rect, SampleRange { first: 0, count: 1 }, &AtomicBool::new(false)).unwrap();
    assert_eq!((part.counters.camera_rays, part.counters.invalid_samples), (rect.area(), 0));
    let mut film = Film::new(WIDTH, HEIGHT);
    film.place(&part).unwrap();
    film
}

fn rmse(a: impl Iterator<Item = f64>, b: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = a.zip(b).fold((0.0, 0.0), |(sum, count), (a, b)| (sum + (a - b) * (a - b), count + 1.0));
    f64::sqrt(sum / count)
}

fn components(film: &Film) -> impl Iterator<Item = f64> {
    film.pixels().iter().flatten().map(|&component| f64::from(component))
}

#[test]
fn every_pixel_is_that_of_a_second_tracer() {
    let slow = Slow { balls: s1::balls() };
    let expected: Vec<DVec3> =
        (0..HEIGHT).flat_map(|row| (0..WIDTH).map(move |column| (column, row))).map(|(x, y)| slow.pixel(x, y)).collect();
    let film = render();
    let differ =
        film.pixels().iter().zip(&expected).filter(|(a, b)| (DVec3::from(a.map(f64::from)) - **b).abs().max_element() > 1e-6).count();
    let rmse = rmse(components(&film), expected.iter().flat_map(|pixel| pixel.to_array()));
    println!("RMSE {rmse:.3e}, {differ} pixels differ by more than 1e-6");
    assert!(rmse <= 1e-6 && differ == 0, "RMSE {rmse:e}, {differ} pixels differ");
}

/// The image is not ours to ship: `TESSERA_S1_REFERENCE` names it where it is at hand.
#[test]
fn every_pixel_is_that_of_povray() {
    let Some(path) = env::var_os("TESSERA_S1_REFERENCE").map(PathBuf::from) else {
        println!("skipped: TESSERA_S1_REFERENCE does not name POV-Ray's image of the scene");
        return;
    };
    let reference = output::exr::read(&path).unwrap().film;
    let rmse = rmse(components(&render()), components(&reference));
    println!("RMSE to POV-Ray {rmse:.3e}");
    assert!(rmse <= 2e-4, "RMSE {rmse:e}");
}
