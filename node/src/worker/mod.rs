//! The worker: the shell around the engine. Joins a coordinator, renders parts on its lanes, hands them in.
//!
//! The network has a thread of its own with a runtime of its own; rendering happens on lanes of lower priority, so heartbeats go out
//! whatever the load. What a lane has rendered is kept until the coordinator says that it is settled, over as many connections as it takes.

mod cache;
mod drain;
mod fetch;
mod lanes;
mod life;
mod session;

use std::{
    net::{SocketAddr, ToSocketAddrs},
    path::PathBuf,
    sync::atomic::AtomicBool,
    time::{Duration, Instant},
};

use tessera_engine::{
    part::{Cancelled, Rect, RenderedPart, SampleRange},
    scene::Scene,
};
use tokio::{
    sync::{mpsc, watch},
    time::{sleep, timeout},
};

use self::{
    cache::Cache,
    drain::{Drain, Step},
    lanes::Lanes,
    life::{Done, Life},
    session::{Backoff, Ended, Node},
};
use crate::{
    error::{Error, ExitCode, Result},
    farm::Incarnation,
    limits::{COMPLAINT_INTERVAL, CONNECT_TIMEOUT},
    supervisor::Watchdog,
    wire::{
        self,
        tls::{self, Identity},
    },
};

/// Renders one part: [`tessera_engine::part::render`]. A node of the tests, and of no one else, does it wrongly.
pub type Renderer = fn(&Scene, Rect, SampleRange, &AtomicBool) -> Result<RenderedPart, Cancelled>;

/// How a node is set up.
pub struct Options {
    /// Host and port of the coordinator. The name is looked up at every attempt to connect, for addresses change.
    pub coordinator: String,
    /// Proves that it belongs to the farm.
    pub identity: Identity,
    /// Rendering threads, at least 1.
    pub lanes: u32,
    /// Folder of fetched assets; `None` keeps them in memory.
    pub cache: Option<PathBuf>,
    /// Bytes of fetched assets.
    pub cache_bytes: u64,
    /// How long it may take to finish what its lanes render when it is told to go.
    pub drain: Duration,
    /// What its lanes do with a part.
    pub render: Renderer,
}

/// Works until it is told to go, and joins again for ever when the connection breaks. Told once it drains; told twice it goes at once.
///
/// # Errors
/// When the machine gives no threads, no socket or no cache folder; never because of the network.
pub fn run(options: &Options, told: watch::Receiver<u32>) -> Result<()> {
    let internal = |error: std::io::Error| Error::new(ExitCode::Internal, format!("cannot start: {error}"));
    let cache = Cache::new(options.cache.as_deref(), options.cache_bytes)
        .map_err(|error| Error::new(ExitCode::File, format!("the cache {:?}: {error}", options.cache)))?;
    let lanes = Lanes::start(options.lanes).map_err(internal)?;
    let node = Node { lanes, lane_count: options.lanes, cache, watchdog: Watchdog::new() };
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build().map_err(internal)?;
    runtime.block_on(join_for_ever(options, &node, Drain::new(told, options.drain)))
}

async fn join_for_ever(options: &Options, node: &Node, mut drain: Drain) -> Result<()> {
    let (mut life, mut done) = Life::new(Incarnation(tls::random()), node.lanes.clone(), options.render);
    let (mut backoff, mut trouble) = (Backoff::default(), Trouble::default());
    loop {
        node.watchdog.feed();
        match join_once(options, node, &mut life, &mut done, (&mut backoff, &mut drain)).await {
            Ended::Stopped => return Ok(()),
            Ended::Broken(reason) => {
                if trouble.is_news(&reason) {
                    tracing::warn!(reason, coordinator = options.coordinator, "not connected; trying again until it works");
                }
            }
            Ended::Closed(reason) => {
                if trouble.is_news(&reason) {
                    tracing::warn!(
                        reason,
                        coordinator = options.coordinator,
                        "the coordinator closed the connection; trying again until it works"
                    );
                }
                (life, done) = Life::new(Incarnation(tls::random()), node.lanes.clone(), options.render);
            }
        }
        tokio::select! {
            Step::Go = drain.next(life.is_busy()) => return Ok(()),
            () = sleep(backoff.pause()) => {}
        }
    }
}

/// What is wrong, said once, and again only after a while.
#[derive(Default)]
struct Trouble(Option<(String, Instant)>);

impl Trouble {
    fn is_news(&mut self, reason: &str) -> bool {
        if self.0.as_ref().is_some_and(|(last, since)| last == reason && since.elapsed() < COMPLAINT_INTERVAL) {
            return false;
        }
        self.0 = Some((reason.to_owned(), Instant::now()));
        true
    }
}

async fn join_once(
    options: &Options,
    node: &Node,
    life: &mut Life,
    done: &mut mpsc::UnboundedReceiver<Done>,
    (backoff, drain): (&mut Backoff, &mut Drain),
) -> Ended {
    let connect = async {
        let address = resolve(&options.coordinator).await?;
        let endpoint = wire::client(&options.identity, address).map_err(|error| error.to_string())?;
        let connection = wire::connect(&endpoint, address).await.map_err(|refusal| refusal.to_string())?;
        Ok::<_, String>((endpoint, connection))
    };
    let connected = tokio::select! {
        Step::Go = drain.next(life.is_busy()) => return Ended::Stopped,
        connected = timeout(CONNECT_TIMEOUT, connect) => connected,
    };
    let (endpoint, connection) = match connected {
        Ok(Ok(connected)) => connected,
        Ok(Err(error)) => return Ended::Broken(error),
        Err(_) => return Ended::Broken(format!("no answer within {} s", CONNECT_TIMEOUT.as_secs())),
    };
    tracing::info!(coordinator = options.coordinator, name = options.identity.peer().name, "connected");
    let connected = Instant::now();
    let ended = session::run(node, &connection, life, done, drain).await;
    if connected.elapsed() > CONNECT_TIMEOUT {
        *backoff = Backoff::default();
    }
    // What was said last still has to leave.
    let _ = timeout(crate::limits::FAREWELL, endpoint.wait_idle()).await;
    ended
}

async fn resolve(host: &str) -> Result<SocketAddr, String> {
    let owned = host.to_owned();
    let found = tokio::task::spawn_blocking(move || owned.to_socket_addrs().map(|mut all| all.next())).await;
    match found {
        Ok(Ok(Some(address))) => Ok(address),
        Ok(Ok(None)) => Err(format!("{host} has no address")),
        Ok(Err(error)) => Err(format!("{host}: {error}")),
        Err(error) => Err(error.to_string()),
    }
}
