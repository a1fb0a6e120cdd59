//! A picture of every shape under every light, and the same one at other scales, under other light, elsewhere: pixels must be the same bits.

use std::sync::atomic::AtomicBool;

use glam::{DAffine3, DMat3, DVec3};
use tessera_engine::{
    description::{
        Camera, Environment, Falloff, Film, Filter, Frame, Group, Light, Material, MemoryAssets, Object, ObjectKind, Quality, Render,
        Shape, SourceId, Texture,
    },
    part::{self, Rect, SampleRange},
    scene::Scene,
};

use super::{
    scenes::{World, ball, frame, matrix, moved},
    trial::Tally,
};

/// In what a picture differs from the plain one.
#[derive(Clone, Copy)]
struct Change {
    /// Factor of all lengths, and, squared, of lights that weaken with the distance.
    scale: f64,
    /// Factor of all lights.
    light: f32,
    /// Where everything is.
    at: DVec3,
}

const PLAIN: Change = Change { scale: 1.0, light: 1.0, at: DVec3::ZERO };

/// Every shape plain and transformed. All coordinates are multiples of 2^-12.
fn objects(scale: f64) -> World {
    let at = |x: f64, y: f64, z: f64| (DVec3::new(x, y, z) * scale).to_array();
    let map = |x: f64, z: f64| {
        let linear = DMat3::from_cols_array(&[1.0, 0.25, 0.0, 0.0, 0.75, -0.5, 0.125, 0.0, 1.25]);
        DAffine3::from_mat3_translation(linear, DVec3::new(x, 1.0, z) * scale)
    };
    let mut world = World::default().with(Shape::Plane { point: at(0.0, 0.0, 0.0), normal: [0.0, 1.0, 0.0] }, DAffine3::IDENTITY);
    let shapes = [
        Shape::Sphere { center: at(-3.0, 1.0, 0.0), radius: 0.75 * scale },
        Shape::Box { min: at(-1.5, 0.25, -0.5), max: at(-0.5, 1.25, 0.5) },
        Shape::Disc { center: at(0.5, 1.0, 0.0), normal: [0.25, 0.5, 1.0], radius: 0.625 * scale },
        Shape::Rectangle { corner: at(1.5, 0.5, 0.0), edge_u: at(1.0, 0.0, -0.25), edge_v: at(0.0, 1.0, 0.25) },
        Shape::Cylinder { from: at(3.0, 0.25, 0.0), to: at(3.5, 1.25, 0.5), radius: 0.375 * scale, capped: true },
        Shape::Cone { from: at(4.5, 0.25, 0.0), to: at(4.5, 1.5, 0.25), radius: 0.5 * scale, to_radius: 0.0, capped: false },
    ];
    for shape in shapes {
        world = world.with(shape.clone(), DAffine3::IDENTITY).with(shape, map(0.0, -3.0));
    }
    let mesh = moved(&ball(16, 24, 0.2), scale, DVec3::ZERO);
    world.with_mesh(&mesh, map(-4.0, -1.5)).with_mesh(&mesh, DAffine3::from_translation(DVec3::new(0.0, 1.0, 3.0) * scale))
}

fn picture(change: Change) -> (Frame, MemoryAssets) {
    let Change { scale, light, at } = change;
    let place = |x: f64, y: f64, z: f64| (DVec3::new(x, y, z) * scale + at).to_array();
    let lit = |color: [f32; 3], factor: f64| color.map(|x| (f64::from(x * light) * factor) as f32);
    let (World { mut objects, assets }, source) = (objects(scale), SourceId::default());
    for (number, object) in objects.iter_mut().enumerate() {
        if let ObjectKind::Shape { material, .. } = &mut object.kind {
            *material = if number == 0 { 3 } else { number as u32 % 3 };
        }
    }
    let mut frame = frame(objects);
    let scene = &mut frame.scene;
    scene.textures = vec![Texture::Checker { even: [0.9, 0.8, 0.7], odd: [0.1, 0.2, 0.3], size: 0.75 * scale }];
    scene.materials.push(Material::Diffuse { reflectance: [0.9; 3], texture: Some(0) });
    let whole = DAffine3::from_translation(at);
    let instance = Object { kind: ObjectKind::Instance { group: 0 }, transform: Some(matrix(whole)), source };
    scene.groups.push(Group { objects: vec![instance] });
    scene.root = 1;
    scene.background = Environment::Constant(lit([0.25, 0.5, 0.75], 1.0));
    scene.lights = vec![
        Light::Point {
            position: place(-3.0, 5.0, 4.0),
            intensity: lit([60.0, 55.0, 50.0], scale * scale),
            falloff: Falloff::InverseSquare,
            source,
        },
        Light::Point { position: place(4.0, 3.0, 2.0), intensity: lit([0.25, 0.25, 0.5], 1.0), falloff: Falloff::None, source },
        Light::Directional { direction: [0.25, -1.0, -0.25], irradiance: lit([0.75, 0.75, 0.5], 1.0), angle: 0.0, source },
    ];
    frame.camera = Camera::pinhole(place(0.5, 3.5, 11.0), place(0.25, 0.75, 0.0), [0.0, 1.0, 0.0], 45.0);
    frame.film = Film { width: 160, height: 120, filter: Filter::Box };
    frame.quality = Quality::of(4);
    frame.render = Render::Whitted { max_depth: 6, transparent_shadows: true, min_weight: 0.0 };
    (frame, assets)
}

fn render(change: Change) -> Result<Vec<[f32; 3]>, String> {
    let (frame, assets) = picture(change);
    let scene = Scene::compile(&frame, &assets).map_err(|error| error.to_string())?;
    let rect = Rect { x: 0, y: 0, width: frame.film.width, height: frame.film.height };
    let samples = SampleRange { first: 0, count: frame.quality.samples.into() };
    part::render(&scene, rect, samples, &AtomicBool::new(false)).map(|part| part.pixels).map_err(|error| error.to_string())
}

/// Holds a picture against the plain one, whose pixels are multiplied; counts pixels.
fn compare(change: Change, factor: f64, what: &str, tally: &mut Tally) {
    let (plain, changed) = match (render(PLAIN), render(change)) {
        (Ok(plain), Ok(changed)) => (plain, changed),
        (plain, changed) => return tally.check(false, || format!("{what}: {:?} {:?}", plain.err(), changed.err())),
    };
    for (pixel, (plain, changed)) in plain.iter().zip(&changed).enumerate() {
        let expected = plain.map(|x| (f64::from(x) * factor) as f32);
        let same = expected.iter().zip(changed).all(|(a, b)| a.to_bits() == b.to_bits());
        tally.check(same, || format!("{what}: pixel ({}, {}) is {changed:?} instead of {expected:?}", pixel % 160, pixel / 160));
    }
}

/// Everything larger and smaller by a power of two.
pub fn scaled(_: u64) -> Tally {
    let mut tally = Tally::default();
    for exponent in [-60, -31, -1, 1, 20, 60] {
        compare(Change { scale: 2f64.powi(exponent), ..PLAIN }, 1.0, &format!("2^{exponent}"), &mut tally);
    }
    tally
}

/// Lights brighter and darker by a power of two.
pub fn lit(_: u64) -> Tally {
    let mut tally = Tally::default();
    for exponent in [-100, -50, -1, 1, 50, 100] {
        compare(Change { light: 2f32.powi(exponent), ..PLAIN }, 2f64.powi(exponent), &format!("2^{exponent}"), &mut tally);
    }
    tally
}

/// The world elsewhere.
pub fn shifted(_: u64) -> Tally {
    let mut tally = Tally::default();
    let at = DVec3::new(1e12, -0.5e12, 0.25e12);
    compare(Change { at, ..PLAIN }, 1.0, "shifted by 1e12", &mut tally);
    tally
}
