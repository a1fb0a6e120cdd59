//! `tessera list`: the jobs that a coordinator keeps.

use std::time::{Duration, UNIX_EPOCH};

use super::{
    client::Access,
    progress::word,
    runtime::{block_on, start_logs},
};
use crate::{
    error::Result,
    manifest::rfc3339,
    report::lined_up,
    wire::{JobState, KeptJob},
};

/// Arguments of `tessera list`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    access: Access,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs `tessera list`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    let jobs = block_on(async {
        let client = args.access.connect().await?;
        let jobs = client.list().await?;
        client.close().await;
        Ok(jobs)
    })?;
    if args.json {
        println!("{}", serde_json::json!(jobs));
        return Ok(());
    }
    let heads = ["job", "number", "MiB", "submitted", "state"].map(str::to_owned).to_vec();
    let rows: Vec<_> = std::iter::once(heads).chain(jobs.iter().map(row)).collect();
    lined_up(&rows).iter().for_each(|line| println!("{line}"));
    Ok(())
}

fn row(job: &KeptJob) -> Vec<String> {
    let state = match &job.state {
        JobState::Failed(reason) | JobState::Cancelled(reason) => format!("{}: {reason}", word(&job.state)),
        state => word(state).to_owned(),
    };
    let submitted = rfc3339(UNIX_EPOCH + Duration::from_secs(job.submitted));
    vec![job.name.clone(), job.job.0.to_string(), format!("{:.1}", job.bytes as f64 / f64::from(1 << 20)), submitted, state]
}
