//! Integrators.

use mlua::Value;
use tessera_engine::description::Render;

use super::{Form, Function};
use crate::job::{
    handle::Thing,
    keys::{Keys, UNIT},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "raycast", form: Form::Table, keys: &[], make: raycast },
    Function { path: "whitted", form: Form::Table, keys: &["max_depth", "transparent_shadows", "min_weight"], make: whitted },
    Function { path: "path", form: Form::Table, keys: &["max_depth", "roulette_depth", "smooth_terminator"], make: path },
];

/// Deepest ray tree: deeper ones change no pixel, and rays are followed on the stack.
const DEEPEST: u32 = 64;

/// Longest path: nothing grows with it but time.
const LONGEST: u32 = 1_000_000;

/// What a job without `render` gets.
pub const DEFAULT: Render = Render::Whitted { max_depth: 8, transparent_shadows: false, min_weight: 0.0 };

fn raycast(keys: &Keys) -> mlua::Result<Value> {
    keys.make(|_| Thing::Render(Render::Raycast))
}

fn whitted(keys: &Keys) -> mlua::Result<Value> {
    let max_depth = keys.or("max_depth", 8, |field| field.integer32(1, DEEPEST))?;
    let transparent_shadows = keys.or("transparent_shadows", false, |field| field.boolean())?;
    let min_weight = keys.or("min_weight", 0.0, |field| field.number(UNIT))?;
    keys.make(|_| Thing::Render(Render::Whitted { max_depth, transparent_shadows, min_weight }))
}

fn path(keys: &Keys) -> mlua::Result<Value> {
    let max_depth = keys.or("max_depth", 16, |field| field.integer32(1, LONGEST))?;
    let roulette_depth = keys.or("roulette_depth", 3, |field| field.integer32(1, LONGEST))?;
    let smooth_terminator = keys.or("smooth_terminator", false, |field| field.boolean())?;
    keys.make(|_| Thing::Render(Render::Path { max_depth, roulette_depth, smooth_terminator }))
}
