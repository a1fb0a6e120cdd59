//! Materials.

use std::sync::Arc;

use mlua::Value;
use tessera_engine::description::{Material, Rgb, Texture};

use super::{Form, Function};
use crate::job::{
    handle::{MaterialNode, Thing},
    keys::{Field, Keys, POSITIVE},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "diffuse", form: Form::Table, keys: &["reflectance", "name"], make: diffuse },
    Function { path: "mirror", form: Form::Table, keys: &["reflectance", "name"], make: mirror },
    Function { path: "glass", form: Form::Table, keys: &["ior", "reflectance", "transmittance", "name"], make: glass },
];

const WHITE: Rgb = [1.0; 3];
const EXPECTED: &str = "a material (tessera.diffuse, tessera.mirror or tessera.glass)";

fn diffuse(keys: &Keys) -> mlua::Result<Value> {
    let (reflectance, texture) = keys.or("reflectance", ([0.5; 3], None), color_or_texture)?;
    make(keys, Material::Diffuse { reflectance, texture: None }, texture)
}

fn mirror(keys: &Keys) -> mlua::Result<Value> {
    let reflectance = keys.or("reflectance", [0.9; 3], |field| field.color(1.0))?;
    make(keys, Material::Mirror { reflectance }, None)
}

fn glass(keys: &Keys) -> mlua::Result<Value> {
    let ior = keys.or("ior", 1.5, |field| field.number(POSITIVE))?;
    let reflectance = keys.or("reflectance", WHITE, |field| field.color(1.0))?;
    let transmittance = keys.or("transmittance", WHITE, |field| field.color(1.0))?;
    make(keys, Material::Glass { ior, reflectance, transmittance }, None)
}

fn make(keys: &Keys, material: Material, texture: Option<Texture>) -> mlua::Result<Value> {
    keys.make(|_| Thing::Material(Arc::new(MaterialNode { material, texture })))
}

fn color_or_texture(field: Field) -> mlua::Result<(Rgb, Option<Texture>)> {
    if field.value.is_userdata() {
        let texture = field.thing("a colour or a texture (tessera.checker or tessera.image)", |handle| match &handle.thing {
            Thing::Texture(texture) => Some(texture.clone()),
            _ => None,
        })?;
        Ok((WHITE, Some(texture)))
    } else {
        Ok((field.color(1.0)?, None))
    }
}

fn read(field: &Field) -> mlua::Result<Arc<MaterialNode>> {
    field.thing(EXPECTED, |handle| match &handle.thing {
        Thing::Material(material) => Some(Arc::clone(material)),
        _ => None,
    })
}

pub fn required(keys: &Keys, key: &'static str) -> mlua::Result<Arc<MaterialNode>> {
    read(&keys.required(key)?)
}

pub fn optional(keys: &Keys, key: &'static str) -> mlua::Result<Option<Arc<MaterialNode>>> {
    keys.optional(key)?.map(|field| read(&field)).transpose()
}
