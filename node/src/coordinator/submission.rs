//! A job as a client hands it in: what is checked, and what the farm's core is told of it.

use std::time::Duration;

use crate::{
    farm::JobSpec,
    job::{JobDescription, Output},
    limits::{ASSETS_PER_JOB, JOBS_AWAITED, LONGEST_PATIENCE, MOST_ATTEMPTS_PER_PART, PIXELS_PER_FRAME, PRIORITY},
    wire::{self, Terms},
};

/// What a client of another make could get wrong.
///
/// # Errors
/// In words.
pub fn check(description: &JobDescription, terms: &Terms) -> Result<(), String> {
    let Output { exr, png, manifest, .. } = &description.output;
    let names: Vec<&String> = [exr, manifest].into_iter().chain(png).collect();
    for (i, name) in names.iter().enumerate() {
        if !wire::is_plain_name(name) {
            return Err(format!("the output {name:?} is no plain file name"));
        }
        if names[..i].contains(name) {
            return Err(format!("two outputs are named {name:?}"));
        }
    }
    if description.assets.len() > ASSETS_PER_JOB {
        return Err(format!("{} assets; {ASSETS_PER_JOB} are allowed", description.assets.len()));
    }
    if !(1..=MOST_ATTEMPTS_PER_PART).contains(&description.attempts) || !description.patience.is_none_or(|seconds| seconds >= 0.0) {
        return Err("attempts and patience are out of range".to_owned());
    }
    check_priority(terms.priority)?;
    if terms.after.len() > JOBS_AWAITED {
        return Err(format!("it waits for {} jobs; {JOBS_AWAITED} are allowed", terms.after.len()));
    }
    let film = &description.frame.film;
    let pixels = u64::from(film.width) * u64::from(film.height);
    if pixels == 0 || pixels > PIXELS_PER_FRAME {
        return Err(format!("a frame of {} x {} pixels; 1 to {PIXELS_PER_FRAME} pixels are allowed", film.width, film.height));
    }
    Ok(())
}

/// Whether a job may have this rank at all.
///
/// # Errors
/// In words.
pub fn check_priority(priority: i32) -> Result<(), String> {
    if (-PRIORITY..=PRIORITY).contains(&priority) { Ok(()) } else { Err(format!("priorities are from -{PRIORITY} to {PRIORITY}")) }
}

/// What the farm's core is told.
pub fn spec(description: &JobDescription, terms: &Terms, owner: &str) -> JobSpec {
    let JobDescription { name, frame, probe, split, assign, audit, attempts, patience, .. } = description;
    JobSpec {
        name: name.clone(),
        width: frame.film.width,
        height: frame.film.height,
        samples: u64::from(frame.quality.samples),
        probe: probe.clone(),
        split: split.clone(),
        assign: *assign,
        min_nodes: terms.min_nodes.max(1),
        audit: *audit,
        owner: owner.to_owned(),
        priority: terms.priority,
        after: terms.after.clone(),
        attempts: *attempts,
        patience: patience.map(|seconds| Duration::from_secs_f64(seconds.clamp(0.0, LONGEST_PATIENCE))),
    }
}
