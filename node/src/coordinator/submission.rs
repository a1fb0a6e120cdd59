//! A job as a client hands it in: what is checked, and what the farm's core is told of it.

use std::time::Duration;

use tessera_engine::description::Quality;

use crate::{
    farm::JobSpec,
    job::{JobDescription, Output},
    limits::{
        ASSETS_PER_JOB, FIRST_SAMPLE, JOBS_AWAITED, LONGEST_PATIENCE, MOST_ATTEMPTS_PER_PART, NODES, PART_BYTES, PARTS_PER_JOB,
        PIXELS_PER_FRAME, PRIORITY, SAMPLES_PER_PIXEL,
    },
    schedule::{Probe, Split},
    wire::{self, Terms},
};

/// What a client of another make could get wrong.
///
/// # Errors
/// In words.
pub fn check(description: &JobDescription, terms: &Terms) -> Result<(), String> {
    check_terms(terms)?;
    outputs(&description.output)?;
    if description.assets.len() > ASSETS_PER_JOB {
        return Err(format!("{} assets; {ASSETS_PER_JOB} are allowed", description.assets.len()));
    }
    let film = &description.frame.film;
    let pixels = u64::from(film.width) * u64::from(film.height);
    if pixels == 0 || pixels > PIXELS_PER_FRAME {
        return Err(format!("a frame of {} x {} pixels; 1 to {PIXELS_PER_FRAME} pixels are allowed", film.width, film.height));
    }
    let Quality { samples, first } = description.frame.quality;
    if first > FIRST_SAMPLE {
        return Err(format!("samples from number {first} on; {FIRST_SAMPLE} at the most is allowed"));
    }
    if !(1..=SAMPLES_PER_PIXEL).contains(&samples) {
        return Err(format!("{samples} samples a pixel; 1 to {SAMPLES_PER_PIXEL} are allowed"));
    }
    if !(0.0..=1.0).contains(&description.audit) {
        return Err(format!("a share of {} of the parts to compare; 0 to 1 is allowed", description.audit));
    }
    if !(1..=MOST_ATTEMPTS_PER_PART).contains(&description.attempts) {
        return Err(format!("{} attempts at a part; 1 to {MOST_ATTEMPTS_PER_PART} are allowed", description.attempts));
    }
    if !description.patience.is_none_or(|seconds| (0.0..=LONGEST_PATIENCE).contains(&seconds)) {
        return Err(format!("a patience of {:?} s; 0 to {LONGEST_PATIENCE} is allowed", description.patience));
    }
    probe(&description.probe)?;
    split(&description.split, film.width, film.height, description.frame.aovs.bytes_per_pixel())
}

fn check_terms(terms: &Terms) -> Result<(), String> {
    check_priority(terms.priority)?;
    if terms.after.len() > JOBS_AWAITED {
        return Err(format!("it waits for {} jobs; {JOBS_AWAITED} are allowed", terms.after.len()));
    }
    Ok(())
}

fn probe(probe: &Probe) -> Result<(), String> {
    match probe {
        Probe::EveryNode { scale } | Probe::Shared { scale } if !(*scale > 0.0 && *scale <= 1.0) => {
            Err(format!("a probe at {scale} of the resolution; above 0 and up to 1 is allowed"))
        }
        Probe::Known { costs, .. } if !costs.is_sound() => Err("the probe's costs are no costs".to_owned()),
        _ => Ok(()),
    }
}

fn split(split: &Split, width: u32, height: u32, bytes_per_pixel: u64) -> Result<(), String> {
    let parts = match *split {
        Split::Grid { width: 0, .. } | Split::Grid { height: 0, .. } | Split::Strips { count: 0 } => 0,
        Split::Grid { width: columns, height: rows } => u64::from(width.div_ceil(columns)) * u64::from(height.div_ceil(rows)),
        Split::Strips { count } => u64::from(count.min(height)),
        Split::Script => 1,
    };
    if !(1..=PARTS_PER_JOB as u64).contains(&parts) {
        return Err(format!("a split into {parts} parts; 1 to {PARTS_PER_JOB} are allowed"));
    }
    let largest = match *split {
        Split::Grid { width: columns, height: rows } => u64::from(columns.min(width)) * u64::from(rows.min(height)),
        Split::Strips { count } => u64::from(width) * u64::from(height.div_ceil(count.max(1))),
        Split::Script => 0,
    };
    if largest.saturating_mul(bytes_per_pixel) > PART_BYTES as u64 {
        return Err(format!(
            "parts of {largest} pixels of {bytes_per_pixel} bytes; {PART_BYTES} bytes are allowed: split it into smaller parts"
        ));
    }
    Ok(())
}

fn outputs(output: &Output) -> Result<(), String> {
    let Output { exr, png, manifest, .. } = output;
    let names: Vec<&String> = [exr, manifest].into_iter().chain(png).collect();
    for (i, name) in names.iter().enumerate() {
        if !wire::is_plain_name(name) {
            return Err(format!("the output {name:?} is no plain file name"));
        }
        if names[..i].contains(name) {
            return Err(format!("two outputs are named {name:?}"));
        }
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
        first_sample: frame.quality.first,
        probe: probe.clone(),
        split: split.clone(),
        assign: *assign,
        min_nodes: terms.min_nodes.clamp(1, NODES as u32),
        audit: *audit,
        owner: owner.to_owned(),
        priority: terms.priority,
        after: terms.after.clone(),
        attempts: *attempts,
        patience: patience.map(|seconds| Duration::from_secs_f64(seconds.clamp(0.0, LONGEST_PATIENCE))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::CostMap;

    #[test]
    fn what_would_spoil_the_core_is_refused() {
        for scale in [f64::NAN, 0.0, -1.0, 2.0, f64::INFINITY] {
            assert!(probe(&Probe::Shared { scale }).is_err(), "{scale}");
        }
        assert!(probe(&Probe::EveryNode { scale: 1.0 }).is_ok());
        let costs = |cost| CostMap { cell: 8, columns: 1, rows: 1, seconds_per_pixel: vec![cost] };
        assert!(probe(&Probe::Known { costs: costs(1.0), powers: Default::default() }).is_ok());
        assert!(probe(&Probe::Known { costs: costs(f64::NAN), powers: Default::default() }).is_err());
        for (wrong, what) in [
            (Split::Grid { width: 1, height: 1 }, "1073741824 parts"),
            (Split::Grid { width: 8, height: 0 }, "0 parts"),
            (Split::Strips { count: 0 }, "0 parts"),
        ] {
            assert!(split(&wrong, 32_768, 32_768, 12).is_err_and(|message| message.contains(what)), "{wrong:?}");
        }
        assert!(split(&Split::Grid { width: 64, height: 64 }, 1024, 768, 76).is_ok());
        let whole = Split::Grid { width: 65_536, height: 65_536 };
        assert!(split(&whole, 4096, 4096, 12).is_ok());
        assert!(split(&whole, 4096, 4096, 76).is_err_and(|message| message.contains("parts of 16777216 pixels of 76 bytes")));
        assert!(split(&Split::Strips { count: 1 }, 4096, 4096, 76).is_err());
    }
}
