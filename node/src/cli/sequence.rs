//! Jobs on their way to a farm and back: one picture, or the frames of a sequence, each a job of its own.

use std::path::{Path, PathBuf};

use tessera_engine::scene::Unbuilt;

use super::{
    client::{self, Client},
    progress::{Progress, Show},
    render::{outcome, report},
    script::Script,
};
use crate::{
    error::{Error, Result},
    farm::JobId,
    job::{JobDescription, LoadedJob},
    limits::PRIORITY,
    wire::{JobState, Terms},
};

/// How jobs stand in a farm's queue.
#[derive(clap::Args)]
pub struct Standing {
    /// Rank in the farm's queue: jobs of higher priority go first. Above 0 takes an operator's key.
    #[arg(long, default_value_t = 0, value_parser = clap::value_parser!(i32).range(i64::from(-PRIORITY)..=i64::from(PRIORITY)), allow_negative_numbers = true)]
    priority: i32,
    /// A job that has to be finished before this one begins; may be given several times.
    #[arg(long, value_name = "JOB", value_parser = super::client::job_number)]
    after: Vec<u64>,
}

impl Standing {
    /// As the farm is told.
    pub fn terms(&self, min_nodes: u32) -> Terms {
        Terms { min_nodes, priority: self.priority, after: self.after.iter().copied().map(JobId).collect() }
    }
}

/// A job that a farm has taken, and what is needed to fetch its files and tell of them.
pub struct Submitted {
    /// Its number.
    pub job: JobId,
    /// Its frame, where it is one of several.
    frame: Option<u32>,
    manifest: String,
    warnings: Vec<String>,
}

/// Submits a job, or one for each frame of its sequence: the farm renders the first while later ones are made. `taken` is told of each.
///
/// Also returns the error that ended it before the last frame: the script's, or that the coordinator refuses a job. The frames before it are submitted then.
pub async fn submit(
    client: &Client,
    script: &Script,
    first: LoadedJob,
    terms: Terms,
    progress: &Progress,
    mut taken: impl FnMut(&Submitted, &JobDescription),
) -> (Vec<Submitted>, Result<()>) {
    let mut all = Vec::new();
    let done = submit_each(client, script, first, terms, progress, &mut all, &mut taken).await;
    (all, done)
}

async fn submit_each(
    client: &Client,
    script: &Script,
    first: LoadedJob,
    mut terms: Terms,
    progress: &Progress,
    all: &mut Vec<Submitted>,
    taken: &mut impl FnMut(&Submitted, &JobDescription),
) -> Result<()> {
    let (sequence, before) = (first.sequence(&script.parameters()), terms.after.clone());
    let mut rest = sequence.into_iter().flat_map(|frames| frames.numbers()).skip(1);
    let mut next = Some(first);
    while let Some(loaded) = next.take() {
        let job = client.submit_patiently(&loaded.description, &loaded.assets, &terms, progress).await?;
        let LoadedJob { description, frames, .. } = loaded;
        let frame = frames.map(|(frame, _)| frame).filter(|_| sequence.is_some());
        let submitted = Submitted { job, frame, manifest: description.output.manifest.clone(), warnings: description.warnings.clone() };
        taken(&submitted, &description);
        all.push(submitted);
        if sequence.is_some_and(|frames| frames.in_order) {
            terms.after = before.iter().copied().chain([job]).collect();
        }
        if let Some(frame) = rest.next() {
            next = Some(load_frame(script, frame)?.0);
        }
    }
    Ok(())
}

fn load_frame(script: &Script, frame: u32) -> Result<(LoadedJob, Unbuilt)> {
    script.load_frame(frame).map_err(|error| Error { message: format!("frame {frame}: {}", error.message), ..error })
}

/// An error in the middle of a sequence of which nobody waits for what is submitted already.
pub fn going_on(error: Error, before: &[Submitted]) -> Error {
    match before {
        [first, ..] if error.help.is_none() => {
            let last = before.last().map_or(first.job.0, |last| last.job.0);
            error.with_help(format!("the frames before it were submitted, as jobs {} to {last}", first.job.0))
        }
        _ => error,
    }
}

/// Follows jobs to their ends, one after the other, and puts their files into a folder.
///
/// # Errors
/// The first that there is; other frames are fetched all the same.
pub async fn follow(client: &Client, jobs: &[Submitted], show: Show, output: &Path) -> Result<()> {
    let mut failed = None;
    for of in jobs {
        if let Err(error) = follow_one(client, of, show, output).await {
            if jobs.len() > 1 && !show.quiet {
                eprintln!("{}error: {error}", of.label());
            }
            let last = jobs.last().map_or(of.job, |last| last.job);
            failed.get_or_insert(if client.has_given_up() { client::going_on(error, of.job, last) } else { error });
        }
        if client.has_given_up() {
            break;
        }
    }
    failed.map_or(Ok(()), Err)
}

async fn follow_one(client: &Client, of: &Submitted, show: Show, output: &Path) -> Result<()> {
    let state = watch(client, of, show).await?;
    let ended = outcome(state.clone());
    if !matches!(state, JobState::Finished | JobState::Incomplete(_)) {
        return ended;
    }
    let files: Vec<PathBuf> = client.fetch(of.job, output, &mut show.progress()).await?;
    ended.map_err(|error| error.with_help(format!("what there is stands in {}", output.display())))?;
    report(show, &files, &output.join(&of.manifest), &of.warnings)
}

/// Shows how a job fares until it ends.
///
/// # Errors
/// As [`Client::watch`].
pub async fn watch(client: &Client, of: &Submitted, show: Show) -> Result<JobState> {
    let mut progress = show.progress();
    if of.frame.is_some() {
        progress.say(&format!("{}job {}", of.label(), of.job.0));
    }
    let state = client.watch(of.job, &mut progress).await?;
    progress.end();
    Ok(state)
}

impl Submitted {
    /// A job that is no frame of a sequence.
    pub fn alone(job: JobId, description: &JobDescription) -> Self {
        Self { job, frame: None, manifest: description.output.manifest.clone(), warnings: description.warnings.clone() }
    }

    fn label(&self) -> String {
        self.frame.map_or_else(String::new, |frame| format!("frame {frame}: "))
    }
}

/// Renders what `render` says for every frame of a sequence, or once.
///
/// # Errors
/// The first that there is.
pub fn each_frame(script: &Script, first: (LoadedJob, Unbuilt), mut render: impl FnMut(&LoadedJob, Unbuilt) -> Result<()>) -> Result<()> {
    let sequence = first.0.sequence(&script.parameters());
    render(&first.0, first.1)?;
    for frame in sequence.into_iter().flat_map(|frames| frames.numbers()).skip(1) {
        let (loaded, scene) = load_frame(script, frame)?;
        render(&loaded, scene)?;
    }
    Ok(())
}
