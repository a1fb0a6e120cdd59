//! Shapes that a formula describes.

use std::sync::Arc;

use mlua::Value;
use tessera_engine::{description::Shape, shape::Rectangle};

use super::{Form, Function, material, transform};
use crate::job::{
    handle::{NodeKind, ObjectNode, Thing},
    keys::{Keys, POSITIVE, Range},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "sphere", form: Form::Table, keys: &["center", "radius", "material", "transform", "name"], make: sphere },
    Function { path: "plane", form: Form::Table, keys: &["point", "normal", "material", "transform", "name"], make: plane },
    Function { path: "box", form: Form::Table, keys: &["min", "max", "center", "size", "material", "transform", "name"], make: cuboid },
    Function { path: "disc", form: Form::Table, keys: &["center", "normal", "radius", "material", "transform", "name"], make: disc },
    Function {
        path: "rectangle",
        form: Form::Table,
        keys: &["corner", "center", "edge_u", "edge_v", "material", "transform", "name"],
        make: rectangle,
    },
    Function {
        path: "cylinder",
        form: Form::Table,
        keys: &["from", "to", "radius", "capped", "material", "transform", "name"],
        make: cylinder,
    },
    Function {
        path: "cone",
        form: Form::Table,
        keys: &["from", "to", "radius", "to_radius", "capped", "material", "transform", "name"],
        make: cone,
    },
];

const ORIGIN: [f64; 3] = [0.0; 3];
const UP: [f64; 3] = [0.0, 1.0, 0.0];
/// 0 is an apex.
const RADIUS: Range = Range { open: false, words: "a number from 0 up", ..POSITIVE };

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

/// By two edges, from a corner or about its middle.
fn rectangle(keys: &Keys) -> mlua::Result<Value> {
    let (edge_u, edge_v) = (keys.required("edge_u")?.direction()?, keys.required("edge_v")?.direction()?);
    let corner = match (keys.optional("corner")?, keys.optional("center")?) {
        (Some(corner), None) => corner.vec3()?,
        (None, center) => {
            let center = center.map_or(Ok(ORIGIN), |field| field.vec3())?;
            std::array::from_fn(|axis| center[axis] - 0.5 * (edge_u[axis] + edge_v[axis]))
        }
        (Some(_), Some(_)) => return Err(keys.fault("takes `corner` or `center`, not both").into()),
    };
    if Rectangle::new(corner.into(), edge_u.into(), edge_v.into()).is_none() {
        return Err(keys.fault("`edge_u` and `edge_v` must not be parallel").into());
    }
    object(keys, Shape::Rectangle { corner, edge_u, edge_v })
}

fn cylinder(keys: &Keys) -> mlua::Result<Value> {
    let [from, to] = ends(keys)?;
    let radius = keys.or("radius", 1.0, |field| field.number(POSITIVE))?;
    let capped = keys.or("capped", true, |field| field.boolean())?;
    object(keys, Shape::Cylinder { from, to, radius, capped })
}

fn cone(keys: &Keys) -> mlua::Result<Value> {
    let [from, to] = ends(keys)?;
    let radius = keys.or("radius", 1.0, |field| field.number(RADIUS))?;
    let to_radius = keys.or("to_radius", 0.0, |field| field.number(RADIUS))?;
    let capped = keys.or("capped", true, |field| field.boolean())?;
    if radius + to_radius == 0.0 {
        return Err(keys.fault("`radius` or `to_radius` must be above 0").into());
    }
    object(keys, Shape::Cone { from, to, radius, to_radius, capped })
}

/// Of the axis of something round.
fn ends(keys: &Keys) -> mlua::Result<[[f64; 3]; 2]> {
    let (from, to) = (keys.or("from", ORIGIN, |field| field.vec3())?, keys.or("to", UP, |field| field.vec3())?);
    if from == to { Err(keys.fault("`from` and `to` must be different points").into()) } else { Ok([from, to]) }
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
        Err(keys
            .fault("`max` must be above `min` in every component")
            .with_help("for a flat thing use a rectangle, a disc or a mesh")
            .into())
    }
}

/// A handle of an object with this shape and the keys `material` and `transform`.
pub fn object(keys: &Keys, shape: Shape) -> mlua::Result<Value> {
    let material = material::required(keys, "material")?;
    let transform = transform::optional(keys, "transform")?;
    keys.make(|source| Thing::Object(Arc::new(ObjectNode { kind: NodeKind::Shape { shape, material }, transform, source })))
}
