//! One evaluation of a job script: from its source to what `tessera.job` was given.

use std::{collections::BTreeMap, sync::Arc};

use mlua::Value;

use super::{
    ScriptBundle,
    context::{Context, Files},
    fault::Fault,
    handle::{Handle, JobNode, Thing},
    keys::{describe, nearest},
    modules::Modules,
    sandbox::{self, Budget, Sandbox},
};

/// A script that was run, in the machine that still holds its functions.
pub struct Evaluated {
    pub sandbox: Sandbox,
    pub job: Arc<JobNode>,
}

/// Runs a script.
///
/// # Errors
/// What the script did wrong, with its place.
pub fn evaluate(
    name: &str,
    source: &str,
    modules: Modules,
    files: Files,
    parameters: &BTreeMap<String, String>,
    budget: Budget,
) -> Result<Evaluated, Fault> {
    let context = Context::new(job_name(name), files, modules, parameters.clone());
    let sandbox = Sandbox::new(context, budget.memory)?;
    let job = sandbox.run(budget.time, |lua| {
        let values = sandbox::evaluate(lua, name, source)?;
        let returned = values.front().cloned().unwrap_or_default();
        job_of(&returned).ok_or_else(|| {
            let what = format!("the script must return a job, got {}", describe(lua, &returned));
            Fault::new(what).with_help("end it with `return tessera.job { ... }`").into()
        })
    });
    let job = job.map_err(|fault| fault.or_at(name))?;
    check_parameters(&sandbox)?;
    Ok(Evaluated { sandbox, job })
}

/// Runs a script that travelled: no file is read.
///
/// # Errors
/// As [`evaluate`].
pub fn evaluate_bundle(bundle: &ScriptBundle, parameters: &BTreeMap<String, String>, budget: Budget) -> Result<Evaluated, Fault> {
    evaluate(&bundle.name, &bundle.source, Modules::in_bundle(bundle), Files::Inert, parameters, budget)
}

fn job_of(value: &Value) -> Option<Arc<JobNode>> {
    let handle = value.as_userdata()?.borrow::<Handle>().ok()?;
    match &handle.thing {
        Thing::Job(job) => Some(Arc::clone(job)),
        _ => None,
    }
}

/// The script's file name without ending.
pub fn job_name(script: &str) -> String {
    let name = script.rsplit(['/', '\\']).next().unwrap_or(script);
    name.rsplit_once('.').map_or(name, |(stem, _)| stem).to_owned()
}

fn check_parameters(sandbox: &Sandbox) -> Result<(), Fault> {
    let context = Context::of(sandbox.lua()).map_err(|error| Fault::from(&error))?;
    let declared = &context.declared;
    let Some(unknown) = context.given.keys().find(|name| !declared.contains(name)) else { return Ok(()) };
    let help = match nearest(unknown, declared.iter().map(String::as_str)) {
        Some(near) => format!("did you mean `{near}`?"),
        None if declared.is_empty() => "the script asks for none (tessera.param)".to_owned(),
        None => format!("it asks for {}", declared.join(", ")),
    };
    Err(Fault::new(format!("--set {unknown}: the script has no such parameter")).with_help(help))
}
