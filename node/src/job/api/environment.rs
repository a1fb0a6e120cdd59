//! What surrounds the scene.

use mlua::Value;
use tessera_engine::description::Environment;

use super::{Form, Function, material::BRIGHTEST, model::asset};
use crate::job::{
    handle::{Handle, Thing},
    keys::{FINITE, Field, Keys, Range},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "environment", form: Form::Table, keys: &["file", "scale", "rotation", "name"], make: environment },
    Function { path: "sky", form: Form::Table, keys: &["sun", "turbidity", "ground", "scale", "disc", "name"], make: sky },
];

const TURBIDITY: Range = Range { lowest: 1.0, highest: 20.0, open: false, words: "a number from 1 to 20" };
const SCALE: Range = Range { lowest: 0.0, highest: BRIGHTEST, open: false, words: "a number from 0 up" };

fn environment(keys: &Keys) -> mlua::Result<Value> {
    let file = keys.required("file")?;
    let name = file.text()?;
    let ending = name.rsplit_once('.').map_or(String::new(), |(_, ending)| ending.to_ascii_lowercase());
    if !matches!(ending.as_str(), "hdr" | "png" | "jpg" | "jpeg") {
        return Err(file.wrong("an image file (.hdr, .png or .jpg)").into());
    }
    let scale = keys.or("scale", [1.0; 3], |field| field.color(BRIGHTEST))?;
    let rotation = keys.or("rotation", 0.0, |field| field.number(FINITE))?;
    let (_, id) = asset(&file, &name)?;
    keys.make(|source| Thing::Environment(Environment::Image { file: id, scale, rotation, source }))
}

fn sky(keys: &Keys) -> mlua::Result<Value> {
    let sun = keys.or("sun", [0.4, 0.6, 0.5], |field| field.direction())?;
    let turbidity = keys.or("turbidity", 3.0, |field| field.number(TURBIDITY))?;
    let ground = keys.or("ground", [0.2; 3], |field| field.color(1.0))?;
    let scale = keys.or("scale", 1.0, |field| field.number(SCALE))?;
    let disc = keys.or("disc", true, |field| field.boolean())?;
    keys.make(|source| Thing::Environment(Environment::Sky { sun, turbidity, ground, scale, disc, source }))
}

/// A colour, or one of these.
pub fn read(field: &Field) -> mlua::Result<Environment> {
    if !field.value.is_userdata() {
        return field.color(BRIGHTEST).map(Environment::Constant);
    }
    field.thing("a colour or an environment (tessera.environment or tessera.sky)", |handle: &Handle| match &handle.thing {
        Thing::Environment(environment) => Some(environment.clone()),
        _ => None,
    })
}
