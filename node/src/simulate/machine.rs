//! A simulated node: it answers what the farm asks, as a worker does, and takes its time for it.

use std::collections::{BTreeMap, BTreeSet, VecDeque};
use std::time::Duration;

use tessera_engine::part::Rect;

use super::random::Random;
use super::{Machine, Scenario};
use crate::farm::{Build, Event, Incarnation, JobId, LeaseId, NodeInfo, ToNode};
use crate::schedule::NodeId;

/// A part that a machine holds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Task {
    pub job: JobId,
    pub lease: LeaseId,
    pub rect: Rect,
}

/// A machine while the simulation runs.
#[derive(Clone, Debug)]
pub(super) struct Node {
    pub id: NodeId,
    pub machine: Machine,
    pub alive: bool,
    pub life: u64,
    pub slowness: f64,
    pub fails_next: bool,
    /// Whether the next part that a lane begins makes it hang.
    pub hangs_next: bool,
    /// What the next part is taken to have lasted, in seconds.
    pub measures_next: Option<f64>,
    /// Whether its pixels are wrong.
    pub corrupt: bool,
    /// The build that its process is of.
    pub build: u32,
    /// Until when the process stands still, and until when nothing passes to it and from it.
    pub paused: Duration,
    pub deaf: Duration,
    pub mute: Duration,
    /// Last moment at which a message of the farm arrives: they arrive in order.
    pub link: Duration,
    pub running: BTreeMap<LeaseId, Task>,
    /// Attempts of lanes that hang.
    hanging: BTreeSet<LeaseId>,
    waiting: VecDeque<Task>,
    delivered: BTreeMap<LeaseId, (JobId, Event)>,
    prepared: BTreeSet<JobId>,
}

/// What a node does next: after some seconds it says something, or ends a part.
pub(super) enum Act {
    Say(f64, Event),
    Finish(f64, Task),
    /// The process dies at once.
    Die,
}

impl Node {
    pub fn new(index: usize, machine: Machine) -> Self {
        Self {
            id: NodeId(index as u32),
            machine,
            alive: false,
            life: 0,
            slowness: 1.0,
            fails_next: false,
            hangs_next: false,
            measures_next: None,
            corrupt: false,
            build: 0,
            paused: Duration::ZERO,
            deaf: Duration::ZERO,
            mute: Duration::ZERO,
            link: Duration::ZERO,
            running: BTreeMap::new(),
            hanging: BTreeSet::new(),
            waiting: VecDeque::new(),
            delivered: BTreeMap::new(),
            prepared: BTreeSet::new(),
        }
    }

    pub fn incarnation(&self) -> Incarnation {
        Incarnation(u64::from(self.id.0) << 32 | self.life)
    }

    /// A new process begins.
    pub fn start(&mut self, build: u32) {
        self.end();
        self.build = build;
        (self.alive, self.life) = (true, self.life + 1);
        (self.paused, self.deaf, self.mute) = (Duration::ZERO, Duration::ZERO, Duration::ZERO);
    }

    /// The process ends, and all that it had in memory.
    pub fn end(&mut self) {
        (self.alive, self.hangs_next) = (false, false);
        self.running.clear();
        self.hanging.clear();
        self.waiting.clear();
        self.delivered.clear();
        self.prepared.clear();
    }

    pub fn joined(&self) -> Event {
        let name = format!("node-{}", self.id.0);
        let info = NodeInfo { name, lanes: self.machine.lanes, build: "simulated".into(), address: "nowhere".into() };
        Event::NodeJoined { node: self.id, incarnation: self.incarnation(), info }
    }

    /// Takes a message of the farm.
    pub fn receive(&mut self, message: ToNode, scenario: &Scenario, random: &mut Random) -> Vec<Act> {
        let (node, incarnation) = (self.id, self.incarnation());
        match message {
            ToNode::Prove => vec![Act::Say(0.01, Event::NodeProved { node, incarnation, canary: canary(self.build).canary })],
            ToNode::Prepare { job } => {
                let result = if self.machine.incapable { Err("no room for the scene".into()) } else { Ok(()) };
                self.prepared.insert(job);
                vec![Act::Say(random.between(0.01, 0.3), Event::Prepared { node, incarnation, job, result })]
            }
            ToNode::Probe { job, cells, .. } => vec![self.probe(job, &cells, scenario, random)],
            ToNode::Render { job, lease, rect, .. } => self.render(Task { job, lease, rect }, scenario, random),
            ToNode::Cancel { lease, .. } if self.hanging.contains(&lease) => Vec::new(),
            ToNode::Cancel { job, lease } => {
                self.waiting.retain(|task| task.lease != lease);
                self.running.remove(&lease);
                self.delivered.remove(&lease);
                let mut acts = vec![Act::Say(0.0, Event::Stopped { node, incarnation, job, lease })];
                acts.extend(self.begin(scenario, random));
                acts
            }
            ToNode::Release { job } => {
                self.prepared.remove(&job);
                self.delivered.retain(|_, (of, _)| *of != job);
                let mut stopped: Vec<LeaseId> = self.waiting.iter().filter(|task| task.job == job).map(|task| task.lease).collect();
                stopped.extend(
                    self.running.values().filter(|task| task.job == job && !self.hanging.contains(&task.lease)).map(|task| task.lease),
                );
                self.waiting.retain(|task| task.job != job);
                self.running.retain(|lease, _| !stopped.contains(lease));
                let mut acts: Vec<Act> =
                    stopped.into_iter().map(|lease| Act::Say(0.0, Event::Stopped { node, incarnation, job, lease })).collect();
                acts.extend(self.begin(scenario, random));
                acts
            }
        }
    }

    fn probe(&mut self, job: JobId, cells: &[(u32, Rect)], scenario: &Scenario, random: &mut Random) -> Act {
        let mut total = 0.0;
        let measured = cells.iter().map(|(cell, rect)| {
            let (x, y) = (f64::from(rect.x) + f64::from(rect.width) / 2.0, f64::from(rect.y) + f64::from(rect.height) / 2.0);
            let seconds = self.seconds(scenario.cost_at(x, y), random);
            total += seconds * 16.0;
            (*cell, seconds)
        });
        let cells = measured.collect();
        let event = Event::Probed { node: self.id, incarnation: self.incarnation(), job, cells };
        Act::Say(total / f64::from(self.machine.lanes), event)
    }

    /// Takes an order; one that it has already, or has carried out, is the same order again.
    fn render(&mut self, task: Task, scenario: &Scenario, random: &mut Random) -> Vec<Act> {
        if let Some((_, event)) = self.delivered.get(&task.lease) {
            return vec![Act::Say(0.0, event.clone())];
        }
        if !self.running.contains_key(&task.lease) && !self.waiting.contains(&task) {
            self.waiting.push_back(task);
        }
        self.begin(scenario, random)
    }

    /// Lets free lanes begin.
    fn begin(&mut self, scenario: &Scenario, random: &mut Random) -> Vec<Act> {
        let mut acts = Vec::new();
        while self.running.len() < self.machine.lanes as usize {
            let Some(task) = self.waiting.pop_front() else { break };
            self.running.insert(task.lease, task);
            if std::mem::take(&mut self.hangs_next) {
                self.hanging.insert(task.lease);
                continue;
            }
            acts.push(Act::Finish(self.seconds(scenario.cost_of(task.rect), random), task));
        }
        acts
    }

    /// A lane is done with a part, unless it was called back.
    pub fn finish(&mut self, task: Task, seconds: f64, scenario: &Scenario, random: &mut Random) -> Vec<Act> {
        let Some(task) = self.running.remove(&task.lease) else { return Vec::new() };
        let (node, incarnation, Task { job, lease, rect }) = (self.id, self.incarnation(), task);
        let poisoned = scenario.poison.is_some_and(|poison| poison.is_in(rect));
        if poisoned && scenario.poison.is_some_and(|poison| poison.kills) {
            return vec![Act::Die];
        }
        let event = if poisoned || std::mem::take(&mut self.fails_next) {
            Event::RenderFailed { node, incarnation, job, lease, reason: "the lane panicked".into() }
        } else {
            let hash = true_hash(job, self.build, rect).map(|byte| if self.corrupt { byte ^ (1 + self.id.0 as u8) } else { byte });
            let seconds = self.measures_next.take().unwrap_or(seconds);
            Event::Rendered { node, incarnation, job, lease, hash, seconds, invalid_samples: 0 }
        };
        self.delivered.insert(lease, (job, event.clone()));
        let mut acts = vec![Act::Say(0.0, event)];
        acts.extend(self.begin(scenario, random));
        acts
    }

    fn seconds(&self, cost: f64, random: &mut Random) -> f64 {
        let jitter = 1.0 + self.machine.jitter * random.between(-1.0, 1.0);
        cost / self.machine.speed * self.slowness * jitter
    }
}

/// The hash of a part's right pixels, rendered with a build.
pub(super) fn true_hash(job: JobId, build: u32, rect: Rect) -> [u8; 32] {
    *blake3::hash(format!("{} {build} {rect:?}", job.0).as_bytes()).as_bytes()
}

/// What a build is known by.
pub(super) fn canary(build: u32) -> Build {
    Build { revision: build, canary: [build as u8; 32] }
}
