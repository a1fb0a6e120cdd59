//! Clear coats that do not face where their base does.

use std::{io::Cursor, sync::atomic::AtomicBool};

use super::*;
use crate::{
    description::{Bumps, ColorSpace, MetallicRoughness, Texture, TextureFilter, Wrap},
    part::{Rect, SampleRange, render},
};

/// One pixel that tells a direction.
fn map(direction: DVec3, assets: &mut MemoryAssets) -> Texture {
    let code = |x: f64| ((0.5 + 0.5 * x) * 65535.0).round() as u16;
    let image: image::ImageBuffer<image::Rgb<u16>, _> = image::ImageBuffer::from_pixel(1, 1, image::Rgb(direction.to_array().map(code)));
    let mut bytes = Cursor::new(Vec::new());
    image::DynamicImage::from(image).write_to(&mut bytes, image::ImageFormat::Png).unwrap();
    let (file, filter) = (assets.insert(bytes.into_inner()), TextureFilter::Bilinear);
    Texture::Image {
        file,
        color_space: ColorSpace::Linear,
        wrap: [Wrap::Repeat; 2],
        filter,
        scale: [1.0; 2],
        offset: [0.0; 2],
        source: SourceId::default(),
    }
}

/// What a smooth coat on black shows of a lamp of radiance 1 in some direction, seen straight from `side`; the coat and its base have bumps that face these ways.
fn seen(coat: Option<DVec3>, base: Option<DVec3>, lamp: DVec3, side: f64) -> f64 {
    let mut assets = MemoryAssets::default();
    let rectangle = Shape::Rectangle { corner: [-1.0, -1.0, 0.0], edge_u: [2.0, 0.0, 0.0], edge_v: [0.0, 2.0, 0.0] };
    let disc = Shape::Disc { center: (lamp * 20.0).to_array(), normal: (-lamp).to_array(), radius: 0.5 };
    let mut frame = frame(vec![shape(rectangle, 0), shape(disc, 1)]);
    let textures = &mut frame.scene.textures;
    let mut bumps = |direction: Option<DVec3>| {
        let texture = map(direction?, &mut assets);
        textures.push(texture);
        Some(Bumps { texture: textures.len() as u32 - 1, scale: 1.0 })
    };
    let usual = MetallicRoughness { base_color: [0.0; 3], metallic: 0.0, specular: 0.0, clearcoat: 1.0, ..MetallicRoughness::default() };
    let model = MetallicRoughness { normal: bumps(base), clearcoat_normal: bumps(coat), ..usual };
    let lit = Material::Emitter { radiance: [1.0; 3], texture: None, two_sided: false };
    frame.scene.materials = vec![Material::MetallicRoughness(Box::new(model)), lit];
    frame.camera = Camera::pinhole([0.1, 0.2, side * 3.0], [0.1, 0.2, 0.0], [0.0, 1.0, 0.0], 1e-4);
    frame.film = Film { width: 1, height: 1, filter: Filter::Point };
    frame.render = Render::Path { max_depth: 3, roulette_depth: 9, smooth_terminator: false };
    let scene = Scene::compile(&frame, &assets).unwrap();
    let (rect, samples) = (Rect { x: 0, y: 0, width: 1, height: 1 }, SampleRange { first: 0, count: 64 });
    render(&scene, rect, samples, &AtomicBool::new(false)).unwrap().pixels[0][0].into()
}

#[test]
fn a_coat_mirrors_by_its_own_bumps() {
    let tilted = DVec3::new(0.28, -0.12, 0.0);
    let tilted = tilted.with_z((1.0 - tilted.length_squared()).sqrt());
    let other = DVec3::new(-0.3, 0.4, 0.75f64.sqrt());
    for side in [1.0, -1.0] {
        let straight = DVec3::Z * side;
        // Straight from above, the mirror direction is 2 (n.z) n - z. Behind, the normal is the other one.
        let mirrored = |n: DVec3| (n * (2.0 * n.z) - DVec3::Z) * side;
        // Schlick's approximation, of an index of 1.5.
        let reflected = |cos: f64| 0.04 + 0.96 * (1.0 - cos).powi(5);
        let cases = [
            ("bumps of its own", Some(tilted), None, mirrored(tilted), reflected(tilted.z)),
            ("bumps of its own over others", Some(tilted), Some(other), mirrored(tilted), reflected(tilted.z)),
            ("those of the base do not count", Some(tilted), Some(other), mirrored(other), 0.0),
            ("nor without its own", None, Some(other), straight, reflected(1.0)),
            ("nor there", None, Some(other), mirrored(other), 0.0),
            ("none at all", None, None, straight, reflected(1.0)),
        ];
        for (what, coat, base, lamp, expected) in cases {
            let lamp = if lamp == straight { (straight + DVec3::new(0.0, 0.02, 0.0)).normalize() } else { lamp };
            let found = seen(coat, base, lamp, side);
            assert!((found - expected).abs() < 1e-4, "{what} from {side}: {found} is not {expected}");
        }
    }
}
