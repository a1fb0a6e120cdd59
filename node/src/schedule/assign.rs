//! Who renders which part: the built-in policies, as pure functions of parts and nodes.
//!
//! `parts` come hardest first, `nodes` most powerful first (the paper's tables S_n and R_p); `backlog` is the cost of what a node has to do
//! already, 0 where it is not named. Every part gets a node as long as there is one.

use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::{cmp::Reverse, fmt};

use super::{NodeId, NodePower, Part, PartId, Plan};

/// Cost that waits at nodes already.
pub type Backlog = BTreeMap<NodeId, f64>;

/// Contiguous segments of parts in the order of their ids (their order on the film), sized by power alone: what an equal split does.
pub fn naive(parts: &[Part], nodes: &[NodePower]) -> Plan {
    let mut on_film: Vec<PartId> = parts.iter().map(|part| part.id).collect();
    on_film.sort_unstable();
    let total: f64 = nodes.iter().map(|node| node.power).sum();
    let (mut plan, mut power, mut from) = (Plan::new(), 0.0, 0);
    for (i, node) in nodes.iter().enumerate() {
        power += node.power;
        let to = if i + 1 == nodes.len() { on_film.len() } else { (on_film.len() as f64 * (power / total)).round() as usize };
        plan.extend(on_film[from..to.max(from)].iter().map(|part| (*part, node.id)));
        from = to.max(from);
    }
    plan
}

/// The hardest part to the most powerful node, statically (Vokorokos, Dankova, Adam 2010: tables S_n and R_p).
///
/// The paper gives each node one part. With more parts than nodes the same rule goes on: the hardest part that is left goes to the node
/// that is predicted to be free first, and to the most powerful of several. So the first parts fall one to a node by rank, as in the paper, and the
/// rest follow the predicted times (Graham's list scheduling by longest time, 1969, on machines of unequal speed).
pub fn paper(parts: &[Part], nodes: &[NodePower], backlog: &Backlog) -> Plan {
    let mut free: BinaryHeap<Reverse<(Seconds, usize)>> =
        (0..nodes.len()).map(|rank| Reverse((Seconds(backlog.get(&nodes[rank].id).unwrap_or(&0.0) / nodes[rank].power), rank))).collect();
    let mut plan = Plan::new();
    for part in parts {
        let Some(Reverse((at, rank))) = free.pop() else { break };
        plan.insert(part.id, nodes[rank].id);
        free.push(Reverse((Seconds(at.0 + part.cost / nodes[rank].power), rank)));
    }
    plan
}

/// Every part, hardest first, to the node that would finish it first; to the most powerful of several.
pub fn earliest_finish(parts: &[Part], nodes: &[NodePower], backlog: &Backlog) -> Plan {
    let mut loads: Vec<f64> = nodes.iter().map(|node| backlog.get(&node.id).copied().unwrap_or(0.0)).collect();
    let mut plan = Plan::new();
    for part in parts {
        let finish = |rank: usize| (loads[rank] + part.cost) / nodes[rank].power;
        let Some(rank) = (0..nodes.len()).min_by(|a, b| finish(*a).total_cmp(&finish(*b))) else { break };
        plan.insert(part.id, nodes[rank].id);
        loads[rank] += part.cost;
    }
    plan
}

/// Orders seconds totally.
#[derive(Clone, Copy, PartialEq)]
struct Seconds(f64);

impl Eq for Seconds {}

impl PartialOrd for Seconds {
    fn partial_cmp(&self, other: &Self) -> Option<std::cmp::Ordering> {
        Some(self.cmp(other))
    }
}

impl Ord for Seconds {
    fn cmp(&self, other: &Self) -> std::cmp::Ordering {
        self.0.total_cmp(&other.0)
    }
}

/// What is wrong with a plan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PlanError {
    /// A part has no node.
    Unassigned(PartId),
    /// The plan names a part that is not there.
    UnknownPart(PartId),
    /// The plan gives a part to a node that is not there.
    UnknownNode(PartId, NodeId),
}

impl fmt::Display for PlanError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Unassigned(part) => write!(f, "the plan gives part {} to no node; every part needs one", part.0),
            Self::UnknownPart(part) => write!(f, "the plan names part {}, which is not among the parts that were given", part.0),
            Self::UnknownNode(part, node) => {
                write!(f, "the plan gives part {} to node {}, which is not among the nodes that were given", part.0, node.0)
            }
        }
    }
}

impl std::error::Error for PlanError {}

/// Checks that a plan gives each of these parts, and no others, to one of these nodes.
///
/// # Errors
/// The first thing that is wrong.
pub fn validate(plan: &Plan, parts: &[Part], nodes: &[NodePower]) -> Result<(), PlanError> {
    if let Some(part) = parts.iter().find(|part| !plan.contains_key(&part.id)) {
        return Err(PlanError::Unassigned(part.id));
    }
    let parts: BTreeSet<PartId> = parts.iter().map(|part| part.id).collect();
    let nodes: BTreeSet<NodeId> = nodes.iter().map(|node| node.id).collect();
    plan.iter().try_for_each(|(part, node)| match (parts.contains(part), nodes.contains(node)) {
        (false, _) => Err(PlanError::UnknownPart(*part)),
        (_, false) => Err(PlanError::UnknownNode(*part, *node)),
        _ => Ok(()),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use tessera_engine::part::Rect;

    fn parts(costs: &[f64]) -> Vec<Part> {
        let rect = Rect { x: 0, y: 0, width: 1, height: 1 };
        let mut parts: Vec<Part> = (0..).zip(costs).map(|(id, cost)| Part { id: PartId(id), rect, cost: *cost }).collect();
        parts.sort_by(|a, b| b.cost.total_cmp(&a.cost));
        parts
    }

    fn nodes(powers: &[f64]) -> Vec<NodePower> {
        (0..).zip(powers).map(|(id, power)| NodePower { id: NodeId(id), name: format!("n{id}"), lanes: 1, power: *power }).collect()
    }

    fn makespan(plan: &Plan, parts: &[Part], nodes: &[NodePower]) -> f64 {
        let load = |id| parts.iter().filter(|part| plan[&part.id] == id).map(|part| part.cost).sum::<f64>();
        nodes.iter().map(|node| load(node.id) / node.power).fold(0.0, f64::max)
    }

    #[test]
    fn naive_cuts_the_film_by_power() {
        let plan = naive(&parts(&[9.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0, 1.0]), &nodes(&[2.0, 1.0, 1.0]));
        assert_eq!(plan.values().map(|node| node.0).collect::<Vec<_>>(), [0, 0, 0, 0, 1, 1, 2, 2]);
    }

    #[test]
    fn paper_matches_ranks_when_there_is_one_part_a_node() {
        let plan = paper(&parts(&[1.0, 7.0, 3.0]), &nodes(&[8.0, 1.0, 0.5]), &Backlog::new());
        assert_eq!(plan.values().map(|node| node.0).collect::<Vec<_>>(), [2, 0, 1]);
    }

    #[test]
    fn earliest_finish_is_near_the_optimum_found_by_trying_all_plans() {
        let (parts, nodes) = (parts(&[5.0, 4.0, 3.5, 3.0, 2.0, 1.5, 1.0, 0.5]), nodes(&[3.0, 1.5, 1.0]));
        let best = (0..3usize.pow(8))
            .map(|code| {
                let plan = parts.iter().map(|part| (part.id, nodes[code / 3usize.pow(part.id.0) % 3].id)).collect();
                makespan(&plan, &parts, &nodes)
            })
            .fold(f64::INFINITY, f64::min);
        let found = makespan(&earliest_finish(&parts, &nodes, &Backlog::new()), &parts, &nodes);
        assert!(found >= best && found <= 1.58 * best, "{found} against {best}"); // LPT's bound on unequal machines (Friesen 1987)
        assert!(found <= makespan(&naive(&parts, &nodes), &parts, &nodes));
    }

    #[test]
    fn what_waits_already_counts() {
        let busy = Backlog::from([(NodeId(0), 100.0)]);
        for policy in [paper, earliest_finish] {
            assert!(policy(&parts(&[1.0, 2.0]), &nodes(&[4.0, 1.0]), &busy).values().all(|node| *node == NodeId(1)));
        }
    }

    #[test]
    fn every_policy_gives_every_part_to_a_node() {
        for (count, powers) in [(1, &[1.0, 2.0][..]), (7, &[1.0]), (100, &[0.1, 5.0, 2.5])] {
            let mut nodes = nodes(powers);
            super::super::evaluate::rank(&mut nodes);
            let parts = parts(&(0..count).map(|i| f64::from(i * 7 % 13)).collect::<Vec<_>>());
            for plan in [naive(&parts, &nodes), paper(&parts, &nodes, &Backlog::new()), earliest_finish(&parts, &nodes, &Backlog::new())] {
                validate(&plan, &parts, &nodes).unwrap();
            }
        }
        assert!(naive(&parts(&[1.0]), &[]).is_empty());
    }

    #[test]
    fn a_wrong_plan_is_named() {
        let (parts, nodes) = (parts(&[1.0, 1.0]), nodes(&[1.0]));
        let plan = |entries: &[(u32, u32)]| entries.iter().map(|(part, node)| (PartId(*part), NodeId(*node))).collect::<Plan>();
        assert_eq!(validate(&plan(&[(0, 0)]), &parts, &nodes), Err(PlanError::Unassigned(PartId(1))));
        assert_eq!(validate(&plan(&[(0, 0), (1, 4)]), &parts, &nodes), Err(PlanError::UnknownNode(PartId(1), NodeId(4))));
        assert_eq!(validate(&plan(&[(0, 0), (1, 0), (2, 0)]), &parts, &nodes), Err(PlanError::UnknownPart(PartId(2))));
    }
}
