//! Probes and built-in policies: how costs are learned, how the frame is split, and who gets which part.

use std::collections::BTreeMap;

use mlua::Value;

use super::{Form, Function};
use crate::{
    job::{
        context::{Context, Files},
        handle::Thing,
        keys::{Field, Keys, Range},
    },
    manifest::{self, Manifest},
    schedule::{Assign, CostMap, Probe, Split},
};

pub const FUNCTIONS: &[Function] = &[
    Function { path: "probe.every_node", form: Form::Table, keys: &["scale"], make: every_node },
    Function { path: "probe.shared", form: Form::Table, keys: &["scale"], make: shared },
    Function { path: "probe.from", form: Form::Positional, keys: &["manifest"], make: from_manifest },
    Function { path: "split.grid", form: Form::Table, keys: &["size", "width", "height"], make: grid },
    Function { path: "split.strips", form: Form::Table, keys: &["count"], make: strips },
    Function { path: "assign.naive", form: Form::Value, keys: &[], make: |keys| assign(keys, Assign::Naive) },
    Function { path: "assign.paper", form: Form::Value, keys: &[], make: |keys| assign(keys, Assign::Paper) },
    Function { path: "assign.earliest_finish", form: Form::Value, keys: &[], make: |keys| assign(keys, Assign::EarliestFinish) },
];

/// What a job gets that says nothing of these.
pub const DEFAULT_SCALE: f64 = 1.0 / 16.0;
pub const DEFAULT_SPLIT: Split = Split::Grid { width: 64, height: 64 };

const SCALE: Range = Range { lowest: 1.0 / 1024.0, highest: 1.0, open: false, words: "a number from 1/1024 to 1" };
const EDGE: u32 = 65_536;

fn scale(keys: &Keys) -> mlua::Result<f64> {
    keys.or("scale", DEFAULT_SCALE, |field| field.number(SCALE))
}

fn every_node(keys: &Keys) -> mlua::Result<Value> {
    let scale = scale(keys)?;
    keys.make(|_| Thing::Probe(Probe::EveryNode { scale }))
}

fn shared(keys: &Keys) -> mlua::Result<Value> {
    let scale = scale(keys)?;
    keys.make(|_| Thing::Probe(Probe::Shared { scale }))
}

/// What an earlier job's manifest says of costs and powers.
fn from_manifest(keys: &Keys) -> mlua::Result<Value> {
    let field = keys.required("manifest")?;
    let name = field.text()?;
    let inert = matches!(Context::of(keys.lua)?.files, Files::Inert);
    let known = if inert { Probe::Known { costs: CostMap::default(), powers: BTreeMap::new() } } else { known(&field, &name)? };
    keys.make(|_| Thing::Probe(known))
}

fn known(field: &Field, name: &str) -> mlua::Result<Probe> {
    let keys = field.keys;
    let (_, bytes) = Context::of(keys.lua)?.read(&keys.place.file, name).map_err(|what| {
        keys.fault(what).with_help("render the job once with another probe; its manifest is NAME.manifest.json in the output folder")
    })?;
    let Manifest { probe, nodes, .. } =
        manifest::parse(name, &String::from_utf8_lossy(&bytes)).map_err(|error| keys.fault(error.message))?;
    let costs = CostMap { cell: probe.cell, columns: probe.columns, rows: probe.rows, seconds_per_pixel: probe.seconds_per_pixel };
    if !costs.is_sound() {
        return Err(keys.fault(format!("{name} tells no costs")).into());
    }
    let powers = nodes.into_iter().filter(|node| node.power > 0.0 && node.power.is_finite()).map(|node| (node.name, node.power));
    Ok(Probe::Known { costs, powers: powers.collect() })
}

/// By `size` for squares, or by `width` and `height`.
fn grid(keys: &Keys) -> mlua::Result<Value> {
    let edge = |field: Field| field.integer32(1, EDGE);
    let square = |edge: u32| (edge, edge);
    let (width, height) = match (keys.optional("size")?, keys.optional("width")?, keys.optional("height")?) {
        (None, None, None) => (64, 64),
        (Some(size), None, None) => square(edge(size)?),
        (None, Some(width), Some(height)) => (edge(width)?, edge(height)?),
        _ => return Err(keys.fault("needs `size`, or both `width` and `height`").into()),
    };
    keys.make(|_| Thing::Split(Split::Grid { width, height }))
}

fn strips(keys: &Keys) -> mlua::Result<Value> {
    let count = keys.required("count")?.integer32(1, EDGE)?;
    keys.make(|_| Thing::Split(Split::Strips { count }))
}

fn assign(keys: &Keys, assign: Assign) -> mlua::Result<Value> {
    keys.make(|_| Thing::Assign(assign))
}
