//! What came of a simulation.

use std::collections::BTreeMap;
use std::time::Duration;

use crate::farm::{JobId, JobRecord, Outcome};
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::NodeId;

/// What came of a simulation.
#[derive(Clone, Debug)]
pub struct Run {
    /// How the job ended; `None` if it had not at the horizon.
    pub outcome: Option<Outcome>,
    /// How other jobs ended.
    pub others: BTreeMap<JobId, Outcome>,
    /// What the farm tells of it.
    pub record: JobRecord,
    /// Promises that were broken. Empty, or there is a bug.
    pub violations: Vec<String>,
    /// Hash of all events, commands and their times.
    pub trace: [u8; 32],
    /// Steps of the farm.
    pub steps: u64,
    /// From each silent death to the moment at which the farm acted on it.
    pub detections: Vec<Duration>,
    /// Parts that were rendered, committed or not.
    pub rendered: u64,
    /// True speed of all lanes of each machine that was there all the time.
    pub powers: BTreeMap<NodeId, f64>,
}

impl Run {
    /// Seconds from the first part handed out to the last commit.
    pub fn makespan(&self) -> f64 {
        self.record.last_commit.unwrap_or(f64::NAN) - self.record.first_lease.unwrap_or(f64::NAN)
    }

    /// Speedup S over one machine of mean power, efficiency E, and overbalance L = (max - min) / min of finish times; `work` in seconds on a lane of
    /// speed 1.
    pub fn figures(&self, work: f64) -> (f64, f64, f64) {
        let start = self.record.first_lease.unwrap_or(0.0);
        let finishes: Vec<f64> = self.record.nodes.iter().filter(|node| node.parts > 0).map(|node| node.finish - start).collect();
        let (min, max) = finishes.iter().fold((f64::INFINITY, 0.0f64), |(min, max), t| (min.min(*t), max.max(*t)));
        let power: f64 = self.powers.values().sum();
        let efficiency = work / (power * self.makespan());
        (efficiency * self.powers.len() as f64, efficiency, (max - min) / min)
    }

    /// How often something happened.
    pub fn count(&self, kind: EventKind) -> usize {
        self.record.events.iter().filter(|event| event.kind == kind).count()
    }

    /// Attempts that ended so.
    pub fn attempts(&self, outcome: AttemptOutcome) -> usize {
        self.record.parts.iter().flat_map(|part| &part.attempts).filter(|attempt| attempt.outcome == outcome).count()
    }
}
