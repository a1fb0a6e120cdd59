//! `tessera cancel`: ends jobs.

use super::{
    client::{Access, Jobs},
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
        for job in args.jobs.numbers() {
            client.cancel(job).await?;
            println!("job {} is cancelled", job.0);
        }
        client.close().await;
        Ok(())
    })
}
