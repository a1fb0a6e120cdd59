//! A shorter journal from which the farm goes on as from the long one.

use std::time::Duration;

use crate::farm::{Event, Farm, FarmConfig, NodeInfo, NodeSnapshot, NodeState};

/// A farm that knows the nodes of this one and none of its jobs, and the events that make it: a replay of them reaches its state because they made it.
/// What commands they put out was carried out long ago. `None` while a job waits or runs, for events of those cannot be left out (they gave attempts
/// their names), or while a node is in between.
pub fn renewed(farm: &Farm, config: FarmConfig) -> Option<(Farm, Vec<(Duration, Event)>)> {
    if farm.jobs().iter().any(|job| job.outcome.is_none()) {
        return None;
    }
    let lives: Vec<Vec<Event>> = farm.nodes().into_iter().map(life).collect::<Option<_>>()?;
    let events: Vec<(Duration, Event)> = lives.into_iter().flatten().map(|event| (farm.now(), event)).collect();
    let mut renewed = Farm::new(config);
    events.iter().for_each(|(at, event)| drop(renewed.step(*at, event.clone())));
    Some((renewed, events))
}

/// What a node did to stand where it stands, if that can be told in short.
fn life(node: NodeSnapshot) -> Option<Vec<Event>> {
    let NodeSnapshot { id, incarnation, name, lanes, build, address, state, reason, .. } = node;
    let verdict = match state {
        NodeState::Ready | NodeState::Lost => Ok(()),
        NodeState::Refused => Err(reason.clone()),
        _ => return None,
    };
    let info = NodeInfo { name, lanes, build, address };
    let mut events = vec![Event::NodeJoined { node: id, incarnation, info }, Event::NodeProved { node: id, incarnation, verdict }];
    if state == NodeState::Lost {
        events.push(Event::NodeLeft { node: id, incarnation, reason });
    }
    Some(events)
}
