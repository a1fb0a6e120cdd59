//! The coordinator's clock, and what it makes of times at which it was away.

use std::time::Duration;

use super::World;
use crate::farm::Event;
use crate::limits::{LATE_TICK, WAKE_INTERVAL};

impl World {
    /// What the coordinator's clock shows.
    pub(super) fn clock(&self) -> Duration {
        shifted(self.now, self.ahead)
    }

    /// The clock jumps forward.
    pub(super) fn jump(&mut self, length: Duration) {
        self.awake.get_or_insert(shifted(self.now, self.ahead) + WAKE_INTERVAL);
        self.ahead += length.as_nanos() as i64;
    }

    /// The process stands still.
    pub(super) fn stall(&mut self, length: Duration) {
        self.awake.get_or_insert(shifted(self.now, self.ahead) + WAKE_INTERVAL);
        self.stalled = self.stalled.max(self.now + length);
    }

    pub(super) fn tick(&mut self) {
        self.wake();
        if self.farm.next_deadline().is_some_and(|deadline| deadline <= self.clock()) {
            self.step(Event::Tick);
        }
    }

    /// If it is long past the time at which the coordinator was to wake up, it was away, or its clock jumped: that time does not count, and nodes have time
    /// to be heard, as with the real one.
    pub(super) fn wake(&mut self) {
        let awake = self.awake.take().unwrap_or(Duration::MAX);
        let Some(late) = self.farm.next_deadline().and_then(|deadline| self.clock().checked_sub(deadline.min(awake))) else { return };
        if late <= LATE_TICK {
            return;
        }
        self.ahead -= late.min(self.clock().saturating_sub(self.farm.now())).as_nanos() as i64;
        for node in 0..self.nodes.len() {
            if self.nodes[node].alive {
                let (node, incarnation) = (self.nodes[node].id, self.nodes[node].incarnation());
                self.step(Event::NodeHeard { node, incarnation });
            }
        }
    }
}

/// A moment, shifted by so many nanoseconds.
pub(super) fn shifted(at: Duration, nanoseconds: i64) -> Duration {
    let by = Duration::from_nanos(nanoseconds.unsigned_abs());
    if nanoseconds < 0 { at.saturating_sub(by) } else { at + by }
}
