//! The evaluation module of the paper: from measured cells to costs (its table S_n) and powers (its table R_p).
//!
//! The unit of power is *one lane of the median node*. A node whose lanes are `s` times as fast as that node's has power `lanes x s`, and cost is
//! what one such lane takes in seconds.

use std::collections::BTreeMap;

use super::{CostMap, NodeId, NodePower, Part, PartId, probe::Cells};

/// What one lane of each node was measured to take in cells: `(cell, seconds per sample of one pixel)`.
pub type Measured = BTreeMap<NodeId, Vec<(u32, f64)>>;

/// Shortest credible time for one sample of a pixel; what is below is the clock's doing.
const FLOOR_SECONDS: f64 = 1e-8;

/// Rounds in which costs and speeds are made to agree; medians settle within two or three.
const ROUNDS: usize = 4;

/// What the probe says.
#[derive(Clone, Debug, PartialEq)]
pub struct Evaluation {
    /// Cost over the frame.
    pub costs: CostMap,
    /// Speed of one lane of each measured node, relative to the median node.
    pub speeds: BTreeMap<NodeId, f64>,
}

/// Fits `seconds[node][cell] = cost[cell] / speed[node]` by medians over nodes and cells in turn, so that neither a disturbed cell nor a disturbed
/// node pulls the others along. Cells that nobody measured count as the median cell.
pub fn evaluate(cells: &Cells, samples: u64, measured: &Measured) -> Evaluation {
    let mut speeds: BTreeMap<NodeId, f64> = measured.iter().filter(|(_, cells)| !cells.is_empty()).map(|(node, _)| (*node, 1.0)).collect();
    for _ in 0..ROUNDS {
        let common = cell_costs(cells, measured, &speeds, 2); // a cell that one node alone measured tells nothing of its speed
        for (node, speed) in &mut speeds {
            *speed = speed_against(&measured[node], &common).unwrap_or(1.0);
        }
        let middle = median(speeds.values().map(|speed| (*speed, 1.0)).collect()).unwrap_or(1.0);
        speeds.values_mut().for_each(|speed| *speed /= middle);
    }
    let costs = cell_costs(cells, measured, &speeds, 1);
    let typical = median(costs.iter().flatten().map(|cost| (*cost, 1.0)).collect()).unwrap_or(FLOOR_SECONDS);
    let seconds_per_pixel = costs.iter().map(|cost| cost.unwrap_or(typical) * samples as f64).collect();
    Evaluation { costs: CostMap { cell: cells.cell, columns: cells.columns, rows: cells.rows, seconds_per_pixel }, speeds }
}

/// Speed of a node that came later, from the cells that it measured; `None` if it measured none.
pub fn calibrate(measured: &[(u32, f64)], costs: &CostMap, samples: u64) -> Option<f64> {
    let costs: Vec<Option<f64>> = costs.seconds_per_pixel.iter().map(|cost| Some(cost / samples.max(1) as f64)).collect();
    speed_against(measured, &costs)
}

/// Speed of a lane of a node, by the powers of an earlier manifest: of its name, or of the mean node there.
pub fn speed_by_name(powers: &BTreeMap<String, f64>, name: &str, lanes: u32) -> f64 {
    let credible = |power: &&f64| power.is_finite() && **power > 0.0;
    let known: Vec<f64> = powers.values().filter(credible).copied().collect();
    let mean = if known.is_empty() { f64::from(lanes.max(1)) } else { known.iter().sum::<f64>() / known.len() as f64 };
    powers.get(name).filter(credible).copied().unwrap_or(mean) / f64::from(lanes.max(1))
}

/// A cost map that says the same of every pixel: 1 second for the whole frame. Only ratios count for it.
pub fn uniform(width: u32, height: u32) -> CostMap {
    let pixels = f64::from(width) * f64::from(height);
    CostMap { cell: width.max(height), columns: 1, rows: 1, seconds_per_pixel: vec![1.0 / pixels.max(1.0)] }
}

/// The paper's table S_n: parts, hardest first; equal ones in order of their ids.
pub fn difficulty(parts: &[Part]) -> Vec<PartId> {
    let mut order: Vec<&Part> = parts.iter().collect();
    order.sort_by(|a, b| b.cost.total_cmp(&a.cost).then(a.id.cmp(&b.id)));
    order.iter().map(|part| part.id).collect()
}

/// Puts nodes in the order of the paper's table R_p: most powerful first; equal ones in order of their ids.
pub fn rank(nodes: &mut [NodePower]) {
    nodes.sort_by(|a, b| b.power.total_cmp(&a.power).then(a.id.cmp(&b.id)));
}

/// Cost of every cell that at least so many nodes measured.
fn cell_costs(cells: &Cells, measured: &Measured, speeds: &BTreeMap<NodeId, f64>, witnesses: usize) -> Vec<Option<f64>> {
    let mut seen = vec![Vec::new(); cells.count() as usize];
    for (node, speed) in speeds {
        for (cell, seconds) in measured[node].iter().filter(|(cell, _)| *cell < cells.count()) {
            seen[*cell as usize].push((credible(*seconds) * speed, 1.0));
        }
    }
    seen.into_iter().map(|seen| if seen.len() < witnesses { None } else { median(seen) }).collect()
}

/// Weighted by cost: long measurements are the exact ones.
fn speed_against(measured: &[(u32, f64)], costs: &[Option<f64>]) -> Option<f64> {
    let known = |cell: u32| costs.get(cell as usize).copied().flatten();
    median(measured.iter().filter_map(|(cell, seconds)| known(*cell).map(|cost| (cost / credible(*seconds), cost))).collect())
}

fn credible(seconds: f64) -> f64 {
    if seconds.is_finite() { seconds.max(FLOOR_SECONDS) } else { FLOOR_SECONDS }
}

/// Weighted median of `(value, weight)`; between two values their mean.
fn median(mut values: Vec<(f64, f64)>) -> Option<f64> {
    values.sort_by(|a, b| a.0.total_cmp(&b.0));
    let half = values.iter().map(|(_, weight)| weight).sum::<f64>() / 2.0;
    let mut below = 0.0;
    for (i, (value, weight)) in values.iter().enumerate() {
        below += weight;
        if below == half && i + 1 < values.len() {
            return Some((value + values[i + 1].0) / 2.0);
        }
        if below >= half {
            return Some(*value);
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::schedule::probe;

    fn truth(cell: u32) -> f64 {
        1e-6 * f64::from(1 + cell % 7 * (cell % 11))
    }

    fn measure(shares: &probe::Shares, speed: impl Fn(NodeId) -> f64) -> Measured {
        shares.iter().map(|(node, share)| (*node, share.iter().map(|cell| (*cell, truth(*cell) / speed(*node))).collect())).collect()
    }

    #[test]
    fn a_shared_probe_finds_speeds_and_costs_despite_disturbances() {
        let cells = probe::cells(1024, 768, 1.0 / 16.0);
        let nodes: Vec<(NodeId, u32)> = (0..5).map(|n| (NodeId(n), 1 + n)).collect();
        let speed = |node: NodeId| [0.5, 0.8, 1.0, 2.0, 4.0][node.0 as usize];
        let mut measured = measure(&probe::shared(&cells, &nodes), speed);
        measured.get_mut(&NodeId(3)).unwrap()[40].1 *= 1000.0; // interrupted
        measured.get_mut(&NodeId(4)).unwrap()[2].1 = 0.0; // finer than the clock
        let found = evaluate(&cells, 9, &measured);
        for (node, found) in &found.speeds {
            assert!((found / speed(*node) - 1.0).abs() < 1e-9, "{node:?}: {found}");
        }
        let exact =
            (0..cells.count()).filter(|cell| (found.costs.seconds_per_pixel[*cell as usize] / (9.0 * truth(*cell)) - 1.0).abs() < 1e-9);
        assert!(exact.count() >= cells.count() as usize - 2);
    }

    #[test]
    fn a_late_node_is_measured_by_the_patch_alone() {
        let cells = probe::cells(640, 480, 1.0 / 8.0);
        let shares = probe::every_node(&cells, &[(NodeId(0), 2), (NodeId(1), 1)]);
        let found = evaluate(&cells, 4, &measure(&shares, |_| 1.0));
        let patch: Vec<(u32, f64)> = cells.patch().iter().map(|cell| (*cell, truth(*cell) / 3.0)).collect();
        assert!((calibrate(&patch, &found.costs, 4).unwrap() - 3.0).abs() < 1e-9);
        assert_eq!(calibrate(&[], &found.costs, 4), None);
    }

    #[test]
    fn nothing_measured_still_gives_costs() {
        let cells = probe::cells(64, 64, 0.25);
        let found = evaluate(&cells, 1, &Measured::new());
        assert!(found.speeds.is_empty() && found.costs.seconds_per_pixel.iter().all(|cost| *cost > 0.0));
        let bad = Measured::from([(NodeId(1), vec![(u32::MAX, 1.0), (0, f64::NAN), (1, -1.0)])]);
        assert!(evaluate(&cells, 1, &bad).costs.seconds_per_pixel.iter().all(|cost| *cost > 0.0 && cost.is_finite()));
    }
}
