//! `tessera cancel`: ends jobs.

use super::{
    client::{Access, Jobs, each_job},
    runtime::{block_on, start_logs},
};
use crate::error::Result;

/// Arguments of `tessera cancel`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    access: Access,
}

/// Runs `tessera cancel`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    block_on(async {
        let client = args.access.connect().await?;
        let done = each_job(&args.jobs, "is cancelled", |job| client.cancel(job)).await;
        client.close().await;
        done
    })
}
