//! Brushed metal: its marks lie along u of every shape.

use std::{f64::consts::PI, sync::atomic::AtomicBool};

use super::*;
use crate::{
    description::{Falloff, Fresnel, Light},
    part::{Rect, SampleRange, render},
};

const ROUGHNESS: [f64; 2] = [0.3, 0.7];
const LIGHT: DVec3 = DVec3::new(1.3, 2.9, 4.1);
const EYE: DVec3 = DVec3::new(-1.1, 2.2, 4.6);

/// A metal that reflects all light once, lit by a point of intensity 1, along the ray from the eye to a place of it.
fn seen(object: Object, place: DVec3, assets: &MemoryAssets) -> f64 {
    let fresnel = Fresnel::Constant([1.0; 3]);
    let mut frame = frame(vec![object]);
    frame.scene.materials = vec![Material::Metal { fresnel, roughness: ROUGHNESS, multiple_scattering: false }];
    let (position, falloff) = (LIGHT.to_array(), Falloff::InverseSquare);
    frame.scene.lights = vec![Light::Point { position, intensity: [1.0; 3], falloff, source: SourceId::default() }];
    frame.camera = Camera::pinhole(EYE.to_array(), place.to_array(), [0.0, 1.0, 0.1], 1e-4);
    frame.film = Film { width: 1, height: 1, filter: Filter::Point };
    frame.render = Render::Path { max_depth: 2, roulette_depth: 5, smooth_terminator: false };
    let scene = Scene::compile(&frame, assets).unwrap();
    let (rect, samples) = (Rect { x: 0, y: 0, width: 1, height: 1 }, SampleRange { first: 0, count: 1 });
    render(&scene, rect, samples, &AtomicBool::new(false)).unwrap().pixels[0][0].into()
}

/// The same by formulas, of a surface of this normal whose marks lie along a tangent (Heitz, "Understanding the Masking-Shadowing Function in Microfacet-Based BRDFs", 2014,
/// equations 85, 86 and 99).
fn told(place: DVec3, normal: DVec3, tangent: DVec3) -> f64 {
    let (x, y) = (tangent.normalize(), normal.cross(tangent).normalize());
    let local = |v: DVec3| DVec3::new(v.dot(x), v.dot(y), v.dot(normal));
    let (to_light, to_eye) = (LIGHT - place, EYE - place);
    let (i, o) = (local(to_light.normalize()), local(to_eye.normalize()));
    assert!(i.z > 0.1 && o.z > 0.1, "the place is hardly seen or lit");
    let alpha = ROUGHNESS.map(|roughness| roughness * roughness);
    let h = (i + o).normalize();
    let spread = (h.x / alpha[0]).powi(2) + (h.y / alpha[1]).powi(2) + h.z * h.z;
    let density = 1.0 / (PI * alpha[0] * alpha[1] * spread * spread);
    let lambda = |w: DVec3| 0.5 * ((1.0 + ((w.x * alpha[0]).powi(2) + (w.y * alpha[1]).powi(2)) / (w.z * w.z)).sqrt() - 1.0);
    density / (1.0 + lambda(i) + lambda(o)) / (4.0 * o.z) / to_light.length_squared()
}

#[test]
fn marks_lie_along_u_of_every_shape() {
    let mut assets = MemoryAssets::default();
    let mesh = MeshData {
        positions: vec![[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 1.0, 0.0]],
        triangles: vec![[0, 1, 2]],
        normals: Vec::new(),
        // u grows along (3, 4), v across it.
        uvs: [[-1.0, -1.0], [1.0, -1.0], [0.0, 1.0f32]].map(|[x, y]| [0.6 * x + 0.8 * y, 0.8 * x - 0.6 * y]).to_vec(),
    };
    let mesh = Shape::Mesh { data: assets.insert(postcard::to_stdvec(&mesh).unwrap()) };
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let n = DVec3::new(0.48, 0.6, 0.64);
    let axis = DVec3::new(0.6, 0.8, 0.0);
    // Off the axis of the cylinder and the cone, towards the eye; the cone grows by half a unit over one.
    let (beside, slope) = (DVec3::new(-0.48, 0.36, 0.8), 0.5);
    let of_cone = (beside - axis * slope).normalize();
    let box_ = Shape::Box { min: [-1.0; 3], max: [1.0; 3] };
    let cases = [
        (Shape::Sphere { center: [0.0; 3], radius: 2.0 }, n * 2.0, n, y.cross(n)),
        (Shape::Disc { center: [0.0; 3], normal: [0.0, 0.0, 1.0], radius: 2.0 }, DVec3::new(0.3, 0.4, 0.0), z, x),
        (Shape::Disc { center: [0.0; 3], normal: n.to_array(), radius: 2.0 }, DVec3::ZERO, n, y.cross(n)),
        (Shape::Disc { center: [0.0; 3], normal: [0.0, 1.0, 0.0], radius: 2.0 }, DVec3::new(0.3, 0.0, 0.4), y, x),
        (Shape::Plane { point: [0.0; 3], normal: [0.0, 1.0, 0.0] }, DVec3::new(0.7, 0.0, 0.2), y, x),
        (Shape::Rectangle { corner: [-1.0; 3], edge_u: [3.0, 3.0, 0.0], edge_v: [-3.0, 3.0, 0.0] }, DVec3::new(-1.0, 1.0, -1.0), z, x + y),
        (box_.clone(), DVec3::new(0.2, 0.3, 1.0), z, x),
        (box_, DVec3::new(0.2, 1.0, 0.3), y, x),
        (
            Shape::Cylinder { from: [0.0; 3], to: axis.to_array(), radius: 2.0, capped: true },
            beside * 2.0 + axis * 0.3,
            beside,
            axis.cross(beside),
        ),
        (Shape::Cylinder { from: [0.0; 3], to: (-z).to_array(), radius: 2.0, capped: true }, DVec3::new(0.3, 0.4, 0.0), z, y.cross(z)),
        (
            Shape::Cone { from: [0.0; 3], to: (axis * 2.0).to_array(), radius: 1.0, to_radius: 2.0, capped: true },
            axis + beside * 1.5,
            of_cone,
            axis.cross(beside),
        ),
        (mesh, DVec3::new(0.1, 0.2, 0.0), z, DVec3::new(0.6, 0.8, 0.0)),
    ];
    // A quarter of a turn about the z axis, and a third of one about the diagonal.
    let turns = [DMat3::IDENTITY, DMat3::from_cols(y, -x, z), DMat3::from_cols(y, z, x)];
    for (of, place, normal, tangent) in cases {
        let mut compared = 0;
        for turn in turns {
            let (place, normal, tangent) = (turn * place, turn * normal, turn * tangent);
            if normal.dot((LIGHT - place).normalize()) < 0.15 || normal.dot((EYE - place).normalize()) < 0.15 {
                continue;
            }
            let object = Object { transform: Some(matrix(DAffine3::from_mat3(turn))), ..shape(of.clone(), 0) };
            let (found, expected) = (seen(object, place, &assets), told(place, normal, tangent));
            let across = told(place, normal, normal.cross(tangent));
            assert!((found / expected - 1.0).abs() < 1e-5, "{of:?}: {found} is not {expected}; across it would be {across}");
            compared += usize::from((across / expected - 1.0).abs() > 0.02);
        }
        assert!(compared > 0, "{of:?}: nothing was compared");
    }
}
