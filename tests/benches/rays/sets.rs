//! The rays of a scene: from the camera, scattered once and twice, short ones around what is seen, and towards a lamp.

use glam::DVec3;
use tessera_engine::{scene::Scene, shape::Ray};

use super::{Numbers, on_sphere, scenes::Model};

/// Edge of the picture in pixels.
const EDGE: u32 = 512;

/// How far rays start beside a surface, in sizes of the scene: enough for f32, and the same for all contenders.
const ASIDE: f64 = 2e-5;

/// What a ray asks.
#[derive(Clone, Copy, PartialEq, Eq)]
pub enum Query {
    /// For the nearest hit.
    Closest,
    /// Whether there is any.
    Any,
}

/// Rays of one kind.
pub struct Set {
    pub name: &'static str,
    pub query: Query,
    /// Whether every eight rays belong together.
    pub is_coherent: bool,
    pub rays: Vec<Ray>,
}

pub fn of(model: &Model, scene: &Scene) -> Vec<Set> {
    let (mut numbers, size) = (Numbers(99), model.size());
    let camera = from_camera(model);
    let first = hits(scene, &camera, size * ASIDE);
    let diffuse = scattered(&first, f64::INFINITY, &mut numbers);
    let mut second = scattered(&hits(scene, &diffuse, size * ASIDE), f64::INFINITY, &mut numbers);
    for at in (1..second.len()).rev() {
        second.swap(at, (numbers.unit() * (at + 1) as f64) as usize);
    }
    let around = scattered(&first, size * 0.03, &mut numbers);
    let lamp = |(point, _): &(DVec3, DVec3)| {
        let corner = DVec3::new(numbers.unit(), numbers.unit(), numbers.unit()) - 0.5;
        let way = model.lamp + corner * (size * 0.02) - *point;
        Ray { t_max: way.length() * 0.9999, ..Ray::new(*point, way.normalize()) }
    };
    let shadow = first.iter().map(lamp).collect();
    let set = |name, query, is_coherent, rays| Set { name, query, is_coherent, rays };
    vec![
        set("primary", Query::Closest, true, camera),
        set("diffuse", Query::Closest, false, diffuse),
        set("second", Query::Closest, false, second),
        set("ao", Query::Any, false, around),
        set("shadow", Query::Any, false, shadow),
    ]
}

/// In blocks of 4 x 2 pixels, so that eight rays in a row belong together.
fn from_camera(model: &Model) -> Vec<Ray> {
    let forward = (model.look_at - model.eye).normalize();
    let right = forward.cross(DVec3::Z).normalize();
    let up = right.cross(forward);
    let blocks = (0..EDGE / 2).flat_map(|y| (0..EDGE / 4).map(move |x| (x, y)));
    let pixels = blocks.flat_map(|(x, y)| (0..8).map(move |k| (4 * x + k % 4, 2 * y + k / 4)));
    let place = |pixel: u32| ((f64::from(pixel) + 0.5) / f64::from(EDGE) * 2.0 - 1.0) * model.half_view;
    pixels.map(|(x, y)| rounded(model.eye, forward + right * place(x) - up * place(y))).collect()
}

/// A ray that starts at a point of f32, as Embree's rays do.
fn rounded(origin: DVec3, direction: DVec3) -> Ray {
    Ray::new(origin.as_vec3().as_dvec3(), direction.normalize())
}

/// Points beside the surfaces that rays meet, with their normals.
fn hits(scene: &Scene, rays: &[Ray], aside: f64) -> Vec<(DVec3, DVec3)> {
    let hit = |ray: &Ray| {
        let surface = scene.closest(ray)?;
        let normal = surface.ng * -surface.ng.dot(ray.direction).signum();
        Some((surface.point + normal * aside, normal))
    };
    rays.iter().filter_map(hit).collect()
}

fn scattered(from: &[(DVec3, DVec3)], t_max: f64, numbers: &mut Numbers) -> Vec<Ray> {
    let scatter = |(point, normal): &(DVec3, DVec3)| {
        let direction = *normal * 1.001 + on_sphere(numbers.unit(), numbers.unit());
        Ray { t_max, ..rounded(*point, direction) }
    };
    from.iter().map(scatter).collect()
}
