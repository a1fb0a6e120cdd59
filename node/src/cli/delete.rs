//! `tessera delete`: removes a job that is over from the coordinator's disk.

use super::{
    client::{Access, job_number},
    runtime::{block_on, start_logs},
};
use crate::{error::Result, farm::JobId};

/// Arguments of `tessera delete`.
#[derive(clap::Args)]
pub struct Args {
    /// The job's number.
    #[arg(value_parser = job_number)]
    job: u64,
    #[command(flatten)]
    access: Access,
}

/// Runs `tessera delete`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    block_on(async {
        let client = args.access.connect().await?;
        client.delete(JobId(args.job)).await?;
        client.close().await;
        println!("job {} is deleted", args.job);
        Ok(())
    })
}
