//! `tessera coordinator`: leads a farm.

use std::{
    net::{Ipv4Addr, SocketAddr},
    path::PathBuf,
};

use tokio::{net::TcpListener, sync::oneshot, time::sleep};

use super::{
    render::seconds,
    runtime::{interrupted, runtime, start_logs},
};
use crate::{
    config::{Config, PORT, required},
    coordinator::{Coordinator, Options, Pulse, Retention},
    error::{Error, ExitCode, Result},
    farm::FarmConfig,
    limits::{FREE_BYTES, KEPT_BYTES, KEPT_FOR, NO_NODE_TIMEOUT, SUBMITTER_BYTES},
    supervisor::{self, Watchdog},
    web,
    wire::tls::{Authority, Identity, Role},
};

/// Arguments of `tessera coordinator`.
#[derive(clap::Args)]
pub struct Args {
    /// Address and UDP port to listen on; port 0 takes a free one [default: 0.0.0.0:7143].
    #[arg(long, env = "TESSERA_LISTEN", value_name = "ADDR:PORT")]
    listen: Option<SocketAddr>,
    /// Folder of jobs, assets and the journal, made where it is missing.
    #[arg(long, env = "TESSERA_DATA", value_name = "DIR")]
    data: Option<PathBuf>,
    /// The coordinator's identity: a file made by `tessera keys`, or a folder that holds one.
    #[arg(long, env = "TESSERA_KEYS", value_name = "PATH")]
    keys: Option<PathBuf>,
    /// Key with which those are certified who join with a token: a file made by `tessera keys issuer` [default: none, and nobody can join].
    #[arg(long, env = "TESSERA_ISSUER", value_name = "PATH")]
    issuer: Option<PathBuf>,
    /// Bytes of assets and jobs that one submitter may leave here [default: 64 GiB].
    #[arg(long, value_name = "BYTES")]
    submitter_bytes: Option<u64>,
    /// List of revoked certificates, read again when it changes [default: `revoked` in the folder of --data].
    #[arg(long, env = "TESSERA_REVOKED", value_name = "FILE")]
    revoked: Option<PathBuf>,
    /// Seconds that a job waits for any node before it fails [default: 60].
    #[arg(long, value_name = "SECONDS")]
    no_node_timeout: Option<f64>,
    /// Address of the status page, plain HTTP for anyone who can reach it: keep it on loopback, or behind a proxy that asks who is there.
    /// A socket that the service manager hands over goes before it.
    #[arg(long, env = "TESSERA_WEB", value_name = "ADDR:PORT")]
    web: Option<SocketAddr>,
    /// Settings file; flags and environment go before it.
    #[arg(long, env = "TESSERA_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
}

/// Runs `tessera coordinator`.
pub fn run(args: Args) -> Result<()> {
    start_logs("info");
    let file = Config::read(args.config.as_deref())?.coordinator;
    let no_node_timeout = args.no_node_timeout.or(file.no_node_timeout).unwrap_or(NO_NODE_TIMEOUT.as_secs_f64());
    let options = Options {
        listen: args.listen.or(file.listen).unwrap_or_else(|| SocketAddr::from((Ipv4Addr::UNSPECIFIED, PORT))),
        data: required(args.data.or(file.data), "--data", "coordinator.data")?,
        identity: Identity::load(&required(args.keys.or(file.keys), "--keys", "coordinator.keys")?, Role::Coordinator)?,
        issuer: args.issuer.or(file.issuer).map(|path| Authority::load_issuer(&path)).transpose()?,
        submitter_bytes: args.submitter_bytes.or(file.submitter_bytes).unwrap_or(SUBMITTER_BYTES),
        revoked: args.revoked.or(file.revoked),
        farm: FarmConfig { no_node_timeout: seconds(no_node_timeout)?, ..FarmConfig::default() },
        free_bytes: file.free_bytes.unwrap_or(FREE_BYTES),
        retention: Retention {
            age: file.keep_days.map_or(Ok(KEPT_FOR), |days| seconds(days * 86_400.0))?,
            bytes: file.keep_bytes.unwrap_or(KEPT_BYTES),
        },
    };
    if let Some(warning) = options.identity.warning() {
        tracing::warn!(warning, "renew the coordinator's key");
    }
    let web = args.web.or(file.web);
    runtime()?.block_on(async {
        let page = match (supervisor::listener()?, web) {
            (Some(listener), _) => Some(TcpListener::from_std(listener).map_err(|error| Error::new(ExitCode::Farm, error.to_string()))?),
            (None, Some(address)) => Some(listen(address).await?),
            (None, None) => None,
        };
        let coordinator = Coordinator::start(options).await?;
        println!("listening on {}", coordinator.address);
        let (stop, stopped) = oneshot::channel::<()>();
        if let Some(listener) = page {
            if let Ok(address) = listener.local_addr() {
                println!("status page at http://{address}/");
            }
            tokio::spawn(web::serve(listener, coordinator.page(), coordinator.metrics.clone(), async { drop(stopped.await) }));
        }
        supervisor::ready();
        let feeding = tokio::spawn(feed_watchdog(coordinator.pulse()));
        interrupted().await;
        supervisor::stopping();
        feeding.abort();
        drop(stop);
        coordinator.stop().await;
        Ok(())
    })
}

async fn listen(address: SocketAddr) -> Result<TcpListener> {
    TcpListener::bind(address).await.map_err(|error| {
        Error::new(ExitCode::Farm, format!("the status page cannot be served at {address}: {error}"))
            .with_help("choose another address with --web")
    })
}

/// Feeds the watchdog as long as the core answers.
async fn feed_watchdog(pulse: Pulse) {
    let watchdog = Watchdog::new();
    let Some(pause) = watchdog.pause() else { return };
    while pulse.felt().await {
        watchdog.feed();
        sleep(pause).await;
    }
}
