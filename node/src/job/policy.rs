//! A job's own policies, asked by the coordinator.

use std::{collections::BTreeMap, time::Duration};

use mlua::{Function, Lua, Table, Value};
use tessera_engine::part::Rect;

use super::{
    ScriptBundle,
    evaluate::{Evaluated, evaluate_bundle},
    fault::Fault,
    handle::Policy,
    keys::describe,
    place::Place,
    sandbox::{Budget, Sandbox},
};
use crate::{
    error::{Error, ExitCode, Result},
    limits,
    schedule::{CostMap, NodeId, NodePower, Part, PartId, Plan, assign, split},
};

/// The functions that a job script gave as `split` and `assign`.
///
/// It holds a virtual machine: to be made and asked on a thread of its own, apart from the core.
pub struct Policies {
    sandbox: Sandbox,
    split: Option<Function>,
    assign: Option<Function>,
}

impl Policies {
    /// Runs the script once more, from its bundle and without any file, and keeps its functions.
    ///
    /// # Errors
    /// What the script did wrong, with its place.
    pub fn new(bundle: &ScriptBundle, parameters: &BTreeMap<String, String>) -> Result<Self> {
        Self::within(bundle, parameters, Budget::default())
    }

    /// As [`Self::new`], within a budget of one's own.
    #[doc(hidden)]
    pub fn within(bundle: &ScriptBundle, parameters: &BTreeMap<String, String>, budget: Budget) -> Result<Self> {
        let Evaluated { sandbox, job } =
            evaluate_bundle(bundle, parameters, budget).map_err(|fault| Error { code: ExitCode::Job, ..Error::from(fault) })?;
        let (split, assign) = (own(&job.split), own(&job.assign));
        Ok(Self { sandbox, split, assign })
    }

    /// Asks the job's split: rectangles that cover a frame of `width` x `height` pixels once.
    ///
    /// # Errors
    /// The function failed, ran longer than `time`, or its rectangles leave a gap, overlap, or reach outside; with its place.
    pub fn split(&mut self, width: u32, height: u32, costs: &CostMap, nodes: &[NodePower], time: Duration) -> Result<Vec<Rect>, String> {
        let function = self.split.clone().ok_or("the job has no split function")?;
        let place = Place::of_function(&function);
        self.ask(&place, time, |lua| {
            let frame = table(lua, [("width", width.into()), ("height", height.into())])?;
            let returned = function.call::<Value>((frame, costs_table(lua, costs)?, nodes_table(lua, nodes)?))?;
            let rects = read_rects(lua, &returned).map_err(|what| place.fault(format!("split: {what}")))?;
            split::validate(&rects, width, height).map_err(|what| place.fault(format!("split: {what}")))?;
            Ok(rects)
        })
    }

    /// Asks the job's assignment: a node for every part. A redistribution asks it the same of what is left.
    ///
    /// # Errors
    /// The function failed, ran longer than `time`, left a part out, or named a part or node that there is not; with its place.
    pub fn assign(&mut self, parts: &[Part], nodes: &[NodePower], time: Duration) -> Result<Plan, String> {
        let function = self.assign.clone().ok_or("the job has no assign function")?;
        let place = Place::of_function(&function);
        self.ask(&place, time, |lua| {
            let returned = function.call::<Value>((parts_table(lua, parts)?, nodes_table(lua, nodes)?))?;
            let plan = read_plan(lua, &returned, parts, nodes).map_err(|what| place.fault(format!("assign: {what}")))?;
            Ok(plan)
        })
    }

    fn ask<T>(&self, place: &Place, time: Duration, work: impl FnOnce(&Lua) -> mlua::Result<T>) -> Result<T, String> {
        if self.sandbox.exhausted() {
            return Err(place.fault("the policy's memory ran out earlier").to_string());
        }
        self.sandbox.run(time, work).map_err(|fault| fault.or_at(place).to_string())
    }
}

fn own<T>(policy: &Policy<T>) -> Option<Function> {
    match policy {
        Policy::Script(function) => Some(function.clone()),
        Policy::BuiltIn(_) => None,
    }
}

fn table<const N: usize>(lua: &Lua, entries: [(&str, f64); N]) -> mlua::Result<Table> {
    let table = lua.create_table_with_capacity(0, N)?;
    entries.into_iter().try_for_each(|(key, value)| table.raw_set(key, value))?;
    Ok(table)
}

fn parts_table(lua: &Lua, parts: &[Part]) -> mlua::Result<Table> {
    let list = lua.create_table_with_capacity(parts.len(), 0)?;
    for Part { id, rect, cost } in parts {
        let corner = [("x", rect.x.into()), ("y", rect.y.into()), ("width", rect.width.into()), ("height", rect.height.into())];
        let part = table(lua, corner)?;
        part.raw_set("id", id.0)?;
        part.raw_set("cost", *cost)?;
        list.raw_push(part)?;
    }
    Ok(list)
}

fn nodes_table(lua: &Lua, nodes: &[NodePower]) -> mlua::Result<Table> {
    let list = lua.create_table_with_capacity(nodes.len(), 0)?;
    for NodePower { id, name, lanes, power } in nodes {
        let node = table(lua, [("id", id.0.into()), ("lanes", (*lanes).into()), ("power", *power)])?;
        node.raw_set("name", name.as_str())?;
        list.raw_push(node)?;
    }
    Ok(list)
}

/// The probe's measurements, and `seconds { x =, y =, width =, height = }`, a rectangle's cost by them.
fn costs_table(lua: &Lua, costs: &CostMap) -> mlua::Result<Table> {
    let map = table(lua, [("cell", costs.cell.into()), ("columns", costs.columns.into()), ("rows", costs.rows.into())])?;
    map.raw_set("seconds_per_pixel", lua.create_sequence_from(costs.seconds_per_pixel.iter().copied())?)?;
    let costs = costs.clone();
    let seconds = lua.create_function(move |lua, rect: Value| {
        let rect = read_rect(lua, 1, &rect).map_err(|what| Place::of_running(lua).fault(format!("costs.seconds: {what}")))?;
        Ok(split::cost_of(rect, &costs))
    })?;
    map.raw_set("seconds", seconds)?;
    Ok(map)
}

fn read_rects(lua: &Lua, returned: &Value) -> Result<Vec<Rect>, String> {
    let Value::Table(list) = returned else {
        return Err(format!("must return a list of {{x =, y =, width =, height =}}, got {}", describe(lua, returned)));
    };
    if list.raw_len() > limits::PARTS_PER_JOB {
        return Err(format!("returns {} rectangles; {} are the most", list.raw_len(), limits::PARTS_PER_JOB));
    }
    (1..=list.raw_len()).map(|at| read_rect(lua, at, &list.raw_get(at).unwrap_or_default())).collect()
}

fn read_rect(lua: &Lua, at: usize, value: &Value) -> Result<Rect, String> {
    let Value::Table(rect) = value else {
        return Err(format!("rectangle {at} must be {{x =, y =, width =, height =}}, got {}", describe(lua, value)));
    };
    let edge = |key: &str, lowest: u32| {
        let value = rect.raw_get::<Value>(key).unwrap_or_default();
        whole(&value)
            .filter(|edge| *edge >= lowest)
            .ok_or_else(|| format!("rectangle {at}: `{key}` must be a whole number from {lowest} up, got {}", describe(lua, &value)))
    };
    Ok(Rect { x: edge("x", 0)?, y: edge("y", 0)?, width: edge("width", 1)?, height: edge("height", 1)? })
}

/// A whole number that fits 32 bits.
fn whole(value: &Value) -> Option<u32> {
    let number = value.as_number().or_else(|| value.as_integer().map(|number| number as f64))?;
    (number.fract() == 0.0 && (0.0..=f64::from(u32::MAX)).contains(&number)).then_some(number as u32)
}

fn read_plan(lua: &Lua, returned: &Value, parts: &[Part], nodes: &[NodePower]) -> Result<Plan, String> {
    let Value::Table(entries) = returned else {
        return Err(format!("must return a table from part.id to node.id, got {}", describe(lua, returned)));
    };
    let mut plan = Plan::new();
    for pair in entries.pairs::<Value, Value>() {
        let (part, node) = pair.map_err(|error| Fault::from(&error).to_string())?;
        let id = whole(&part).ok_or_else(|| format!("the plan names {}; keys must be the ids of parts", describe(lua, &part)))?;
        let given =
            whole(&node).ok_or_else(|| format!("the plan gives part {id} to {}; values must be the ids of nodes", describe(lua, &node)))?;
        plan.insert(PartId(id), NodeId(given));
    }
    assign::validate(&plan, parts, nodes).map_err(|error| error.to_string())?;
    Ok(plan)
}
