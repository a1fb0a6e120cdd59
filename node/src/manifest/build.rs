//! From what the farm's core recorded to a manifest.

use std::{collections::BTreeMap, time::SystemTime};

use super::{
    EventEntry, ImageEntry, JobEntry, Manifest, NodeEntry, PartEntry, ProbeEntry, ReportEntry, VERSION, evaluate, figures, rfc3339,
};
use crate::schedule::{NodeId, PartId};

/// What the farm's core knows of a job: facts alone. What follows from them is worked out by [`build`].
#[derive(Clone, Debug, PartialEq)]
pub struct JobRecord {
    /// How it was split, in words.
    pub split: String,
    /// How it was assigned, in words.
    pub assign: String,
    /// `finished`, `failed: ...` or `cancelled: ...`.
    pub outcome: String,
    /// How costs were learned.
    pub probe: ProbeEntry,
    /// Every node that took part; [`build`] fills in `parts`, `busy` and `finish`.
    pub nodes: Vec<NodeEntry>,
    /// Every part with every attempt.
    pub parts: Vec<PartEntry>,
    /// What happened, in order of time.
    pub events: Vec<EventEntry>,
    /// What went not as asked for.
    pub warnings: Vec<String>,
}

/// What the coordinator knows of a job beside its core.
#[derive(Clone, Debug, PartialEq)]
pub struct Submission {
    /// The coordinator's number for it.
    pub id: u64,
    /// Its name: the script's file name without ending.
    pub name: String,
    /// Values given with `--set`.
    pub parameters: BTreeMap<String, String>,
    /// Moment of submission.
    pub submitted: SystemTime,
    /// What the description warns of.
    pub warnings: Vec<String>,
}

/// Makes the manifest of a job: puts nodes and parts in order, sums up each node, ranks parts and nodes (the paper's tables S_n and R_p)
/// and evaluates the whole. `total` is the time in seconds from submission to the finished file.
pub fn build(submission: Submission, image: ImageEntry, record: JobRecord, total: f64) -> Manifest {
    let mut warnings = submission.warnings;
    warnings.extend(record.warnings);
    warnings.extend(invalid_samples(&image));
    warnings.extend(blackness(&image).map(str::to_owned));
    let mut manifest = Manifest {
        version: VERSION,
        program: program(),
        job: JobEntry {
            id: submission.id,
            name: submission.name,
            parameters: submission.parameters,
            submitted: rfc3339(submission.submitted),
            split: record.split,
            assign: record.assign,
            outcome: record.outcome,
        },
        image,
        probe: record.probe,
        difficulty: hardest_first(&record.parts),
        power: most_powerful_first(&record.nodes),
        nodes: record.nodes,
        parts: record.parts,
        events: record.events,
        report: ReportEntry::default(),
        warnings,
    };
    manifest.nodes.sort_by_key(|node| node.id);
    manifest.parts.sort_by_key(|part| part.id);
    manifest.events.sort_by(|a, b| a.time.total_cmp(&b.time));
    sum_up_nodes(&mut manifest);
    manifest.report = ReportEntry { total, ..evaluate(&manifest) };
    manifest
}

/// Version and engine revision of this program, as they stand in manifests.
pub fn program() -> String {
    format!("tessera {} (engine revision {})", env!("CARGO_PKG_VERSION"), tessera_engine::REVISION)
}

/// What is to be said of a picture in which nothing is to be seen, though nothing failed.
pub fn blackness(image: &ImageEntry) -> Option<&'static str> {
    let is_odd = image.is_black && image.holes.is_empty() && image.invalid_samples == 0;
    is_odd.then_some("every pixel is black: look whether light gets to what the camera sees, and whether the camera is inside of something or looks past it")
}

fn invalid_samples(image: &ImageEntry) -> Option<String> {
    let (invalid, all) = (image.invalid_samples, image.sample_count());
    (invalid > 0).then(|| format!("{invalid} of {all} samples are invalid (negative, infinite, or no numbers): they count as black"))
}

fn sum_up_nodes(manifest: &mut Manifest) {
    let start = super::evaluate::first_handed_out(manifest).unwrap_or(0.0);
    let all = figures(manifest);
    for (node, figures) in manifest.nodes.iter_mut().zip(all) {
        node.parts = figures.parts;
        node.busy = figures.busy;
        node.finish = figures.finish.map_or(0.0, |since_start| start + since_start);
    }
}

fn hardest_first(parts: &[PartEntry]) -> Vec<PartId> {
    let mut order: Vec<_> = parts.iter().collect();
    order.sort_by(|a, b| b.predicted.total_cmp(&a.predicted).then(a.id.cmp(&b.id)));
    order.iter().map(|part| part.id).collect()
}

fn most_powerful_first(nodes: &[NodeEntry]) -> Vec<NodeId> {
    let mut order: Vec<_> = nodes.iter().filter(|node| node.power > 0.0).collect();
    order.sort_by(|a, b| b.power.total_cmp(&a.power).then(a.id.cmp(&b.id)));
    order.iter().map(|node| node.id).collect()
}
