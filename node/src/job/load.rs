//! Loading a job script from a file.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::Path,
};

use tessera_engine::{
    description::{Aov, AssetId, AssetSource, MemoryAssets, Sources},
    scene::Unbuilt,
};

use super::{
    FRAME_PARAMETER, Frames, JobDescription, ScriptBundle, assemble,
    compile::{self, Compiled},
    context::{Context, Files, read_bounded},
    description::not_extended,
    evaluate::{self, Evaluated, evaluate},
    fault::Fault,
    handle::Policy,
    modules::Modules,
    sandbox::Budget,
};
use crate::{
    error::Result,
    limits,
    schedule::{Assign, Split},
};

/// A job script, run: its description, and what was collected on the way.
pub struct LoadedJob {
    /// What is submitted.
    pub description: JobDescription,
    /// The assets that the description names.
    pub assets: MemoryAssets,
    /// Where each object was made.
    pub sources: Sources,
    /// Which frame it is, where the script says several.
    pub frames: Option<(u32, Frames)>,
}

impl LoadedJob {
    /// The sequence that the script says, unless one frame of it was chosen.
    pub fn sequence(&self, parameters: &BTreeMap<String, String>) -> Option<Frames> {
        self.frames.map(|(_, frames)| frames).filter(|_| !parameters.contains_key(FRAME_PARAMETER))
    }
}

/// Runs the job script at `path` with values given with `--set`, and compiles its scene, so that what is wrong with a file shows at once.
///
/// # Errors
/// Exit code 3 and `file:line: object: what is wrong`, for anything that is wrong with the script or a file that it names.
pub fn load(path: &Path, parameters: &BTreeMap<String, String>) -> Result<(LoadedJob, Unbuilt)> {
    Ok(load_within(path, parameters, Budget::default())?)
}

/// As [`load`], within a budget of one's own.
pub fn load_within(path: &Path, parameters: &BTreeMap<String, String>, budget: Budget) -> Result<(LoadedJob, Unbuilt), Fault> {
    let name = path.display().to_string();
    let bytes = read_bounded(path, limits::SCRIPT_FILE_BYTES).map_err(Fault::new)?;
    let source = String::from_utf8(bytes).map_err(|_| Fault::new(format!("{name}: the script is not UTF-8 text")))?;
    let modules = Modules::on_disk(&name, path).map_err(Fault::new)?;
    let evaluated = evaluate(&name, &source, modules, Files::Disk, parameters, budget)?;
    describe(evaluated, name, source, parameters)
}

fn describe(
    evaluated: Evaluated,
    name: String,
    source: String,
    parameters: &BTreeMap<String, String>,
) -> Result<(LoadedJob, Unbuilt), Fault> {
    let Evaluated { sandbox, job } = evaluated;
    let context = sandbox.lua().remove_app_data::<Context>().ok_or_else(|| Fault::new(format!("{name}: its context is gone")))?;
    let (scene, needed) = assemble::scene(&job.scene).map_err(|error| Fault::new(format!("{name}: {error}")))?;
    let assets = only(&context.assets, &needed);
    let Compiled { frame, scene, mut warnings } = compile::compile(&name, scene, &job, &assets, &context.sources)?;
    if frame.aovs.contains(Aov::Residual) {
        warnings.extend(
            not_extended(frame.aovs)
                .map(|what| format!("{name}: a picture that tells {what} cannot be extended, though it tells its \"residual\"")),
        );
    }
    let (split, assign) = (built_in(&job.split, Split::Script), built_in(&job.assign, Assign::Script));
    let asks_script = matches!(job.split, Policy::Script(_)) || matches!(job.assign, Policy::Script(_));
    let description = JobDescription {
        name: job.frames.map_or_else(|| evaluate::job_name(&name), |(frame, _)| format!("{}.{frame:04}", evaluate::job_name(&name))),
        frame,
        assets: needed.into_iter().collect(),
        probe: job.probe.clone(),
        split,
        assign,
        audit: job.audit,
        attempts: job.attempts,
        patience: job.patience,
        output: job.output.clone(),
        script: asks_script.then(|| ScriptBundle { name, source, modules: context.modules.into_loaded() }),
        parameters: parameters.clone(),
        warnings,
    };
    Ok((LoadedJob { description, assets, sources: context.sources, frames: job.frames }, scene))
}

fn built_in<T: Clone>(policy: &Policy<T>, script: T) -> T {
    match policy {
        Policy::BuiltIn(policy) => policy.clone(),
        Policy::Script(_) => script,
    }
}

fn only(assets: &MemoryAssets, needed: &BTreeSet<AssetId>) -> MemoryAssets {
    let mut kept = MemoryAssets::default();
    needed.iter().filter_map(|id| assets.bytes(*id)).for_each(|bytes| {
        kept.insert(bytes);
    });
    kept
}
