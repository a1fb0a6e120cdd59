//! A small frame that every node renders before it is given work: equal hashes show that it computes the same bits as the others, and builds the same
//! trees: where rays hit several things at equal distances, what they see may depend on the tree.

use std::{io, sync::atomic::AtomicBool};

use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};

use super::{Rect, RenderedPart, SampleRange, render};
use crate::{
    accel::{Content, Identity, LeafRule, Tree, Triangles},
    description::{
        Aovs, AssetId, Camera, ColorSpace, Environment, Falloff, Film, Filter, Frame, Fresnel, Group, Light, Material, Matrix, Medium,
        MemoryAssets, MeshData, Object, ObjectKind, Quality, Render, Scene, Shape, SourceId, Texture, TextureFilter, Wrap,
    },
    scene,
};

/// Why the canary cannot be rendered: a fault of the engine.
#[derive(Debug, thiserror::Error)]
#[error("the canary frame cannot be rendered: {0}")]
pub struct CanaryError(String);

/// The hash of the canary, for samples of this seed: BLAKE3 over those of its pixels, of its trees, and of a tree that takes all ways through the builder.
///
/// # Errors
/// Only if the engine is at fault.
pub fn canary_hash(seed: u64) -> Result<[u8; 32], CanaryError> {
    let (frame, assets) = canary(seed)?;
    let compile = |frame: &Frame| scene::Scene::compile(frame, &assets).map_err(fault);
    // Side by side: a farm's first part waits for both.
    let (plain, lit) = rayon::join(|| proof(&compile(&frame)?), || pixels(&compile(&in_all_light(frame.clone()))?));
    let mut hasher = blake3::Hasher::new();
    plain?.iter().chain([&lit?]).for_each(|hash| _ = hasher.update(hash));
    Ok(*hasher.finalize().as_bytes())
}

/// What a node shows that has this canary: its pixels, its tree, and a tree that takes all ways through the builder.
fn proof(scene: &scene::Scene) -> Result<[[u8; 32]; 3], CanaryError> {
    Ok([pixels(scene)?, scene.tree_hash(), hash(&thicket())])
}

/// The hash of all pixels of a scene.
fn pixels(scene: &scene::Scene) -> Result<[u8; 32], CanaryError> {
    let rect = Rect { x: 0, y: 0, width: scene.film.width, height: scene.film.height };
    let samples = SampleRange { first: 0, count: scene.quality.samples.into() };
    render(scene, rect, samples, &AtomicBool::new(false)).map(|part: RenderedPart| part.hash()).map_err(fault)
}

fn fault(error: impl ToString) -> CanaryError {
    CanaryError(error.to_string())
}

/// The frame: every shape, material, texture and light, and instances, made in code.
///
/// # Errors
/// Only if the engine is at fault.
pub fn canary(seed: u64) -> Result<(Frame, MemoryAssets), CanaryError> {
    let mut assets = MemoryAssets::default();
    let mesh = assets.insert(postcard::to_stdvec(&bumps()).map_err(fault)?);
    let image = assets.insert(stripes().map_err(fault)?);
    let mut scene = Scene { background: Environment::Constant([0.3, 0.5, 0.8]), lights: lights(), ..Scene::default() };
    scene.textures = vec![
        Texture::Checker { even: [0.9, 0.85, 0.8], odd: [0.1, 0.15, 0.2], size: 0.7 },
        Texture::Image {
            file: image,
            color_space: ColorSpace::Srgb,
            wrap: [Wrap::Repeat, Wrap::Mirror],
            filter: TextureFilter::Bilinear,
            scale: [1.0; 2],
            offset: [0.0; 2],
            source: SourceId::default(),
        },
    ];
    scene.materials = vec![
        Material::Diffuse { reflectance: [0.9; 3], texture: Some(0) },
        Material::Diffuse { reflectance: [0.8, 0.9, 1.0], texture: Some(1) },
        Material::Mirror { reflectance: [0.9, 0.8, 0.7] },
        Material::smooth_glass(1.45, [0.95, 1.0, 0.95]),
    ];
    let cluster = Group {
        objects: vec![
            shape(Shape::Sphere { center: [0.0, 0.5, 0.0], radius: 0.5 }, 2, None),
            shape(Shape::Sphere { center: [0.9, 0.4, 0.3], radius: 0.4 }, 3, None),
            shape(Shape::Box { min: [-1.0, 0.0, -0.4], max: [-0.6, 0.9, 0.2] }, 1, Some(turned(0.6, 0.8, [0.1, 0.0, 0.2]))),
            shape(Shape::Disc { center: [0.2, 1.3, -0.2], normal: [0.2, 1.0, 0.4], radius: 0.45 }, 2, None),
            shape(Shape::Rectangle { corner: [-1.7, 0.1, -0.9], edge_u: [0.6, 0.0, 0.3], edge_v: [0.0, 1.1, -0.1] }, 1, None),
            shape(Shape::Cylinder { from: [0.6, 0.0, 1.1], to: [1.3, 0.3, 1.3], radius: 0.2, capped: false }, 1, None),
            shape(
                Shape::Cone { from: [-0.4, 0.0, 0.9], to: [-0.3, 0.8, 0.8], radius: 0.35, to_radius: 0.0, capped: true },
                3,
                Some([[1.0, 0.2, 0.0, 0.0], [0.0, 0.9, 0.0, 0.0], [0.0, 0.0, 0.7, 0.3]]),
            ),
        ],
    };
    let world = Group {
        objects: vec![
            shape(Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }, 0, None),
            shape(Shape::Mesh { data: mesh }, 1, Some(turned(0.8, 0.6, [-0.2, 0.0, -2.2]))),
            shape(
                Shape::Sphere { center: [0.0; 3], radius: 1.0 },
                1,
                Some([[0.5, 0.1, 0.0, 1.8], [0.0, 0.4, 0.0, 0.5], [0.0, 0.2, 0.6, 1.0]]),
            ),
            instance(None),
            instance(Some(turned(0.28, 0.96, [-2.1, 0.1, 0.4]))),
        ],
    };
    scene.groups = vec![cluster, world];
    scene.root = 1;
    let frame = Frame {
        scene,
        camera: Camera::pinhole([0.4, 1.9, 5.2], [-0.2, 0.6, 0.0], [0.0, 1.0, 0.0], 48.0),
        film: Film { width: 64, height: 48, filter: Filter::Box },
        render: Render::Whitted { max_depth: 6, transparent_shadows: true, min_weight: 0.0 },
        quality: Quality::of(2),
        seed,
        aovs: Aovs::NONE,
    };
    Ok((frame, assets))
}

/// The canary's frame by path tracing: the same things of other materials, in fog, among surfaces and surroundings that shine, seen through a lens.
pub(super) fn in_all_light(mut frame: Frame) -> Frame {
    let fog = |density: f32| Medium { absorption: [density, 0.0, 0.5 * density], scattering: [0.5 * density; 3], anisotropy: 0.4 };
    let scene = &mut frame.scene;
    let image = match &scene.textures[1] {
        Texture::Image { file, .. } => *file,
        _ => AssetId([0; 32]),
    };
    scene.materials = vec![
        Material::RoughDiffuse { reflectance: [0.9; 3], texture: Some(0), roughness: 0.5 },
        Material::Plastic { reflectance: [0.8, 0.9, 1.0], texture: Some(1), ior: 1.5, roughness: 0.3 },
        Material::Metal {
            fresnel: Fresnel::Index { eta: [0.18, 0.42, 1.37], k: [3.42, 2.35, 1.77] },
            roughness: [0.5, 0.3],
            multiple_scattering: true,
        },
        Material::Glass {
            ior: 1.45,
            reflectance: [1.0; 3],
            transmittance: [0.95, 1.0, 0.95],
            roughness: 0.3,
            multiple_scattering: true,
            interior: Some(fog(0.5)),
            priority: 1,
        },
        Material::Emitter { radiance: [9.0, 8.0, 5.0], texture: None, two_sided: false },
        Material::Emitter { radiance: [2.0; 3], texture: Some(1), two_sided: true },
        Material::Boundary { interior: fog(0.8) },
        Material::smooth_glass(1.33, [1.0; 3]),
    ];
    scene.groups[1].objects.extend([
        shape(Shape::Sphere { center: [-1.2, 2.2, 1.0], radius: 0.3 }, 4, None),
        shape(Shape::Disc { center: [1.9, 2.1, 0.2], normal: [-1.0, -1.0, 0.2], radius: 0.4 }, 5, None),
        shape(Shape::Box { min: [0.9, 0.0, 1.3], max: [1.5, 0.7, 1.9] }, 6, None),
        shape(Shape::Sphere { center: [0.2, 0.4, 2.0], radius: 0.35 }, 7, None),
    ]);
    scene.background = Environment::Image { file: image, scale: [0.4; 3], rotation: 30.0, source: SourceId::default() };
    scene.medium = Some(fog(0.01));
    frame.camera = Camera::Perspective {
        eye: [0.4, 1.9, 5.2],
        look_at: [-0.2, 0.6, 0.0],
        up: [0.0, 1.0, 0.0],
        horizontal_fov: 48.0,
        lens_radius: 0.05,
        focus_distance: 5.0,
    };
    frame.film = Film { width: 48, height: 36, filter: Filter::Mitchell };
    frame.render = Render::Path { max_depth: 8, roulette_depth: 3, smooth_terminator: false };
    frame.quality = Quality::of(4);
    frame
}

fn shape(shape: Shape, material: u32, transform: Option<Matrix>) -> Object {
    Object { kind: ObjectKind::Shape { shape, material }, transform, source: SourceId::default() }
}

fn instance(transform: Option<Matrix>) -> Object {
    Object { kind: ObjectKind::Instance { group: 0 }, transform, source: SourceId::default() }
}

/// A turn about y, given by cosine and sine, and a shift.
fn turned(cos: f64, sin: f64, [x, y, z]: [f64; 3]) -> Matrix {
    [[cos, 0.0, sin, x], [0.0, 1.0, 0.0, y], [-sin, 0.0, cos, z]]
}

fn lights() -> Vec<Light> {
    let source = SourceId::default();
    vec![
        Light::Point { position: [-3.0, 5.0, 4.0], intensity: [60.0, 55.0, 50.0], falloff: Falloff::InverseSquare, source },
        Light::Point { position: [4.0, 3.0, 2.0], intensity: [0.2, 0.2, 0.3], falloff: Falloff::None, source },
        Light::Directional { direction: [0.3, -1.0, -0.2], irradiance: [0.8, 0.8, 0.7], angle: 0.0, source },
    ]
}

/// The tree of a mesh as builders fear them: long thin triangles, which are split, nested ones, which hardly cluster, and equal ones.
fn thicket() -> Tree {
    let thorn = |i: u32| {
        let [x, y, z] = [i * 7 % 16, i * 11 % 13, i * 5 % 9].map(|x| x as f32 * 0.1);
        [[x, y, z], [x + 0.01, y, z], [z, x + 1.0, y + 1.0]]
    };
    let shell = |i: u32| [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]].map(|p| p.map(|x| x * (0.1 + i as f32 * 0.001)));
    let equal = [[0.5, 0.25, 0.0], [0.5, 0.0, 0.25], [0.0, 0.5, 0.25]];
    let corners: Vec<[f32; 3]> = (0..300).flat_map(|i| [if i % 4 == 0 { thorn(i) } else { equal }, shell(i), equal]).flatten().collect();
    let triangles = (0..corners.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
    let thicket = Triangles::new(corners, triangles);
    Content::of(&thicket).grow(thicket.bounds(), LeafRule::MEASURED)
}

fn hash(tree: &Tree) -> [u8; 32] {
    let mut identity = Identity::new();
    tree.identify(&mut identity);
    identity.finish()
}

/// A wavy patch of 12 x 12 squares with smooth normals and texture coordinates.
fn bumps() -> MeshData {
    const SIDE: u32 = 12;
    let vertices = (0..=SIDE).flat_map(|row| (0..=SIDE).map(move |column| (column as f32 / SIDE as f32, row as f32 / SIDE as f32)));
    let mut mesh = MeshData::default();
    for (u, v) in vertices {
        // A saddle: x^2 - z^2 over [-1, 1]^2.
        let (x, z) = (2.0 * u - 1.0, 2.0 * v - 1.0);
        mesh.positions.push([1.8 * x, 1.1 + 0.6 * (x * x - z * z), z]);
        let slope = glam::Vec3::new(-1.2 * x / 1.8, 1.0, 1.2 * z).normalize();
        mesh.normals.push(slope.into());
        mesh.uvs.push([3.0 * u, 3.0 * v]);
    }
    for row in 0..SIDE {
        for column in 0..SIDE {
            let corner = row * (SIDE + 1) + column;
            let (below, right) = (corner + SIDE + 1, corner + 1);
            mesh.triangles.extend([[corner, below, right], [right, below, below + 1]]);
        }
    }
    mesh
}

/// A PNG of 8 x 8 pixels in stripes.
fn stripes() -> Result<Vec<u8>, io::Error> {
    let pixels: Vec<u8> = (0..64_u8).flat_map(|i| [40 + 3 * i, if i % 8 < 4 { 220 } else { 60 }, 255 - 3 * i]).collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png).write_image(&pixels, 8, 8, ExtendedColorType::Rgb8).map_err(io::Error::other)?;
    Ok(png)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::accel::LeafRule;

    fn hex(hash: [u8; 32]) -> String {
        hash.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    fn compiled(seed: u64) -> scene::Scene {
        let (frame, assets) = canary(seed).unwrap();
        scene::Scene::compile(&frame, &assets).unwrap()
    }

    fn lit(seed: u64) -> scene::Scene {
        let (frame, assets) = canary(seed).unwrap();
        scene::Scene::compile(&in_all_light(frame), &assets).unwrap()
    }

    /// The first node of a farm sets what the others must agree with, so this hash may change, but only together with [`crate::REVISION`] or with what the frame shows.
    #[test]
    fn the_hash_is_that_of_this_revision() {
        let pixels = hex(pixels(&compiled(1)).unwrap());
        assert_eq!((crate::REVISION, pixels.as_str()), (8, "bb53a9fc2c50cb86b0ffece72f6a8519d49e916ded3b5fbff15b7cb2044dc7ad"));
    }

    /// The same of paths.
    #[test]
    fn the_hash_of_paths_is_that_of_this_revision() {
        let pixels = hex(pixels(&lit(1)).unwrap());
        assert_eq!((crate::REVISION, pixels.as_str()), (8, "f8aa369e7a6a71f1cbeeb56d3425ecc6fc365e5bb14b056cdf19c04ed1fa204f"));
    }

    /// Every kind of surface, light and medium is met, and nothing in it is no number.
    #[test]
    fn paths_of_the_canary_are_sound() {
        let scene = lit(1);
        let rect = Rect { x: 0, y: 0, width: scene.film.width, height: scene.film.height };
        let part = render(&scene, rect, SampleRange { first: 0, count: 64 }, &AtomicBool::new(false)).unwrap();
        assert_eq!(part.counters.invalid_samples, 0);
        assert!(scene.media && scene.light_sampler.has_local() && scene.light_sampler.has_distant());
    }

    /// Other trees are another build to a farm, though no picture tells: these hashes may change at any time, but not unnoticed, and not by machine.
    #[test]
    fn trees_are_those_of_this_build() {
        assert!(thicket().is_split());
        assert_eq!(hex(compiled(1).tree_hash()), "ae88be7bad47e20d19ad4f894691335b77064ea4f2964eafc181970b04f11fc6");
        assert_eq!(hex(hash(&thicket())), "70665445a0ef59d169e024ad6ca95b5ff82afa2bf4e4b502e4795dbeb43327c5");
    }

    /// Leaves of fewer triangles: the same pixels, but not the same node.
    #[test]
    fn another_tree_is_another_hash_of_the_same_pixels() {
        let (usual, other) = (compiled(1), compiled(1).with_leaves(LeafRule { most: 2, cost: 1.0 }));
        assert_eq!(pixels(&usual).unwrap(), pixels(&other).unwrap());
        assert_ne!(usual.tree_hash(), other.tree_hash());
        assert_eq!(usual.tree_hash(), compiled(2).tree_hash());
        assert_ne!(proof(&usual).unwrap(), proof(&other).unwrap());
    }

    #[test]
    fn another_seed_is_another_hash() {
        assert_ne!(canary_hash(1).unwrap(), canary_hash(2).unwrap());
    }

    /// Each of them is seen: without any one of them it is another picture.
    #[test]
    fn every_object_of_the_canary_counts() {
        let (frame, assets) = canary(1).unwrap();
        let hash = |frame: &Frame| {
            let scene = scene::Scene::compile(frame, &assets).unwrap();
            let rect = Rect { x: 0, y: 0, width: frame.film.width, height: frame.film.height };
            render(&scene, rect, SampleRange { first: 0, count: 1 }, &AtomicBool::new(false)).unwrap().hash()
        };
        let whole = hash(&frame);
        for (group, objects) in frame.scene.groups.iter().map(|group| group.objects.len()).enumerate() {
            for object in 0..objects {
                let mut without = frame.clone();
                let gone = without.scene.groups[group].objects.remove(object);
                assert_ne!(hash(&without), whole, "{gone:?}");
            }
        }
    }

    /// A canary that shows only sky would prove nothing: everything in it is met by rays.
    #[test]
    fn the_canary_does_all_kinds_of_work() {
        let (frame, assets) = canary(1).unwrap();
        let scene = scene::Scene::compile(&frame, &assets).unwrap();
        let rect = Rect { x: 0, y: 0, width: frame.film.width, height: frame.film.height };
        let met: std::collections::BTreeSet<u32> = (0..rect.area())
            .filter_map(|i| {
                let ray = scene.camera.ray((i % 64) as f64 + 0.5, (i / 64) as f64 + 0.5, glam::DVec2::ZERO);
                scene.closest(&ray).map(|surface| surface.material)
            })
            .collect();
        assert_eq!(met.into_iter().collect::<Vec<_>>(), [0, 1, 2, 3]);
        let part = render(&scene, rect, SampleRange { first: 0, count: 2 }, &AtomicBool::new(false)).unwrap();
        assert_eq!(part.counters.invalid_samples, 0);
        assert!(part.counters.secondary_rays > 1000 && part.counters.shadow_rays > 5000, "{:?}", part.counters);
    }
}
