//! Shapes that a formula describes.

use std::sync::Arc;

use mlua::Value;
use tessera_engine::description::Shape;

use super::{Form, Function, material, transform};
use crate::job::{
    handle::{NodeKind, ObjectNode, Thing},
    keys::{Keys, POSITIVE},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "sphere", form: Form::Table, keys: &["center", "radius", "material", "transform", "name"], make: sphere },
    Function { path: "plane", form: Form::Table, keys: &["point", "normal", "material", "transform", "name"], make: plane },
    Function { path: "box", form: Form::Table, keys: &["min", "max", "center", "size", "material", "transform", "name"], make: cuboid },
    Function { path: "disc", form: Form::Table, keys: &["center", "normal", "radius", "material", "transform", "name"], make: disc },
];

const ORIGIN: [f64; 3] = [0.0; 3];
const UP: [f64; 3] = [0.0, 1.0, 0.0];

fn sphere(keys: &Keys) -> mlua::Result<Value> {
    let center = keys.or("center", ORIGIN, |field| field.vec3())?;
    let radius = keys.or("radius", 1.0, |field| field.number(POSITIVE))?;
    object(keys, Shape::Sphere { center, radius })
}

fn plane(keys: &Keys) -> mlua::Result<Value> {
    let point = keys.or("point", ORIGIN, |field| field.vec3())?;
    let normal = keys.or("normal", UP, |field| field.direction())?;
    object(keys, Shape::Plane { point, normal })
}

fn disc(keys: &Keys) -> mlua::Result<Value> {
    let center = keys.or("center", ORIGIN, |field| field.vec3())?;
    let normal = keys.or("normal", UP, |field| field.direction())?;
    let radius = keys.or("radius", 1.0, |field| field.number(POSITIVE))?;
    object(keys, Shape::Disc { center, normal, radius })
}

/// By two corners, or by its middle and edges.
fn cuboid(keys: &Keys) -> mlua::Result<Value> {
    let (min, max) = match (keys.optional("min")?, keys.optional("max")?, keys.optional("center")?, keys.optional("size")?) {
        (Some(min), Some(max), None, None) => (min.vec3()?, max.vec3()?),
        (None, None, center, Some(size)) => {
            let center = center.map_or(Ok(ORIGIN), |field| field.vec3())?;
            let size = size.numbers::<3>(POSITIVE)?;
            let corner = |sign: f64| std::array::from_fn(|axis| center[axis] + sign * 0.5 * size[axis]);
            (corner(-1.0), corner(1.0))
        }
        _ => return Err(keys.fault("needs `min` and `max`, or `size` and perhaps `center`").into()),
    };
    if (0..3).all(|axis| min[axis] < max[axis]) {
        object(keys, Shape::Box { min, max })
    } else {
        Err(keys.fault("`max` must be above `min` in every component").with_help("for a flat thing use a disc or a mesh").into())
    }
}

/// A handle of an object with this shape and the keys `material` and `transform`.
pub fn object(keys: &Keys, shape: Shape) -> mlua::Result<Value> {
    let material = material::required(keys, "material")?;
    let transform = transform::optional(keys, "transform")?;
    keys.make(|source| Thing::Object(Arc::new(ObjectNode { kind: NodeKind::Shape { shape, material }, transform, source })))
}
