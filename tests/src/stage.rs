//! Small scenes built in code, and what one point of them shows.

use std::f64::consts::FRAC_PI_2;

use glam::DVec3;
use tessera_engine::{
    description::{
        Aovs, Camera, Environment, Falloff, Film, Filter, Frame, Group, Light, Material, MemoryAssets, MeshData, Object, ObjectKind,
        Quality, Render, Rgb, Scene as Description, Shape, SourceId,
    },
    scene::Scene,
};

use crate::{seeds, statistics::Estimate};

/// A scene that is being put together.
#[derive(Clone, Debug, Default)]
pub struct Stage {
    /// What is there.
    pub scene: Description,
    /// Files and meshes.
    pub assets: MemoryAssets,
}

/// A Lambertian surface.
pub fn diffuse(reflectance: Rgb) -> Material {
    Material::Diffuse { reflectance, texture: None }
}

/// A surface that shines on the side of its normal.
pub fn lamp(radiance: Rgb) -> Material {
    Material::Emitter { radiance, texture: None, two_sided: false }
}

/// A point light whose irradiance falls with the square of the distance.
pub fn point(position: [f64; 3], intensity: Rgb) -> Light {
    Light::Point { position, intensity, falloff: Falloff::InverseSquare, source: SourceId::default() }
}

/// A light infinitely far away.
pub fn directional(direction: [f64; 3], irradiance: Rgb, angle: f64) -> Light {
    Light::Directional { direction, irradiance, angle, source: SourceId::default() }
}

/// A sphere.
pub fn sphere(center: [f64; 3], radius: f64) -> Shape {
    Shape::Sphere { center, radius }
}

/// A parallelogram.
pub fn rectangle(corner: [f64; 3], edge_u: [f64; 3], edge_v: [f64; 3]) -> Shape {
    Shape::Rectangle { corner, edge_u, edge_v }
}

/// The plane y = 0, seen from above.
pub fn ground() -> Shape {
    Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }
}

/// Path tracing that nothing ends but the number of its rays.
pub fn path(max_depth: u32) -> Render {
    Render::Path { max_depth, roulette_depth: max_depth, smooth_terminator: false }
}

impl Stage {
    /// Nothing, in the dark.
    pub fn new() -> Self {
        Self { scene: Description { groups: vec![Group::default()], ..Description::default() }, assets: MemoryAssets::default() }
    }

    /// The same with a shape.
    #[must_use]
    pub fn with(self, shape: Shape, material: Material) -> Self {
        self.with_placed(shape, material, None)
    }

    /// The same with a shape that is stretched along the axes.
    #[must_use]
    pub fn with_stretched(self, shape: Shape, material: Material, [x, y, z]: [f64; 3]) -> Self {
        self.with_placed(shape, material, Some([[x, 0.0, 0.0, 0.0], [0.0, y, 0.0, 0.0], [0.0, 0.0, z, 0.0]]))
    }

    fn with_placed(mut self, shape: Shape, material: Material, transform: Option<[[f64; 4]; 3]>) -> Self {
        let known = self.scene.materials.iter().position(|other| *other == material);
        let index = known.unwrap_or_else(|| {
            self.scene.materials.push(material);
            self.scene.materials.len() - 1
        });
        let kind = ObjectKind::Shape { shape, material: index as u32 };
        self.scene.groups[0].objects.push(Object { kind, transform, source: SourceId::default() });
        self
    }

    /// The same with a mesh of flat triangles.
    #[must_use]
    pub fn with_mesh(self, positions: &[[f32; 3]], triangles: &[[u32; 3]], material: Material) -> Self {
        self.with_data(&MeshData { positions: positions.to_vec(), triangles: triangles.to_vec(), ..MeshData::default() }, material)
    }

    /// The same with any mesh.
    #[must_use]
    pub fn with_data(mut self, mesh: &MeshData, material: Material) -> Self {
        let data = self.assets.insert(postcard::to_stdvec(mesh).expect("plain data is coded"));
        self.with(Shape::Mesh { data }, material)
    }

    /// The same with a light.
    #[must_use]
    pub fn lit(mut self, light: Light) -> Self {
        self.scene.lights.push(light);
        self
    }

    /// The same in surroundings of this radiance.
    #[must_use]
    pub fn within(mut self, radiance: Rgb) -> Self {
        self.scene.background = Environment::Constant(radiance);
        self
    }

    /// The same surrounded by an image, row by row from the top; its numbers should be some that Radiance's format can hold.
    #[must_use]
    pub fn within_image(mut self, width: usize, height: usize, pixel: impl Fn(usize, usize) -> Rgb) -> Self {
        let pixels: Vec<_> = (0..width * height).map(|i| image::Rgb(pixel(i % width, i / width))).collect();
        let mut file = Vec::new();
        image::codecs::hdr::HdrEncoder::new(&mut file).encode(&pixels, width, height).expect("an image");
        let file = self.assets.insert(file);
        self.scene.background = Environment::Image { file, scale: [1.0; 3], rotation: 0.0, source: SourceId::default() };
        self
    }

    /// The frame that a camera sees.
    pub fn frame(&self, camera: Camera, film: Film, render: Render) -> Frame {
        Frame { scene: self.scene.clone(), camera, film, render, quality: Quality::of(1), seed: 1, aovs: Aovs::NONE }
    }

    /// The scene compiled for that.
    pub fn compiled(&self, camera: Camera, film: Film, render: Render) -> Scene {
        Scene::compile(&self.frame(camera, film, render), &self.assets).expect("a scene that can be compiled")
    }

    /// What a ray from `eye` towards `target` shows, measured by `1024` pixels of so many samples that all look at the same point and are independent of each other.
    pub fn seen(&self, eye: [f64; 3], target: [f64; 3], render: Render, samples: u64) -> [Estimate; 3] {
        let way = DVec3::from(target) - DVec3::from(eye);
        let up = if way.y.abs() > 0.9 * way.length() { [1.0, 0.0, 0.0] } else { [0.0, 1.0, 0.0] };
        let camera = Camera::Orthographic { eye, look_at: target, up, width: 1e-9 * way.length() };
        let film = Film { width: 32, height: 32, filter: Filter::Point };
        let pixels = seeds::picture(&self.compiled(camera, film, render), tessera_engine::part::SampleRange { first: 0, count: samples });
        [0, 1, 2].map(|channel| Estimate::of(&pixels.iter().map(|pixel| f64::from(pixel[channel])).collect::<Vec<_>>()))
    }
}

/// Irradiance that a polygon of radiance 1 gives a point of this normal, `1/2 sum(angle of edge * its plane's normal . n)`, if all of it stands on the normal's side (Lambert, "Photometria",
/// 1760). Its corners are given clockwise as seen from the point.
pub fn lamberts_polygon(point: DVec3, normal: DVec3, corners: &[DVec3]) -> f64 {
    let next = corners.iter().cycle().skip(1);
    let edges = corners.iter().zip(next).map(|(a, b)| {
        let (a, b) = ((*a - point).normalize(), (*b - point).normalize());
        let across = a.cross(b);
        let angle = FRAC_PI_2 - (a.dot(b) / across.length()).atan();
        angle * across.normalize().dot(normal)
    });
    0.5 * edges.sum::<f64>().abs()
}
