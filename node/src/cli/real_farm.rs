//! `tessera verify farm --real`: a farm of processes on this machine, of which one after another is killed; what comes of it is measured.
//!
//! Moments are those of the manifests. When a node was killed is not known there: it was heard last at most a heartbeat before its death, so the
//! silence at its suspicion is the longest that noticing can have taken.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::PathBuf,
    process::Stdio,
    time::{Duration, Instant},
};

use tokio::{
    io::{AsyncBufReadExt, BufReader, Lines},
    process::{Child, ChildStdout, Command},
    time::sleep,
};

use super::{client::Client, local::node_command, progress::Show, render::outcome, runtime::block_on};
use crate::{
    error::{Error, ExitCode, Result},
    farm::{JobId, NodeState},
    job::{self, LoadedJob},
    manifest::{self, AttemptOutcome, EventEntry, EventKind, Manifest},
    report::lined_up,
    schedule::NodeId,
    simulate::Random,
    wire::{
        Terms,
        tls::{Authority, Identity, Role},
    },
};

/// Nodes of the farm, of one lane each.
const NODES: usize = 3;

/// Deaths of nodes to one of the coordinator.
const NODES_TO_COORDINATORS: u32 = 4;

/// The longest that noticing may take, in seconds.
const NOTICED_WITHIN: f64 = 1.0;

/// The longest that a coordinator may take until it listens again, in seconds.
const BACK_WITHIN: f64 = 3.0;

/// How often it is looked whether the moment has come.
const LOOK: Duration = Duration::from_millis(20);

/// Measures, and prints what was measured.
///
/// # Errors
/// When a promise is broken or a figure misses its goal, or when this machine gives no processes.
pub fn run(deaths: u32) -> Result<()> {
    let figures = block_on(measure(deaths))?;
    let head = ["figure", "times", "least", "median", "99 of 100", "most"].map(str::to_owned).to_vec();
    let rows = [
        ("s of silence until a death is noticed", &figures.noticed),
        ("s from there until its part is given to another", &figures.reassigned),
        ("s of rendering lost with a node", &figures.lost),
        ("s until a killed coordinator listens again", &figures.listening),
        ("s until it answers a client", &figures.answering),
    ];
    let rows: Vec<_> = std::iter::once(head).chain(rows.map(|(name, seconds)| row(name, seconds))).collect();
    lined_up(&rows).iter().for_each(|line| println!("{line}"));
    println!("{} parts in all; rendered again after they were committed: {}", figures.parts, figures.again);
    println!("pictures that differ from the first: {}", figures.pictures.len().saturating_sub(1));
    let missed: Vec<&str> = [
        (share(&figures.noticed, 0.99) > NOTICED_WITHIN, "a death was noticed late"),
        (share(&figures.listening, 1.0) > BACK_WITHIN, "a coordinator came back late"),
        (figures.again > 0, "committed parts were rendered again"),
        (figures.pictures.len() > 1, "pictures differ"),
    ]
    .into_iter()
    .filter_map(|(missed, what)| missed.then_some(what))
    .collect();
    if missed.is_empty() { Ok(()) } else { Err(Error::new(ExitCode::Verify, missed.join(", "))) }
}

#[derive(Default)]
struct Figures {
    noticed: Vec<f64>,
    reassigned: Vec<f64>,
    lost: Vec<f64>,
    listening: Vec<f64>,
    answering: Vec<f64>,
    parts: usize,
    again: usize,
    /// Hashes of all pictures.
    pictures: BTreeSet<[u8; 32]>,
}

fn row(name: &str, seconds: &[f64]) -> Vec<String> {
    let at = |place: f64| if seconds.is_empty() { "-".to_owned() } else { format!("{:.3}", share(seconds, place)) };
    vec![name.to_owned(), seconds.len().to_string(), at(0.0), at(0.5), at(0.99), at(1.0)]
}

/// The value below which this share of all is.
fn share(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let last = sorted.len().saturating_sub(1);
    sorted.get((share * last as f64).ceil() as usize).copied().unwrap_or(0.0)
}

async fn measure(deaths: u32) -> Result<Figures> {
    let mut farm = RealFarm::start().await?;
    let script = farm.folder.path().join("real.lua");
    fs::write(&script, include_str!("real_farm.lua")).map_err(|error| internal(&error))?;
    let (loaded, _) = job::load(&script, &BTreeMap::new())?;
    let (mut random, mut figures) = (Random::new(1), Figures::default());
    for death in 0..deaths {
        let (node, moment) = (random.below(NODES as u32) as usize, random.between(0.1, 0.7));
        let job = farm.begin(&loaded, moment).await?;
        farm.kill_node(node).await?;
        let manifest = farm.end(job, &loaded, &mut figures).await?;
        figures.take_death(&manifest, &node_name(node));
        farm.start_node(node)?;
        if death % NODES_TO_COORDINATORS == 0 {
            let job = farm.begin(&loaded, random.between(0.1, 0.9)).await?;
            let (listening, answering) = farm.kill_coordinator().await?;
            figures.listening.push(listening.as_secs_f64());
            figures.answering.push(answering.as_secs_f64());
            farm.end(job, &loaded, &mut figures).await?;
        }
    }
    Ok(figures)
}

fn internal(error: &std::io::Error) -> Error {
    Error::new(ExitCode::Internal, format!("cannot run a farm on this machine: {error}"))
}

fn node_name(node: usize) -> String {
    format!("node-{}", node + 1)
}

// ---- The farm ----------------------------------------------------------------------------------------------------------

/// A coordinator and nodes, each in a process of its own; they end with this.
struct RealFarm {
    folder: tempfile::TempDir,
    coordinator: CoordinatorProcess,
    keys: PathBuf,
    operator: Identity,
    nodes: Vec<(PathBuf, Child)>,
}

struct CoordinatorProcess {
    address: String,
    child: Child,
    /// Kept, so that what it prints later has somewhere to go.
    _lines: Lines<BufReader<ChildStdout>>,
}

impl RealFarm {
    async fn start() -> Result<Self> {
        let folder = tempfile::Builder::new().prefix("tessera-").tempdir().map_err(|error| internal(&error))?;
        let authority = Authority::new()?;
        let keys = authority.issue(Role::Coordinator, "coordinator")?.save(folder.path())?;
        fs::write(folder.path().join("farm.toml"), "[coordinator]\nfree_bytes = 0\n").map_err(|error| internal(&error))?;
        let coordinator = lead(folder.path(), &keys, "127.0.0.1:0").await?;
        let mut nodes = Vec::new();
        for node in 0..NODES {
            let keys = authority.issue(Role::Node, &node_name(node))?.save(folder.path())?;
            let child = spawn(&coordinator.address, &keys)?;
            nodes.push((keys, child));
        }
        Ok(Self { folder, coordinator, keys, operator: authority.issue(Role::Operator, "verify")?, nodes })
    }

    async fn client(&self) -> Result<Client> {
        Client::connect(&self.coordinator.address, &self.operator).await
    }

    /// Submits the job once all nodes are ready, and waits until this share of it is done.
    async fn begin(&self, loaded: &LoadedJob, moment: f64) -> Result<JobId> {
        let client = self.client().await?;
        while client.status().await?.nodes.iter().filter(|node| node.state == NodeState::Ready).count() < NODES {
            sleep(LOOK).await;
        }
        let job = client.submit(&loaded.description, &loaded.assets, &Terms { min_nodes: NODES as u32, ..Terms::default() }).await?;
        loop {
            let status = client.status().await?;
            // A status that is older than the job does not know it yet.
            let come = |parts: u32, committed: u32| parts > 0 && f64::from(committed) >= moment * f64::from(parts);
            let known = status.jobs.iter().find(|known| known.job == job);
            if known.is_some_and(|known| known.state.is_over() || come(known.parts, known.committed)) {
                client.close().await;
                return Ok(job);
            }
            sleep(LOOK).await;
        }
    }

    async fn kill_node(&mut self, node: usize) -> Result<()> {
        self.nodes[node].1.kill().await.map_err(|error| internal(&error))
    }

    fn start_node(&mut self, node: usize) -> Result<()> {
        self.nodes[node].1 = spawn(&self.coordinator.address, &self.nodes[node].0)?;
        Ok(())
    }

    /// Kills the coordinator and starts it again: until it listens, and until it answers.
    async fn kill_coordinator(&mut self) -> Result<(Duration, Duration)> {
        self.coordinator.child.kill().await.map_err(|error| internal(&error))?;
        let begin = Instant::now();
        self.coordinator = lead(self.folder.path(), &self.keys, &self.coordinator.address).await?;
        let listening = begin.elapsed();
        let client = self.client().await?;
        client.status().await?;
        let answering = begin.elapsed();
        client.close().await;
        Ok((listening, answering))
    }

    /// Waits for a job's end, and takes note of what holds for every job.
    async fn end(&self, job: JobId, loaded: &LoadedJob, figures: &mut Figures) -> Result<Manifest> {
        let client = self.client().await?;
        let mut progress = Show { json: false, quiet: true }.progress();
        outcome(client.watch(job, &mut progress).await?)?;
        let folder = self.folder.path().join(format!("out-{}", job.0));
        fs::create_dir_all(&folder).map_err(|error| internal(&error))?;
        client.fetch(job, &folder, &mut progress).await?;
        client.close().await;
        let picture = fs::read(folder.join(&loaded.description.output.exr)).map_err(|error| internal(&error))?;
        figures.pictures.insert(*blake3::hash(&picture).as_bytes());
        let manifest = manifest::read(&folder.join(&loaded.description.output.manifest))?;
        figures.parts += manifest.parts.len();
        figures.again += rendered_again(&manifest);
        Ok(manifest)
    }
}

fn spawn(address: &str, keys: &std::path::Path) -> Result<Child> {
    node_command(address, keys, 1).and_then(|mut command| command.spawn()).map_err(|error| internal(&error))
}

async fn lead(folder: &std::path::Path, keys: &std::path::Path, listen: &str) -> Result<CoordinatorProcess> {
    let mut command = Command::new(std::env::current_exe().map_err(|error| internal(&error))?);
    command.args(["coordinator", "--listen", listen, "--config"]).arg(folder.join("farm.toml"));
    command.arg("--data").arg(folder.join("data")).arg("--keys").arg(keys);
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::null()).process_group(0).kill_on_drop(true);
    let mut child = command.spawn().map_err(|error| internal(&error))?;
    let stdout = child.stdout.take().ok_or_else(|| Error::new(ExitCode::Internal, "a process without output"))?;
    let mut lines = BufReader::new(stdout).lines();
    while let Some(line) = lines.next_line().await.map_err(|error| internal(&error))? {
        if let Some(address) = line.strip_prefix("listening on ") {
            return Ok(CoordinatorProcess { address: address.to_owned(), child, _lines: lines });
        }
    }
    Err(Error::new(ExitCode::Internal, "the coordinator ended before it listened"))
}

// ---- What manifests tell -----------------------------------------------------------------------------------------------

impl Figures {
    /// What the death of a node came to. It tells nothing where the node had handed in all that it held, or where it was suspected before.
    fn take_death(&mut self, manifest: &Manifest, name: &str) {
        let Some(id) = manifest.nodes.iter().find(|node| node.name == name).map(|node| node.id) else { return };
        let of = |kind| manifest.events.iter().filter(move |event| event.kind == kind && event.node == Some(id));
        let Some((event, silence)) = of(EventKind::Suspected).next_back().and_then(|event| Some((event, silence(event)?))) else { return };
        self.noticed.push(silence);
        let Some((part, begun)) = rendered_at(manifest, id, event.time) else { return };
        self.lost.push((event.time - silence - begun).max(0.0));
        let next = manifest.parts[part].attempts.iter().map(|attempt| attempt.start).filter(|start| *start >= event.time);
        self.reassigned.extend(next.map(|start| start - event.time).reduce(f64::min));
    }
}

fn silence(event: &EventEntry) -> Option<f64> {
    event.detail.strip_prefix("silent for ")?.strip_suffix(" s")?.parse().ok()
}

/// The part that a node's lane was at when it was suspected, and since when: the one that it was given first of those that it never handed in.
fn rendered_at(manifest: &Manifest, node: NodeId, time: f64) -> Option<(usize, f64)> {
    let attempts = || manifest.parts.iter().enumerate().flat_map(|(part, entry)| entry.attempts.iter().map(move |attempt| (part, attempt)));
    let of_node = || attempts().filter(|(_, attempt)| attempt.node == node && attempt.start <= time);
    let delivered = of_node().filter(|(_, attempt)| attempt.outcome == AttemptOutcome::Committed).filter_map(|(_, attempt)| attempt.end);
    let free = delivered.fold(0.0, f64::max);
    let open = of_node().filter(|(_, attempt)| attempt.outcome != AttemptOutcome::Committed && attempt.end.is_none_or(|end| end >= time));
    open.map(|(part, attempt)| (part, attempt.start)).min_by(|a, b| a.1.total_cmp(&b.1)).map(|(part, start)| (part, start.max(free)))
}

/// Parts that somebody began after they were committed.
fn rendered_again(manifest: &Manifest) -> usize {
    let again = |part: &&manifest::PartEntry| {
        let committed = part.attempts.iter().filter(|attempt| attempt.outcome == AttemptOutcome::Committed);
        let end = committed.filter_map(|attempt| attempt.end).fold(f64::INFINITY, f64::min);
        part.attempts.iter().any(|attempt| attempt.start > end)
    };
    manifest.parts.iter().filter(again).count()
}
