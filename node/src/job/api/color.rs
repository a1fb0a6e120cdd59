//! Colours in other codings: each function returns the linear `{r, g, b}` that every key takes.

use mlua::Value;
use tessera_engine::math;

use super::{Form, Function};
use crate::job::keys::{FINITE, Keys, Range, UNIT};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "rgb", form: Form::Positional, keys: &["r", "g", "b"], make: rgb },
    Function { path: "srgb", form: Form::Positional, keys: &["r", "g", "b"], make: srgb },
    Function { path: "hex", form: Form::Positional, keys: &["code"], make: hex },
];

const COMPONENT: Range = Range { lowest: 0.0, words: "a number from 0 up", ..FINITE };

fn rgb(keys: &Keys) -> mlua::Result<Value> {
    let component = |key| keys.required(key)?.number(COMPONENT);
    list(keys, [component("r")?, component("g")?, component("b")?])
}

fn srgb(keys: &Keys) -> mlua::Result<Value> {
    let component = |key| keys.required(key)?.number(UNIT).map(linear);
    list(keys, [component("r")?, component("g")?, component("b")?])
}

/// `#rrggbb` or `#rgb`, sRGB-coded, as on web pages.
fn hex(keys: &Keys) -> mlua::Result<Value> {
    let code = keys.required("code")?;
    let text = code.text()?;
    let digits: Vec<u32> = text.strip_prefix('#').unwrap_or(&text).chars().filter_map(|digit| digit.to_digit(16)).collect();
    let all_digits = digits.len() == text.strip_prefix('#').unwrap_or(&text).chars().count();
    let bytes = match digits.as_slice() {
        [r, g, b] if all_digits => [r * 17, g * 17, b * 17],
        [r1, r0, g1, g0, b1, b0] if all_digits => [r1 * 16 + r0, g1 * 16 + g0, b1 * 16 + b0],
        _ => return Err(code.wrong("a colour such as \"#ff8800\" or \"#f80\"").into()),
    };
    list(keys, bytes.map(|byte| linear(f64::from(byte) / 255.0)))
}

/// IEC 61966-2-1, 5.2.
fn linear(coded: f64) -> f64 {
    if coded <= 0.04045 { coded / 12.92 } else { math::pow((coded + 0.055) / 1.055, 2.4) }
}

fn list(keys: &Keys, components: [f64; 3]) -> mlua::Result<Value> {
    keys.lua.create_sequence_from(components).map(Value::Table)
}
