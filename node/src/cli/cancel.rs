//! `tessera cancel`: ends a job.

use super::{
    client::{Access, job_number},
    runtime::{block_on, start_logs},
};
use crate::{error::Result, farm::JobId};

/// Arguments of `tessera cancel`.
#[derive(clap::Args)]
pub struct Args {
    /// The job's number.
    #[arg(value_parser = job_number)]
    job: u64,
    #[command(flatten)]
    access: Access,
}

/// Runs `tessera cancel`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    block_on(async {
        let client = args.access.connect().await?;
        client.cancel(JobId(args.job)).await?;
        client.close().await;
        println!("job {} is cancelled", args.job);
        Ok(())
    })
}
