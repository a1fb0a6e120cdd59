//! One life of a node: what it holds between connections, and the work it gives to its lanes.

use std::{
    collections::BTreeMap,
    sync::{
        Arc,
        atomic::{AtomicBool, Ordering},
    },
    time::Instant,
};

use tessera_engine::{
    description::AssetId,
    part::{self, Rect, SampleRange},
    scene::Scene,
};
use tokio::sync::mpsc;

use super::{Renderer, lanes::Lanes};
use crate::{
    farm::{Incarnation, JobId, LeaseId},
    wire::{FromNode, PartHeader, ToNode},
};

/// A rendered part until the coordinator has settled it.
pub struct Delivery {
    /// What is announced.
    pub header: PartHeader,
    /// The pixels.
    pub bytes: Vec<u8>,
}

/// What lanes and the fetching of scenes come to.
pub enum Done {
    /// Something to be said.
    Say(FromNode),
    /// A scene stands, or does not.
    Compiled(JobId, AssetId, Result<Arc<Scene>, String>),
    /// A probe cell was measured (`None`: it was stopped): seconds per sample of a pixel.
    Measured(ProbeId, u32, Result<Option<f64>, String>),
    /// A part was rendered (`None`: it was stopped).
    Rendered(JobId, LeaseId, Result<Option<Delivery>, String>),
}

/// What a message leads to beside work on lanes.
pub enum Reaction {
    /// Nothing.
    Nothing,
    /// Something is to be said.
    Say(FromNode),
    /// Hand in a part.
    Deliver(Arc<Delivery>),
    /// Fetch a frame and its assets and compile it.
    Fetch(JobId, AssetId, Vec<AssetId>),
}

struct Job {
    frame: AssetId,
    scene: Option<Arc<Scene>>,
}

/// A probe among those of a life.
type ProbeId = u64;

struct Probe {
    job: JobId,
    asked: Vec<(u32, Rect)>,
    answered: usize,
    cells: Vec<(u32, f64)>,
    cancel: Arc<AtomicBool>,
}

impl Drop for Probe {
    fn drop(&mut self) {
        self.cancel.store(true, Ordering::Relaxed);
    }
}

/// The state of one life.
pub struct Life {
    /// Its name.
    pub incarnation: Incarnation,
    /// Where lanes put what they come to.
    pub done: mpsc::UnboundedSender<Done>,
    lanes: Lanes,
    render: Renderer,
    jobs: BTreeMap<JobId, Job>,
    probes: BTreeMap<ProbeId, Probe>,
    last_probe: ProbeId,
    running: BTreeMap<(JobId, LeaseId), Arc<AtomicBool>>,
    outbox: BTreeMap<(JobId, LeaseId), Arc<Delivery>>,
}

impl Drop for Life {
    fn drop(&mut self) {
        self.running.values().for_each(|cancel| cancel.store(true, Ordering::Relaxed));
    }
}

impl Life {
    /// A new life, and the other end of its `done`.
    pub fn new(incarnation: Incarnation, lanes: Lanes, render: Renderer) -> (Self, mpsc::UnboundedReceiver<Done>) {
        let (done, received) = mpsc::unbounded_channel();
        let life = Self {
            incarnation,
            done,
            lanes,
            render,
            jobs: BTreeMap::new(),
            probes: BTreeMap::new(),
            last_probe: 0,
            running: BTreeMap::new(),
            outbox: BTreeMap::new(),
        };
        (life, received)
    }

    /// Whether it holds anything that the coordinator waits for.
    pub fn is_busy(&self) -> bool {
        !self.running.is_empty() || !self.outbox.is_empty()
    }

    /// What is to be handed in once more.
    pub fn unsettled(&self) -> Vec<Arc<Delivery>> {
        self.outbox.values().cloned().collect()
    }

    /// Does what the coordinator asks.
    pub fn hear(&mut self, message: ToNode) -> Reaction {
        match message {
            ToNode::Prove { seed } => self.prove(seed),
            ToNode::Prepare { job, frame, assets } => return self.prepare(job, frame, assets),
            ToNode::Probe { job, cells, stride } => return self.probe(job, cells, stride),
            ToNode::Render { job, lease, rect, samples } => return self.render(job, lease, rect, samples),
            ToNode::Cancel { job, lease } => return self.cancel(job, lease),
            ToNode::Settled { job, lease } => {
                self.outbox.remove(&(job, lease));
            }
            ToNode::Release { job } => self.release(job),
        }
        Reaction::Nothing
    }

    /// Takes what lanes came to.
    pub fn take(&mut self, done: Done) -> Reaction {
        match done {
            Done::Say(message) => Reaction::Say(message),
            Done::Compiled(job, frame, result) => self.compiled(job, frame, result),
            Done::Measured(id, cell, result) => self.measured(id, cell, result),
            Done::Rendered(job, lease, result) => self.rendered(job, lease, result),
        }
    }

    fn prove(&self, seed: u64) {
        let done = self.done.clone();
        self.lanes.add(self.lanes.shared(move || part::canary_hash(seed).map_err(|error| error.to_string())), move |result| {
            match result.and_then(|result| result) {
                Ok(hash) => drop(done.send(Done::Say(FromNode::Proof { hash }))),
                Err(error) => tracing::error!(error, "the canary part cannot be rendered"),
            }
        });
    }

    fn prepare(&mut self, job: JobId, frame: AssetId, assets: Vec<AssetId>) -> Reaction {
        match self.jobs.get(&job) {
            Some(known) if known.frame == frame && known.scene.is_some() => Reaction::Say(FromNode::Prepared { job, result: Ok(()) }),
            _ => {
                self.jobs.insert(job, Job { frame, scene: None });
                Reaction::Fetch(job, frame, assets)
            }
        }
    }

    fn compiled(&mut self, job: JobId, frame: AssetId, result: Result<Arc<Scene>, String>) -> Reaction {
        let Some(known) = self.jobs.get_mut(&job).filter(|known| known.frame == frame) else { return Reaction::Nothing };
        let result = result.map(|scene| known.scene = Some(scene));
        if result.is_err() {
            self.jobs.remove(&job);
        }
        Reaction::Say(FromNode::Prepared { job, result })
    }

    fn scene(&self, job: JobId) -> Option<(AssetId, Arc<Scene>)> {
        let known = self.jobs.get(&job)?;
        Some((known.frame, known.scene.clone()?))
    }

    fn probe(&mut self, job: JobId, cells: Vec<(u32, Rect)>, stride: u32) -> Reaction {
        let Some((_, scene)) = self.scene(job) else {
            return Reaction::Say(FromNode::Prepared { job, result: Err("asked to probe a scene that is not here".to_owned()) });
        };
        if cells.is_empty() {
            return Reaction::Say(FromNode::Probed { job, cells: Vec::new() });
        }
        // A coordinator that does not know what a broken connection swallowed asks again.
        if self.probes.values().any(|probe| probe.job == job && probe.asked == cells) {
            return Reaction::Nothing;
        }
        self.last_probe += 1;
        let (id, cancel) = (self.last_probe, Arc::new(AtomicBool::new(false)));
        for (cell, rect) in cells.iter().copied() {
            let (done, scene) = (self.done.clone(), scene.clone());
            let cancel = cancel.clone();
            let measure = move || {
                let start = Instant::now();
                let samples = part::probe(&scene, rect, stride, &cancel).ok()?;
                Some(start.elapsed().as_secs_f64() / samples.max(1) as f64)
            };
            self.lanes.add_first(measure, move |result| drop(done.send(Done::Measured(id, cell, result))));
        }
        self.probes.insert(id, Probe { job, asked: cells, answered: 0, cells: Vec::new(), cancel });
        Reaction::Nothing
    }

    fn measured(&mut self, id: ProbeId, cell: u32, result: Result<Option<f64>, String>) -> Reaction {
        let Some(probe) = self.probes.get_mut(&id) else { return Reaction::Nothing };
        match result {
            Ok(seconds) => probe.cells.extend(seconds.map(|seconds| (cell, seconds))),
            Err(error) => tracing::error!(cell, error, "a cell could not be measured"),
        }
        probe.answered += 1;
        if probe.answered < probe.asked.len() {
            return Reaction::Nothing;
        }
        let Some(mut probe) = self.probes.remove(&id) else { return Reaction::Nothing };
        probe.cells.sort_by_key(|(cell, _)| *cell);
        Reaction::Say(FromNode::Probed { job: probe.job, cells: std::mem::take(&mut probe.cells) })
    }

    fn render(&mut self, job: JobId, lease: LeaseId, rect: Rect, samples: SampleRange) -> Reaction {
        if self.running.contains_key(&(job, lease)) || self.outbox.contains_key(&(job, lease)) {
            return Reaction::Nothing;
        }
        let Some((frame, scene)) = self.scene(job) else {
            return Reaction::Say(FromNode::Failed { job, lease, reason: "the scene is not here".to_owned() });
        };
        let cancel = Arc::new(AtomicBool::new(false));
        self.running.insert((job, lease), cancel.clone());
        let (done, render) = (self.done.clone(), self.render);
        let work = move || {
            let start = Instant::now();
            let rendered = render(&scene, rect, samples, &cancel).ok()?;
            let (seconds, invalid_samples) = (start.elapsed().as_secs_f64(), rendered.counters.invalid_samples);
            let header = PartHeader { job, lease, frame, seconds, hash: rendered.hash(), invalid_samples };
            Some(Delivery { header, bytes: rendered.to_bytes() })
        };
        self.lanes.add(work, move |result| drop(done.send(Done::Rendered(job, lease, result))));
        Reaction::Nothing
    }

    fn rendered(&mut self, job: JobId, lease: LeaseId, result: Result<Option<Delivery>, String>) -> Reaction {
        self.running.remove(&(job, lease));
        match result {
            Ok(Some(delivery)) => {
                let delivery = Arc::new(delivery);
                self.outbox.insert((job, lease), delivery.clone());
                Reaction::Deliver(delivery)
            }
            Ok(None) => Reaction::Say(FromNode::Cancelled { job, lease }),
            Err(reason) => Reaction::Say(FromNode::Failed { job, lease, reason }),
        }
    }

    fn cancel(&mut self, job: JobId, lease: LeaseId) -> Reaction {
        match self.running.get(&(job, lease)) {
            Some(cancel) => {
                cancel.store(true, Ordering::Relaxed);
                Reaction::Nothing
            }
            None => {
                self.outbox.remove(&(job, lease));
                Reaction::Say(FromNode::Cancelled { job, lease })
            }
        }
    }

    fn release(&mut self, job: JobId) {
        self.jobs.remove(&job);
        self.probes.retain(|_, probe| probe.job != job);
        self.outbox.retain(|(other, _), _| *other != job);
        self.running.iter().filter(|((other, _), _)| *other == job).for_each(|(_, cancel)| cancel.store(true, Ordering::Relaxed));
    }
}
