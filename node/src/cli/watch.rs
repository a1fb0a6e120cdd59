//! `tessera watch`: follows a job to its end.

use super::{
    client::{Access, job_number},
    farewell::Farewell,
    progress::Show,
    render::outcome,
    runtime::{block_on_farm, start_logs},
};
use crate::{error::Result, farm::JobId};

/// Arguments of `tessera watch`.
#[derive(clap::Args)]
pub struct Args {
    /// The job's number.
    #[arg(value_parser = job_number)]
    job: u64,
    #[command(flatten)]
    access: Access,
    #[command(flatten)]
    show: Show,
}

/// Runs `tessera watch`: the exit code tells how the job ended.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    let mut progress = args.show.progress();
    let farewell = Farewell::default();
    let state = block_on_farm(&farewell, async {
        let client = args.access.connect().await?;
        farewell.and(args.job);
        let state = client.watch(JobId(args.job), &mut progress).await?;
        client.close().await;
        Ok(state)
    })?;
    progress.end();
    outcome(state)
}
