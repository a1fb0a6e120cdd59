//! Parts while they are rendered: where each is, and who tried it.

use std::time::Duration;

use tessera_engine::part::Rect;

use super::{Incarnation, LeaseId, log::Log};
use crate::limits::ATTEMPTS_LISTED_PER_PART;
use crate::manifest::{AttemptEntry, AttemptOutcome, PartEntry};
use crate::schedule::{NodeId, Part, PartId};

/// Where a part is. It is in one place only, and never leaves [`Place::Committed`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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
}

/// A part of a running job.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct PartState {
    pub id: PartId,
    pub rect: Rect,
    pub cost: f64,
    pub place: Place,
    pub planned: Option<NodeId>,
    pub hash: Option<[u8; 32]>,
    /// Nodes that said they could not, with their reasons.
    pub failures: Vec<(NodeId, String)>,
    pub attempts: Vec<Attempt>,
}

/// A try at a part, for the record.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Attempt {
    pub lease: LeaseId,
    pub node: NodeId,
    pub start: Duration,
    pub end: Option<Duration>,
    pub seconds: Option<f64>,
    pub outcome: AttemptOutcome,
    pub reason: Option<String>,
}

/// An attempt that may still end well. Its part's place tells whether it is the one that counts on, or a stray.
#[derive(Clone, Debug, PartialEq)]
pub(super) struct Lease {
    pub part: PartId,
    pub node: NodeId,
    pub incarnation: Incarnation,
    /// When a lane can have begun it, by what the farm knows.
    pub begun: Option<Duration>,
}

impl PartState {
    pub fn new(id: PartId, rect: Rect, cost: f64) -> Self {
        Self { id, rect, cost, place: Place::Loose, planned: None, hash: None, failures: Vec::new(), attempts: Vec::new() }
    }

    /// The part as policies see it.
    pub fn describe(&self) -> Part {
        Part { id: self.id, rect: self.rect, cost: self.cost }
    }

    /// The attempt whose pixels are on disk.
    pub fn committed_by(&self) -> Option<LeaseId> {
        if let Place::Committed(lease) = self.place { Some(lease) } else { None }
    }

    /// Whether its pixels are here.
    pub fn is_delivered(&self) -> bool {
        matches!(self.place, Place::Committing(_) | Place::Committed(_))
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

    /// Its pixels are gone with the coordinator's memory.
    pub fn lose_pixels(&mut self, lease: LeaseId) {
        self.hash = None;
        if let Some(attempt) = self.attempt_mut(lease) {
            attempt.outcome = AttemptOutcome::Lost;
            attempt.reason = Some("the coordinator was started anew".into());
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
        PartEntry {
            id: self.id,
            rect: [self.rect.x, self.rect.y, self.rect.width, self.rect.height],
            predicted: self.cost,
            planned: self.planned,
            hash: self.hash.filter(|_| self.committed_by().is_some()).map(|hash| hash.iter().map(|byte| format!("{byte:02x}")).collect()),
            attempts: self.attempts.iter().map(entry).collect(),
        }
    }
}
