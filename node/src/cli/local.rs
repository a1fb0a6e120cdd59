//! A farm on this machine for one job: a coordinator in this process, nodes in processes of their own, keys that nobody keeps.

use std::{
    net::{Ipv4Addr, SocketAddr},
    path::{Path, PathBuf},
    process::{ExitStatus, Stdio},
};

use tokio::{
    process::{Child, Command},
    task::JoinSet,
};

use super::client::Client;
use crate::{
    coordinator::{Coordinator, Options, Retention},
    error::{Error, ExitCode, Result},
    farm::FarmConfig,
    wire::tls::{Authority, Identity, Role},
};

/// The farm. Its nodes end with it.
pub struct LocalFarm {
    /// Names of the node processes, and their numbers.
    pub nodes: Vec<(String, u32)>,
    coordinator: Coordinator,
    client: Identity,
    running: JoinSet<(String, std::io::Result<ExitStatus>)>,
    /// Keys, journal and output, until they are fetched.
    folder: PathBuf,
}

/// A folder for a farm. Whoever holds it lets it go when nobody writes there any more, which is after the runtime that the farm lives in.
///
/// # Errors
/// When the machine gives none.
pub fn folder() -> Result<tempfile::TempDir> {
    tempfile::Builder::new().prefix("tessera-").tempdir().map_err(|error| {
        Error::new(ExitCode::Internal, format!("{}: no temporary folder can be made there: {error}", std::env::temp_dir().display()))
            .with_help("let the environment variable TMPDIR name a folder that can be written and has room")
    })
}

fn unstarted(error: &std::io::Error) -> Error {
    Error::new(ExitCode::Internal, format!("cannot start a farm on this machine: {error}"))
}

impl LocalFarm {
    /// Starts within a [`folder`] a coordinator and `nodes` node processes of `lanes` rendering threads each.
    ///
    /// # Errors
    /// When the machine gives no port, no processes or no temporary folder.
    pub async fn start(nodes: u32, lanes: u32, farm: FarmConfig, folder: &Path) -> Result<Self> {
        let authority = Authority::new()?;
        let options = Options {
            listen: SocketAddr::from((Ipv4Addr::LOCALHOST, 0)),
            data: folder.join("data"),
            identity: authority.issue(Role::Coordinator, "coordinator")?,
            issuer: None,
            submitter_bytes: u64::MAX,
            revoked: None,
            farm,
            free_bytes: 0,
            retention: Retention::default(),
        };
        let coordinator = Coordinator::start(options).await?;
        let client = authority.issue(Role::Operator, "render")?;
        let mut local = Self { nodes: Vec::new(), coordinator, client, running: JoinSet::new(), folder: folder.to_owned() };
        for number in 1..=nodes {
            let name = format!("node-{number}");
            let child = local.spawn(&authority.issue(Role::Node, &name)?, lanes).map_err(|error| unstarted(&error))?;
            local.nodes.push((name.clone(), child.id().unwrap_or_default()));
            local.running.spawn(wait(name, child));
        }
        Ok(local)
    }

    fn spawn(&self, identity: &Identity, lanes: u32) -> std::io::Result<Child> {
        let keys = identity.save(&self.folder).map_err(std::io::Error::other)?;
        node_command(&self.coordinator.address.to_string(), &keys, lanes)?.arg("--cache").arg(self.assets()).spawn()
    }

    /// Where the coordinator has its assets: on one machine nodes read them there, and clients put them there.
    fn assets(&self) -> PathBuf {
        self.folder.join("data/assets")
    }

    /// A client of the farm.
    ///
    /// # Errors
    /// As [`Client::connect`].
    pub async fn client(&self) -> Result<Client> {
        Ok(Client::connect(&self.coordinator.address.to_string(), &self.client).await?.beside(self.assets()))
    }

    /// Waits until a node's process has ended, and says which and how. Never ends while there is no node process at all.
    ///
    /// # Errors
    /// When it was the last one: nobody is left to render.
    pub async fn node_ended(&mut self) -> Result<String> {
        let Some(ended) = self.running.join_next().await else { return std::future::pending().await };
        let said = match ended {
            Ok((name, Ok(status))) => format!("{name}: its process ended ({status})"),
            Ok((name, Err(error))) => format!("{name}: its process ended ({error})"),
            Err(error) => format!("a node's process was lost: {error}"),
        };
        if self.running.is_empty() {
            return Err(Error::new(ExitCode::Job, format!("no node is left to render the job; the last one was {said}"))
                .with_help("earlier output files are as they were"));
        }
        Ok(said)
    }

    /// Ends nodes and coordinator. Nobody is told: nobody is left who would come back.
    pub async fn stop(mut self) {
        self.running.shutdown().await;
        self.coordinator.abandon();
    }
}

/// A node process that ends with its owner. Its own process group, so that Ctrl-C reaches this process alone, which then ends its nodes in order.
///
/// # Errors
/// When the system does not say which program this is.
pub fn node_command(coordinator: &str, keys: &Path, lanes: u32) -> std::io::Result<Command> {
    let quiet = std::env::var_os("TESSERA_LOG").unwrap_or_else(|| "error".into());
    let mut command = Command::new(std::env::current_exe()?);
    command
        .args(["node", "--with-parent", "--coordinator", coordinator, "--lanes", &lanes.to_string(), "--keys"])
        .arg(keys)
        .env("TESSERA_LOG", quiet)
        .env_remove("TESSERA_CONFIG")
        .env_remove("TESSERA_CACHE")
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .process_group(0)
        .kill_on_drop(true);
    Ok(command)
}

async fn wait(name: String, mut child: Child) -> (String, std::io::Result<ExitStatus>) {
    // The child's stdin stays open as long as this process lives: that is how the node knows.
    let stdin = child.stdin.take();
    let status = child.wait().await;
    drop(stdin);
    (name, status)
}
