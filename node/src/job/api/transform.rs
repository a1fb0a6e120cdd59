//! Transforms: affine maps from an object's coordinates to those around it. `a * b` applies b first, as matrices do.

use glam::{DAffine3, DMat3, DVec3};
use mlua::{Lua, Value};
use tessera_engine::{description::Matrix, math};

use super::{Form, Function};
use crate::job::{
    handle::{Handle, Thing},
    keys::{FINITE, Keys, describe},
    place::Place,
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "translate", form: Form::Positional, keys: &["x", "y", "z"], make: translate },
    Function { path: "rotate", form: Form::Positional, keys: &["axis", "degrees"], make: rotate },
    Function { path: "scale", form: Form::Positional, keys: &["x", "y", "z"], make: scale },
    Function { path: "look_at", form: Form::Positional, keys: &["eye", "target", "up"], make: look_at },
    Function { path: "matrix", form: Form::Positional, keys: &["rows"], make: matrix },
];

const EXPECTED: &str = "a transform (tessera.translate, rotate, scale, look_at or matrix)";

fn translate(keys: &Keys) -> mlua::Result<Value> {
    make(keys, DAffine3::from_translation(three(keys)?))
}

/// One number scales alike in all directions.
fn scale(keys: &Keys) -> mlua::Result<Value> {
    let x = keys.required("x")?;
    let alike = x.value.is_number() || x.value.is_integer();
    let factors = if alike && keys.optional("y")?.is_none() { DVec3::splat(x.number(FINITE)?) } else { three(keys)? };
    if factors.min_element() == 0.0 || factors.x * factors.y * factors.z == 0.0 {
        return Err(keys.fault("a factor of 0 makes things flat").with_help("for a flat thing use a rectangle, a disc or a mesh").into());
    }
    make(keys, DAffine3::from_scale(factors))
}

/// `(x, y, z)` or `({x, y, z})`.
fn three(keys: &Keys) -> mlua::Result<DVec3> {
    let x = keys.required("x")?;
    if x.value.is_table() || x.value.is_vector() {
        return x.vec3().map(DVec3::from);
    }
    let number = |key| keys.required(key)?.number(FINITE);
    Ok(DVec3::new(number("x")?, number("y")?, number("z")?))
}

fn rotate(keys: &Keys) -> mlua::Result<Value> {
    let axis = DVec3::from(keys.required("axis")?.direction()?).normalize();
    let (sin, cos) = sin_cos_degrees(keys.required("degrees")?.number(FINITE)?);
    make(keys, DAffine3::from_mat3(rotation(axis, sin, cos)))
}

/// Rodrigues' formula, R = cos I + sin [k]x + (1 - cos) k k^T (pbrt, 4th ed., 3.9.4).
fn rotation(k: DVec3, sin: f64, cos: f64) -> DMat3 {
    let column = |e: DVec3| e * cos + k.cross(e) * sin + k * (k.dot(e) * (1.0 - cos));
    DMat3::from_cols(column(DVec3::X), column(DVec3::Y), column(DVec3::Z))
}

/// Exact for quarter turns.
fn sin_cos_degrees(degrees: f64) -> (f64, f64) {
    let turn = degrees.rem_euclid(360.0);
    match turn {
        0.0 => (0.0, 1.0),
        90.0 => (1.0, 0.0),
        180.0 => (0.0, -1.0),
        270.0 => (-1.0, 0.0),
        _ => math::sin_cos(turn.to_radians()),
    }
}

/// Moves the origin to `eye` and turns -z towards `target`, y as far up as can be: as a camera or lamp of glTF stands.
fn look_at(keys: &Keys) -> mlua::Result<Value> {
    let eye = DVec3::from(keys.required("eye")?.vec3()?);
    let target = DVec3::from(keys.required("target")?.vec3()?);
    let up = DVec3::from(keys.or("up", [0.0, 1.0, 0.0], |field| field.direction())?).normalize();
    if eye == target {
        return Err(keys.fault("`target` must differ from `eye`").into());
    }
    let back = (eye - target).normalize();
    let right = up.cross(back);
    if right.length() < 1e-9 {
        return Err(keys.fault("`up` must not be parallel to the view").into());
    }
    let right = right.normalize();
    make(keys, DAffine3 { matrix3: DMat3::from_cols(right, back.cross(right), back), translation: eye })
}

/// Three rows of four numbers.
fn matrix(keys: &Keys) -> mlua::Result<Value> {
    let field = keys.required("rows")?;
    let rows = match &field.value {
        Value::Table(table) if table.raw_len() == 3 => table.sequence_values::<Value>().collect::<mlua::Result<Vec<_>>>()?,
        _ => return Err(field.wrong("three rows of four numbers").into()),
    };
    let mut matrix: Matrix = [[0.0; 4]; 3];
    for (index, row) in rows.into_iter().enumerate() {
        matrix[index] = crate::job::keys::Field { keys, name: format!("rows[{}]", index + 1), value: row }.numbers::<4>(FINITE)?;
    }
    let map = from_rows(&matrix);
    let determinant = map.matrix3.determinant();
    if determinant == 0.0 || !determinant.is_finite() {
        return Err(keys.fault("the matrix cannot be inverted").with_help("rows are {xx, xy, xz, tx}: the last column moves").into());
    }
    make(keys, map)
}

fn make(keys: &Keys, transform: DAffine3) -> mlua::Result<Value> {
    keys.make(|_| Thing::Transform(transform))
}

/// The product of two handles.
pub fn compose(lua: &Lua, left: &Value, right: &Value) -> mlua::Result<Value> {
    let transform = |value: &Value| value.as_userdata().and_then(|data| of_handle(&*data.borrow::<Handle>().ok()?));
    match (transform(left), transform(right)) {
        (Some(left), Some(right)) => {
            Keys::of_list(lua, "transform", &[], mlua::MultiValue::new())?.make(|_| Thing::Transform(left * right))
        }
        _ => {
            let what = format!("`*` composes two transforms, got {} and {}", describe(lua, left), describe(lua, right));
            Err(Place::of_running(lua).fault(what).into())
        }
    }
}

fn of_handle(handle: &Handle) -> Option<DAffine3> {
    match &handle.thing {
        Thing::Transform(transform) => Some(*transform),
        _ => None,
    }
}

/// The transform of a key, if it is given.
pub fn optional(keys: &Keys, key: &'static str) -> mlua::Result<Option<Matrix>> {
    keys.optional(key)?.map(|field| field.thing(EXPECTED, of_handle).map(|transform| rows(&transform))).transpose()
}

fn rows(map: &DAffine3) -> Matrix {
    std::array::from_fn(|row| {
        let r = map.matrix3.row(row);
        [r.x, r.y, r.z, map.translation[row]]
    })
}

fn from_rows(rows: &Matrix) -> DAffine3 {
    let column = |at: usize| DVec3::new(rows[0][at], rows[1][at], rows[2][at]);
    DAffine3 { matrix3: DMat3::from_cols(column(0), column(1), column(2)), translation: column(3) }
}
