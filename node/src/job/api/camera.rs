//! Cameras.

use glam::DVec3;
use mlua::Value;
use tessera_engine::description::Camera;

use super::{Form, Function};
use crate::job::{
    handle::Thing,
    keys::{Keys, POSITIVE, Range},
};

pub const FUNCTIONS: &[Function] = &[
    Function {
        path: "perspective",
        form: Form::Table,
        keys: &["eye", "look_at", "up", "fov", "lens_radius", "focus_distance", "name"],
        make: perspective,
    },
    Function { path: "orthographic", form: Form::Table, keys: &["eye", "look_at", "up", "width", "name"], make: orthographic },
    Function { path: "panoramic", form: Form::Table, keys: &["eye", "look_at", "up", "name"], make: panoramic },
];

const FOV: Range = Range { lowest: 0.0, highest: 180.0, open: true, words: "degrees above 0 and below 180" };

const LENS: Range = Range { lowest: 0.0, highest: f64::MAX, open: false, words: "a number from 0 up" };

fn perspective(keys: &Keys) -> mlua::Result<Value> {
    let View { eye, look_at, up, distance } = view(keys)?;
    let horizontal_fov = keys.or("fov", 40.0, |field| field.number(FOV))?;
    let lens_radius = keys.or("lens_radius", 0.0, |field| field.number(LENS))?;
    let focus_distance = keys.or("focus_distance", distance, |field| field.number(POSITIVE))?;
    keys.make(|_| Thing::Camera(Camera::Perspective { eye, look_at, up, horizontal_fov, lens_radius, focus_distance }))
}

fn orthographic(keys: &Keys) -> mlua::Result<Value> {
    let View { eye, look_at, up, .. } = view(keys)?;
    let width = keys.required("width")?.number(POSITIVE)?;
    keys.make(|_| Thing::Camera(Camera::Orthographic { eye, look_at, up, width }))
}

fn panoramic(keys: &Keys) -> mlua::Result<Value> {
    let View { eye, look_at, up, .. } = view(keys)?;
    keys.make(|_| Thing::Camera(Camera::Panoramic { eye, look_at, up }))
}

/// Where a camera stands and looks.
struct View {
    eye: [f64; 3],
    look_at: [f64; 3],
    up: [f64; 3],
    /// Between `eye` and `look_at`.
    distance: f64,
}

fn view(keys: &Keys) -> mlua::Result<View> {
    let eye = keys.required("eye")?.vec3()?;
    let look_at = keys.or("look_at", [0.0; 3], |field| field.vec3())?;
    let up = keys.or("up", [0.0, 1.0, 0.0], |field| field.direction())?;
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
    Ok(View { eye, look_at, up, distance: view.length() })
}
