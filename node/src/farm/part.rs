//! Parts while they are rendered: where each is, and who tried it.

use std::time::Duration;

use serde::{Deserialize, Serialize};
use tessera_engine::part::Rect;

use super::{Incarnation, LeaseId, log::Log};
use crate::limits::ATTEMPTS_LISTED_PER_PART;
use crate::manifest::{AttemptEntry, AttemptOutcome, PartEntry};
use crate::schedule::{NodeId, Part, PartId};

/// Where a part is. It is in one place only. It leaves [`Place::Committed`] only when its pixels are revoked or lost.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Place {
    /// With no node: it waits for a policy or for a node.
    Loose,
    /// In the queue of a node.
    Queued(NodeId),
    /// Handed out; further attempts of nodes that were suspected or called back may still run.
    Leased(LeaseId),
    /// Its pixels are here, and on their way to the disk.
    Committing(LeaseId),
    /// Its pixels are on disk.
    Committed(LeaseId),
    /// Smaller parts took its place.
    Replaced,
    /// Nobody can render it: the picture has a hole there.
    Hole,
}

/// What an attempt is for.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub(super) enum Role {
    /// It is the one that its part's place names.
    Main,
    /// It races with that one.
    Spare,
    /// Its part is delivered; its pixels are compared with those.
    Audit,
    /// It does not count any more, but may still end well.
    Stray,
}

/// A part of a running job.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct PartState {
    pub id: PartId,
    pub rect: Rect,
    pub cost: f64,
    /// Cost by what is known now: more than was predicted, if an attempt took longer.
    pub expected: f64,
    pub place: Place,
    pub planned: Option<NodeId>,
    /// Nodes that delivered it, with the hashes of their pixels: first the one whose pixels are taken, then those that were asked to compare.
    pub votes: Vec<(NodeId, [u8; 32])>,
    /// Invalid samples of the pixels that are taken, as their node says.
    pub invalid_samples: u64,
    /// Nodes that said they could not, or died of it, with reasons.
    pub failures: Vec<(NodeId, String)>,
    /// Whether it was cut from a part that nobody could render.
    pub suspect: bool,
    /// The parts that took its place.
    pub replaced_by: Vec<PartId>,
    pub attempts: Vec<Attempt>,
}

/// A try at a part, for the record.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Attempt {
    pub lease: LeaseId,
    pub node: NodeId,
    pub start: Duration,
    pub end: Option<Duration>,
    pub seconds: Option<f64>,
    pub outcome: AttemptOutcome,
    pub reason: Option<String>,
}

/// An attempt that may still end well.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(super) struct Lease {
    pub part: PartId,
    pub node: NodeId,
    pub incarnation: Incarnation,
    pub role: Role,
    /// When a lane can have begun it, by what the farm knows.
    pub begun: Option<Duration>,
    /// When it will have taken suspiciously long.
    pub due: Option<Duration>,
}

impl PartState {
    pub fn new(id: PartId, rect: Rect, cost: f64) -> Self {
        Self {
            id,
            rect,
            cost,
            expected: cost,
            place: Place::Loose,
            planned: None,
            votes: Vec::new(),
            invalid_samples: 0,
            failures: Vec::new(),
            suspect: false,
            replaced_by: Vec::new(),
            attempts: Vec::new(),
        }
    }

    /// The part as policies see it.
    pub fn describe(&self) -> Part {
        Part { id: self.id, rect: self.rect, cost: self.expected }
    }

    /// The attempt whose pixels are on disk.
    pub fn committed_by(&self) -> Option<LeaseId> {
        if let Place::Committed(lease) = self.place { Some(lease) } else { None }
    }

    /// Whether its pixels are here.
    pub fn is_delivered(&self) -> bool {
        matches!(self.place, Place::Committing(_) | Place::Committed(_))
    }

    /// Whether nothing is left to do for it, but perhaps to compare.
    pub fn is_settled(&self) -> bool {
        matches!(self.place, Place::Committed(_) | Place::Replaced | Place::Hole)
    }

    pub fn voted(&self, node: NodeId) -> bool {
        self.votes.iter().any(|(voter, _)| *voter == node)
    }

    pub fn failed_on(&self, node: NodeId) -> bool {
        self.failures.iter().any(|(failed, _)| *failed == node)
    }

    pub fn begin_attempt(&mut self, lease: LeaseId, node: NodeId, now: Duration) {
        if self.attempts.len() == ATTEMPTS_LISTED_PER_PART {
            self.attempts.remove(0);
        }
        self.attempts.push(Attempt { lease, node, start: now, end: None, seconds: None, outcome: AttemptOutcome::Running, reason: None });
    }

    pub fn attempt_mut(&mut self, lease: LeaseId) -> Option<&mut Attempt> {
        self.attempts.iter_mut().rev().find(|attempt| attempt.lease == lease)
    }

    /// Notes how an attempt ended, once.
    pub fn end_attempt(&mut self, lease: LeaseId, now: Duration, outcome: AttemptOutcome, reason: &str) {
        if let Some(attempt) = self.attempt_mut(lease).filter(|attempt| attempt.end.is_none()) {
            attempt.end = Some(now);
            attempt.outcome = outcome;
            attempt.reason = (!reason.is_empty()).then(|| reason.to_owned());
        }
    }

    /// Pixels that it had are gone, or not to be trusted.
    pub fn lose_pixels(&mut self, lease: LeaseId, outcome: AttemptOutcome, reason: &str) {
        self.votes.clear();
        if let Some(attempt) = self.attempt_mut(lease) {
            attempt.outcome = outcome;
            attempt.reason = Some(reason.to_owned());
        }
    }

    pub fn entry(&self, log: &Log) -> PartEntry {
        let entry = |attempt: &Attempt| AttemptEntry {
            lease: attempt.lease.0,
            node: attempt.node,
            start: log.at(attempt.start),
            end: attempt.end.map(|at| log.at(at)),
            seconds: attempt.seconds,
            outcome: attempt.outcome,
            reason: attempt.reason.clone(),
        };
        let hash = self.votes.first().filter(|_| self.committed_by().is_some()).map(|(_, hash)| hash);
        PartEntry {
            id: self.id,
            rect: [self.rect.x, self.rect.y, self.rect.width, self.rect.height],
            predicted: self.cost,
            planned: self.planned,
            hash: hash.map(|hash| hash.iter().map(|byte| format!("{byte:02x}")).collect()),
            invalid_samples: if self.committed_by().is_some() { self.invalid_samples } else { 0 },
            replaced_by: self.replaced_by.clone(),
            attempts: self.attempts.iter().map(entry).collect(),
        }
    }
}
