//! What the farm tells of its jobs: short for the status page, in full for the manifest.

use std::{collections::BTreeMap, time::Duration};

use serde::{Deserialize, Serialize};
use tessera_engine::part::Rect;

use super::job::{Job, Member, Phase};
use super::part::{PartState, Place};
use super::{Build, Farm, JobId, JobSpec, LeaseId, NodeSnapshot, Outcome};
use crate::manifest::{AttemptOutcome, EventEntry, NodeEntry, PartEntry, ProbeEntry};
use crate::schedule::{NodeId, Part, PartId, Probe, evaluate};

/// What of a job's place in the queue an operator said: nobody else changes it.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Fixed {
    /// That it waits.
    pub pause: bool,
    /// Its priority.
    pub rank: bool,
}

/// How far a job is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum JobPhase {
    /// Another job runs.
    Waiting,
    /// Nodes gather and compile its scene.
    Preparing,
    /// Costs and powers are measured.
    Probing,
    /// It is split and assigned.
    Planning,
    /// Its parts are rendered.
    Rendering,
    /// Its outputs are written.
    Assembling,
    /// It is over.
    Over,
}

/// A job, for the status page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct JobSnapshot {
    /// Its id.
    pub id: JobId,
    /// Its name.
    pub name: String,
    /// Who submitted it.
    pub owner: String,
    /// Its rank.
    pub priority: i32,
    /// Whether someone wants it to wait.
    pub paused: bool,
    /// How far it is.
    pub phase: JobPhase,
    /// How it ended.
    pub outcome: Option<Outcome>,
    /// Parts, once it is split.
    pub parts: usize,
    /// Parts that are on disk.
    pub committed: usize,
    /// Share of the predicted work that is on disk, 0 to 1.
    pub progress: f64,
    /// Seconds since its submission, until its end.
    pub seconds: f64,
}

/// How far a part is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum PartPhase {
    /// It waits for a node, or in a node's queue.
    Waiting,
    /// It is handed out.
    Rendering,
    /// Its pixels are on disk.
    Committed,
    /// Nobody can render it.
    LeftOut,
}

/// A part, for the status page.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct PartSnapshot {
    /// Its id.
    pub id: PartId,
    /// Its pixels.
    pub rect: Rect,
    /// How far it is.
    pub phase: PartPhase,
    /// Who renders it, or rendered it.
    pub node: Option<NodeId>,
}

/// All that a manifest needs to know of the farm's side of a job. Times are seconds since its submission.
#[derive(Clone, Debug, PartialEq)]
pub struct JobRecord {
    /// Its id.
    pub id: JobId,
    /// What was asked for.
    pub spec: JobSpec,
    /// What it is rendered with, once it has begun.
    pub build: Option<Build>,
    /// How it ended; `None` while it has not.
    pub outcome: Option<Outcome>,
    /// The farm's clock at its submission.
    pub submitted: Duration,
    /// Seconds until its end, or until now.
    pub seconds: f64,
    /// Moment at which the first part was handed out.
    pub first_lease: Option<f64>,
    /// Moment of the last commit.
    pub last_commit: Option<f64>,
    /// How costs were learned.
    pub probe: ProbeEntry,
    /// Nodes that took part, in order of their ids.
    pub nodes: Vec<NodeEntry>,
    /// Parts, in order of their ids.
    pub parts: Vec<PartEntry>,
    /// The paper's table S_n.
    pub difficulty: Vec<PartId>,
    /// The paper's table R_p, of measured nodes.
    pub power: Vec<NodeId>,
    /// Parts that nobody could render.
    pub holes: usize,
    /// What happened, in order of time.
    pub events: Vec<EventEntry>,
    /// What the user should know.
    pub warnings: Vec<String>,
}

impl Farm {
    /// Jobs that wait, run, or ended lately, in order of submission.
    pub fn jobs(&self) -> Vec<JobSnapshot> {
        self.jobs.values().map(|job| snapshot(job, self.turn.now)).collect()
    }

    /// All nodes that ever joined, in order of their ids.
    pub fn nodes(&self) -> Vec<NodeSnapshot> {
        let of = |(id, node): (&NodeId, &super::node::Node)| {
            let members = || self.open_jobs().filter_map(|job| job.members.get(id));
            NodeSnapshot {
                id: *id,
                incarnation: node.incarnation,
                name: node.info.name.clone(),
                lanes: node.info.lanes,
                build: node.info.build.clone(),
                address: node.info.address.clone(),
                state: node.state,
                reason: node.reason.clone(),
                power: members().find_map(Member::power),
                holds: node.held.len(),
                queued: members().map(|member| member.queue.len()).sum(),
            }
        };
        self.nodes.iter().map(of).collect()
    }

    /// What an operator said of a job's place in the queue.
    pub fn fixed(&self, job: JobId) -> Fixed {
        self.jobs.get(&job).map_or(Fixed::default(), |job| job.fixed)
    }

    /// All that is known of a job; `None` if it is not known (any more). Parts, nodes and events are known until another job ends.
    pub fn record(&self, job: JobId) -> Option<JobRecord> {
        self.jobs.get(&job).map(|job| record(job, self.turn.now))
    }

    /// Parts of a job, in order of their ids, and how far each is; without those that smaller ones replaced.
    pub fn parts(&self, job: JobId) -> Vec<PartSnapshot> {
        let parts = self.jobs.get(&job).map_or(&[][..], |job| &job.parts).iter();
        parts.filter(|part| part.place != Place::Replaced).map(part_snapshot).collect()
    }

    /// Rectangles of a job that nobody could render.
    pub fn holes(&self, job: JobId) -> Vec<Rect> {
        self.jobs.get(&job).map_or_else(Vec::new, |job| job.holes().map(|part| part.rect).collect())
    }

    /// Parts of a job that are committed, with the attempt that holds their pixels.
    pub fn committed(&self, job: JobId) -> Vec<(PartId, Rect, LeaseId)> {
        let parts = self.jobs.get(&job).map_or(&[][..], |job| &job.parts);
        parts.iter().filter_map(|part| part.committed_by().map(|lease| (part.id, part.rect, lease))).collect()
    }
}

fn part_snapshot(part: &PartState) -> PartSnapshot {
    let (phase, lease) = match part.place {
        Place::Loose | Place::Queued(_) | Place::Replaced => (PartPhase::Waiting, None),
        Place::Hole => (PartPhase::LeftOut, None),
        Place::Leased(lease) | Place::Committing(lease) => (PartPhase::Rendering, Some(lease)),
        Place::Committed(lease) => (PartPhase::Committed, Some(lease)),
    };
    let node = part.attempts.iter().find(|attempt| Some(attempt.lease) == lease).map(|attempt| attempt.node);
    PartSnapshot { id: part.id, rect: part.rect, phase, node }
}

fn snapshot(job: &Job, now: Duration) -> JobSnapshot {
    let (total, done) = job.cost;
    JobSnapshot {
        id: job.id,
        name: job.spec.name.clone(),
        owner: job.spec.owner.clone(),
        priority: job.spec.priority,
        paused: job.paused,
        phase: phase(&job.phase),
        outcome: job.outcome().cloned(),
        parts: job.split_into,
        committed: job.committed,
        progress: if total > 0.0 { done / total } else { 0.0 },
        seconds: job.log.at(job.log.ended.unwrap_or(now)),
    }
}

fn phase(phase: &Phase) -> JobPhase {
    match phase {
        Phase::Waiting => JobPhase::Waiting,
        Phase::Gathering(_) => JobPhase::Preparing,
        Phase::Probing(_) => JobPhase::Probing,
        Phase::Splitting | Phase::Assigning => JobPhase::Planning,
        Phase::Rendering => JobPhase::Rendering,
        Phase::Assembling => JobPhase::Assembling,
        Phase::Over(_) => JobPhase::Over,
    }
}

fn record(job: &Job, now: Duration) -> JobRecord {
    let parts: Vec<Part> = job.parts.iter().map(|part| part.describe()).collect();
    let mut powers = job.powers();
    evaluate::rank(&mut powers);
    JobRecord {
        id: job.id,
        spec: job.spec.clone(),
        build: job.build,
        outcome: job.outcome().cloned(),
        submitted: job.log.submitted,
        seconds: job.log.at(job.log.ended.unwrap_or(now)),
        first_lease: job.log.first_lease.map(|at| job.log.at(at)),
        last_commit: job.log.last_commit.map(|at| job.log.at(at)),
        probe: probe_entry(job),
        nodes: node_entries(job),
        parts: job.parts.iter().map(|part| part.entry(&job.log)).collect(),
        difficulty: evaluate::difficulty(&parts),
        power: powers.iter().map(|node| node.id).collect(),
        holes: job.holes().count(),
        events: job.log.events.clone(),
        warnings: job.log.warnings.clone(),
    }
}

fn probe_entry(job: &Job) -> ProbeEntry {
    let (mode, scale) = match &job.spec.probe {
        Probe::EveryNode { scale } => ("every_node", Some(*scale)),
        Probe::Shared { scale } => ("shared", Some(*scale)),
        Probe::Known { .. } => ("known", None),
    };
    ProbeEntry {
        mode: mode.into(),
        scale,
        seconds: job.log.probe_seconds,
        cell: job.costs.cell,
        columns: job.costs.columns,
        rows: job.costs.rows,
        seconds_per_pixel: job.costs.seconds_per_pixel.clone(),
    }
}

/// Nodes of a job, with what they delivered: in one pass over the parts, for there may be many of both.
fn node_entries(job: &Job) -> Vec<NodeEntry> {
    let entry = |(id, member): (&NodeId, &Member)| {
        let entry = NodeEntry {
            id: *id,
            name: member.info.name.clone(),
            lanes: member.info.lanes,
            build: member.info.build.clone(),
            power: member.power().unwrap_or(0.0),
            parts: 0,
            busy: 0.0,
            finish: 0.0,
            probed: member.probed.clone(),
        };
        (*id, entry)
    };
    let mut entries: BTreeMap<NodeId, NodeEntry> = job.members.iter().map(entry).collect();
    let attempts = job.parts.iter().flat_map(|part| &part.attempts);
    for attempt in attempts.filter(|attempt| attempt.outcome == AttemptOutcome::Committed) {
        let Some(entry) = entries.get_mut(&attempt.node) else { continue };
        entry.parts += 1;
        entry.busy += attempt.seconds.unwrap_or(0.0);
        entry.finish = entry.finish.max(attempt.end.map_or(0.0, |at| job.log.at(at)));
    }
    entries.into_values().collect()
}
