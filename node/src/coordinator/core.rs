//! The one task that owns the farm's core: turns what comes in into events, and commands into deeds.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    time::{Duration, Instant},
};

use tokio::{
    sync::{mpsc, watch},
    time::{Instant as TokioInstant, sleep_until},
};

use super::{
    Shared,
    asked::Asked,
    canary::Canary,
    disk::Disk,
    input::{Input, LinkId},
    jobs::{Known, Unanswered},
    leases::Lease,
    links::Link,
    policy::Thinker,
    status::{self, Times},
};
use crate::{
    error::Result,
    farm::{self, Build, Command, DiscardReason, Event, Farm, Incarnation, JobId, JobPhase, LeaseId},
    limits::{INPUT_BATCH, LATE_TICK, STATUS_INTERVAL, WAKE_INTERVAL},
    schedule::NodeId,
    web::Snapshot,
    wire::{FromNode, PartHeader, Place, Status, ToNode},
};

/// Pixels that came in.
pub struct Arrived {
    /// Taken out on their way to the disk.
    bytes: Vec<u8>,
    length: usize,
    at: Instant,
}

/// The core and what stands around it.
pub struct Core {
    pub(super) farm: Farm,
    /// What the farm's clock showed when this process began.
    pub(super) offset: Duration,
    /// When that was, later by all the time for which it was away.
    pub(super) begin: Instant,
    /// When it last looked at the clock.
    pub(super) awake: Instant,
    pub(super) shared: Shared,
    pub(super) disk: Disk,
    pub(super) thinker: Thinker,
    pub(super) canary: Canary,
    pub(super) asked: Asked,
    pub(super) links: BTreeMap<NodeId, Link>,
    pub(super) nodes: BTreeMap<LinkId, NodeId>,
    pub(super) ids: BTreeMap<String, NodeId>,
    pub(super) jobs: BTreeMap<JobId, Known>,
    /// Who waits to hear that a job is taken.
    pub(super) unanswered: Unanswered,
    /// Why the disk takes no events and pixels.
    pub(super) disk_trouble: Option<String>,
    /// Why there is no room for more jobs.
    pub(super) no_space: Option<String>,
    pub(super) times: BTreeMap<JobId, Times>,
    /// Pixels that came in and are neither on disk nor given up.
    pub(super) pixels: BTreeMap<(JobId, LeaseId), Arrived>,
    pub(super) published: watch::Sender<Arc<Status>>,
    /// Whether more than a sign of life has come since the status was published.
    pub(super) changed: bool,
    /// When the farm wants to be told of the time, or earlier; `None` if that is to be asked anew. Signs of life, by far the most frequent events,
    /// only put it off.
    pub(super) due: Option<Option<Duration>>,
}

impl Core {
    /// A core over what the journal brought back.
    ///
    /// # Errors
    /// When pixels on disk cannot be read.
    pub fn new(
        farm: Farm,
        shared: Shared,
        disk: Disk,
        mut thinker: Thinker,
        canary: Canary,
        published: watch::Sender<Arc<Status>>,
    ) -> Result<Self> {
        let ids = farm.nodes().into_iter().map(|node| (node.name, node.id)).collect();
        if let Err(error) = shared.store.settle(&farm.jobs()) {
            tracing::warn!(%error, "jobs on disk could not be put in order; the next start tries again");
        }
        let known = farm.jobs().into_iter().filter_map(|job| Some((job.id, Known::again(&shared.store, &job)?)));
        let jobs: BTreeMap<JobId, Known> = known.collect();
        for job in farm.jobs().into_iter().filter(|job| job.phase != JobPhase::Waiting) {
            if let Some(stored) = jobs.get(&job.id).and_then(|known| known.stored.as_ref()) {
                thinker.load(job.id, &stored.description);
            }
        }
        let mut core = Self {
            offset: farm.now(),
            farm,
            begin: Instant::now(),
            awake: Instant::now(),
            shared,
            disk,
            thinker,
            canary,
            asked: Asked::default(),
            links: BTreeMap::new(),
            nodes: BTreeMap::new(),
            ids,
            jobs,
            unanswered: BTreeMap::new(),
            disk_trouble: None,
            no_space: None,
            times: BTreeMap::new(),
            pixels: BTreeMap::new(),
            published,
            changed: true,
            due: None,
        };
        core.recover()?;
        Ok(core)
    }

    /// Steps through what the journal alone does not know: parts whose pixels reached the disk when their commit did not.
    fn recover(&mut self) -> Result<()> {
        let open: Vec<JobId> = self.farm.jobs().into_iter().filter(|job| job.outcome.is_none()).map(|job| job.id).collect();
        let is_described = |job: &JobId| self.jobs.get(job).is_some_and(|known| known.stored.is_some());
        let (described, lost): (Vec<JobId>, Vec<JobId>) = open.into_iter().partition(is_described);
        let mut stored = Vec::new();
        for job in described {
            let committed: BTreeSet<LeaseId> = self.farm.committed(job).into_iter().map(|(_, _, lease)| lease).collect();
            let on_disk = self.disk.pixels.stored(job)?;
            stored.extend(on_disk.into_iter().filter(|lease| !committed.contains(lease)).map(|lease| (job, lease)));
        }
        let build = Build { revision: tessera_engine::REVISION, canary: self.canary.hash };
        self.step(Event::Restarted { build, stored });
        for job in lost {
            let reason = "its description on the coordinator's disk cannot be read any more".to_owned();
            self.step(Event::JobCancelled { job, reason });
        }
        Ok(())
    }

    /// Works until nobody can send inputs any more, or the process ends.
    pub async fn run(mut self, mut inputs: mpsc::Receiver<Input>) {
        let mut waiting = Vec::new();
        let mut publish = TokioInstant::now();
        self.awake = Instant::now();
        loop {
            let wake = self.wake_time();
            let received = tokio::select! {
                received = inputs.recv_many(&mut waiting, INPUT_BATCH) => {
                    if received == 0 {
                        return;
                    }
                    received
                }
                () = sleep_until(wake.unwrap_or(self.begin).into()), if wake.is_some() => 0,
                () = sleep_until(publish), if self.changed => 0,
            };
            self.note_absence();
            if received > 0 {
                self.shared.metrics.inputs_waiting.set(i64::try_from(received + inputs.len()).unwrap_or(i64::MAX));
                waiting.drain(..).for_each(|input| self.handle(input));
                self.shared.metrics.inputs_waiting.set(i64::try_from(inputs.len()).unwrap_or(i64::MAX));
            }
            if self.is_due() {
                self.tick();
            }
            if self.changed && TokioInstant::now() >= publish {
                self.publish();
                publish = TokioInstant::now() + STATUS_INTERVAL;
            }
        }
    }

    /// When this is to wake up, whatever comes in.
    fn wake_time(&mut self) -> Option<Instant> {
        self.deadline().map(|deadline| deadline.min(self.awake + WAKE_INTERVAL))
    }

    /// When the core wants to be told of the time.
    fn deadline(&mut self) -> Option<Instant> {
        let due = *self.due.get_or_insert_with(|| self.farm.next_deadline());
        due.map(|at| self.begin + at.saturating_sub(self.offset))
    }

    /// Whether the core is to be told of the time now. Signs of life may have put that off.
    fn is_due(&mut self) -> bool {
        if self.deadline().is_some_and(|deadline| deadline <= Instant::now()) {
            self.due = None;
        }
        self.deadline().is_some_and(|deadline| deadline <= Instant::now())
    }

    /// If it is long past the time at which this was to wake up, the process itself was away: that time does not count, and the silence of others says
    /// nothing.
    fn note_absence(&mut self) {
        self.is_due(); // or signs of life have put it off
        let late = self.wake_time().map_or(Duration::ZERO, |wake| wake.elapsed());
        self.awake = Instant::now();
        if late <= LATE_TICK {
            return;
        }
        tracing::warn!(seconds = late.as_secs_f64(), "this process did not run for a while: nodes are given time to be heard");
        // The farm's clock never goes back: what it was told meanwhile counts.
        let now = self.offset + self.begin.elapsed();
        self.begin += late.min(now.saturating_sub(self.farm.now()));
        let all: Vec<_> = self.links.iter().map(|(node, link)| (*node, link.incarnation)).collect();
        all.into_iter().for_each(|(node, incarnation)| self.step(Event::NodeHeard { node, incarnation }));
    }

    fn tick(&mut self) {
        self.step(Event::Tick);
        for (node, link) in &mut self.links {
            let suspected = self.farm.is_suspected(*node);
            if suspected && !link.suspected {
                self.shared.metrics.suspected(link.heard.elapsed());
            }
            link.suspected = suspected;
        }
    }

    fn handle(&mut self, input: Input) {
        match input {
            Input::Joined { link, name, hello, address, outgoing, known } => {
                self.joined(link, name, hello, address.to_string(), outgoing);
                let _ = known.send(());
            }
            Input::Heard(link) => self.of(link, |_, node, incarnation| Some(Event::NodeHeard { node, incarnation })),
            Input::Said(link, message, _room) => self.of(link, |core, node, incarnation| core.said(node, incarnation, message)),
            Input::Delivered(link, header, bytes) => {
                self.of(link, |core, node, incarnation| core.delivered(node, incarnation, &header, bytes))
            }
            Input::Damaged(link, job, lease) => self.of(link, |_, node, incarnation| {
                Some(Event::RenderFailed { node, incarnation, job, lease, reason: "its pixels do not agree with their hash".to_owned() })
            }),
            Input::Gone(link, left) => self.gone(link, left),
            Input::HeldUp(job, reason) => self.held_up(job, reason),
            Input::Disk(trouble) => self.disk_refuses(trouble),
            Input::Space(trouble) => {
                trouble.iter().for_each(|trouble| tracing::warn!(trouble, "no job is taken"));
                self.no_space = trouble;
                self.changed = true;
            }
            Input::Assemble(job) => {
                if self.farm.jobs().iter().any(|known| known.id == job && known.phase == JobPhase::Assembling) {
                    self.assemble(job);
                }
            }
            Input::Ping(reply) => drop(reply.send(())),
            Input::Event(event) => {
                if let Event::Committed { job, lease } = event {
                    if let Some(arrived) = self.pixels.get(&(job, lease)) {
                        self.shared.metrics.committed(arrived.length, arrived.at.elapsed());
                    }
                    self.settle(job, lease);
                }
                self.step(event);
            }
            Input::Submit { description, terms, owner, limited, reply } => match self.submit(*description, terms, &owner, limited) {
                Ok(job) => self.answer_when_taken(job, reply),
                Err(reason) => drop(reply.send(Err(reason))),
            },
            Input::Rest => {
                // Who begins to look at the page sees soon how things stand.
                self.changed = true;
                self.shorten_journal();
            }
            Input::Taken(job) => {
                // Whoever asked may have gone meanwhile.
                self.unanswered.remove(&job).into_iter().for_each(|reply| drop(reply.send(Ok(job))));
            }
            Input::Delete { job, reply } => drop(reply.send(self.delete(job))),
            Input::Release { node, reply } => {
                let done = self.release(&node);
                self.answer(reply, done);
            }
            Input::Move { job, place, operator, reason, reply } => {
                let done = self.may_move(job, place, operator).and_then(|()| {
                    let event = match place {
                        Place::Paused => Event::JobPaused { job, reason, operator },
                        Place::Resumed => Event::JobResumed { job, reason },
                        Place::Ranked(priority) => Event::JobRanked { job, priority, operator },
                    };
                    self.change_open(job, event)
                });
                self.answer(reply, done);
            }
            Input::Cancel { job, reason, reply } => {
                let done = self.change_open(job, Event::JobCancelled { job, reason });
                self.answer(reply, done);
            }
        }
    }

    /// The node at the other end of a connection, if that is still the connection of this node.
    pub(super) fn at(&self, link: LinkId) -> Option<(NodeId, Incarnation)> {
        let node = *self.nodes.get(&link)?;
        self.links.get(&node).filter(|latest| latest.id == link).map(|latest| (node, latest.incarnation))
    }

    fn of(&mut self, link: LinkId, act: impl FnOnce(&mut Self, NodeId, Incarnation) -> Option<Event>) {
        let Some((node, incarnation)) = self.at(link) else { return };
        if let Some(link) = self.links.get_mut(&node) {
            (link.heard, link.suspected) = (Instant::now(), false);
        }
        if let Some(event) = act(self, node, incarnation) {
            self.step(event);
        }
    }

    fn said(&mut self, node: NodeId, incarnation: Incarnation, message: FromNode) -> Option<Event> {
        if !self.asked.settles(node, &message) {
            return Some(Event::NodeHeard { node, incarnation });
        }
        match message {
            FromNode::Proof { hash } => Some(Event::NodeProved { node, incarnation, canary: hash }),
            FromNode::Prepared { job, result } => Some(Event::Prepared { node, incarnation, job, result }),
            FromNode::Probed { job, cells } => Some(Event::Probed { node, incarnation, job, cells }),
            FromNode::Failed { job, lease, .. } if self.shared.leases.get(job, lease).is_none_or(|lease| lease.node != node) => {
                Some(self.too_late(node, incarnation, job, lease))
            }
            FromNode::Failed { job, lease, reason } => {
                self.shared.leases.remove_of(node, job, lease);
                Some(Event::RenderFailed { node, incarnation, job, lease, reason })
            }
            FromNode::Cancelled { job, lease } => {
                self.shared.leases.remove_of(node, job, lease);
                Some(Event::Stopped { node, incarnation, job, lease })
            }
            FromNode::Draining => Some(Event::NodeDraining { node, incarnation }),
            // Its connection ends with it.
            FromNode::Goodbye { .. } => None,
        }
    }

    fn delivered(&mut self, node: NodeId, incarnation: Incarnation, header: &PartHeader, bytes: Vec<u8>) -> Option<Event> {
        let PartHeader { job, lease, seconds, hash, invalid_samples, .. } = *header;
        let handed_out = self.shared.leases.get(job, lease).is_some_and(|lease| lease.incarnation == incarnation);
        if !handed_out || bytes.is_empty() {
            self.say(node, incarnation, ToNode::Settled { job, lease });
            return Some(self.too_late(node, incarnation, job, lease));
        }
        if self.pixels.contains_key(&(job, lease)) {
            return Some(Event::NodeHeard { node, incarnation });
        }
        self.pixels.insert((job, lease), Arrived { length: bytes.len(), bytes, at: Instant::now() });
        Some(Event::Rendered { node, incarnation, job, lease, hash, seconds, invalid_samples })
    }

    /// What an answer tells that does not count any more: that its node lives, and perhaps that a lane does not hang.
    fn too_late(&self, node: NodeId, incarnation: Incarnation, job: JobId, lease: LeaseId) -> Event {
        if self.farm.hangs(node, job, lease) {
            Event::Stopped { node, incarnation, job, lease }
        } else {
            Event::NodeHeard { node, incarnation }
        }
    }

    pub(super) fn step(&mut self, event: Event) {
        let now = self.offset + self.begin.elapsed();
        match event {
            Event::NodeHeard { node, .. } if !self.farm.is_suspected(node) => {}
            Event::NodeHeard { .. } => self.due = None,
            _ => (self.changed, self.due) = (true, None),
        }
        self.disk.note(&self.farm, now, &event);
        self.shared.metrics.events.inc();
        let silence = matches!(event, Event::Tick);
        for command in self.farm.step(now, event) {
            if let Command::Close { node, incarnation, .. } = &command {
                self.sent_away(*node, *incarnation, silence);
            }
            self.carry_out(command);
        }
    }

    fn carry_out(&mut self, command: Command) {
        match command {
            Command::Send { node, incarnation, message } => {
                if let Some(message) = self.for_the_wire(node, incarnation, message) {
                    self.say(node, incarnation, message);
                }
            }
            Command::Close { node, incarnation, reason } => self.close(node, incarnation, reason),
            Command::AskPolicy { id, job, question } => self.thinker.ask(id, job, question),
            Command::Commit { job, part, lease } => {
                // What stays is the name alone, so that a second delivery is known as one.
                if let Some(arrived) = self.pixels.get_mut(&(job, lease)) {
                    self.disk.commit(job, part, lease, std::mem::take(&mut arrived.bytes));
                }
            }
            Command::Discard { job, lease, reason } => self.discard(job, lease, reason),
            Command::Revoke { job, lease, .. } => {
                // Its record stays in the segment until the job is over; nothing points at it.
                self.pixels.remove(&(job, lease));
            }
            Command::Assemble { job } => self.assemble(job),
            Command::End { job, outcome } => {
                tracing::info!(job = job.0, ?outcome, "a job ended");
                self.ended(job, &outcome);
                self.shared.leases.remove_job(job);
                self.pixels.retain(|(other, _), _| *other != job);
                self.thinker.forget(job);
                self.asked.forget_job(job);
                self.disk.forget(job);
                self.publish();
            }
        }
    }

    fn for_the_wire(&mut self, node: NodeId, incarnation: Incarnation, message: farm::ToNode) -> Option<ToNode> {
        Some(match message {
            farm::ToNode::Prove => ToNode::Prove { seed: self.canary.seed },
            farm::ToNode::Prepare { job } => {
                let stored = self.jobs.get(&job)?.stored.as_ref()?;
                self.thinker.load(job, &stored.description);
                ToNode::Prepare { job, frame: stored.frame, assets: stored.description.assets.clone() }
            }
            farm::ToNode::Probe { job, cells, stride } => ToNode::Probe { job, cells, stride },
            farm::ToNode::Render { job, lease, rect, samples } => {
                let stored = self.jobs.get(&job)?.stored.as_ref()?;
                let (frame, aovs) = (stored.frame, stored.description.frame.aovs);
                if self.shared.leases.add(job, lease, Lease { node, incarnation, frame, rect, aovs }) {
                    self.shared.metrics.attempts.inc();
                }
                ToNode::Render { job, lease, rect, samples }
            }
            farm::ToNode::Cancel { job, lease } => ToNode::Cancel { job, lease },
            farm::ToNode::Release { job } => ToNode::Release { job },
        })
    }

    /// The node may forget an attempt.
    fn settle(&mut self, job: JobId, lease: LeaseId) {
        self.pixels.remove(&(job, lease));
        let Some(known) = self.shared.leases.get(job, lease) else { return };
        self.shared.leases.remove(job, lease);
        self.say(known.node, known.incarnation, ToNode::Settled { job, lease });
    }

    fn discard(&mut self, job: JobId, lease: LeaseId, reason: DiscardReason) {
        tracing::debug!(job = job.0, lease = lease.0, ?reason, "pixels are not taken");
        self.settle(job, lease);
    }

    pub(super) fn publish(&mut self) {
        self.changed = false;
        let (now, refusal) = (self.offset + self.begin.elapsed(), self.refusal());
        let status =
            status::of(&self.farm, &mut self.times, now, refusal.clone(), |id| self.jobs.get(&id).map(|known| known.trouble.clone()));
        if *self.published.borrow().as_ref() != status {
            self.published.send_replace(Arc::new(status));
        }
        if self.shared.page.receiver_count() > 0 {
            let seen = |id| self.jobs.get(&id).map(|known| (known.size, known.trouble.clone()));
            self.shared.page.send_replace(Arc::new(Snapshot::of(&self.farm, refusal, seen)));
        }
    }
}
