//! Tests of the job room.

mod attacks;
mod faults;
mod policies;
mod reference;
mod scripts;
mod values;

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
    time::Duration,
};

use super::{LoadedJob, ScriptBundle, fault::Fault, load::load_within, sandbox::Budget};

const BUDGET: Budget = Budget { memory: 256 << 20, time: Duration::from_secs(20) };

/// The root of the repository.
fn repository() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().expect("the crate lies in the repository").to_owned()
}

fn load_file(path: &Path, parameters: &[(&str, &str)], budget: Budget) -> Result<LoadedJob, Fault> {
    let parameters: BTreeMap<_, _> = parameters.iter().map(|(name, value)| (name.to_string(), value.to_string())).collect();
    load_within(path, &parameters, budget).map(|(job, _)| job)
}

/// Runs a script in a project of its own: `files` are further files of it. The folder's name is taken out of messages.
fn run(script: &str, files: &[(&str, &str)], parameters: &[(&str, &str)], budget: Budget) -> Result<LoadedJob, Fault> {
    let folder = tempfile::tempdir().unwrap();
    let root = folder.path().canonicalize().unwrap();
    std::fs::create_dir(root.join("jobs")).unwrap();
    std::fs::write(root.join(".luaurc"), "{}").unwrap();
    for (name, content) in files.iter().chain(&[("jobs/job.lua", script)]) {
        std::fs::create_dir_all(root.join(name).parent().unwrap()).unwrap();
        std::fs::write(root.join(name), content).unwrap();
    }
    let clean = |text: String| text.replace(&format!("{}/", root.display()), "").replace(&root.display().to_string(), "(project)");
    load_file(&root.join("jobs/job.lua"), parameters, budget)
        .map_err(|fault| Fault { message: clean(fault.message), help: fault.help.map(clean) })
}

/// A job around a few words of its scene, film and policies.
fn job_with(body: &str) -> String {
    format!("local tessera = require(\"tessera\")\nlocal grey = tessera.diffuse {{ reflectance = 0.5 }}\n{body}")
}

/// A whole small job; `changes` stand last in its table and replace what is there.
fn small_job(changes: &str) -> String {
    job_with(&format!(
        "local job = {{
  scene = tessera.scene {{ objects = {{ tessera.sphere {{ material = grey }} }}, lights = {{}} }},
  camera = tessera.perspective {{ eye = {{0, 0, 5}} }},
  film = {{ width = 16, height = 12 }},
}}
for key, value in {{ {changes} }} do job[key] = value end
return tessera.job(job)"
    ))
}

fn bundle(script: &str) -> ScriptBundle {
    ScriptBundle { name: "job.lua".to_owned(), source: script.to_owned(), modules: BTreeMap::new() }
}
