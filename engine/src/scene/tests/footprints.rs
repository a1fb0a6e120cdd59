//! What pixels of the film cover of textures, and which way tangents run.

use std::{io::Cursor, sync::atomic::AtomicBool};

use super::*;
use crate::{
    description::{ColorSpace, Environment, Texture, TextureFilter, Wrap},
    part::{Rect, SampleRange, render},
    scene::Surface,
};

/// Squares of single pixels, black and white.
fn checker(side: u32) -> Vec<u8> {
    let image = image::GrayImage::from_fn(side, side, |x, y| image::Luma([if (x + y) % 2 == 0 { 255 } else { 0 }]));
    let mut bytes = Cursor::new(Vec::new());
    image.write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    bytes.into_inner()
}

/// Objects of material 0, which shows an image of that many pixels.
fn textured(objects: Vec<Object>, side: u32, filter: TextureFilter) -> (Frame, MemoryAssets) {
    let (mut frame, mut assets) = (frame(objects), MemoryAssets::default());
    let (file, wrap) = (assets.insert(checker(side)), [Wrap::Repeat; 2]);
    frame.scene.textures = vec![Texture::Image {
        file,
        color_space: ColorSpace::Linear,
        wrap,
        filter,
        scale: [1.0; 2],
        offset: [0.0; 2],
        source: SourceId::default(),
    }];
    frame.scene.materials[0] = Material::Diffuse { reflectance: [1.0; 3], texture: Some(0) };
    (frame, assets)
}

fn cameras() -> [Camera; 3] {
    let (eye, look_at, up) = ([0.4, 0.9, 3.0], [0.1, 0.2, 0.0], [0.1, 1.0, 0.0]);
    [Camera::pinhole(eye, look_at, up, 60.0), Camera::Orthographic { eye, look_at, up, width: 3.0 }, Camera::Panoramic { eye, look_at, up }]
}

fn shapes() -> Vec<Shape> {
    vec![
        Shape::Sphere { center: [0.1, 0.2, -0.1], radius: 0.9 },
        Shape::Plane { point: [0.0, -0.3, 0.0], normal: [0.0, 1.0, 0.0] },
        Shape::Plane { point: [0.0, 0.0, -1.0], normal: [0.3, 0.4, 1.0] },
        Shape::Box { min: [-0.7, -0.4, -0.5], max: [0.5, 0.6, 0.8] },
        Shape::Disc { center: [0.0, 0.1, 0.0], normal: [0.5, 0.6, 1.0], radius: 1.2 },
        Shape::Disc { center: [0.0, 0.1, 0.0], normal: [0.0, 1.0, 0.0], radius: 1.2 },
        Shape::Rectangle { corner: [-0.8, -0.6, -0.2], edge_u: [1.5, 0.2, 0.1], edge_v: [0.3, 1.3, -0.2] },
        Shape::Cylinder { from: [-0.2, -0.6, 0.1], to: [0.3, 0.9, -0.2], radius: 0.5, capped: true },
        Shape::Cone { from: [0.2, -0.5, 0.0], to: [0.0, 0.8, 0.3], radius: 0.7, to_radius: 0.2, capped: true },
        Shape::Cone { from: [0.2, -0.5, 0.0], to: [0.0, 0.8, 0.3], radius: 0.1, to_radius: 0.8, capped: true },
    ]
}

/// Every shape, as it is and in a space of its own, and a triangle.
fn objects(assets: &mut MemoryAssets) -> Vec<Object> {
    let map = [[0.9, 0.3, 0.0, 0.1], [-0.2, 1.1, 0.1, 0.0], [0.1, 0.0, 0.7, 0.2]];
    let triangle = MeshData {
        positions: vec![[-1.0, -0.8, 0.1], [1.2, -0.7, -0.3], [0.1, 1.1, 0.2]],
        triangles: vec![[0, 1, 2]],
        normals: Vec::new(),
        uvs: vec![[0.1, 0.9], [0.8, 0.7], [0.4, -0.3]],
    };
    let data = assets.insert(postcard::to_stdvec(&triangle).unwrap());
    let all: Vec<_> = shapes().into_iter().chain([Shape::Mesh { data }]).map(|of| shape(of, 0)).collect();
    let turned = all.iter().cloned().map(|object| Object { transform: Some(map), ..object });
    all.iter().cloned().chain(turned).collect()
}

/// What is seen at a place of the film, if it is not too slanted.
fn seen(scene: &Scene, x: f64, y: f64) -> Option<Surface> {
    let ray = scene.camera.ray(x, y, DVec2::ZERO);
    scene.closest(&ray).filter(|surface| surface.ng.dot(ray.direction).abs() > 0.15)
}

/// Compares footprints with differences between rays, and says how many.
fn compared(scene: &Scene, is_sphere: bool) -> usize {
    let mut compared = 0;
    for (x, y) in (0..30).flat_map(|y| (0..40).map(move |x| (f64::from(x) + 0.3, f64::from(y) + 0.6))) {
        let Some(surface) = seen(scene, x, y) else { continue };
        let step = 1e-5;
        for (side, (dx, dy)) in [(step, 0.0), (0.0, step)].into_iter().enumerate() {
            let Some(beside) = seen(scene, x + dx, y + dy).filter(|beside| beside.part == surface.part) else { continue };
            let expected = (beside.uv - surface.uv) / step;
            // Where u jumps, and near the poles, differences tell nothing.
            let at_pole = is_sphere && !(0.1..0.9).contains(&surface.uv.y);
            if at_pole || expected.length() > 1e3 {
                continue;
            }
            let found = surface.footprints[0].0[side].as_dvec2();
            assert!((found - expected).length() < 1e-4 * (1.0 + expected.length()), "{x} {y}: {found} is not {expected}");
            compared += 1;
        }
    }
    compared
}

#[test]
fn footprints_are_what_neighbouring_pixels_see() {
    let (mut frame, mut assets) = textured(Vec::new(), 2, TextureFilter::Trilinear);
    frame.film = Film { width: 40, height: 30, filter: Filter::Point };
    for object in objects(&mut assets) {
        let is_sphere = matches!(object.kind, ObjectKind::Shape { shape: Shape::Sphere { .. }, .. });
        println!("{object:?}");
        frame.scene.groups = vec![Group { objects: vec![object] }];
        let counts = cameras().map(|camera| {
            frame.camera = camera;
            compared(&Scene::compile(&frame, &assets).unwrap(), is_sphere)
        });
        // Some camera may see it edge on.
        assert!(counts.iter().sum::<usize>() > 40 && counts.iter().filter(|count| **count > 0).count() >= 2, "{counts:?}");
    }
}

/// A wide plane of fine squares seen from low above it, one sample a pixel, lit so that its albedo is seen.
fn horizon(filter: TextureFilter) -> Vec<[f32; 3]> {
    let plane = shape(Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }, 0);
    let (mut frame, assets) = textured(vec![plane], 64, filter);
    frame.camera = Camera::pinhole([0.01, 0.02, 0.013], [0.3, -0.18, 0.5], [0.0, 1.0, 0.0], 60.0);
    frame.film = Film { width: 64, height: 64, filter: Filter::Point };
    frame.render = Render::Path { max_depth: 2, roulette_depth: 5, smooth_terminator: false };
    frame.scene.background = Environment::Constant([1.0; 3]);
    let scene = Scene::compile(&frame, &assets).unwrap();
    let (rect, samples) = (Rect { x: 0, y: 0, width: 64, height: 64 }, SampleRange { first: 0, count: 1 });
    render(&scene, rect, samples, &AtomicBool::new(false)).unwrap().pixels
}

#[test]
fn far_squares_are_their_mean_with_one_sample_and_near_ones_are_sharp() {
    let (plain, filtered) = (horizon(TextureFilter::Bilinear), horizon(TextureFilter::Trilinear));
    let row = |pixels: &[[f32; 3]], y: usize| pixels[64 * y..64 * (y + 1)].iter().map(|pixel| f64::from(pixel[0])).collect::<Vec<_>>();
    let horizon = (0..64).find(|y| row(&plain, *y).iter().all(|value| *value < 1.0)).unwrap();
    assert!((5..40).contains(&horizon), "{horizon}");
    for y in horizon..horizon + 6 {
        let (far, aliased) = (row(&filtered, y), row(&plain, y));
        assert!(far.iter().all(|value| (value - 0.5).abs() < 0.01), "{y}: {far:?}");
        assert!(aliased.iter().any(|value| (value - 0.5).abs() > 0.3), "{y}: {aliased:?}");
    }
    for y in 56..64 {
        assert_eq!(row(&filtered, y), row(&plain, y), "{y}");
        assert!(row(&plain, y).iter().any(|value| (value - 0.5).abs() > 0.3));
    }
}
