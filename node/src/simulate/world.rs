//! The world around the farm: time, the network, the disk, the job's own policy, and a judge who watches the promises.

use std::collections::{BTreeMap, BTreeSet, BinaryHeap};
use std::{cmp::Reverse, time::Duration};

use super::clock::shifted;
use super::disk::Disk;
use super::machine::{Act, Node, Task, canary};
use super::random::Random;
use super::{Fault, Run, Scenario, ScriptPolicy};
use crate::farm::{Answer, Command, Event, Farm, Incarnation, JobId, JobSpec, LeaseId, Outcome, Question, ToNode};
use crate::journal::Filter;
use crate::limits::{HEARTBEAT_INTERVAL, IDLE_TIMEOUT};
use crate::schedule::{NodeId, PartId, assign, split};

/// The job that a run tells most of.
const JOB: JobId = JobId(1);

/// What happens at a moment.
pub(super) enum Happening {
    /// The farm learns of something, unless the coordinator was started anew since (its epoch).
    Farm(Event, u64),
    /// The same, from a node in one of its lives.
    FromNode(Event, usize, u64, u64),
    /// A message arrives at a node.
    ToNode(ToNode, usize, u64, u64),
    /// A lane ends a part that took so many seconds.
    Finish(usize, u64, Task, f64),
    /// A node's heart beats.
    Beat(usize, u64),
    /// A node's connection is closed by the coordinator.
    Closed(usize, u64),
    /// Pixels of a part are on disk.
    Stored(JobId, LeaseId, PartId, u64),
    /// So many entries of the journal are on disk.
    Synced(usize, u64),
    /// A node that drains has no more time.
    Goes(usize, u64),
    /// A job is submitted.
    Submit(JobId, Box<JobSpec>),
    Fault(Fault),
}

impl Happening {
    /// Whether the coordinator hears of it.
    fn is_heard(&self) -> bool {
        match self {
            Self::Farm(..) | Self::FromNode(..) | Self::Stored(..) | Self::Synced(..) | Self::Submit(..) => true,
            Self::Fault(fault) => fault.is_of_user(),
            _ => false,
        }
    }
}

/// A simulation while it runs.
pub struct World {
    pub(super) scenario: Scenario,
    pub(super) random: Random,
    pub(super) farm: Farm,
    pub(super) nodes: Vec<Node>,
    pub(super) now: Duration,
    /// What the coordinator's clock shows beyond `now`, in nanoseconds: it goes on from where a journal ends, and may jump.
    pub(super) ahead: i64,
    /// By when the coordinator would have woken up, on its clock, had it not been away since.
    pub(super) awake: Option<Duration>,
    agenda: BinaryHeap<Reverse<(Duration, u64, usize)>>,
    happenings: Vec<Option<Happening>>,
    pub(super) epoch: u64,
    /// The build that is installed.
    pub(super) build: u32,
    /// Until when the coordinator stands still.
    pub(super) stalled: Duration,
    /// Whether pixels of a part are to be found damaged.
    damaged: bool,
    pub(super) filter: Filter,
    pub(super) disk: Disk,
    /// Parts that are committed, with the attempt whose pixels they are.
    pub(super) settled: BTreeMap<(JobId, PartId), LeaseId>,
    /// Attempts whose pixels do not count any more.
    pub(super) revoked: BTreeSet<LeaseId>,
    /// Deliveries that the farm has to say something about.
    pub(super) open: BTreeSet<LeaseId>,
    pub(super) killed: BTreeMap<usize, Duration>,
    trace: blake3::Hasher,
    pub(super) run: Run,
}

impl World {
    /// A world in which nothing has happened yet.
    pub fn new(scenario: Scenario) -> Self {
        let mut farm = Farm::new(scenario.config.clone());
        let begin =
            [Event::Restarted { build: canary(0), stored: Vec::new() }, Event::JobSubmitted { job: JOB, spec: scenario.job.clone() }];
        begin.iter().for_each(|event| drop(farm.step(Duration::ZERO, event.clone())));
        let nodes: Vec<Node> = scenario.machines.iter().enumerate().map(|(i, machine)| Node::new(i, machine.clone())).collect();
        let powers = nodes.iter().map(|node| (node.id, node.machine.speed * f64::from(node.machine.lanes))).collect();
        #[expect(clippy::expect_used, reason = "it was submitted above")]
        let record = farm.record(JOB).expect("the job is known");
        let mut world = Self {
            random: Random::new(scenario.seed),
            farm,
            nodes,
            now: Duration::ZERO,
            ahead: 0,
            awake: None,
            agenda: BinaryHeap::new(),
            happenings: Vec::new(),
            epoch: 0,
            build: 0,
            stalled: Duration::ZERO,
            damaged: false,
            filter: Filter::default(),
            disk: Disk {
                journal: begin.into_iter().map(|event| (Duration::ZERO, event)).collect(),
                synced: 2,
                syncing: false,
                full: Duration::ZERO,
                pixels: BTreeMap::new(),
                coming: BTreeMap::new(),
                ends: Vec::new(),
            },
            settled: BTreeMap::new(),
            revoked: BTreeSet::new(),
            open: BTreeSet::new(),
            killed: BTreeMap::new(),
            trace: blake3::Hasher::new(),
            run: Run {
                outcome: None,
                others: BTreeMap::new(),
                record,
                violations: Vec::new(),
                trace: [0; 32],
                steps: 0,
                detections: Vec::new(),
                rendered: 0,
                powers,
            },
            scenario,
        };
        let starts: Vec<(Duration, Fault)> =
            world.nodes.iter().enumerate().map(|(i, node)| (node.machine.starts, Fault::Start(i))).collect();
        let faults = world.scenario.faults.clone();
        starts.into_iter().chain(faults).for_each(|(at, fault)| world.plan(at, Happening::Fault(fault)));
        for (number, (at, job)) in (JOB.0 + 1..).zip(world.scenario.others.clone()) {
            world.plan(at, Happening::Submit(JobId(number), Box::new(job)));
        }
        world
    }

    /// Lets everything happen until all jobs are over.
    pub fn run(mut self) -> Run {
        while !self.is_over() && self.run.violations.is_empty() && self.now < self.scenario.horizon {
            let next = self.agenda.peek().map(|Reverse((at, ..))| *at);
            let deadline = self.farm.next_deadline().map(|deadline| shifted(deadline, -self.ahead).max(self.stalled));
            match (deadline, next) {
                (Some(deadline), next) if next.is_none_or(|next| deadline < next) => {
                    self.now = self.now.max(deadline);
                    self.tick();
                }
                (_, Some(_)) => self.next(),
                _ => break,
            }
        }
        if !self.is_over() && self.run.violations.is_empty() {
            let open = self.farm.jobs().into_iter().filter(|job| job.outcome.is_none());
            let open: Vec<_> = open.map(|job| (job.id.0, job.phase, job.paused, job.committed, job.parts)).collect();
            let nodes: Vec<_> = self.farm.nodes().into_iter().map(|node| (node.name, node.state, node.holds, node.queued)).collect();
            self.violation(format!("jobs do not end: {open:?}; {nodes:?}"));
        }
        if let Some(record) = self.farm.record(JOB).filter(|_| self.run.outcome.is_none()) {
            self.run.record = record;
        }
        self.run.trace = *self.trace.finalize().as_bytes();
        self.run
    }

    fn is_over(&self) -> bool {
        self.run.outcome.is_some() && self.run.others.len() == self.scenario.others.len()
    }

    pub(super) fn violation(&mut self, what: impl Into<String>) {
        self.run.violations.push(format!("at {:.3} s: {}", self.now.as_secs_f64(), what.into()));
    }

    pub(super) fn plan(&mut self, at: Duration, happening: Happening) {
        self.agenda.push(Reverse((at, self.happenings.len() as u64, self.happenings.len())));
        self.happenings.push(Some(happening));
    }

    fn next(&mut self) {
        let Some(Reverse((at, number, index))) = self.agenda.pop() else { return };
        self.now = self.now.max(at);
        let Some(happening) = self.happenings[index].take() else { return };
        if let Some(later) = self.held_up(&happening) {
            // A user's requests come in the order in which they were made.
            if matches!(happening, Happening::Fault(_)) {
                self.happenings[index] = Some(happening);
                return self.agenda.push(Reverse((later, number, index)));
            }
            return self.plan(later, happening);
        }
        if happening.is_heard() {
            self.wake();
        }
        match happening {
            Happening::Farm(event, epoch) if epoch == self.epoch => self.step(event),
            Happening::FromNode(event, _, _, epoch) if epoch == self.epoch => self.deliver(event),
            Happening::ToNode(message, node, life, epoch) if self.lives(node, life) && epoch == self.epoch => {
                let acts = self.nodes[node].receive(message, &self.scenario, &mut self.random);
                self.act(node, acts);
            }
            Happening::Finish(node, life, task, seconds) if self.lives(node, life) => {
                self.run.rendered += 1;
                let acts = self.nodes[node].finish(task, seconds, &self.scenario, &mut self.random);
                self.act(node, acts);
            }
            Happening::Beat(node, life) if self.lives(node, life) => self.beat(node),
            Happening::Closed(node, life) if self.lives(node, life) => self.start(node),
            Happening::Stored(job, lease, part, epoch) if epoch == self.epoch => {
                self.store(job, lease, part);
                self.step(Event::Committed { job, lease });
            }
            Happening::Synced(entries, epoch) if epoch == self.epoch => self.synced(entries),
            Happening::Submit(job, spec) => self.step(Event::JobSubmitted { job, spec: *spec }),
            Happening::Goes(node, life) if self.lives(node, life) => self.fault(Fault::Leave(node)),
            Happening::Fault(fault) => self.fault(fault),
            _ => {}
        }
    }

    fn lives(&self, node: usize, life: u64) -> bool {
        self.nodes[node].alive && self.nodes[node].life == life
    }

    /// A process that stands still does nothing until it goes on; through a parted network streams deliver when it is whole again.
    fn held_up(&self, happening: &Happening) -> Option<Duration> {
        let (node, until) = match happening {
            Happening::Finish(node, life, ..)
            | Happening::Beat(node, life)
            | Happening::Closed(node, life)
            | Happening::Goes(node, life) => (self.lives(*node, *life), self.nodes[*node].paused),
            Happening::ToNode(_, node, life, _) => (self.lives(*node, *life), self.nodes[*node].paused.max(self.nodes[*node].deaf)),
            Happening::FromNode(_, node, life, _) => {
                (true, self.stalled.max(if self.lives(*node, *life) { self.nodes[*node].mute } else { self.stalled }))
            }
            Happening::Farm(Event::Assembled { .. }, _) | Happening::Stored(..) | Happening::Synced(..) => {
                (true, self.stalled.max(self.disk.full))
            }
            Happening::Farm(..) | Happening::Submit(..) => (true, self.stalled),
            Happening::Fault(fault) => (fault.is_of_user(), self.stalled),
        };
        (node && until > self.now).then_some(until)
    }

    pub(super) fn delay(&mut self) -> Duration {
        let (low, high) = self.scenario.network.delay;
        self.random.seconds(low, high)
    }

    fn act(&mut self, node: usize, acts: Vec<Act>) {
        for act in acts {
            match act {
                Act::Finish(seconds, task) => {
                    let at = self.now + Duration::from_secs_f64(seconds);
                    self.plan(at, Happening::Finish(node, self.nodes[node].life, task, seconds));
                }
                Act::Say(seconds, event) => self.say(node, seconds, event),
                Act::Die => {
                    self.fault(Fault::Kill(node));
                    let again = self.now + self.random.seconds(0.3, 1.0);
                    self.plan(again, Happening::Fault(Fault::Start(node)));
                }
            }
        }
    }

    pub(super) fn say(&mut self, node: usize, seconds: f64, event: Event) {
        let at = self.now + Duration::from_secs_f64(seconds) + self.delay();
        let (life, epoch) = (self.nodes[node].life, self.epoch);
        if self.random.happens(self.scenario.network.duplication) {
            let again = at + self.delay();
            self.plan(again, Happening::FromNode(event.clone(), node, life, epoch));
        }
        self.plan(at, Happening::FromNode(event, node, life, epoch));
    }

    fn beat(&mut self, node: usize) {
        let life = self.nodes[node].life;
        self.plan(self.now + HEARTBEAT_INTERVAL, Happening::Beat(node, life));
        if self.nodes[node].mute <= self.now && !self.random.happens(self.scenario.network.loss) {
            let (at, incarnation) = (self.now + self.delay(), self.nodes[node].incarnation());
            let heard = Event::NodeHeard { node: NodeId(node as u32), incarnation };
            self.plan(at, Happening::Farm(heard, self.epoch));
        }
    }

    /// What a node said arrives; of pixels the farm has to say at once what becomes of them.
    fn deliver(&mut self, event: Event) {
        if let Event::Rendered { lease, .. } = &event {
            self.open.insert(*lease);
        }
        self.step(event);
        if let Some(lease) = self.open.pop_first() {
            self.violation(format!("pixels of lease {} are neither taken nor discarded", lease.0));
        }
    }

    pub(super) fn step(&mut self, event: Event) {
        let now = self.clock();
        let news = self.filter.admit(&self.farm, now, &event);
        self.note(news);
        let plain = matches!(&event, Event::NodeHeard { node, .. } if !self.farm.is_suspected(*node));
        self.run.steps += 1;
        let commands = self.farm.step(now, event.clone());
        if !plain {
            self.judge();
            self.note_detections();
            self.trace.update(format!("{:?}{event:?}{commands:?}", self.now).as_bytes());
        }
        commands.into_iter().for_each(|command| self.carry_out(command));
    }

    fn carry_out(&mut self, command: Command) {
        match command {
            Command::Send { node, incarnation, message } => self.send(node, incarnation, message),
            Command::Close { node, incarnation, .. } => {
                let index = node.0 as usize;
                if self.nodes[index].incarnation() == incarnation {
                    let at = self.now + self.delay();
                    self.plan(at, Happening::Closed(index, self.nodes[index].life));
                }
            }
            Command::AskPolicy { id, question, .. } => {
                if let Some((seconds, answer)) = self.answer(&question) {
                    let at = self.now + Duration::from_secs_f64(seconds);
                    self.plan(at, Happening::Farm(Event::PolicyAnswered { id, answer }, self.epoch));
                }
            }
            Command::Commit { job, part, lease } => {
                if !self.open.remove(&lease) {
                    self.violation(format!("lease {} is to be committed, but its pixels are not here", lease.0));
                }
                let at = self.now + Duration::from_secs_f64(self.scenario.disk * self.random.between(0.5, 2.0));
                self.disk.coming.insert((job, lease), part);
                self.plan(at, Happening::Synced(self.disk.journal.len(), self.epoch));
                self.plan(at, Happening::Stored(job, lease, part, self.epoch));
            }
            Command::Discard { lease, .. } => _ = self.open.remove(&lease),
            Command::Revoke { job, part, lease } => {
                self.revoked.insert(lease);
                if self.settled.get(&(job, part)) == Some(&lease) {
                    self.settled.remove(&(job, part));
                }
            }
            Command::Assemble { job } => self.assemble(job),
            Command::End { job, outcome } => self.disk.ends.push((self.disk.journal.len(), job, outcome)),
        }
    }

    fn send(&mut self, node: NodeId, incarnation: Incarnation, message: ToNode) {
        let index = node.0 as usize;
        let at = (self.now + self.delay()).max(self.nodes[index].link);
        if self.nodes[index].incarnation() == incarnation {
            self.nodes[index].link = at;
            self.plan(at, Happening::ToNode(message, index, self.nodes[index].life, self.epoch));
        }
    }

    /// The job's own policy. Before rendering it answers well; later as the scenario says.
    fn answer(&mut self, question: &Question) -> Option<(f64, Result<Answer, String>)> {
        let plan = |parts, nodes| Answer::Plan(assign::paper(parts, nodes, &assign::Backlog::new()));
        let (parts, nodes) = match question {
            Question::Split { width, height, nodes, .. } => {
                let rects = split::strips(*width, *height, 3 * nodes.len() as u32);
                return Some((self.random.between(0.01, 2.0), Ok(Answer::Split(rects))));
            }
            Question::Assign { parts, nodes } => return Some((self.random.between(0.01, 2.0), Ok(plan(parts, nodes)))),
            Question::Redistribute { parts, nodes } => (parts, nodes),
        };
        match self.scenario.policy {
            ScriptPolicy::Good => Some((self.random.between(0.0, 0.049), Ok(plan(parts, nodes)))),
            ScriptPolicy::Late => Some((self.random.between(0.051, 1.0), Ok(plan(parts, nodes)))),
            ScriptPolicy::Never => None,
            ScriptPolicy::Wrong => Some((0.001, Ok(plan(&parts[1..], nodes)))),
            ScriptPolicy::Fails => Some((0.001, Err("job.lua:7: attempt to index nil".into()))),
        }
    }

    pub(super) fn end(&mut self, job: JobId, outcome: Outcome) {
        if job != JOB {
            if self.run.others.insert(job, outcome).is_some() {
                self.violation(format!("job {} ends twice", job.0));
            }
            return;
        }
        self.run.outcome = Some(outcome);
        if let Some(record) = self.farm.record(JOB) {
            self.run.record = record;
        }
    }

    /// Writes the outputs, if every pixel is on disk once.
    fn assemble(&mut self, job: JobId) {
        let (committed, Some(record)) = (self.farm.committed(job), self.farm.record(job)) else { return };
        let rects: Vec<_> = committed.iter().map(|(_, rect, _)| *rect).chain(self.farm.holes(job)).collect();
        if let Err(wrong) = split::validate(&rects, record.spec.width, record.spec.height) {
            self.violation(format!("the picture is not whole: {wrong}"));
        }
        if committed.iter().any(|(part, _, lease)| self.settled.get(&(job, *part)) != Some(lease)) {
            self.violation("the farm takes parts for committed that are not on disk");
        }
        self.judge_pixels(job, &record);
        let at = self.now + Duration::from_millis(50);
        let event = match committed.first().filter(|_| std::mem::take(&mut self.damaged)) {
            Some((part, ..)) => Event::PixelsLost { job, part: *part, reason: "the checksum is wrong".into() },
            None => Event::Assembled { job, result: Ok(()) },
        };
        self.plan(at, Happening::Farm(event, self.epoch));
    }

    fn start(&mut self, node: usize) {
        self.nodes[node].start(self.build);
        self.killed.remove(&node);
        let life = self.nodes[node].life;
        self.nodes[node].link = self.now;
        let joined = self.nodes[node].joined();
        self.say(node, 0.01, joined);
        self.plan(self.now + HEARTBEAT_INTERVAL, Happening::Beat(node, life));
    }

    fn fault(&mut self, fault: Fault) {
        match fault {
            Fault::Start(node) => self.start(node),
            Fault::Kill(node) => {
                if self.nodes[node].alive && self.nodes[node].paused.max(self.nodes[node].mute) <= self.now {
                    self.killed.insert(node, self.now);
                }
                self.nodes[node].end();
            }
            Fault::Leave(node) if self.nodes[node].alive => {
                let (id, incarnation) = (self.nodes[node].id, self.nodes[node].incarnation());
                let left = Event::NodeLeft { node: id, incarnation, reason: "goodbye".into() };
                let at = self.now + self.delay();
                self.plan(at, Happening::Farm(left, self.epoch));
                self.nodes[node].end();
            }
            Fault::Pause(node, length) => self.nodes[node].paused = self.now + length,
            Fault::Partition(node, length) => {
                self.fault(Fault::Deafen(node, length));
                self.fault(Fault::Mute(node, length));
            }
            Fault::Deafen(node, length) => self.nodes[node].deaf = self.now + length.min(IDLE_TIMEOUT),
            Fault::Mute(node, length) => self.nodes[node].mute = self.now + length.min(IDLE_TIMEOUT),
            Fault::Hang(node) => self.nodes[node].hangs_next = true,
            Fault::Corrupt(node) => self.nodes[node].corrupt = true,
            Fault::DamagePixels => self.damaged = true,
            Fault::FullDisk(length) => self.disk.full = self.disk.full.max(self.now + length),
            Fault::JumpClock(length) => self.jump(length),
            Fault::JumpNodeClock(node, seconds) => self.nodes[node].measures_next = Some(seconds),
            Fault::Stall(length) => self.stall(length),
            Fault::Slow(node, factor) => self.nodes[node].slowness = factor,
            Fault::FailPart(node) => self.nodes[node].fails_next = true,
            Fault::RestartCoordinator => self.restart(),
            Fault::Upgrade => {
                self.build += 1;
                self.restart();
            }
            Fault::Cancel(job) => self.step(Event::JobCancelled { job, reason: "not wanted".into() }),
            Fault::PauseJob(job) => self.step(Event::JobPaused { job, reason: "another goes first".into(), operator: false }),
            Fault::ResumeJob(job) => self.step(Event::JobResumed { job, reason: "its turn".into() }),
            Fault::Rank(job, priority) => self.step(Event::JobRanked { job, priority, operator: false }),
            Fault::Drain(node, length) if self.nodes[node].alive => {
                let (id, incarnation) = (self.nodes[node].id, self.nodes[node].incarnation());
                self.say(node, 0.0, Event::NodeDraining { node: id, incarnation });
                let life = self.nodes[node].life;
                self.plan(self.now + length, Happening::Goes(node, life));
            }
            Fault::Leave(_) | Fault::Drain(..) => {}
        }
    }
}

impl Run {
    /// Whether the job is finished.
    pub fn finished(&self) -> bool {
        self.outcome == Some(Outcome::Finished)
    }
}
