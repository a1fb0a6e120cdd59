//! The paper's table over several runs.

use serde::Serialize;

use super::style::{Style, table as lined_up};
use crate::manifest::{Manifest, figures};

/// One run, in the paper's terms.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Run {
    /// Name of the job.
    pub job: String,
    /// How its parts were assigned.
    pub assign: String,
    /// Nodes that were there at any time of the render.
    pub nodes: usize,
    /// T_n: seconds from the first part handed out to the last commit.
    pub time: f64,
    /// Seconds from submission to the finished file.
    pub total: f64,
    /// S = T_1 / T_n.
    pub speedup: f64,
    /// S / n.
    pub efficiency: f64,
    /// Work over what all nodes could have done in the makespan, by the speeds measured in this very run.
    pub efficiency_by_speeds: f64,
    /// L = (max - min) / min of the nodes' finish times.
    pub overbalance: f64,
    /// Whether T_1 is the time of a run on one node that stands in the same table, rather than an estimate from this run alone.
    pub measured_alone: bool,
}

/// The runs of a table, by number of nodes. T_1 is the time of the one-node run with the same picture, where one is among them (the fastest,
/// where several are).
pub fn runs(manifests: &[Manifest]) -> Vec<Run> {
    let mut runs: Vec<_> = manifests.iter().map(|manifest| run(manifest, alone(manifests, manifest))).collect();
    runs.sort_by_key(|run| run.nodes);
    runs
}

/// The table as text: one column a run; below it, what its numbers rest on. Ends in a line break.
pub fn table(manifests: &[Manifest], style: Style) -> String {
    let runs = runs(manifests);
    let row = |name: &str, cell: &dyn Fn(&Run) -> String| [name.to_owned()].into_iter().chain(runs.iter().map(cell)).collect::<Vec<_>>();
    let rows = [
        row("nodes", &|run| run.nodes.to_string()),
        row("time s", &|run| format!("{:.2}", run.time)),
        row("speedup", &|run| format!("{:.2}", run.speedup)),
        row("efficiency", &|run| format!("{:.3}", run.efficiency)),
        row("efficiency by measured speeds", &|run| format!("{:.3}", run.efficiency_by_speeds)),
        row("overbalance", &|run| format!("{:.3}", run.overbalance)),
        row("with probe and output s", &|run| format!("{:.2}", run.total)),
    ];
    let mut lines = lined_up(&rows);
    lines[0] = style.bold(&lines[0]);
    lines.extend(notes(manifests, &runs).iter().map(|note| style.dim(note)));
    lines.iter().map(|line| format!("{line}\n")).collect()
}

/// What a reader of the table has to know.
pub fn notes(manifests: &[Manifest], runs: &[Run]) -> Vec<String> {
    let mut notes = Vec::new();
    if runs.iter().all(|run| run.measured_alone) {
        notes.push("T_1 is the time of the run on one node.".to_owned());
    } else {
        notes.push("T_1 is estimated where no run on one node shows the same picture: work over the mean speed of the nodes.".to_owned());
    }
    if manifests.windows(2).any(|pair| pair[0].image.image_hash != pair[1].image.image_hash) {
        notes.push("These runs show different pictures.".to_owned());
    }
    notes
}

fn run(manifest: &Manifest, alone: Option<f64>) -> Run {
    let report = &manifest.report;
    let nodes = nodes_of(manifest);
    let speedup = match alone {
        Some(time) if report.makespan > 0.0 => time / report.makespan,
        _ => report.speedup,
    };
    Run {
        job: manifest.job.name.clone(),
        assign: manifest.job.assign.clone(),
        nodes,
        time: report.makespan,
        total: report.total,
        speedup,
        efficiency: speedup / nodes.max(1) as f64,
        efficiency_by_speeds: report.efficiency,
        overbalance: report.overbalance,
        measured_alone: alone.is_some(),
    }
}

/// Time of the fastest run on one node with the same picture.
fn alone(manifests: &[Manifest], of: &Manifest) -> Option<f64> {
    let same = manifests.iter().filter(|other| other.image.image_hash == of.image.image_hash && nodes_of(other) == 1);
    same.map(|run| run.report.makespan).filter(|time| *time > 0.0).min_by(f64::total_cmp)
}

fn nodes_of(manifest: &Manifest) -> usize {
    figures(manifest).iter().filter(|node| node.present > 0.0).count()
}
