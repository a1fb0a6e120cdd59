//! A job as a client hands it in: what is checked, and what the farm's core is told of it.

use crate::{
    farm::JobSpec,
    job::{JobDescription, Output},
    limits::{ASSETS_PER_JOB, PIXELS_PER_FRAME},
    wire,
};

/// What a client of another make could get wrong.
///
/// # Errors
/// In words.
pub fn check(description: &JobDescription) -> Result<(), String> {
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
    let film = &description.frame.film;
    let pixels = u64::from(film.width) * u64::from(film.height);
    if pixels == 0 || pixels > PIXELS_PER_FRAME {
        return Err(format!("a frame of {} x {} pixels; 1 to {PIXELS_PER_FRAME} pixels are allowed", film.width, film.height));
    }
    Ok(())
}

/// What the farm's core is told.
pub fn spec(description: &JobDescription, min_nodes: u32) -> JobSpec {
    let JobDescription { name, frame, probe, split, assign, audit, .. } = description;
    JobSpec {
        name: name.clone(),
        width: frame.film.width,
        height: frame.film.height,
        samples: u64::from(frame.quality.samples),
        probe: probe.clone(),
        split: split.clone(),
        assign: *assign,
        min_nodes: min_nodes.max(1),
        audit: *audit,
    }
}
