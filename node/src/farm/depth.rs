//! How many parts a node gets in advance: enough for its lanes not to wait for the network.
//!
//! From the moment at which a lane can have begun a part to the moment at which the part comes in, the lane renders, and waits. Over many parts the moments
//! of arrival cancel out, whatever the network's delays, and what is left is the time for which lanes waited. While that is too much, the node gets
//! more in advance.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::limits::{DEEPEST_PREFETCH, LEAST_WAITING, MOST_WAITING, WAITING_SHARE};

/// What a node's lanes did since its depth was last considered.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Depth {
    /// Attempts for each lane beyond those that every node gets in advance.
    pub extra: usize,
    parts: usize,
    /// Seconds for which lanes waited, and for which they rendered.
    waited: f64,
    rendered: f64,
}

impl Depth {
    /// A part came in: its lane was free for it so long, and rendered for so many seconds. The node may hold `capacity` attempts.
    pub fn note(&mut self, free: Duration, rendered: f64, capacity: usize) {
        if !(0.0..1e6).contains(&rendered) {
            return;
        }
        self.parts += 1;
        self.waited += (free.as_secs_f64() - rendered).min(MOST_WAITING.as_secs_f64());
        self.rendered += rendered;
        // What was in the node's hands before the last change says nothing of it.
        if self.parts <= capacity {
            return;
        }
        let too_much = self.waited > self.rendered * WAITING_SHARE && self.waited > LEAST_WAITING.as_secs_f64() * self.parts as f64;
        let extra = if too_much { (2 * self.extra + 1).min(DEEPEST_PREFETCH) } else { self.extra };
        *self = Self { extra, ..Self::default() };
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A lane that renders for 100 ms, behind a network whose turn around takes `away` for each part that it does not hold already.
    fn depth_behind(away: f64) -> usize {
        let mut depth = Depth::default();
        for _ in 0..200 {
            let held = 2 + depth.extra;
            // A lane that holds n parts gets n of them through in a turn, or as many as it can render.
            let turn = (away + 0.1).max(0.1 * held as f64);
            depth.note(Duration::from_secs_f64(turn / held as f64), 0.1, held);
        }
        depth.extra
    }

    #[test]
    fn a_node_far_away_gets_more_in_advance_and_a_near_one_does_not() {
        assert_eq!((depth_behind(0.0), depth_behind(0.05), depth_behind(0.09)), (0, 0, 0));
        assert_eq!((depth_behind(0.2), depth_behind(0.4)), (1, 3));
        assert_eq!(depth_behind(60.0), DEEPEST_PREFETCH);
    }

    /// Parts that come in late by turns do not make lanes wait.
    #[test]
    fn jitter_that_lanes_do_not_notice_changes_nothing() {
        let mut depth = Depth::default();
        for turn in 0..1000u32 {
            let free = if turn % 2 == 0 { 190 } else { 10 };
            depth.note(Duration::from_millis(free), 0.1, 3);
        }
        assert_eq!(depth.extra, 0);
    }

    #[test]
    fn one_long_pause_does_not_look_like_a_network_for_ever() {
        let mut depth = Depth::default();
        depth.note(Duration::from_secs(1000), 0.1, 2);
        (0..1000).for_each(|_| depth.note(Duration::from_millis(100), 0.1, 2));
        assert_eq!(depth.extra, 1);
    }
}
