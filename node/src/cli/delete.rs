//! `tessera delete`: removes jobs that is over from the coordinator's disk.

use super::{
    client::{Access, Jobs, each_job},
    runtime::{block_on, start_logs},
};
use crate::error::Result;

/// Arguments of `tessera delete`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    access: Access,
}

/// Runs `tessera delete`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    block_on(async {
        let client = args.access.connect().await?;
        let done = each_job(&args.jobs, "is deleted", |job| client.delete(job)).await;
        client.close().await;
        done
    })
}
