//! Policies that are functions of the script.

use std::{collections::BTreeMap, time::Duration};

use tessera_engine::part::Rect;

use super::{bundle, small_job};
use crate::{
    job::Policies,
    schedule::{CostMap, NodeId, NodePower, Part, PartId, Plan},
};

const TIME: Duration = Duration::from_secs(10);

fn policies(changes: &str) -> Policies {
    Policies::new(&bundle(&small_job(changes)), &BTreeMap::new()).unwrap_or_else(|error| panic!("{error}"))
}

fn costs() -> CostMap {
    CostMap { cell: 8, columns: 2, rows: 2, seconds_per_pixel: vec![1.0, 2.0, 3.0, 4.0] }
}

fn parts(count: u32) -> Vec<Part> {
    let rect = |id| Rect { x: id, y: 0, width: 1, height: 12 };
    (0..count).map(|id| Part { id: PartId(id), rect: rect(id), cost: f64::from(count - id) }).collect()
}

fn nodes(count: u32) -> Vec<NodePower> {
    (0..count).map(|id| NodePower { id: NodeId(10 + id), name: format!("node-{id}"), lanes: 2, power: f64::from(count - id) }).collect()
}

fn assign(function: &str) -> Result<Plan, String> {
    policies(&format!("assign = {function}")).assign(&parts(5), &nodes(2), TIME)
}

fn split(function: &str) -> Result<Vec<Rect>, String> {
    policies(&format!("split = {function}")).split(16, 12, &costs(), &nodes(2), TIME)
}

#[test]
fn the_naive_function_deals_parts_in_turn() {
    let deal = "function(parts, nodes)
  local plan = {}
  for rank, part in ipairs(parts) do plan[part.id] = nodes[(rank - 1) % #nodes + 1].id end
  return plan
end";
    let expected: Plan = (0..5).map(|id| (PartId(id), NodeId(10 + id % 2))).collect();
    assert_eq!(assign(deal).unwrap(), expected);
    let mut policies = policies(&format!("assign = {deal}"));
    // A redistribution asks the same function about what is left.
    let left: Vec<Part> = parts(5).split_off(3);
    assert_eq!(policies.assign(&left, &nodes(2)[1..], TIME).unwrap(), [(PartId(3), NodeId(11)), (PartId(4), NodeId(11))].into());
}

#[test]
fn functions_see_costs_powers_and_names() {
    let plan = assign(
        "function(parts, nodes)
  local plan = {}
  assert(parts[1].cost == 5 and parts[1].x == 0 and parts[1].width == 1 and parts[1].height == 12)
  assert(nodes[1].name == 'node-0' and nodes[1].power == 2 and nodes[1].lanes == 2)
  for _, part in parts do plan[part.id] = part.cost > 3 and nodes[1].id or nodes[2].id end
  return plan
end",
    );
    assert_eq!(plan.unwrap().values().filter(|node| **node == NodeId(10)).count(), 2);
    let rects = split(
        "function(frame, costs, nodes)
  -- The left half costs 8 x 8 x 1 + 8 x 4 x 3, by hand.
  assert(costs.seconds { x = 0, y = 0, width = 8, height = 12 } == 160)
  local half = frame.width / #nodes
  return { { x = 0, y = 0, width = half, height = frame.height }, { x = half, y = 0, width = half, height = frame.height } }
end",
    );
    assert_eq!(rects.unwrap()[1], Rect { x: 8, y: 0, width: 8, height: 12 });
}

#[test]
fn what_is_wrong_with_an_answer_is_named() {
    let rects = |rects: &str| split(&format!("function(frame) return {rects} end")).unwrap_err();
    let plan = |plan: &str| assign(&format!("function(parts, nodes) {plan} end")).unwrap_err();
    let one = "{ x = 0, y = 0, width = 16, height = 6 }";
    let messages = [
        rects("5"),
        rects("{}"),
        rects("{ 7 }"),
        rects("{ { x = 0, y = 0, width = 16 } }"),
        rects("{ { x = 0, y = 0, width = 16, height = 0 } }"),
        rects("{ { x = 0.5, y = 0, width = 16, height = 12 } }"),
        rects("{ { x = 0, y = 0, width = 0 / 0, height = 12 } }"),
        rects(&format!("{{ {one} }}")),
        rects(&format!("{{ {one}, {{ x = 0, y = 5, width = 16, height = 7 }} }}")),
        rects(&format!("{{ {one}, {{ x = 0, y = 6, width = 17, height = 6 }} }}")),
        rects("frame.size.width"),
        plan(""),
        plan("return {}"),
        plan("local plan = {} for _, part in parts do plan[part.id] = 99 end return plan"),
        plan("local plan = {} for _, part in parts do plan[part.id] = nodes[1] end return plan"),
        plan("local plan = { [77] = 10 } for _, part in parts do plan[part.id] = 10 end return plan"),
        plan("local plan = { hard = 10 } for _, part in parts do plan[part.id] = 10 end return plan"),
        plan("return parts.all.of.them"),
        plan("error('no idea')"),
        plan("error({})"),
    ];
    insta::assert_snapshot!(messages.join("\n"));
}

#[test]
fn a_slow_function_is_ended_and_asked_again() {
    let mut policies = policies(
        "assign = function(parts)
  if #parts > 1 then while true do pcall(function() while true do end end) end end
  return { [parts[1].id] = 10 }
end",
    );
    let message = policies.assign(&parts(2), &nodes(1), Duration::from_millis(50)).unwrap_err();
    assert!(message.contains("job.lua:") && message.contains("ran longer than 0.05 s"), "{message}");
    assert_eq!(policies.assign(&parts(1), &nodes(1), TIME).unwrap().len(), 1);
}

#[test]
fn policies_can_move_to_a_thread_of_their_own() {
    fn is_send<T: Send>() {}
    is_send::<Policies>();
}
