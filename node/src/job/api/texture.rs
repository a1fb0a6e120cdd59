//! Textures.

use mlua::Value;
use tessera_engine::description::{ColorSpace, Texture, TextureFilter, Wrap};

use super::{Form, Function, material::BRIGHTEST, model::asset};
use crate::job::{
    handle::Thing,
    keys::{FINITE, Field, Keys, POSITIVE, Range},
};

const COORDINATE: Range = Range { lowest: -1e6, highest: 1e6, open: false, words: "a number from -1e6 to 1e6" };

pub const FUNCTIONS: &[Function] = &[
    Function { path: "checker", form: Form::Table, keys: &["even", "odd", "size", "name"], make: checker },
    Function { path: "gradient", form: Form::Table, keys: &["from", "to", "start", "end", "name"], make: gradient },
    Function { path: "noise", form: Form::Table, keys: &["low", "high", "size", "octaves", "seed", "name"], make: noise },
    Function { path: "image", form: Form::Table, keys: &["file", "color_space", "wrap", "filter", "scale", "offset", "name"], make: image },
];

fn checker(keys: &Keys) -> mlua::Result<Value> {
    let even = keys.or("even", [0.8; 3], |field| field.color(1.0))?;
    let odd = keys.or("odd", [0.2; 3], |field| field.color(1.0))?;
    let size = keys.or("size", 1.0, |field| field.number(POSITIVE))?;
    keys.make(|_| Thing::Texture(Texture::Checker { even, odd, size }))
}

fn gradient(keys: &Keys) -> mlua::Result<Value> {
    let from = keys.or("from", [0.0; 3], |field| field.color(BRIGHTEST))?;
    let to = keys.or("to", [1.0; 3], |field| field.color(BRIGHTEST))?;
    let start = keys.or("start", [0.0, 1.0], |field| field.numbers::<2>(FINITE))?;
    let end = keys.or("end", [0.0, 0.0], |field| field.numbers::<2>(FINITE))?;
    if start == end {
        return Err(keys.fault("`start` and `end` must be different places").into());
    }
    keys.make(|_| Thing::Texture(Texture::Gradient { from, to, start, end }))
}

fn noise(keys: &Keys) -> mlua::Result<Value> {
    let low = keys.or("low", [0.0; 3], |field| field.color(BRIGHTEST))?;
    let high = keys.or("high", [1.0; 3], |field| field.color(BRIGHTEST))?;
    let size = keys.or("size", 1.0, |field| field.number(POSITIVE))?;
    let octaves = keys.or("octaves", 4, |field| field.integer32(1, 16))?;
    let seed = keys.or("seed", 0, |field| field.integer(0, 1 << 53))?;
    keys.make(|_| Thing::Texture(Texture::Noise { low, high, size, octaves, seed }))
}

fn image(keys: &Keys) -> mlua::Result<Value> {
    let file = keys.required("file")?;
    let name = file.text()?;
    let ending = name.rsplit_once('.').map_or(String::new(), |(_, ending)| ending.to_ascii_lowercase());
    if !matches!(ending.as_str(), "png" | "jpg" | "jpeg" | "hdr") {
        return Err(file.wrong("an image file (.png, .jpg or .hdr)").into());
    }
    // Radiance files hold linear numbers; the others are coded for displays.
    let usual = if ending == "hdr" { ColorSpace::Linear } else { ColorSpace::Srgb };
    let color_space = keys.or("color_space", usual, |field| field.choice(&[("srgb", ColorSpace::Srgb), ("linear", ColorSpace::Linear)]))?;
    let wrap = keys.or("wrap", [Wrap::Repeat; 2], wrap)?;
    let filters = [("bilinear", TextureFilter::Bilinear), ("trilinear", TextureFilter::Trilinear)];
    let filter = keys.or("filter", TextureFilter::Bilinear, |field| field.choice(&filters))?;
    let scale = keys.or("scale", [1.0; 2], |field| {
        if field.value.is_table() { field.numbers(COORDINATE) } else { field.number(COORDINATE).map(|scale| [scale; 2]) }
    })?;
    let offset = keys.or("offset", [0.0; 2], |field| field.numbers(COORDINATE))?;
    let (_, id) = asset(&file, &name)?;
    keys.make(|source| Thing::Texture(Texture::Image { file: id, color_space, wrap, filter, scale, offset, source }))
}

/// One word for both directions, or a list of two.
fn wrap(field: Field) -> mlua::Result<[Wrap; 2]> {
    let word = |field: &Field| field.choice(&[("repeat", Wrap::Repeat), ("mirror", Wrap::Mirror), ("clamp", Wrap::Clamp)]);
    if !field.value.is_table() {
        return word(&field).map(|wrap| [wrap; 2]);
    }
    match field.list()?.as_slice() {
        [u, v] => Ok([word(u)?, word(v)?]),
        _ => Err(field.wrong("a word or a list of two words, for u and v").into()),
    }
}
