//! Triangle meshes that a script makes, from tables or from Luau buffers.
//!
//! Tables count vertices from 1, as Lua does; buffers hold little-endian f32 and u32 and count from 0, as files do.

use mlua::{Buffer, Table, Value};
use tessera_engine::description::{MeshData, Shape};

use super::{Form, Function, shape};
use crate::job::{
    context::Context,
    keys::{FINITE, Field, Keys},
};

pub const FUNCTIONS: &[Function] = &[Function {
    path: "mesh",
    form: Form::Table,
    keys: &["positions", "triangles", "normals", "uvs", "material", "transform", "name"],
    make: mesh,
}];

fn mesh(keys: &Keys) -> mlua::Result<Value> {
    let positions: Vec<[f32; 3]> = vectors(&keys.required("positions")?)?;
    let triangles = triangles(&keys.required("triangles")?, positions.len())?;
    let normals = attribute(keys, "normals", positions.len())?.into_iter().map(normalized).collect::<Option<_>>();
    let normals = normals.ok_or_else(|| keys.fault("`normals` must have a length: one of them is {0, 0, 0}"))?;
    let uvs = attribute(keys, "uvs", positions.len())?;
    if triangles.is_empty() {
        return Err(keys.fault("`triangles` is empty").into());
    }
    let data = MeshData { positions, triangles, normals, uvs };
    let coded = postcard::to_stdvec(&data).map_err(|error| keys.fault(error))?;
    let data = Context::of(keys.lua)?.keep(coded).map_err(|what| keys.fault(what))?;
    shape::object(keys, Shape::Mesh { data })
}

fn attribute<const N: usize>(keys: &Keys, key: &'static str, vertices: usize) -> mlua::Result<Vec<[f32; N]>> {
    let Some(field) = keys.optional(key)? else { return Ok(Vec::new()) };
    let values = vectors(&field)?;
    if values.len() == vertices {
        Ok(values)
    } else {
        Err(field.fault(format!("must be one for each of {vertices} positions, got {}", values.len())).into())
    }
}

fn normalized(normal: [f32; 3]) -> Option<[f32; 3]> {
    let [x, y, z] = normal.map(f64::from);
    let length = (x * x + y * y + z * z).sqrt();
    (length > 0.0).then(|| [x, y, z].map(|component| (component / length) as f32))
}

/// A list of `{x, y, z}`, or a buffer of f32.
fn vectors<const N: usize>(field: &Field) -> mlua::Result<Vec<[f32; N]>> {
    match &field.value {
        Value::Buffer(buffer) => {
            let vectors: Vec<[f32; N]> = words(field, buffer)?.map(|words| words.map(f32::from_le_bytes)).collect();
            match vectors.iter().position(|vector| !vector.iter().all(|component| component.is_finite())) {
                Some(at) => Err(field.fault(format!("holds a number that is not finite, in element {at} of the buffer")).into()),
                None => Ok(vectors),
            }
        }
        Value::Table(table) => rows(field, table, |row| {
            let numbers = row.numbers::<N>(FINITE)?.map(|number| number as f32);
            if numbers.iter().all(|number| number.is_finite()) { Ok(numbers) } else { Err(row.fault("is too large").into()) }
        }),
        _ => Err(field.wrong(format!("a list of {{{}}} or a buffer of f32", if N == 3 { "x, y, z" } else { "u, v" })).into()),
    }
}

fn triangles(field: &Field, vertices: usize) -> mlua::Result<Vec<[u32; 3]>> {
    let highest = u32::try_from(vertices).ok().filter(|count| *count > 0);
    let highest = highest.ok_or_else(|| field.keys.fault("`positions` must hold 1 to 2^32 - 1 vertices"))?;
    match &field.value {
        Value::Buffer(buffer) => {
            let triangles: Vec<[u32; 3]> = words(field, buffer)?.map(|words| words.map(u32::from_le_bytes)).collect();
            match triangles.iter().position(|triangle| triangle.iter().any(|vertex| *vertex >= highest)) {
                Some(at) => Err(field
                    .fault(format!("names a vertex that there is not, in triangle {at}: buffers count from 0 to {}", highest - 1))
                    .into()),
                None => Ok(triangles),
            }
        }
        Value::Table(table) => rows(field, table, |row| {
            let corners = row.list()?;
            let [a, b, c] = corners.as_slice() else { return Err(row.wrong("three vertices {a, b, c}, counted from 1").into()) };
            let corner = |field: &Field| field.integer32(1, highest).map(|vertex| vertex - 1);
            Ok([corner(a)?, corner(b)?, corner(c)?])
        }),
        _ => Err(field.wrong("a list of {a, b, c} or a buffer of u32").into()),
    }
}

fn rows<T>(field: &Field, table: &Table, read: impl Fn(&Field) -> mlua::Result<T>) -> mlua::Result<Vec<T>> {
    let row = |index: usize| read(&Field { keys: field.keys, name: format!("{}[{index}]", field.name), value: table.raw_get(index)? });
    (1..=table.raw_len()).map(row).collect()
}

/// The buffer in groups of `N` words of 4 bytes.
fn words<const N: usize>(field: &Field, buffer: &Buffer) -> mlua::Result<impl Iterator<Item = [[u8; 4]; N]>> {
    let bytes = buffer.to_vec();
    if !bytes.len().is_multiple_of(4 * N) {
        return Err(field.fault(format!("must hold a multiple of {} bytes, got {}", 4 * N, bytes.len())).into());
    }
    let word = |group: usize, at: usize| std::array::from_fn(|byte| bytes[4 * (N * group + at) + byte]);
    let groups: Vec<_> = (0..bytes.len() / (4 * N)).map(|group| std::array::from_fn(|at| word(group, at))).collect();
    Ok(groups.into_iter())
}
