//! What a plan promises: when each node would be done, if costs and powers were exact.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
};

use super::{NodeId, NodePower, Part, PartId, Plan};

/// Predicted moments of the last part of each node, in seconds from the first one handed out; 0 for nodes without parts. A node renders its parts
/// hardest first, each on the first of its lanes that is free, with an equal share of its power. Nothing is taken from one node by another.
pub fn finish_times(plan: &Plan, parts: &[Part], nodes: &[NodePower]) -> BTreeMap<NodeId, f64> {
    let costs: BTreeMap<PartId, f64> = parts.iter().map(|part| (part.id, part.cost)).collect();
    let mut of_node: BTreeMap<NodeId, Vec<f64>> = BTreeMap::new();
    for (part, node) in plan {
        of_node.entry(*node).or_default().extend(costs.get(part));
    }
    nodes.iter().map(|node| (node.id, of_node.remove(&node.id).map_or(0.0, |costs| finish_time(costs, node)))).collect()
}

fn finish_time(mut costs: Vec<f64>, node: &NodePower) -> f64 {
    costs.sort_by(|a, b| b.total_cmp(a));
    let lane_power = node.power / f64::from(node.lanes.max(1));
    // Seconds that are not negative are ordered as their bits are.
    let mut free: BinaryHeap<Reverse<u64>> = (0..node.lanes.max(1)).map(|_| Reverse(0)).collect();
    let mut last: f64 = 0.0;
    for cost in costs {
        let Some(Reverse(start)) = free.pop() else { break };
        let end = f64::from_bits(start) + (cost / lane_power).max(0.0);
        last = last.max(end);
        free.push(Reverse(end.to_bits()));
    }
    last
}

#[cfg(test)]
mod tests {
    use tessera_engine::part::Rect;

    use super::*;

    #[test]
    fn lanes_take_parts_hardest_first() {
        let rect = Rect { x: 0, y: 0, width: 1, height: 1 };
        let parts: Vec<_> =
            [3.0, 1.0, 2.0, 2.0, 8.0].iter().zip(0..).map(|(cost, id)| Part { id: PartId(id), rect, cost: *cost }).collect();
        let node = |id, lanes, power| NodePower { id: NodeId(id), name: String::new(), lanes, power };
        let nodes = [node(0, 2, 2.0), node(1, 1, 4.0), node(2, 4, 4.0)];
        let plan = (0..5).map(|id| (PartId(id), NodeId(u32::from(id == 4)))).collect();
        // Two lanes of power 1: 3 and 2, then 2 follows 2, and 1 follows 3. One lane of power 4: 8 takes 2.
        let found = finish_times(&plan, &parts, &nodes);
        assert_eq!(found, [(NodeId(0), 4.0), (NodeId(1), 2.0), (NodeId(2), 0.0)].into());
    }
}
