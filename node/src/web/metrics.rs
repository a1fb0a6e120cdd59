//! What a coordinator measures, in the text format of OpenMetrics, which Prometheus reads.
//!
//! Counters count since the process began, and no label names a job, a part or a node: the number of lines stays the same for weeks. What stands in a
//! [`Snapshot`] is not kept here again, it is read from there when somebody asks. `deploy/README.md` tells what each metric is good for; a test holds that
//! page to this one.

use std::{fmt::Error, sync::atomic::AtomicU64, time::Duration};

use prometheus_client::{
    encoding::text::{encode_eof, encode_registry},
    metrics::{counter::Counter, family::Family, gauge::Gauge, histogram::Histogram, info::Info},
    registry::{Registry, Unit},
};

use super::{Snapshot, wasted};
use crate::{
    farm::{JobPhase, JobRecord, NodeState, Outcome},
    manifest::{EventKind, ReportEntry},
};

/// A set of one label.
type Label = [(&'static str, &'static str); 1];

/// Seconds of silence before a suspicion: around [`crate::limits::SUSPECT_AFTER`].
const DETECTION: [f64; 9] = [0.25, 0.5, 0.55, 0.6, 0.75, 1.0, 2.0, 5.0, 10.0];

/// Seconds from pixels in memory to pixels on disk.
const COMMIT: [f64; 14] = [0.001, 0.0025, 0.005, 0.01, 0.025, 0.05, 0.1, 0.25, 0.5, 1.0, 2.5, 5.0, 10.0, 30.0];

/// Seconds that a part took over those predicted.
const PREDICTION: [f64; 13] = [0.1, 0.25, 0.5, 0.67, 0.8, 0.9, 1.0, 1.1, 1.25, 1.5, 2.0, 4.0, 10.0];

/// What is counted and timed as it happens.
pub struct Metrics {
    registry: Registry,
    /// Events that the farm's core took.
    pub events: Counter,
    /// Events and messages that wait for the core.
    pub inputs_waiting: Gauge,
    /// Deeds that wait for the journal's thread.
    pub disk_waiting: Gauge,
    /// Attempts handed out to nodes.
    pub attempts: Counter,
    /// Lives of nodes that ended without a goodbye.
    pub deaths: Counter,
    /// Connections that were turned away.
    pub refused_peers: Counter,
    /// Writes that the disk refused.
    pub disk_refusals: Counter,
    /// Bytes of the journal's events on disk.
    pub journal_bytes: Gauge<u64, AtomicU64>,
    /// Events in the journal.
    pub journal_events: Gauge<u64, AtomicU64>,
    /// Bytes that are free where the coordinator's folder is.
    pub disk_free: Gauge<u64, AtomicU64>,
    suspicions: Counter,
    detection: Histogram,
    parts_committed: Counter,
    pixel_bytes: Counter,
    commit: Histogram,
    jobs_ended: Family<Label, Counter>,
    reassigned: Counter,
    wasted: Counter<f64, AtomicU64>,
    prediction: Histogram,
    efficiency: Gauge<f64, AtomicU64>,
    overbalance: Gauge<f64, AtomicU64>,
}

impl Default for Metrics {
    fn default() -> Self {
        let mut registry = Registry::with_prefix("tessera");
        let version = [("version", env!("CARGO_PKG_VERSION").to_owned()), ("revision", tessera_engine::REVISION.to_string())];
        registry.register("build", "Version and engine revision of the coordinator", Info::new(version));
        let metrics = Self {
            registry: Registry::default(),
            events: Counter::default(),
            inputs_waiting: Gauge::default(),
            disk_waiting: Gauge::default(),
            attempts: Counter::default(),
            deaths: Counter::default(),
            refused_peers: Counter::default(),
            disk_refusals: Counter::default(),
            journal_bytes: Gauge::default(),
            journal_events: Gauge::default(),
            disk_free: Gauge::default(),
            suspicions: Counter::default(),
            detection: Histogram::new(DETECTION),
            parts_committed: Counter::default(),
            pixel_bytes: Counter::default(),
            commit: Histogram::new(COMMIT),
            jobs_ended: Family::default(),
            reassigned: Counter::default(),
            wasted: Counter::default(),
            prediction: Histogram::new(PREDICTION),
            efficiency: Gauge::default(),
            overbalance: Gauge::default(),
        };
        for outcome in [
            &Outcome::Finished,
            &Outcome::Incomplete { holes: 0 },
            &Outcome::Failed { reason: String::new() },
            &Outcome::Cancelled { reason: String::new() },
        ] {
            drop(metrics.jobs_ended.get_or_create(&[("outcome", word(outcome))]));
        }
        metrics.register(&mut registry);
        Self { registry, ..metrics }
    }
}

impl Metrics {
    fn register(&self, to: &mut Registry) {
        to.register("events", "Events that the farm's core took", self.events.clone());
        to.register("inputs_waiting", "Events and messages that wait for the farm's core", self.inputs_waiting.clone());
        to.register("disk_waiting", "Deeds that wait for the journal's thread", self.disk_waiting.clone());
        to.register("attempts", "Attempts at parts that were handed out to nodes", self.attempts.clone());
        to.register("suspicions", "Times that a silent node was suspected", self.suspicions.clone());
        to.register("deaths", "Lives of nodes that ended without a goodbye", self.deaths.clone());
        to.register("refused_peers", "Connections that were turned away, nodes that may not render included", self.refused_peers.clone());
        to.register("disk_refusals", "Writes that the disk refused; each is tried again", self.disk_refusals.clone());
        to.register("parts_committed", "Parts whose pixels are on disk", self.parts_committed.clone());
        to.register("jobs_ended", "Jobs that ended", self.jobs_ended.clone());
        to.register("parts_reassigned", "Parts that lost their node, by jobs that ended", self.reassigned.clone());
        to.register_with_unit(
            "detection_latency",
            "From a node's last sign of life to its suspicion",
            Unit::Seconds,
            self.detection.clone(),
        );
        to.register_with_unit("commit_latency", "From a part's pixels in memory to its pixels on disk", Unit::Seconds, self.commit.clone());
        to.register_with_unit("pixels_stored", "Pixels of parts that were put on disk", Unit::Bytes, self.pixel_bytes.clone());
        to.register_with_unit("wasted", "Lane time of attempts that did not count, by jobs that ended", Unit::Seconds, self.wasted.clone());
        to.register_with_unit("journal_size", "The journal's events on disk", Unit::Bytes, self.journal_bytes.clone());
        to.register("journal_events", "Events in the journal", self.journal_events.clone());
        to.register_with_unit("disk_free", "Free where the coordinator's folder is", Unit::Bytes, self.disk_free.clone());
        let ratio = || Unit::Other("ratio".to_owned());
        to.register_with_unit("prediction_error", "Seconds that a part took over those predicted", ratio(), self.prediction.clone());
        to.register_with_unit("last_job_efficiency", "Efficiency E of the last finished job", ratio(), self.efficiency.clone());
        to.register_with_unit("last_job_overbalance", "Overbalance L of the last finished job", ratio(), self.overbalance.clone());
    }

    /// A node was suspected after so long a silence.
    pub fn suspected(&self, silence: Duration) {
        self.suspicions.inc();
        self.detection.observe(silence.as_secs_f64());
    }

    /// The pixels of a part, so many bytes, are on disk so long after they arrived.
    pub fn committed(&self, bytes: usize, after: Duration) {
        self.parts_committed.inc();
        self.pixel_bytes.inc_by(bytes as u64);
        self.commit.observe(after.as_secs_f64());
    }

    /// A job is over.
    pub fn ended(&self, outcome: &Outcome, record: &JobRecord) {
        self.jobs_ended.get_or_create(&[("outcome", word(outcome))]).inc();
        let reassigned = record.events.iter().filter(|event| event.kind == EventKind::Reassigned).map(|event| event.parts.len() as u64);
        self.reassigned.inc_by(reassigned.sum());
        self.wasted.inc_by(wasted::seconds(record));
        wasted::prediction_errors(record).for_each(|error| self.prediction.observe(error));
    }

    /// What came of a job whose files stand.
    pub fn finished(&self, report: &ReportEntry) {
        self.efficiency.set(report.efficiency);
        self.overbalance.set(report.overbalance);
    }

    /// All metrics as text, together with what `snapshot` tells.
    ///
    /// # Errors
    /// Never, as far as text in memory never refuses.
    pub fn text(&self, snapshot: &Snapshot) -> Result<String, Error> {
        let mut text = String::new();
        encode_registry(&mut text, &self.registry)?;
        encode_registry(&mut text, &standing(snapshot))?;
        encode_eof(&mut text)?;
        Ok(text)
    }
}

/// How things stand in a snapshot.
fn standing(snapshot: &Snapshot) -> Registry {
    let mut registry = Registry::with_prefix("tessera");
    let (nodes, jobs) = (Family::<Label, Gauge>::default(), Family::<Label, Gauge>::default());
    use NodeState::{Lost, Proving, Quarantined, Ready, Refused, Suspected};
    for state in [Proving, Ready, Refused, Suspected, Lost, Quarantined] {
        let count = snapshot.nodes.iter().filter(|node| node.state == state).count();
        nodes.get_or_create(&[("state", node_word(state))]).set(signed(count));
    }
    let open = [JobPhase::Waiting, JobPhase::Preparing, JobPhase::Probing, JobPhase::Planning, JobPhase::Rendering, JobPhase::Assembling];
    for phase in open {
        let count = snapshot.jobs.iter().filter(|job| job.phase == phase).count();
        jobs.get_or_create(&[("state", phase_word(phase))]).set(signed(count));
    }
    let ready = snapshot.nodes.iter().filter(|node| node.state == NodeState::Ready);
    let held = snapshot.nodes.iter().map(|node| node.holds).sum();
    let begun = snapshot.jobs.iter().filter(|job| job.phase != JobPhase::Over);
    let left = begun.map(|job| job.total.saturating_sub(job.committed)).sum();
    registry.register("nodes", "Nodes by state", nodes);
    registry.register("jobs", "Jobs that wait or run, by state", jobs);
    registry.register("lanes", "Rendering threads of nodes that may get work", gauge(ready.map(|node| node.lanes as usize).sum()));
    registry.register("parts_held", "Parts that nodes hold now", gauge(held));
    registry.register("parts_left", "Parts of the running job that are not on disk yet", gauge(left));
    let held_up = snapshot.jobs.iter().filter(|job| job.trouble.is_some()).count();
    registry.register("jobs_held_up", "Jobs whose files the disk refuses", gauge(held_up));
    registry.register("refuses_jobs", "1 while no job is taken, else 0", gauge(usize::from(snapshot.refusal.is_some())));
    registry
}

fn signed(count: usize) -> i64 {
    i64::try_from(count).unwrap_or(i64::MAX)
}

fn gauge(count: usize) -> Gauge {
    let gauge = Gauge::default();
    gauge.set(signed(count));
    gauge
}

fn word(outcome: &Outcome) -> &'static str {
    match outcome {
        Outcome::Finished => "finished",
        Outcome::Incomplete { .. } => "incomplete",
        Outcome::Failed { .. } => "failed",
        Outcome::Cancelled { .. } => "cancelled",
    }
}

fn node_word(state: NodeState) -> &'static str {
    match state {
        NodeState::Proving => "proving",
        NodeState::Ready => "ready",
        NodeState::Draining => "draining",
        NodeState::Refused => "refused",
        NodeState::Suspected => "suspected",
        NodeState::Lost => "lost",
        NodeState::Quarantined => "quarantined",
    }
}

fn phase_word(phase: JobPhase) -> &'static str {
    match phase {
        JobPhase::Waiting => "waiting",
        JobPhase::Preparing => "preparing",
        JobPhase::Probing => "probing",
        JobPhase::Planning => "planning",
        JobPhase::Rendering => "rendering",
        JobPhase::Assembling => "writing",
        JobPhase::Over => "over",
    }
}
