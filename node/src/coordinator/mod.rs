//! The coordinator: the shell around the farm's core. Sockets, clock, disk and policies stand here; decisions stand in [`crate::farm`].

mod asked;
mod assemble;
mod bands;
mod canary;
mod core;
mod disk;
mod gate;
mod housekeeping;
mod input;
mod jobs;
mod join;
mod kept;
mod leases;
mod links;
mod policy;
mod quota;
mod register;
mod requests;
mod retention;
mod revoked;
mod room;
mod session;
mod status;
mod store;
#[doc(hidden)]
pub mod submission;

use std::{net::SocketAddr, path::PathBuf, sync::Arc};

use quinn::Endpoint;
use tokio::{
    sync::{mpsc, oneshot, watch},
    task::JoinHandle,
};

pub use self::{
    assemble::{identity, write_pictures},
    retention::Retention,
};
use self::{
    canary::Canary,
    core::Core,
    disk::Disk,
    gate::{Admitted, Gate, Guest},
    input::Input,
    join::Joining,
    leases::Leases,
    policy::Thinker,
    quota::Quota,
    register::Register,
    room::Room,
    store::Store,
};
use crate::{
    error::{Error, ExitCode, Result},
    farm::FarmConfig,
    limits::EVENT_QUEUE,
    web::{Metrics, Snapshot},
    wire::{
        self, CLOSE_RESUME, Status,
        tls::{Authority, Identity, Role},
    },
};

/// How a coordinator is set up.
pub struct Options {
    /// Where it listens; port 0 takes a free one.
    pub listen: SocketAddr,
    /// Its folder.
    pub data: PathBuf,
    /// Proves that it is the coordinator.
    pub identity: Identity,
    /// Certifies those who join; nobody joins without.
    pub issuer: Option<Authority>,
    /// The list of revoked certificates; `None` takes `revoked` in its folder.
    pub revoked: Option<PathBuf>,
    /// Bytes that one submitter may leave here.
    pub submitter_bytes: u64,
    /// Timeouts.
    pub farm: FarmConfig,
    /// Bytes that stay free on its disk.
    pub free_bytes: u64,
    /// What is kept of jobs that are over.
    pub retention: Retention,
}

/// What every connection needs.
#[derive(Clone)]
struct Shared {
    inputs: mpsc::Sender<Input>,
    store: Store,
    leases: Leases,
    gate: Gate,
    joining: Joining,
    room: Room,
    quota: Quota,
    status: watch::Receiver<Arc<Status>>,
    /// What the status page shows; made only while somebody may look.
    page: watch::Sender<Arc<Snapshot>>,
    metrics: Arc<Metrics>,
}

impl Shared {
    /// Hands in what has an answer.
    async fn ask<T>(&self, input: Input, answer: oneshot::Receiver<Result<T, String>>) -> Result<T, String> {
        let ends = || "the coordinator ends".to_owned();
        self.inputs.send(input).await.map_err(|_| ends())?;
        answer.await.map_err(|_| ends())?
    }
}

/// Tells whether a coordinator's core still works.
#[derive(Clone)]
pub struct Pulse {
    inputs: mpsc::Sender<Input>,
}

impl Pulse {
    /// Waits until the core has taken all that came before and answers; false once it has ended.
    pub async fn felt(&self) -> bool {
        let (reply, answer) = oneshot::channel();
        self.inputs.send(Input::Ping(reply)).await.is_ok() && answer.await.is_ok()
    }
}

/// A running coordinator.
pub struct Coordinator {
    /// Where it listens.
    pub address: SocketAddr,
    /// How nodes and jobs stand.
    pub status: watch::Receiver<Arc<Status>>,
    /// What is counted and timed.
    pub metrics: Arc<Metrics>,
    page: watch::Sender<Arc<Snapshot>>,
    pulse: Pulse,
    endpoint: Endpoint,
    tasks: [JoinHandle<()>; 4],
}

impl Coordinator {
    /// Starts within the current runtime: reads the journal, then listens.
    ///
    /// # Errors
    /// When the address is taken, or the folder cannot be used.
    pub async fn start(options: Options) -> Result<Self> {
        let folder = |error: std::io::Error| Error::new(ExitCode::File, format!("{}: {error}", options.data.display()));
        let endpoint = wire::server(options.listen, &options.identity, options.issuer.is_some())?;
        let address = endpoint.local_addr().map_err(|error| Error::new(ExitCode::Farm, error.to_string()))?;
        let store = Store::open(&options.data, options.free_bytes).map_err(folder)?;
        let revoked = options.revoked.unwrap_or_else(|| options.data.join("revoked"));
        let revocations = revoked::open(&revoked)?;
        let joining = Joining::new(options.issuer, Register::open(&options.data)?);
        let quota = Quota::new(&options.data, options.submitter_bytes);
        let (inputs, received) = mpsc::channel(EVENT_QUEUE);
        let metrics = Arc::new(Metrics::default());
        let (disk, farm) = Disk::open(&options.data, options.farm, inputs.clone(), metrics.clone())?;
        let thinker = Thinker::new(inputs.clone());
        let data = options.data.clone();
        let canary = tokio::task::spawn_blocking(move || Canary::render(&data)).await;
        let canary = canary.map_err(|error| Error::new(ExitCode::Internal, error.to_string()))??;
        let (published, status) = watch::channel(Arc::default());
        let page = watch::Sender::new(Arc::default());
        let pulse = Pulse { inputs: inputs.clone() };
        let shared = Shared {
            inputs,
            store,
            leases: Leases::default(),
            gate: Gate::new(metrics.clone(), revocations.subscribe()),
            joining,
            room: Room::new(),
            quota,
            status: status.clone(),
            page: page.clone(),
            metrics: metrics.clone(),
        };
        let core = Core::new(farm, shared.clone(), disk, thinker, canary, published)?;
        // Before anyone is served it is on disk that this process began: a crash must not let another one give the same names to other attempts.
        let (on_disk, begun) = oneshot::channel();
        core.disk.then(move || _ = on_disk.send(()));
        let _ = begun.await;
        let keeping = tokio::spawn(housekeeping::keep(shared.clone(), options.retention));
        let following = tokio::spawn(revoked::follow(revoked, revocations));
        let tasks = [tokio::spawn(core.run(received)), tokio::spawn(accept(endpoint.clone(), shared)), keeping, following];
        Ok(Self { address, status, metrics, page, pulse, endpoint, tasks })
    }

    /// What the status page shows. From now on it is made.
    pub fn page(&self) -> watch::Receiver<Arc<Snapshot>> {
        self.page.subscribe()
    }

    /// Its core's pulse.
    pub fn pulse(&self) -> Pulse {
        self.pulse.clone()
    }

    /// Ends without a word to anybody.
    pub fn abandon(self) {
        self.tasks.iter().for_each(JoinHandle::abort);
    }

    /// Ends: connections are closed so that nodes keep what they hold and look for the coordinator again.
    pub async fn stop(self) {
        self.endpoint.close(CLOSE_RESUME.into(), b"the coordinator ends");
        self.tasks.iter().for_each(JoinHandle::abort);
        let _ = tokio::time::timeout(crate::limits::FAREWELL, self.endpoint.wait_idle()).await;
    }
}

async fn accept(endpoint: Endpoint, shared: Shared) {
    while let Some(incoming) = endpoint.accept().await {
        let Some((incoming, room)) = shared.gate.room(incoming) else { continue };
        let shared = shared.clone();
        tokio::spawn(async move {
            match shared.gate.admit(incoming, room).await {
                Some(Admitted::Guest(guest)) => serve(shared, guest).await,
                Some(Admitted::Joiner(joiner)) => shared.joining.serve(joiner, shared.gate.revoked()).await,
                None => {}
            }
        });
    }
}

async fn serve(shared: Shared, guest: Guest) {
    let (register, peer) = (shared.joining.register.clone(), guest.peer().clone());
    drop(tokio::task::spawn_blocking(move || register.see(&peer)));
    match guest.peer().role {
        Role::Node => session::serve(shared, guest).await,
        Role::Submitter | Role::Observer | Role::Operator => requests::serve(shared, guest).await,
        // The gate lets none in.
        Role::Coordinator => {}
    }
}
