//! The one task that owns the farm's core: turns what comes in into events, and commands into deeds.

use std::{
    collections::{BTreeMap, BTreeSet},
    sync::Arc,
    thread,
    time::{Duration, Instant, SystemTime, UNIX_EPOCH},
};

use tessera_engine::part;
use tokio::{
    sync::{mpsc, watch},
    time::{Instant as TokioInstant, sleep_until},
};

use super::{
    Shared,
    assemble::{self, Assembly, Refusal},
    disk::Disk,
    input::{Input, LinkId, Outgoing},
    leases::Lease,
    policy::Thinker,
    status::{self, Times},
    store::StoredJob,
};
use crate::{
    error::Result,
    farm::{self, Command, DiscardReason, Event, Farm, Incarnation, JobId, JobPhase, JobSpec, LeaseId, NodeInfo},
    job::JobDescription,
    limits::{DISK_RETRY, INPUT_BATCH, LATE_TICK, STATUS_INTERVAL},
    schedule::NodeId,
    web::Snapshot,
    wire::{FromNode, Hello, PartHeader, Status, ToNode, tls},
};

/// A node's latest connection.
struct Link {
    id: LinkId,
    incarnation: Incarnation,
    outgoing: mpsc::Sender<Outgoing>,
}

/// The core and what stands around it.
pub struct Core {
    farm: Farm,
    /// What the farm's clock showed when this process began.
    offset: Duration,
    begin: Instant,
    shared: Shared,
    disk: Disk,
    thinker: Thinker,
    canary: Canary,
    links: BTreeMap<NodeId, Link>,
    nodes: BTreeMap<LinkId, NodeId>,
    ids: BTreeMap<String, NodeId>,
    jobs: BTreeMap<JobId, StoredJob>,
    times: BTreeMap<JobId, Times>,
    /// Pixels that came in and are neither on disk nor given up.
    pixels: BTreeMap<(JobId, LeaseId), Vec<u8>>,
    published: watch::Sender<Arc<Status>>,
    /// Whether more than a sign of life has come since the status was published.
    changed: bool,
}

/// The canary part: whoever renders it to the same bytes may render others.
#[derive(Clone, Copy)]
pub struct Canary {
    /// Chooses it.
    pub seed: u64,
    /// What it comes to here.
    pub hash: [u8; 32],
}

impl Canary {
    /// Renders it.
    ///
    /// # Errors
    /// In words, when it cannot be rendered here.
    pub fn render() -> std::result::Result<Self, String> {
        let seed = tls::random();
        Ok(Self { seed, hash: part::canary_hash(seed).map_err(|error| error.to_string())? })
    }
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
        let known = farm.jobs().into_iter().filter_map(|job| Some((job.id, shared.store.get_job(job.id).ok()?)));
        let jobs: BTreeMap<JobId, StoredJob> = known.collect();
        let begun = farm.jobs().into_iter().filter(|job| job.outcome.is_none() && job.phase != JobPhase::Waiting);
        begun.filter_map(|job| jobs.get_key_value(&job.id)).for_each(|(id, job)| thinker.load(*id, &job.description));
        let mut core = Self {
            offset: farm.now(),
            farm,
            begin: Instant::now(),
            shared,
            disk,
            thinker,
            canary,
            links: BTreeMap::new(),
            nodes: BTreeMap::new(),
            ids,
            jobs,
            times: BTreeMap::new(),
            pixels: BTreeMap::new(),
            published,
            changed: true,
        };
        core.recover()?;
        Ok(core)
    }

    /// Steps through what the journal alone does not know: parts whose pixels reached the disk when their commit did not.
    fn recover(&mut self) -> Result<()> {
        for job in self.farm.jobs().into_iter().filter(|job| job.outcome.is_none()) {
            let committed: BTreeSet<LeaseId> = self.farm.committed(job.id).into_iter().map(|(_, _, lease)| lease).collect();
            for lease in self.disk.pixels.stored(job.id)?.into_iter().filter(|lease| !committed.contains(lease)) {
                self.step(Event::Committed { job: job.id, lease });
            }
        }
        self.step(Event::Restarted);
        Ok(())
    }

    /// Works until nobody can send inputs any more, or the process ends.
    pub async fn run(mut self, mut inputs: mpsc::Receiver<Input>) {
        let mut waiting = Vec::new();
        let mut publish = TokioInstant::now();
        loop {
            let deadline = self.deadline();
            tokio::select! {
                received = inputs.recv_many(&mut waiting, INPUT_BATCH) => {
                    if received == 0 {
                        return;
                    }
                    waiting.drain(..).for_each(|input| self.handle(input));
                }
                () = sleep_until(deadline.unwrap_or(self.begin).into()), if deadline.is_some() => {}
                () = sleep_until(publish), if self.changed => {}
            }
            if let Some(deadline) = self.deadline().filter(|deadline| *deadline <= Instant::now()) {
                self.tick(deadline);
            }
            if self.changed && TokioInstant::now() >= publish {
                self.publish();
                publish = TokioInstant::now() + STATUS_INTERVAL;
            }
        }
    }

    /// When the core wants to be told of the time.
    fn deadline(&self) -> Option<Instant> {
        self.farm.next_deadline().map(|at| self.begin + at.saturating_sub(self.offset))
    }

    /// Time has come. If it is long past, this process itself was away, and the silence of others says nothing.
    fn tick(&mut self, deadline: Instant) {
        if deadline.elapsed() > LATE_TICK {
            tracing::warn!("this process did not run for a while: nodes are given time to be heard");
            let all: Vec<_> = self.links.iter().map(|(node, link)| (*node, link.incarnation)).collect();
            all.into_iter().for_each(|(node, incarnation)| self.step(Event::NodeHeard { node, incarnation }));
        }
        self.step(Event::Tick);
    }

    fn handle(&mut self, input: Input) {
        match input {
            Input::Joined { link, name, hello, address, outgoing, known } => {
                self.joined(link, name, hello, address.to_string(), outgoing);
                let _ = known.send(());
            }
            Input::Heard(link) => self.of(link, |_, node, incarnation| Some(Event::NodeHeard { node, incarnation })),
            Input::Said(link, message) => self.of(link, |core, node, incarnation| core.said(node, incarnation, message)),
            Input::Delivered(link, header, bytes) => {
                self.of(link, |core, node, incarnation| core.delivered(node, incarnation, &header, bytes))
            }
            Input::Damaged(link, job, lease) => self.of(link, |_, node, incarnation| {
                Some(Event::RenderFailed { node, incarnation, job, lease, reason: "its pixels do not agree with their hash".to_owned() })
            }),
            Input::Gone(link, left) => self.gone(link, left),
            Input::Assemble(job) => {
                if self.farm.jobs().iter().any(|known| known.id == job && known.phase == JobPhase::Assembling) {
                    self.assemble(job);
                }
            }
            Input::Event(event) => {
                if let Event::Committed { job, lease } = event {
                    self.settle(job, lease);
                }
                self.step(event);
            }
            Input::Submit { description, min_nodes, reply } => {
                let submitted = self.submit(*description, min_nodes);
                // Taken is what is on disk. Whoever asked may have gone meanwhile.
                self.disk.then(move || drop(reply.send(submitted)));
            }
            Input::Cancel { job, reason, reply } => {
                let running = self.farm.jobs().iter().any(|known| known.id == job && known.outcome.is_none());
                if running {
                    self.step(Event::JobCancelled { job, reason });
                }
                let _ = reply.send(if running { Ok(()) } else { Err(format!("there is no job {} that runs or waits", job.0)) });
            }
        }
    }

    /// The node at the other end of a connection, if that is still the connection of this node.
    fn at(&self, link: LinkId) -> Option<(NodeId, Incarnation)> {
        let node = *self.nodes.get(&link)?;
        self.links.get(&node).filter(|latest| latest.id == link).map(|latest| (node, latest.incarnation))
    }

    fn of(&mut self, link: LinkId, act: impl FnOnce(&mut Self, NodeId, Incarnation) -> Option<Event>) {
        let Some((node, incarnation)) = self.at(link) else { return };
        if let Some(event) = act(self, node, incarnation) {
            self.step(event);
        }
    }

    fn joined(&mut self, id: LinkId, name: String, hello: Hello, address: String, outgoing: mpsc::Sender<Outgoing>) {
        let next = NodeId(u32::try_from(self.ids.len()).unwrap_or(u32::MAX));
        let node = *self.ids.entry(name.clone()).or_insert(next);
        let incarnation = hello.incarnation;
        tracing::info!(node = name, address, lanes = hello.lanes, build = hello.build, "a node joined");
        self.nodes.insert(id, node);
        self.links.insert(node, Link { id, incarnation, outgoing });
        let info = NodeInfo { name, lanes: hello.lanes, build: hello.build, address };
        self.step(Event::NodeJoined { node, incarnation, info });
        if hello.revision != tessera_engine::REVISION {
            let reason = format!("its engine has revision {}, the coordinator's {}", hello.revision, tessera_engine::REVISION);
            self.step(Event::NodeProved { node, incarnation, verdict: Err(reason) });
        }
    }

    fn said(&mut self, node: NodeId, incarnation: Incarnation, message: FromNode) -> Option<Event> {
        match message {
            FromNode::Proof { hash } => {
                let verdict = if hash == self.canary.hash {
                    Ok(())
                } else {
                    Err("it renders the canary part to other bytes than the coordinator: its processor or its build computes differently"
                        .to_owned())
                };
                Some(Event::NodeProved { node, incarnation, verdict })
            }
            FromNode::Prepared { job, result } => Some(Event::Prepared { node, incarnation, job, result }),
            FromNode::Probed { job, cells } => Some(Event::Probed { node, incarnation, job, cells }),
            FromNode::Failed { job, lease, reason } => {
                self.shared.leases.remove_of(node, job, lease);
                Some(Event::RenderFailed { node, incarnation, job, lease, reason })
            }
            FromNode::Cancelled { job, lease } => {
                self.shared.leases.remove_of(node, job, lease);
                Some(Event::NodeHeard { node, incarnation })
            }
            // Its connection ends with it.
            FromNode::Goodbye { .. } => None,
        }
    }

    fn delivered(&mut self, node: NodeId, incarnation: Incarnation, header: &PartHeader, bytes: Vec<u8>) -> Option<Event> {
        let PartHeader { job, lease, seconds, hash, .. } = *header;
        let handed_out = self.shared.leases.get(job, lease).is_some_and(|lease| lease.incarnation == incarnation);
        if !handed_out || bytes.is_empty() {
            self.say(node, incarnation, ToNode::Settled { job, lease });
            return Some(Event::NodeHeard { node, incarnation });
        }
        if self.pixels.contains_key(&(job, lease)) {
            return Some(Event::NodeHeard { node, incarnation });
        }
        self.pixels.insert((job, lease), bytes);
        Some(Event::Rendered { node, incarnation, job, lease, hash, seconds })
    }

    /// A node that said goodbye, or was sent away, has left. One whose connection broke is only silent: it may come back with what it holds.
    fn gone(&mut self, link: LinkId, left: Option<String>) {
        let latest = self.at(link);
        self.nodes.remove(&link);
        if let (Some((node, incarnation)), Some(reason)) = (latest, left) {
            self.links.remove(&node);
            self.step(Event::NodeLeft { node, incarnation, reason });
        }
    }

    fn submit(&mut self, description: JobDescription, min_nodes: u32) -> std::result::Result<JobId, String> {
        let words = |error: &dyn std::fmt::Display| format!("the job could not be stored: {error}");
        let job = self.shared.store.next_job().map_err(|error| words(&error))?;
        let frame = postcard::to_stdvec(&description.frame).map_err(|error| words(&error))?;
        let frame = self.shared.store.put(&frame).map_err(|error| words(&error))?;
        let submitted = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let spec = spec(&description, min_nodes);
        let stored = StoredJob { description, frame, submitted };
        self.shared.store.put_job(job, &stored).map_err(|error| words(&error))?;
        tracing::info!(job = job.0, name = stored.description.name, "a job was submitted");
        self.jobs.insert(job, stored);
        self.step(Event::JobSubmitted { job, spec });
        self.publish();
        Ok(job)
    }

    fn step(&mut self, event: Event) {
        let now = self.offset + self.begin.elapsed();
        self.changed |= !matches!(event, Event::NodeHeard { .. });
        self.disk.note(&self.farm, now, &event);
        for command in self.farm.step(now, event) {
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
                if let Some(bytes) = self.pixels.get_mut(&(job, lease)) {
                    self.disk.commit(job, part, lease, std::mem::take(bytes));
                }
            }
            Command::Discard { job, lease, reason } => self.discard(job, lease, reason),
            Command::Assemble { job } => self.assemble(job),
            Command::End { job, outcome } => {
                tracing::info!(job = job.0, ?outcome, "a job ended");
                self.shared.leases.remove_job(job);
                self.pixels.retain(|(other, _), _| *other != job);
                self.thinker.forget(job);
                self.disk.forget(job);
                self.publish();
            }
        }
    }

    fn for_the_wire(&mut self, node: NodeId, incarnation: Incarnation, message: farm::ToNode) -> Option<ToNode> {
        Some(match message {
            farm::ToNode::Prove => ToNode::Prove { seed: self.canary.seed },
            farm::ToNode::Prepare { job } => {
                let stored = self.jobs.get(&job)?;
                self.thinker.load(job, &stored.description);
                ToNode::Prepare { job, frame: stored.frame, assets: stored.description.assets.clone() }
            }
            farm::ToNode::Probe { job, cells, stride } => ToNode::Probe { job, cells, stride },
            farm::ToNode::Render { job, lease, rect, samples } => {
                self.shared.leases.add(job, lease, Lease { node, incarnation, frame: self.jobs.get(&job)?.frame, rect });
                ToNode::Render { job, lease, rect, samples }
            }
            farm::ToNode::Cancel { job, lease } => ToNode::Cancel { job, lease },
            farm::ToNode::Release { job } => ToNode::Release { job },
        })
    }

    fn link_of(&mut self, node: NodeId, incarnation: Incarnation) -> Option<&mut Link> {
        self.links.get_mut(&node).filter(|link| link.incarnation == incarnation)
    }

    fn say(&mut self, node: NodeId, incarnation: Incarnation, message: ToNode) {
        let Some(link) = self.link_of(node, incarnation) else { return };
        if link.outgoing.try_send(Outgoing::Say(message)).is_err() {
            tracing::debug!(node = node.0, "a message could not be handed to its connection");
        }
    }

    fn close(&mut self, node: NodeId, incarnation: Incarnation, reason: String) {
        let name = self.ids.iter().find(|(_, id)| **id == node).map_or("?", |(name, _)| name.as_str());
        tracing::warn!(node = name, reason, "a node is sent away");
        if let Some(link) = self.link_of(node, incarnation) {
            let _ = link.outgoing.try_send(Outgoing::Close(reason));
        }
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

    fn assemble(&mut self, job: JobId) {
        let (Some(stored), Some(record)) = (self.jobs.get(&job).cloned(), self.farm.record(job)) else { return };
        let assembly =
            Assembly { job, stored, record, parts: self.farm.committed(job), files: self.shared.store.files(job), made: Instant::now() };
        let (pixels, inputs) = (self.disk.pixels.clone(), self.shared.inputs.clone());
        tokio::task::spawn_blocking(move || {
            let input = match assemble::write(&assembly, &pixels) {
                Ok(()) => Input::Event(Event::Assembled { job, result: Ok(()) }),
                Err(Refusal::Pixels(reason)) => Input::Event(Event::Assembled { job, result: Err(reason) }),
                Err(Refusal::Files(reason)) => {
                    tracing::error!(job = job.0, reason, "the job keeps its parts until the disk takes its files");
                    thread::sleep(DISK_RETRY);
                    Input::Assemble(job)
                }
            };
            drop(inputs.blocking_send(input));
        });
    }

    fn publish(&mut self) {
        self.changed = false;
        let status = status::of(&self.farm, &mut self.times, self.offset + self.begin.elapsed());
        if *self.published.borrow().as_ref() != status {
            self.published.send_replace(Arc::new(status));
        }
        if self.shared.page.receiver_count() > 0 {
            let film =
                |id| self.jobs.get(&JobId(id)).map_or((0, 0), |job| (job.description.frame.film.width, job.description.frame.film.height));
            self.shared.page.send_replace(Arc::new(Snapshot::of(&self.farm, film)));
        }
    }
}

fn spec(description: &JobDescription, min_nodes: u32) -> JobSpec {
    let JobDescription { name, frame, probe, split, assign, .. } = description;
    JobSpec {
        name: name.clone(),
        width: frame.film.width,
        height: frame.film.height,
        samples: u64::from(frame.quality.samples),
        probe: probe.clone(),
        split: split.clone(),
        assign: *assign,
        min_nodes: min_nodes.max(1),
    }
}
