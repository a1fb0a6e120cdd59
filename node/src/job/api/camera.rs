//! Cameras.

use glam::DVec3;
use mlua::Value;
use tessera_engine::description::Camera;

use super::{Form, Function};
use crate::job::{
    handle::Thing,
    keys::{Keys, Range},
};

pub const FUNCTIONS: &[Function] =
    &[Function { path: "perspective", form: Form::Table, keys: &["eye", "look_at", "up", "fov", "name"], make: perspective }];

const FOV: Range = Range { lowest: 0.0, highest: 180.0, open: true, words: "degrees above 0 and below 180" };

fn perspective(keys: &Keys) -> mlua::Result<Value> {
    let eye = keys.required("eye")?.vec3()?;
    let look_at = keys.or("look_at", [0.0; 3], |field| field.vec3())?;
    let up = keys.or("up", [0.0, 1.0, 0.0], |field| field.direction())?;
    let horizontal_fov = keys.or("fov", 40.0, |field| field.number(FOV))?;
    let view = DVec3::from(look_at) - DVec3::from(eye);
    if view == DVec3::ZERO {
        return Err(keys.fault("`look_at` must differ from `eye`").into());
    }
    if view.normalize().cross(DVec3::from(up).normalize()).length() < 1e-9 {
        return Err(keys
            .fault("`up` must not be parallel to the view")
            .with_help("to look straight down or up, give another `up`, such as {0, 0, -1}")
            .into());
    }
    keys.make(|_| Thing::Camera(Camera::Perspective { eye, look_at, up, horizontal_fov }))
}
