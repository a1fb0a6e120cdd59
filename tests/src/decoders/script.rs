//! Job scripts, in a sandbox that is tighter than usual.

use std::{collections::BTreeMap, fs, time::Duration};

use tessera_node::{
    coordinator::submission,
    job::{Budget, JobDescription, Policies, load_within},
    limits::{PIXELS_PER_FRAME, REQUEST_BYTES},
    schedule::{CostMap, NodeId, NodePower, Part, PartId, assign, split},
    wire::{self, Terms},
};

use super::{model::PNG, scene::OBJ, wire::message};

const BUDGET: Budget = Budget { memory: 32 << 20, time: Duration::from_millis(200) };

/// A job script beside which there are `a.obj`, `a.png` and a module `module`. It is run as where it is submitted; what comes of it travels, and
/// its policies are asked as on the coordinator.
pub fn job(bytes: &[u8]) -> bool {
    let folder = tempfile::tempdir().unwrap();
    let files: [(&str, &[u8]); 5] =
        [("job.lua", bytes), (".luaurc", b"{}"), ("a.obj", OBJ), ("a.png", PNG), ("module.lua", b"return { one = 1 }")];
    files.iter().for_each(|(name, content)| fs::write(folder.path().join(name), content).unwrap());
    let Ok((job, scene)) = load_within(&folder.path().join("job.lua"), &BTreeMap::new(), BUDGET) else { return false };
    drop(scene);
    let description = job.description;
    // Where objects were made stays here.
    message::<JobDescription>(&wire::encode(&description, REQUEST_BYTES).unwrap()[4..]).expect("a description travels");
    let pixels = u64::from(description.frame.film.width) * u64::from(description.frame.film.height);
    if pixels <= PIXELS_PER_FRAME {
        submission::check(&description, &Terms::default()).unwrap_or_else(|wrong| panic!("what was described is refused: {wrong}"));
    }
    ask(&description);
    true
}

/// What its policies answer covers the frame once, and gives every part to a node that there is.
fn ask(description: &JobDescription) {
    let Some(bundle) = &description.script else { return };
    let Ok(mut policies) = Policies::within(bundle, &description.parameters, BUDGET) else { return };
    let (width, height) = (description.frame.film.width, description.frame.film.height);
    let nodes = [1, 2].map(|id| NodePower { id: NodeId(id), name: format!("node-{id}"), lanes: 2, power: f64::from(id) });
    let costs = CostMap { cell: width.max(height), columns: 1, rows: 1, seconds_per_pixel: vec![1e-6] };
    if let Ok(rects) = policies.split(width, height, &costs, &nodes, BUDGET.time) {
        split::validate(&rects, width, height).unwrap();
    }
    let parts: Vec<Part> = split::grid(width, height, width.div_ceil(2), height)
        .into_iter()
        .zip(0..)
        .map(|(rect, id)| Part { id: PartId(id), rect, cost: 1.0 })
        .collect();
    if let Ok(plan) = policies.assign(&parts, &nodes, BUDGET.time) {
        assign::validate(&plan, &parts, &nodes).unwrap();
    }
}
