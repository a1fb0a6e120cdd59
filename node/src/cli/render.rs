//! `tessera render`: renders a job here, or on a farm, and puts its files into a folder.

use std::{
    fs,
    io::IsTerminal,
    path::{Path, PathBuf},
    time::Duration,
};

use serde_json::json;

use super::{
    client::Client,
    direct, extend,
    farewell::Farewell,
    local::{self, LocalFarm},
    node::cores,
    progress::{Show, event},
    runtime::{block_on, block_on_farm, start_logs},
    script::Script,
    sequence::{self, Standing, Submitted, each_frame},
};
use crate::{
    error::{Error, ExitCode, Result},
    farm::FarmConfig,
    job::{JobDescription, LoadedJob},
    limits::{INVALID_SAMPLES, NO_NODE_TIMEOUT},
    manifest,
    report::{self, Style},
    wire::{JobState, tls::Identity},
};

/// Arguments of `tessera render`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    script: Script,
    /// Node processes on this machine.
    #[arg(long, default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1024))]
    nodes: u32,
    /// Nodes that the job waits for before it begins, for a while [default: those of this machine; 1 on a farm].
    #[arg(long, value_name = "NUMBER", conflicts_with = "threads")]
    min_nodes: Option<u32>,
    /// Rendering threads of each node [default: the cores, shared out].
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=4096))]
    lanes: Option<u32>,
    /// Render in this process, with so many threads: no farm, no probe, no report.
    #[arg(long, conflicts_with_all = ["nodes", "lanes", "coordinator"], value_parser = clap::value_parser!(u32).range(1..=4096))]
    threads: Option<u32>,
    /// Render on the farm of this coordinator.
    #[arg(long, value_name = "HOST:PORT", conflicts_with_all = ["nodes", "lanes"], requires = "keys")]
    coordinator: Option<String>,
    /// The client's identity on that farm.
    #[arg(long, env = "TESSERA_KEYS", value_name = "PATH")]
    keys: Option<PathBuf>,
    /// Folder of the output files, made where it is missing.
    #[arg(long, short, default_value = ".", value_name = "DIR")]
    output: PathBuf,
    /// Seconds that the job waits for any node of this machine.
    #[arg(long, value_name = "SECONDS", default_value_t = NO_NODE_TIMEOUT.as_secs_f64())]
    no_node_timeout: f64,
    /// Add the samples that are missing to a picture of this job that an earlier run left in the folder: it becomes the one of all samples at once, to the byte. The job asks for the
    /// AOV "residual", and its samples are a power of two.
    #[arg(long, conflicts_with = "threads")]
    extend: bool,
    #[command(flatten)]
    standing: Standing,
    #[command(flatten)]
    show: Show,
}

/// Runs `tessera render`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    check_writable(&args.output)?;
    match (&args.coordinator, args.threads) {
        (Some(address), None) => {
            let (loaded, _) = args.script.load()?;
            let farewell = Farewell::default();
            block_on_farm(&farewell, on_farm(address, &args, loaded, &farewell))
        }
        (_, Some(threads)) => each_frame(&args.script, args.script.load()?, |loaded, scene| {
            show_files(args.show, &direct::render(&loaded.description, scene, threads, &args.output, args.show)?)
        }),
        (None, None) => {
            // It goes when nothing runs any more that writes into it.
            let mut folder = None;
            block_on(async { here(&args, folder.insert(local::folder()?).path()).await })
        }
    }
}

async fn on_farm(address: &str, args: &Args, loaded: LoadedJob, farewell: &Farewell) -> Result<()> {
    let keys = args.keys.as_deref().ok_or_else(|| Error::new(ExitCode::Usage, "--keys is missing"))?;
    let client = Client::connect(address, &Identity::load_client(keys)?).await?;
    submit_and_follow(&client, args, loaded, args.min_nodes.unwrap_or(1), farewell).await?;
    client.close().await;
    Ok(())
}

async fn here(args: &Args, folder: &Path) -> Result<()> {
    let (loaded, mut local) = loaded_and_started(args, folder).await?;
    local.nodes.iter().for_each(|(name, process)| args.show.progress().started(name, *process));
    let client = local.client().await?;
    // This farm ends with its client: there is nothing that goes on.
    let farewell = Farewell::default();
    let work = submit_and_follow(&client, args, loaded, args.min_nodes.unwrap_or(args.nodes), &farewell);
    tokio::pin!(work);
    let done = loop {
        tokio::select! {
            done = &mut work => break done,
            ended = local.node_ended() => {
                let said = ended?;
                if !args.show.quiet && !args.show.json {
                    eprintln!("{said}");
                }
            }
        }
    };
    local.stop().await;
    done
}

/// Runs the script while a farm starts: neither needs the other. An error of the script is told at once.
async fn loaded_and_started(args: &Args, folder: &Path) -> Result<(LoadedJob, LocalFarm)> {
    let lanes = args.lanes.unwrap_or_else(|| (cores() / args.nodes).max(1));
    let farm = FarmConfig { no_node_timeout: seconds(args.no_node_timeout)?, ..FarmConfig::default() };
    let script = args.script.clone();
    let loading = tokio::task::spawn_blocking(move || script.load().map(|(loaded, _)| loaded));
    let loading = async { loading.await.map_err(|error| Error::new(ExitCode::Internal, error.to_string()))? };
    let starting = LocalFarm::start(args.nodes, lanes, farm, folder);
    tokio::pin!(loading, starting);
    tokio::select! {
        biased;
        loaded = &mut loading => Ok((loaded?, starting.await?)),
        local = &mut starting => Ok((loading.await?, local?)),
    }
}

/// Submits what a script says, shows how it fares, fetches its files.
async fn submit_and_follow(client: &Client, args: &Args, loaded: LoadedJob, min_nodes: u32, farewell: &Farewell) -> Result<()> {
    if args.extend {
        let terms = args.standing.terms(min_nodes);
        return extend::extend(client, &args.script, loaded, terms, args.show, &args.output, farewell).await;
    }
    let progress = args.show.progress();
    let taken = |submitted: &Submitted, description: &JobDescription| {
        description.warnings.iter().for_each(|warning| progress.say(&format!("warning: {warning}")));
        progress.submitted(submitted.job.0);
        farewell.and(submitted.job.0);
    };
    let (jobs, submitted) = sequence::submit(client, &args.script, loaded, args.standing.terms(min_nodes), &progress, taken).await;
    // The frames before one that fails are pictures all the same.
    let done = sequence::follow(client, &jobs, args.show, &args.output).await;
    submitted.and(done)
}

/// A length of time given on the command line.
///
/// # Errors
/// When it is none.
pub fn seconds(number: f64) -> Result<Duration> {
    Duration::try_from_secs_f64(number).map_err(|error| Error::new(ExitCode::Usage, format!("{number} seconds: {error}")))
}

/// An error for a job that did not end well.
///
/// # Errors
/// Exactly then.
pub fn outcome(state: JobState) -> Result<()> {
    match state {
        JobState::Failed(reason) => Err(Error::new(ExitCode::Job, format!("the job failed: {reason}"))),
        JobState::Cancelled(reason) => Err(Error::new(ExitCode::Job, format!("the job was cancelled: {reason}"))),
        JobState::Incomplete(holes) => Err(Error::new(
            ExitCode::Incomplete,
            format!("the picture is incomplete: {holes} parts could not be rendered; the manifest says which and why"),
        )),
        _ => Ok(()),
    }
}

/// An error for a picture with too many samples that are invalid, of so many.
///
/// # Errors
/// Exactly then.
pub fn check_samples(invalid: u64, all: u64) -> Result<()> {
    if invalid as f64 <= INVALID_SAMPLES * all as f64 {
        return Ok(());
    }
    let message = format!(
        "{invalid} of the picture's {all} samples are invalid (negative, infinite, or no numbers) and count as black: it stands, but is not to be trusted"
    );
    Err(Error::new(ExitCode::Invalid, message).with_help(
        "look for lights whose strength or distance is far from all others; the manifest of a farm's job says in which parts they are",
    ))
}

/// Makes the folder where it is missing and sees that files can be written into it, before anything is rendered.
pub fn check_writable(folder: &Path) -> Result<()> {
    let refused = |error: std::io::Error| {
        let why = if folder.is_file() { "it is a file, not a folder".to_owned() } else { error.to_string() };
        Error::new(ExitCode::File, format!("{}: output cannot be written there: {why}", folder.display()))
            .with_help("choose another folder with -o DIR")
    };
    fs::create_dir_all(folder).map_err(refused)?;
    tempfile::tempfile_in(folder).map(drop).map_err(refused)
}

/// The report at the end. What the job's description warns of was said at the beginning, and is not said again.
///
/// # Errors
/// When there is no manifest, or too many samples are invalid.
pub fn report(show: Show, files: &[PathBuf], manifest: &Path, said: &[String]) -> Result<()> {
    let mut manifest = manifest::read(manifest)?;
    manifest.warnings.retain(|warning| !said.contains(warning));
    if show.json {
        event(&json!({ "event": "finished", "files": files, "report": manifest.report }));
    } else if !show.quiet {
        print!("{}", report::text(&manifest, files, Style { color: std::io::stdout().is_terminal() }));
    }
    check_samples(manifest.image.invalid_samples, manifest.image.sample_count())
}

fn show_files(show: Show, files: &[PathBuf]) -> Result<()> {
    if show.json {
        event(&json!({ "event": "finished", "files": files }));
    } else if !show.quiet {
        files.iter().for_each(|file| println!("{}", file.display()));
    }
    Ok(())
}
