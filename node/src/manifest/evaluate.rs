//! The paper's figures, worked out from what was measured in the render itself.
//!
//! The unit of work is a part's *cost*: its predicted seconds on a node of power 1. A node's rate is the cost that it committed per
//! lane second, times its lanes; so the probe's estimate of powers plays no role where a node has rendered a fair amount. (A node that dies after
//! one part has a rate that tells how wrong that part's prediction was, not how fast the node is.) With rate `C_i`, busy
//! lane seconds `b_i` and lanes `l_i`, the work done is `W = sum C_i b_i / l_i`, and
//!
//! - efficiency `E = W / sum(C_i t_i)`, with `t_i` the part of the makespan for which node i was there: 1 exactly when all lanes of all nodes
//!   did useful work all the time. Errors in the rates only shift the weight of one node's utilisation against another's; they never bring
//!   it above 1 or make an idle lane look busy.
//! - speedup `S = T_1 / T_n`, with `T_1 = W / mean(C_i)`, what a node of mean power would take alone with all its lanes busy. Without losses
//!   `S = n E`. It takes parts as dear as they were in this run; against a true run on one node, see `tessera report` with both manifests.
//! - overbalance `L = (max - min) / min` of the moments at which nodes handed in their last part, over the nodes that were there at the end
//!   and committed anything. (A node that stood idle throughout shows in E.)

use std::collections::BTreeMap;

use super::{AttemptEntry, AttemptOutcome, EventKind, Manifest, NodeEntry, PartEntry, ReportEntry};
use crate::schedule::NodeId;

/// A node that was busy for less than this share of the mean tells too little to measure its rate.
const FAIR_SHARE: f64 = 0.1;

/// What one node did between the first part handed out and the last commit.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NodeFigures {
    /// Parts of it that were committed.
    pub parts: u32,
    /// Lane seconds that it spent on them.
    pub busy: f64,
    /// Their cost, in predicted seconds on a node of power 1.
    pub work: f64,
    /// Cost that it renders in a second with all its lanes, as measured in the render; estimated from the probe where it committed next to
    /// nothing.
    pub rate: f64,
    /// Seconds for which it was there.
    pub present: f64,
    /// Moment of its last commit in seconds since the first part was handed out, if it committed any.
    pub finish: Option<f64>,
    /// Whether it was still there at the last commit.
    pub at_end: bool,
}

/// Evaluates a run. `total` is taken over from the manifest's own report, because no other entry tells it.
pub fn evaluate(manifest: &Manifest) -> ReportEntry {
    let nodes = figures(manifest);
    let makespan = span(manifest).map_or(0.0, |(start, end)| end - start);
    let work: f64 = nodes.iter().zip(&manifest.nodes).map(|(node, entry)| ratio(node.rate * node.busy, f64::from(entry.lanes))).sum();
    let possible: f64 = nodes.iter().map(|node| node.rate * node.present).sum();
    let there: Vec<_> = nodes.iter().filter(|node| node.present > 0.0).collect();
    let mean_rate = ratio(there.iter().map(|node| node.rate).sum(), there.len() as f64);
    ReportEntry {
        total: manifest.report.total,
        makespan,
        work: nodes.iter().map(|node| node.busy).sum(),
        speedup: ratio(work, mean_rate * makespan),
        efficiency: ratio(work, possible),
        overbalance: overbalance(nodes.iter().filter(|node| node.at_end).filter_map(|node| node.finish)),
    }
}

/// The figures of each node, in the manifest's order.
pub fn figures(manifest: &Manifest) -> Vec<NodeFigures> {
    let mut all = vec![NodeFigures::default(); manifest.nodes.len()];
    let Some((start, end)) = span(manifest) else { return all };
    add_commits(&mut all, manifest, start);
    measure_rates(&mut all, &manifest.nodes);
    add_presence(&mut all, manifest, start, end);
    estimate_missing_rates(&mut all, &manifest.nodes);
    all
}

/// L = (max - min) / min of finish times; 0 where fewer than two are given.
pub fn overbalance(finish: impl Iterator<Item = f64>) -> f64 {
    let (min, max) = finish.fold((f64::INFINITY, 0.0), |(min, max), t| (t.min(min), t.max(max)));
    if min < max { ratio(max - min, min) } else { 0.0 }
}

/// Moment at which the first part was handed out.
pub(super) fn first_handed_out(manifest: &Manifest) -> Option<f64> {
    attempts(manifest).map(|(_, attempt)| attempt.start).min_by(f64::total_cmp)
}

/// From the first part handed out to the last commit.
fn span(manifest: &Manifest) -> Option<(f64, f64)> {
    let end = committed(manifest).filter_map(|(_, attempt)| attempt.end).max_by(f64::total_cmp)?;
    Some((first_handed_out(manifest)?, end))
}

fn add_commits(all: &mut [NodeFigures], manifest: &Manifest, start: f64) {
    let index = index_of_nodes(manifest);
    let uncosted = manifest.parts.iter().all(|part| part.predicted <= 0.0);
    for (part, attempt) in committed(manifest) {
        let Some(figures) = index.get(&attempt.node).and_then(|&i| all.get_mut(i)) else { continue };
        let finish = attempt.end.unwrap_or(start) - start;
        figures.parts += 1;
        figures.busy += attempt.seconds.unwrap_or(0.0);
        figures.work += if uncosted { area(part) } else { part.predicted };
        figures.finish = Some(figures.finish.map_or(finish, |earlier| earlier.max(finish)));
    }
}

fn measure_rates(all: &mut [NodeFigures], nodes: &[NodeEntry]) {
    let of_a_lane = |figures: &NodeFigures, node: &NodeEntry| ratio(figures.busy, f64::from(node.lanes));
    let mean = ratio(all.iter().zip(nodes).map(|(figures, node)| of_a_lane(figures, node)).sum(), all.len() as f64);
    for (figures, node) in all.iter_mut().zip(nodes).filter(|(figures, node)| of_a_lane(figures, node) >= FAIR_SHARE * mean) {
        figures.rate = ratio(figures.work, figures.busy) * f64::from(node.lanes);
    }
}

/// A node whose rate was not measured gets the rate that its probed power promises, by the same measure as the others'; or their mean.
fn estimate_missing_rates(all: &mut [NodeFigures], nodes: &[NodeEntry]) {
    let measured = |figures: &&NodeFigures| figures.rate > 0.0;
    let mean = ratio(all.iter().map(|figures| figures.rate).sum(), all.iter().filter(measured).count() as f64);
    let both = || all.iter().zip(nodes).filter(|(figures, node)| figures.rate > 0.0 && node.power > 0.0);
    let rate_per_power = ratio(both().map(|(figures, _)| figures.rate).sum(), both().map(|(_, node)| node.power).sum());
    for (figures, node) in all.iter_mut().zip(nodes).filter(|(figures, _)| figures.rate <= 0.0) {
        let promised = node.power * rate_per_power;
        figures.rate = if promised > 0.0 { promised } else { mean };
    }
}

/// For how long nodes were there between two moments, and whether at the end. A node whose joining is not among the events was there from the
/// start.
fn add_presence(all: &mut [NodeFigures], manifest: &Manifest, start: f64, end: f64) {
    let index = index_of_nodes(manifest);
    let mut turns = vec![Vec::new(); all.len()];
    for event in &manifest.events {
        let Some(&node) = event.node.as_ref().and_then(|node| index.get(node)) else { continue };
        match event.kind {
            EventKind::Joined | EventKind::Recovered => turns[node].push((event.time, true)),
            EventKind::Suspected | EventKind::Lost | EventKind::Refused => turns[node].push((event.time, false)),
            _ => {}
        }
    }
    for (figures, turns) in all.iter_mut().zip(turns) {
        (figures.present, figures.at_end) = presence(&turns, start, end);
    }
}

/// Seconds of presence between two moments and presence at the second, from the turns of a node in order of time: `(when, whether it came)`.
fn presence(turns: &[(f64, bool)], start: f64, end: f64) -> (f64, bool) {
    let mut there = turns.first().is_none_or(|&(_, came)| !came);
    let (mut since, mut seconds) = (start, 0.0);
    for &(time, came) in turns.iter().take_while(|(time, _)| *time < end) {
        let time = time.max(start);
        seconds += if there { time - since } else { 0.0 };
        (since, there) = (time, came);
    }
    (seconds + if there { end - since } else { 0.0 }, there)
}

fn index_of_nodes(manifest: &Manifest) -> BTreeMap<NodeId, usize> {
    manifest.nodes.iter().enumerate().map(|(i, node)| (node.id, i)).collect()
}

fn attempts(manifest: &Manifest) -> impl Iterator<Item = (&PartEntry, &AttemptEntry)> {
    manifest.parts.iter().flat_map(|part| part.attempts.iter().map(move |attempt| (part, attempt)))
}

fn committed(manifest: &Manifest) -> impl Iterator<Item = (&PartEntry, &AttemptEntry)> {
    attempts(manifest).filter(|(_, attempt)| attempt.outcome == AttemptOutcome::Committed)
}

fn area(part: &PartEntry) -> f64 {
    f64::from(part.rect[2]) * f64::from(part.rect[3])
}

/// A quotient, or 0 where there is nothing to divide by.
fn ratio(a: f64, b: f64) -> f64 {
    if b > 0.0 { a / b } else { 0.0 }
}
