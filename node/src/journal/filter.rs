//! Which events a journal has to hold so that a replay reaches the same state.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::farm::{Event, Farm, Incarnation};
use crate::schedule::NodeId;

/// Leaves out what changes nothing: ticks before a deadline, and all signs of life but the last before a deadline strikes.
#[derive(Clone, Debug, Default)]
pub struct Filter {
    /// By life, for one that is over may still be heard, and changes nothing.
    heard: BTreeMap<(NodeId, Incarnation), Duration>,
}

impl Filter {
    /// The entries to append before `farm` takes this event.
    pub fn admit(&mut self, farm: &Farm, now: Duration, event: &Event) -> Vec<(Duration, Event)> {
        match event {
            Event::NodeHeard { node, incarnation } if !farm.is_suspected(*node) => {
                self.heard.insert((*node, *incarnation), now);
                Vec::new()
            }
            Event::Tick if farm.next_deadline().is_none_or(|deadline| deadline > now) => Vec::new(),
            Event::Tick => {
                let mut entries = self.flush();
                entries.push((now, Event::Tick));
                entries
            }
            _ => vec![(now, event.clone())],
        }
    }

    /// The signs of life that were left out, in order of time.
    pub fn flush(&mut self) -> Vec<(Duration, Event)> {
        let heard = std::mem::take(&mut self.heard);
        let entry = |((node, incarnation), at)| (at, Event::NodeHeard { node, incarnation });
        let mut entries: Vec<(Duration, Event)> = heard.into_iter().map(entry).collect();
        entries.sort_by_key(|(at, _)| *at);
        entries
    }
}
