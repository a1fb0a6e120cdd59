//! `tessera delete`: removes jobs that is over from the coordinator's disk.

use super::{
    client::{Access, Jobs},
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
        for job in args.jobs.numbers() {
            client.delete(job).await?;
            println!("job {} is deleted", job.0);
        }
        client.close().await;
        Ok(())
    })
}
