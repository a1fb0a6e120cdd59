//! Logs that a peer can cause must not drown those that matter.

use std::{
    sync::{Mutex, PoisonError},
    time::{Duration, Instant},
};

/// Lets through so many entries within an interval, and counts the rest.
pub struct Throttle {
    entries: u32,
    interval: Duration,
    state: Mutex<State>,
}

struct State {
    since: Instant,
    passed: u32,
    dropped: u64,
}

impl Throttle {
    /// Lets `entries` through within each `interval`.
    pub fn new(entries: u32, interval: Duration) -> Self {
        Self { entries, interval, state: Mutex::new(State { since: Instant::now(), passed: 0, dropped: 0 }) }
    }

    /// Whether an entry of this moment passes; then with the number of those that did not since the last that did.
    pub fn pass(&self, now: Instant) -> Option<u64> {
        let mut state = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        if now.saturating_duration_since(state.since) >= self.interval {
            (state.since, state.passed) = (now, 0);
        }
        if state.passed >= self.entries {
            state.dropped += 1;
            return None;
        }
        state.passed += 1;
        Some(std::mem::take(&mut state.dropped))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_counted_and_the_next_interval_tells_of_it() {
        let throttle = Throttle::new(2, Duration::from_secs(10));
        let now = Instant::now();
        let passed: Vec<_> = (0..5).map(|_| throttle.pass(now)).collect();
        assert_eq!(passed, [Some(0), Some(0), None, None, None]);
        assert_eq!(throttle.pass(now + Duration::from_secs(11)), Some(3));
        assert_eq!(throttle.pass(now + Duration::from_secs(11)), Some(0));
    }
}
