//! The report at the end of a render.

use std::{collections::BTreeSet, path::PathBuf};

use super::style::{Style, seconds, table};
use crate::{
    manifest::{AttemptOutcome, EventKind, Manifest, NodeEntry},
    schedule::NodeId,
};

/// The report: what was rendered, per node its power, parts and times, the paper's figures, who was lost and what others took over, warnings,
/// and the written `files`. Ends in a line break.
pub fn text(manifest: &Manifest, files: &[PathBuf], style: Style) -> String {
    let mut lines = vec![headline(manifest, style), String::new()];
    lines.extend(nodes(manifest, style));
    lines.push(String::new());
    lines.extend(figures(manifest, style));
    lines.extend(losses(manifest, style));
    lines.extend(manifest.warnings.iter().map(|warning| style.warning(&format!("warning: {warning}"))));
    lines.extend(files.iter().enumerate().map(|(i, file)| format!("{}{}", if i == 0 { "files  " } else { "       " }, file.display())));
    lines.iter().map(|line| format!("{line}\n")).collect()
}

fn headline(manifest: &Manifest, style: Style) -> String {
    let image = &manifest.image;
    let samples = if image.samples == 1 { "1 sample".to_owned() } else { format!("{} samples", image.samples) };
    let what = format!("{} x {}, {samples} a pixel", image.width, image.height);
    let parts = if manifest.parts.len() == 1 { "1 part".to_owned() } else { format!("{} parts", manifest.parts.len()) };
    let how = format!("{parts} ({}), {}", manifest.job.split, manifest.job.assign);
    format!("{}  {what}; {how}; {}", style.bold(&manifest.job.name), manifest.job.outcome)
}

fn nodes(manifest: &Manifest, style: Style) -> Vec<String> {
    let mut rows = vec![["node", "lanes", "power", "parts", "busy s", "finish s"].map(str::to_owned).to_vec()];
    rows.extend(manifest.nodes.iter().map(|node| node_row(manifest, node)));
    let mut lines: Vec<_> = table(&rows).into_iter().map(|line| format!("  {line}")).collect();
    if let Some(head) = lines.first_mut() {
        *head = style.dim(head);
    }
    lines
}

fn node_row(manifest: &Manifest, node: &NodeEntry) -> Vec<String> {
    let power = if node.power > 0.0 { format!("{:.3}", node.power) } else { "-".to_owned() };
    let finish = if node.parts > 0 { format!("{:.2}", node.finish) } else { "-".to_owned() };
    let mut row = vec![node.name.clone(), node.lanes.to_string(), power, node.parts.to_string(), format!("{:.2}", node.busy), finish];
    row.extend(fate(manifest, node.id));
    row
}

/// What befell a node last, if it was lost or refused.
fn fate(manifest: &Manifest, node: NodeId) -> Option<String> {
    let last = manifest.events.iter().rfind(|event| event.node == Some(node) && is_turn(event.kind))?;
    match last.kind {
        EventKind::Suspected | EventKind::Lost => Some(format!("lost at {:.2} s", last.time)),
        EventKind::Refused => Some("refused".to_owned()),
        _ => None,
    }
}

fn is_turn(kind: EventKind) -> bool {
    matches!(kind, EventKind::Joined | EventKind::Recovered | EventKind::Suspected | EventKind::Lost | EventKind::Refused)
}

fn figures(manifest: &Manifest, style: Style) -> Vec<String> {
    let report = &manifest.report;
    let paper = format!("speedup {:.2}, efficiency {:.3}, overbalance {:.3}", report.speedup, report.efficiency, report.overbalance);
    let times = [("probe", manifest.probe.seconds), ("render", report.makespan), ("in all", report.total)];
    let times: Vec<_> = times.iter().map(|(what, time)| format!("{what} {}", seconds(*time))).collect();
    vec![format!("{}; {}", style.bold(&paper), times.join(", "))]
}

/// Nodes that were lost or refused, with the reason, and how many parts others took over.
fn losses(manifest: &Manifest, style: Style) -> Vec<String> {
    let name =
        |id: NodeId| manifest.nodes.iter().find(|node| node.id == id).map_or_else(|| format!("node {}", id.0), |node| node.name.clone());
    let told = |kind| matches!(kind, EventKind::Suspected | EventKind::Recovered | EventKind::Lost | EventKind::Refused);
    let mut lines: Vec<_> = (manifest.events.iter().filter(|event| told(event.kind)))
        .map(|event| {
            let who = event.node.map(name).unwrap_or_default();
            style.warning(&format!("{who} {} at {:.2} s: {}", word(event.kind), event.time, event.detail))
        })
        .collect();
    let reassigned: BTreeSet<_> =
        manifest.events.iter().filter(|event| event.kind == EventKind::Reassigned).flat_map(|event| &event.parts).collect();
    let wasted = (manifest.parts.iter().flat_map(|part| &part.attempts))
        .filter(|attempt| attempt.outcome == AttemptOutcome::Discarded)
        .filter_map(|attempt| attempt.seconds)
        .fold(0.0, |sum, seconds| sum + seconds); // an empty `sum` of floats is -0
    if !reassigned.is_empty() {
        let parts = if reassigned.len() == 1 { "1 part was".to_owned() } else { format!("{} parts were", reassigned.len()) };
        lines.push(format!("{parts} given out once more; {} of finished work was not needed", seconds(wasted)));
    }
    lines
}

fn word(kind: EventKind) -> &'static str {
    match kind {
        EventKind::Suspected => "fell silent",
        EventKind::Recovered => "was heard again",
        EventKind::Refused => "was refused work",
        _ => "was lost",
    }
}
