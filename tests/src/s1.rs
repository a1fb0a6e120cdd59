//! Scene S1, "whitted": the scene that POV-Ray is compared on, built from its definition in numbers.

use tessera_engine::description::{
    Aovs, Camera, Environment, Falloff, Film, Filter, Frame, Group, Light, Material, Object, ObjectKind, Quality, Render, Scene, Shape,
    SourceId, Texture,
};

/// One sphere of the scene.
#[derive(Clone, Copy, Debug)]
pub struct Ball {
    /// Middle.
    pub center: [f64; 3],
    /// Radius.
    pub radius: f64,
    /// What it is made of.
    pub kind: Kind,
}

/// What a sphere is made of.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Kind {
    /// Lambertian with this albedo.
    Diffuse([f64; 3]),
    /// Reflects 0.9 at every angle.
    Mirror,
    /// Index of refraction 1.5, colourless.
    Glass,
}

/// Point lights, position and colour: without fall-off and without 1/pi.
pub const LIGHTS: [([f64; 3], [f64; 3]); 2] = [([-6.0, 9.0, 6.0], [0.60, 0.60, 0.60]), ([7.0, 8.0, 3.0], [0.40, 0.38, 0.35])];

/// Radiance of rays that leave the scene.
pub const BACKGROUND: [f64; 3] = [0.25, 0.40, 0.70];

/// Albedo of the floor's squares of edge 1: even and odd.
pub const FLOOR: [f64; 2] = [0.8, 0.2];

/// Eye and target of the camera; up is y, the horizontal field of view 45 degrees.
pub const CAMERA: [[f64; 3]; 2] = [[0.0, 3.5, 11.0], [0.0, 0.8, 0.0]];

/// The 32 spheres.
pub fn balls() -> Vec<Ball> {
    let spiral = (0..30_u8).map(|i| {
        let radius = 0.30 + 0.10 * f64::from(i % 4);
        let (rho, angle) = (0.95 * (f64::from(i) + 0.5).sqrt(), 2.399963 * f64::from(i));
        let kind = match i % 3 {
            0 => Kind::Diffuse(color(f64::from(i / 3))),
            1 => Kind::Mirror,
            _ => Kind::Glass,
        };
        Ball { center: [rho * angle.cos(), radius, rho * angle.sin()], radius, kind }
    });
    let large = Ball { center: [-4.5, 1.6, -6.5], radius: 1.6, kind: Kind::Mirror };
    let high = Ball { center: [1.2, 1.9, 2.5], radius: 0.6, kind: Kind::Glass };
    spiral.chain([large, high]).collect()
}

fn color(k: f64) -> [f64; 3] {
    let third = std::f64::consts::TAU / 3.0;
    [0.0, third, 2.0 * third].map(|phase| 0.5 + 0.4 * (k + phase).cos())
}

/// The frame as a job would describe it: one sample at the centre of each pixel.
pub fn frame(width: u32, height: u32) -> Frame {
    let mut scene = Scene { background: Environment::Constant(BACKGROUND.map(|c| c as f32)), ..Scene::default() };
    let [even, odd] = FLOOR.map(|albedo| [albedo as f32; 3]);
    scene.textures.push(Texture::Checker { even, odd, size: 1.0 });
    let mut group = Group::default();
    let mut add = |shape, material| {
        scene.materials.push(material);
        let material = scene.materials.len() as u32 - 1;
        group.objects.push(Object { kind: ObjectKind::Shape { shape, material }, transform: None, source: SourceId::default() });
    };
    let floor = Material::Diffuse { reflectance: [1.0; 3], texture: Some(0) };
    add(Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }, floor);
    for Ball { center, radius, kind } in balls() {
        let material = match kind {
            Kind::Diffuse(albedo) => Material::Diffuse { reflectance: albedo.map(|c| c as f32), texture: None },
            Kind::Mirror => Material::Mirror { reflectance: [0.9; 3] },
            Kind::Glass => Material::smooth_glass(1.5, [1.0; 3]),
        };
        add(Shape::Sphere { center, radius }, material);
    }
    scene.groups.push(group);
    scene.lights = LIGHTS
        .map(|(position, color)| Light::Point {
            position,
            intensity: color.map(|c| c as f32),
            falloff: Falloff::None,
            source: SourceId::default(),
        })
        .to_vec();
    let [eye, look_at] = CAMERA;
    Frame {
        scene,
        camera: Camera::pinhole(eye, look_at, [0.0, 1.0, 0.0], 45.0),
        film: Film { width, height, filter: Filter::Point },
        render: Render::Whitted { max_depth: 8, transparent_shadows: true, min_weight: 1.0 / 255.0 },
        quality: Quality::of(1),
        seed: 0,
        aovs: Aovs::NONE,
    }
}
