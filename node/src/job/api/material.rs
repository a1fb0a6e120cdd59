//! Materials.

use std::sync::Arc;

use mlua::Value;
use tessera_engine::{
    description::{Fresnel, Material, Rgb, Texture, TextureId},
    material::metals,
};

use super::{Form, Function, medium};
use crate::job::{
    handle::{MaterialNode, Thing},
    keys::{Field, Keys, POSITIVE, Range, UNIT, nearest},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "diffuse", form: Form::Table, keys: &["reflectance", "roughness", "name"], make: diffuse },
    Function { path: "mirror", form: Form::Table, keys: &["reflectance", "name"], make: mirror },
    Function {
        path: "metal",
        form: Form::Table,
        keys: &["metal", "eta", "k", "reflectance", "fresnel", "roughness", "multiple_scattering", "name"],
        make: metal,
    },
    Function {
        path: "glass",
        form: Form::Table,
        keys: &["ior", "roughness", "reflectance", "transmittance", "interior", "priority", "multiple_scattering", "name"],
        make: glass,
    },
    Function { path: "plastic", form: Form::Table, keys: &["reflectance", "ior", "roughness", "name"], make: plastic },
    Function { path: "emitter", form: Form::Table, keys: &["radiance", "two_sided", "name"], make: emitter },
    Function { path: "boundary", form: Form::Table, keys: &["interior", "name"], make: boundary },
];

const WHITE: Rgb = [1.0; 3];
const EXPECTED: &str = "a material (tessera.diffuse, mirror, metal, glass, plastic, metallic_roughness, emitter or boundary)";

/// Radiance has no physical bound; this keeps sums of it finite in single precision.
pub const BRIGHTEST: f64 = 1e30;

pub const COAT: Range = Range { lowest: 1.0, highest: 10.0, open: false, words: "a number from 1 to 10" };

fn diffuse(keys: &Keys) -> mlua::Result<Value> {
    let (reflectance, texture) = keys.or("reflectance", ([0.5; 3], None), color_or_texture)?;
    let roughness = keys.or("roughness", 0.0, |field| field.number(UNIT))?;
    let material = if roughness == 0.0 {
        Material::Diffuse { reflectance, texture: only(&texture) }
    } else {
        Material::RoughDiffuse { reflectance, texture: only(&texture), roughness }
    };
    make(keys, material, texture)
}

fn mirror(keys: &Keys) -> mlua::Result<Value> {
    let reflectance = keys.or("reflectance", [0.9; 3], |field| field.color(1.0))?;
    make(keys, Material::Mirror { reflectance }, [])
}

/// By name, by its index of refraction, or by colour.
fn metal(keys: &Keys) -> mlua::Result<Value> {
    let fresnel = match (keys.optional("metal")?, keys.optional("eta")?, keys.optional("k")?, keys.optional("reflectance")?) {
        (Some(name), None, None, None) => named(&name)?,
        (None, Some(eta), Some(k), None) => {
            let index = eta.color(100.0)?;
            if index.iter().any(|component| *component <= 0.0) {
                return Err(eta.wrong("above 0 in each component").into());
            }
            Fresnel::Index { eta: index, k: k.color(100.0)? }
        }
        (None, None, None, Some(color)) => {
            let color = color.color(1.0)?;
            match keys.or("fresnel", "schlick", |field| field.choice(&[("schlick", "schlick"), ("constant", "constant")]))? {
                "constant" => Fresnel::Constant(color),
                _ => Fresnel::Schlick(color),
            }
        }
        _ => return Err(keys.fault("needs `metal` (a name), `reflectance` (a colour), or `eta` and `k`: one of these").into()),
    };
    if !matches!(fresnel, Fresnel::Schlick(_) | Fresnel::Constant(_)) && keys.optional("fresnel")?.is_some() {
        return Err(keys.fault("`fresnel` goes with `reflectance` alone").into());
    }
    let roughness = keys.or("roughness", [0.3; 2], |field| match field.value.is_table() {
        true => field.numbers::<2>(UNIT),
        false => field.number(UNIT).map(|roughness| [roughness; 2]),
    })?;
    let multiple_scattering = keys.or("multiple_scattering", true, |field| field.boolean())?;
    make(keys, Material::Metal { fresnel, roughness, multiple_scattering }, [])
}

fn named(field: &Field) -> mlua::Result<Fresnel> {
    let name = field.text()?;
    match metals::named(&name) {
        Some((eta, k)) => Ok(Fresnel::Index { eta: eta.as_vec3().into(), k: k.as_vec3().into() }),
        None => {
            let fault = field.wrong(format!("one of {}", metals::NAMES.join(", ")));
            Err(match nearest(&name, metals::NAMES.iter().copied()) {
                Some(near) => fault.with_help(format!("did you mean \"{near}\"?")),
                None => fault,
            }
            .into())
        }
    }
}

fn glass(keys: &Keys) -> mlua::Result<Value> {
    let ior = keys.or("ior", 1.5, |field| field.number(POSITIVE))?;
    let roughness = keys.or("roughness", 0.0, |field| field.number(UNIT))?;
    let reflectance = keys.or("reflectance", WHITE, |field| field.color(1.0))?;
    let transmittance = keys.or("transmittance", WHITE, |field| field.color(1.0))?;
    let interior = medium::optional(keys, "interior")?;
    let priority = keys.or("priority", 0, |field| field.integer32(0, 255))? as u8;
    let multiple_scattering = keys.or("multiple_scattering", true, |field| field.boolean())?;
    make(keys, Material::Glass { ior, reflectance, transmittance, roughness, multiple_scattering, interior, priority }, [])
}

fn plastic(keys: &Keys) -> mlua::Result<Value> {
    let (reflectance, texture) = keys.or("reflectance", ([0.5; 3], None), color_or_texture)?;
    let ior = keys.or("ior", 1.5, |field| field.number(COAT))?;
    let roughness = keys.or("roughness", 0.0, |field| field.number(UNIT))?;
    make(keys, Material::Plastic { reflectance, texture: only(&texture), ior, roughness }, texture)
}

fn emitter(keys: &Keys) -> mlua::Result<Value> {
    let (radiance, texture) = texture_or(keys.required("radiance")?, |field| field.color(BRIGHTEST))?;
    let two_sided = keys.or("two_sided", false, |field| field.boolean())?;
    make(keys, Material::Emitter { radiance, texture: only(&texture), two_sided }, texture)
}

fn boundary(keys: &Keys) -> mlua::Result<Value> {
    let Some(interior) = medium::optional(keys, "interior")? else {
        return Err(keys
            .fault("`interior` is missing")
            .with_help("a boundary surrounds a medium: interior = tessera.medium { ... }")
            .into());
    };
    make(keys, Material::Boundary { interior }, [])
}

pub fn make(keys: &Keys, material: Material, textures: impl IntoIterator<Item = Texture>) -> mlua::Result<Value> {
    let textures = textures.into_iter().collect();
    keys.make(|_| Thing::Material(Arc::new(MaterialNode { material, textures })))
}

/// The number of a material's only texture.
fn only(texture: &Option<Texture>) -> Option<TextureId> {
    texture.as_ref().map(|_| 0)
}

fn color_or_texture(field: Field) -> mlua::Result<(Rgb, Option<Texture>)> {
    texture_or(field, |field| field.color(1.0))
}

/// A colour, or white and a texture.
pub fn texture_or(field: Field, color: impl FnOnce(&Field) -> mlua::Result<Rgb>) -> mlua::Result<(Rgb, Option<Texture>)> {
    if field.value.is_userdata() {
        Ok((WHITE, Some(texture(&field, "a colour or a texture (tessera.checker, gradient, noise or image)")?)))
    } else {
        Ok((color(&field)?, None))
    }
}

/// A texture, where one was `expected`.
pub fn texture(field: &Field, expected: &str) -> mlua::Result<Texture> {
    field.thing(expected, |handle| match &handle.thing {
        Thing::Texture(texture) => Some(texture.clone()),
        _ => None,
    })
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
