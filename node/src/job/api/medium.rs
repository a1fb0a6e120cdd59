//! What fills space.

use mlua::Value;
use tessera_engine::description::Medium;

use super::{Form, Function};
use crate::job::{
    handle::Thing,
    keys::{Keys, Range},
};

pub const FUNCTIONS: &[Function] =
    &[Function { path: "medium", form: Form::Table, keys: &["absorption", "scattering", "anisotropy", "name"], make: medium }];

/// Per scene unit: what is denser is a surface.
const DENSEST: f64 = 1e12;
const ANISOTROPY: Range = Range { lowest: -1.0, highest: 1.0, open: true, words: "a number above -1 and below 1" };

fn medium(keys: &Keys) -> mlua::Result<Value> {
    let absorption = keys.or("absorption", [0.0; 3], |field| field.color(DENSEST))?;
    let scattering = keys.or("scattering", [0.0; 3], |field| field.color(DENSEST))?;
    let anisotropy = keys.or("anisotropy", 0.0, |field| field.number(ANISOTROPY))?;
    keys.make(|_| Thing::Medium(Medium { absorption, scattering, anisotropy }))
}

pub fn optional(keys: &Keys, key: &'static str) -> mlua::Result<Option<Medium>> {
    let medium = |handle: &crate::job::handle::Handle| match &handle.thing {
        Thing::Medium(medium) => Some(medium.clone()),
        _ => None,
    };
    keys.optional(key)?.map(|field| field.thing("a medium (tessera.medium)", medium)).transpose()
}
