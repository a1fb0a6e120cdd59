//! The job itself: what the script returns.

use std::sync::Arc;

use mlua::Value;
use tessera_engine::description::{Aov, Aovs, Film, Filter, Quality};

use super::{
    Form, Function,
    frames::{self, numbered, of_frame},
    plan, render,
};
use crate::{
    job::{
        Frames, Output, PixelType,
        context::Context,
        handle::{JobNode, Policy, Thing},
        keys::{Field, Keys, Range},
    },
    limits,
    schedule::{Assign, Probe, Split},
};

pub const FUNCTIONS: &[Function] = &[Function {
    path: "job",
    form: Form::Table,
    keys: &[
        "scene", "camera", "film", "render", "quality", "probe", "split", "assign", "output", "seed", "audit", "frames", "attempts",
        "patience",
    ],
    make: job,
}];

/// Keys of the tables within a job: annotations and reference are held to them.
#[cfg(test)]
pub const TABLES: &[(&str, &[&str])] = &[("film", FILM), ("quality", QUALITY), ("output", OUTPUT), ("frames", frames::FRAMES)];

const FILM: &[&str] = &["width", "height", "filter"];
const QUALITY: &[&str] = &["samples", "first"];
const OUTPUT: &[&str] = &["exr", "png", "pixel_type", "exposure", "aovs"];

const FILTERS: &[(&str, Filter)] = &[
    ("box", Filter::Box),
    ("point", Filter::Point),
    ("gaussian", Filter::Gaussian),
    ("blackman_harris", Filter::BlackmanHarris),
    ("mitchell", Filter::Mitchell),
];

const EDGE: u32 = 65_536;
const EXPOSURE: Range = Range { lowest: -100.0, highest: 100.0, open: false, words: "stops from -100 to 100" };
const PATIENCE: Range = Range { lowest: 0.0, highest: limits::LONGEST_PATIENCE, open: false, words: "seconds, up to a year of them" };
const SHARE: Range = Range { lowest: 0.0, highest: 1.0, open: false, words: "a share from 0 to 1" };

fn job(keys: &Keys) -> mlua::Result<Value> {
    let frames = frames::frames(keys)?;
    let scene = of_frame(keys.required("scene")?, frames.as_ref())?.thing("a scene (tessera.scene)", |handle| match &handle.thing {
        Thing::Scene(scene) => Some(Arc::clone(scene)),
        _ => None,
    })?;
    let camera = keys.or("camera", None, |field| {
        of_frame(field, frames.as_ref())?.thing("a camera (tessera.perspective, orthographic or panoramic)", |handle| match &handle.thing {
            Thing::Camera(camera) => Some(Some(camera.clone())),
            _ => None,
        })
    })?;
    let film = film(&keys.required("film")?)?;
    let render = keys.or("render", render::DEFAULT, |field| {
        field.thing("an integrator (tessera.raycast, whitted or path)", |handle| match &handle.thing {
            Thing::Render(render) => Some(render.clone()),
            _ => None,
        })
    })?;
    let quality = keys.or("quality", Quality::of(4), quality)?;
    let probe = keys.or("probe", Probe::Shared { scale: plan::DEFAULT_SCALE }, |field| probe(&field, &film))?;
    let split = keys.or("split", Policy::BuiltIn(plan::DEFAULT_SPLIT), |field| split(&field, &film))?;
    let assign = keys.or("assign", Policy::BuiltIn(Assign::EarliestFinish), |field| assign(&field))?;
    let (output, aovs) = output(keys, frames.as_ref())?;
    let seed = keys.or("seed", 0, |field| field.integer(0, 1 << 53))?;
    let audit = keys.or("audit", 0.0, |field| field.number(SHARE))?;
    let attempts = keys.or("attempts", limits::ATTEMPTS_PER_PART, |field| field.integer32(1, limits::MOST_ATTEMPTS_PER_PART))?;
    let patience = keys.or("patience", None, |field| field.number(PATIENCE).map(Some))?;
    let job = JobNode { scene, camera, film, render, quality, probe, split, assign, output, aovs, seed, audit, attempts, patience, frames };
    keys.make(|_| Thing::Job(Arc::new(job)))
}

fn film(field: &Field) -> mlua::Result<Film> {
    let keys = field.table(FILM)?;
    Ok(Film {
        width: keys.required("width")?.integer32(1, EDGE)?,
        height: keys.required("height")?.integer32(1, EDGE)?,
        filter: keys.or("filter", Filter::Box, |field| field.choice(FILTERS))?,
    })
}

fn quality(field: Field) -> mlua::Result<Quality> {
    let keys = field.table(QUALITY)?;
    Ok(Quality {
        samples: keys.required("samples")?.integer32(1, limits::SAMPLES_PER_PIXEL)?,
        first: keys.or("first", 0, |field| field.integer(0, limits::FIRST_SAMPLE))?,
    })
}

fn probe(field: &Field, film: &Film) -> mlua::Result<Probe> {
    let probe = field.thing("a probe (tessera.probe.shared, every_node or from)", |handle| match &handle.thing {
        Thing::Probe(probe) => Some(probe.clone()),
        _ => None,
    })?;
    if let Probe::Known { costs, .. } = &probe {
        let fits = |edge: u32, cells: u32| cells == 0 || edge.div_ceil(costs.cell.max(1)) == cells;
        if !fits(film.width, costs.columns) || !fits(film.height, costs.rows) {
            let fault = field.fault(format!("is of a frame of another size than {} x {}", film.width, film.height));
            return Err(fault.with_help("take the manifest of a job with the same film").into());
        }
    }
    Ok(probe)
}

fn split(field: &Field, film: &Film) -> mlua::Result<Policy<Split>> {
    if let Some(function) = field.function() {
        return Ok(Policy::Script(function.clone()));
    }
    let split = field.thing("a split (tessera.split.grid, tessera.split.strips) or a function", |handle| match &handle.thing {
        Thing::Split(split) => Some(split.clone()),
        _ => None,
    })?;
    let parts = match split {
        Split::Grid { width, height } => u64::from(film.width.div_ceil(width)) * u64::from(film.height.div_ceil(height)),
        Split::Strips { count } if count > film.height => {
            return Err(field.fault(format!("makes {count} strips of {} rows", film.height)).into());
        }
        Split::Strips { count } => count.into(),
        Split::Script => 1,
    };
    if parts > limits::PARTS_PER_JOB as u64 {
        return Err(field
            .fault(format!("makes {parts} parts; {} are the most", limits::PARTS_PER_JOB))
            .with_help("make larger parts")
            .into());
    }
    Ok(Policy::BuiltIn(split))
}

fn assign(field: &Field) -> mlua::Result<Policy<Assign>> {
    if let Some(function) = field.function() {
        return Ok(Policy::Script(function.clone()));
    }
    field
        .thing("an assignment (tessera.assign.naive, paper or earliest_finish) or a function", |handle| match &handle.thing {
            Thing::Assign(assign) => Some(*assign),
            _ => None,
        })
        .map(Policy::BuiltIn)
}

/// Plain file names: the client puts them into the folder that the user chose; and what the picture tells beside colours.
fn output(job: &Keys, frames: Option<&(u32, Frames)>) -> mlua::Result<(Output, Aovs)> {
    let name = Context::of(job.lua)?.name.clone();
    let manifest = numbered(&format!("{name}.manifest.json"), ".manifest.json", frames);
    let defaults =
        Output { exr: format!("{name}.exr"), png: Some(format!("{name}.png")), manifest, pixel_type: PixelType::Float, exposure: 0.0 };
    let Some(field) = job.optional("output")? else { return Ok((defaults.numbered(frames), Aovs::NONE)) };
    let keys = field.table(OUTPUT)?;
    let exr = keys.or("exr", defaults.exr, |field| file_name(&field, ".exr"))?;
    let png = keys.or("png", defaults.png, |field| match field.value {
        Value::Boolean(false) => Ok(None),
        _ => file_name(&field, ".png").map(Some),
    })?;
    let types = [("float", PixelType::Float), ("half", PixelType::Half)];
    let pixel_type = keys.or("pixel_type", PixelType::Float, |field| field.choice(&types))?;
    let exposure = keys.or("exposure", 0.0, |field| field.number(EXPOSURE))?;
    let words = Aov::ALL.map(|aov| (aov.name(), aov));
    let aovs: Aovs = keys.or("aovs", Aovs::NONE, |field| Ok(field.choices(&words)?.into_iter().collect()))?;
    if aovs.contains(Aov::Residual) && pixel_type == PixelType::Half {
        let fault =
            keys.fault("`pixel_type` \"half\" and the AOV \"residual\" do not go together: the residual is what floats of 32 bits lack");
        return Err(fault.with_help("leave `pixel_type` out").into());
    }
    Ok((Output { exr, png, manifest: defaults.manifest, pixel_type, exposure }.numbered(frames), aovs))
}

fn file_name(field: &Field, ending: &str) -> mlua::Result<String> {
    let name = field.text()?;
    let plain = !name.contains(['/', '\\', '\0']) && !name.starts_with('.') && name.len() <= 200 && !name.chars().any(char::is_control);
    if plain && name.ends_with(ending) && name.len() > ending.len() {
        Ok(name)
    } else {
        let fault = field.wrong(format!("a plain file name that ends in {ending}"));
        Err(fault.with_help("choose the folder with -o on the command line").into())
    }
}
