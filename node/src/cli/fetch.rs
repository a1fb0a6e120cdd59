//! `tessera fetch`: brings a job's files here.

use std::path::PathBuf;

use super::{
    client::{Access, job_number},
    render::check_writable,
    runtime::{block_on, start_logs},
};
use crate::{error::Result, farm::JobId};

/// Arguments of `tessera fetch`.
#[derive(clap::Args)]
pub struct Args {
    /// The job's number.
    #[arg(value_parser = job_number)]
    job: u64,
    #[command(flatten)]
    access: Access,
    /// Folder of the files, made where it is missing.
    #[arg(long, short, default_value = ".", value_name = "DIR")]
    output: PathBuf,
}

/// Runs `tessera fetch`: prints the files' paths.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    check_writable(&args.output)?;
    let files = block_on(async {
        let client = args.access.connect().await?;
        let files = client.fetch(JobId(args.job), &args.output).await?;
        client.close().await;
        Ok(files)
    })?;
    files.iter().for_each(|file| println!("{}", file.display()));
    Ok(())
}
