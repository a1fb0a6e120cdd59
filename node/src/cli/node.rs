//! `tessera node`: renders for a farm.

use std::{io::Read, path::PathBuf, process, thread};

use tessera_engine::part;

use super::{
    render::seconds,
    runtime::{count_signals, start_logs},
};
use crate::{
    config::{Config, required},
    error::{Error, ExitCode, Result},
    limits::{CACHE_BYTES, DRAIN_LIMIT},
    supervisor,
    wire::tls::{Identity, Role},
    worker,
};

/// Arguments of `tessera node`.
#[derive(clap::Args)]
pub struct Args {
    /// Host and port of the coordinator.
    #[arg(long, env = "TESSERA_COORDINATOR", value_name = "HOST:PORT")]
    coordinator: Option<String>,
    /// The node's identity: a file made by `tessera keys issue`, or a folder that holds one.
    #[arg(long, env = "TESSERA_KEYS", value_name = "PATH")]
    keys: Option<PathBuf>,
    /// Rendering threads [default: one a core].
    #[arg(long, env = "TESSERA_LANES", value_parser = clap::value_parser!(u32).range(1..=4096))]
    lanes: Option<u32>,
    /// Folder of fetched assets [default: memory].
    #[arg(long, env = "TESSERA_CACHE", value_name = "DIR")]
    cache: Option<PathBuf>,
    /// Bytes of fetched assets [default: 8 GiB].
    #[arg(long, value_name = "BYTES")]
    cache_bytes: Option<u64>,
    /// Seconds in which a node that is told to end (SIGTERM) finishes what its lanes render; told again it ends at once [default: 60].
    #[arg(long, value_name = "SECONDS", allow_negative_numbers = true)]
    drain: Option<f64>,
    /// Settings file; flags and environment go before it.
    #[arg(long, env = "TESSERA_CONFIG", value_name = "FILE")]
    config: Option<PathBuf>,
    /// End with the process that holds the other end of stdin.
    #[arg(long, hide = true)]
    with_parent: bool,
}

/// Runs `tessera node`.
pub fn run(args: Args) -> Result<()> {
    start_logs("info");
    let file = Config::read(args.config.as_deref())?.node;
    let options = worker::Options {
        coordinator: required(args.coordinator.or(file.coordinator), "--coordinator", "node.coordinator")?,
        identity: Identity::load(&required(args.keys.or(file.keys), "--keys", "node.keys")?, Role::Node)?,
        lanes: args.lanes.or(file.lanes).unwrap_or_else(cores).max(1),
        cache: args.cache.or(file.cache),
        cache_bytes: args.cache_bytes.or(file.cache_bytes).unwrap_or(CACHE_BYTES),
        drain: match args.drain.or(file.drain) {
            Some(length) => seconds(length)
                .map_err(|error| error.with_help("give --drain, or `drain` in the [node] section of the settings, 0 or more seconds"))?,
            None => DRAIN_LIMIT,
        },
        render: part::render,
    };
    if let Some(warning) = options.identity.warning() {
        tracing::warn!(warning, "renew this node's key");
    }
    if args.with_parent {
        end_with_parent()?;
    }
    let told = count_signals()?;
    // Ready does not mean connected: a node outlives its coordinator, and waits for it.
    supervisor::ready();
    worker::run(&options, told)
}

/// Cores that this process may use.
pub fn cores() -> u32 {
    thread::available_parallelism().map_or(1, |cores| u32::try_from(cores.get()).unwrap_or(1))
}

fn end_with_parent() -> Result<()> {
    let watch = || {
        // Nothing is ever written there: reading ends when the other end is closed, at the latest by the parent's death.
        let _ = std::io::stdin().read_to_end(&mut Vec::new());
        process::exit(0);
    };
    thread::Builder::new()
        .name("parent".to_owned())
        .spawn(watch)
        .map(drop)
        .map_err(|error| Error::new(ExitCode::Internal, format!("cannot start: {error}")))
}
