//! What a job's manifest will tell besides its parts.

use std::time::Duration;

use serde::{Deserialize, Serialize};

use crate::limits::EVENTS_PER_JOB;
use crate::manifest::{EventEntry, EventKind};
use crate::schedule::{NodeId, PartId};

/// A job's own time line.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub(super) struct Log {
    pub submitted: Duration,
    pub ended: Option<Duration>,
    pub first_lease: Option<Duration>,
    pub last_commit: Option<Duration>,
    pub probe_seconds: f64,
    pub events: Vec<EventEntry>,
    pub warnings: Vec<String>,
}

impl Log {
    /// Seconds since the job's submission.
    pub fn at(&self, now: Duration) -> f64 {
        now.saturating_sub(self.submitted).as_secs_f64()
    }

    /// Adds an event, as long as the list may grow.
    pub fn event(&mut self, now: Duration, kind: EventKind, node: Option<NodeId>, parts: Vec<PartId>, detail: impl Into<String>) {
        if self.events.len() < EVENTS_PER_JOB {
            self.events.push(EventEntry { time: self.at(now), kind, node, parts, detail: detail.into() });
        }
    }

    /// Adds a warning, each text once.
    pub fn warn(&mut self, warning: String) {
        if self.warnings.len() < EVENTS_PER_JOB && !self.warnings.contains(&warning) {
            self.warnings.push(warning);
        }
    }
}
