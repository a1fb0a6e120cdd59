//! `tessera fetch`: brings a job's files here.

use std::path::PathBuf;

use super::{
    client::{Access, job_number},
    progress::Show,
    render::{check_samples, check_writable},
    runtime::{block_on, start_logs},
};
use crate::{error::Result, farm::JobId, manifest};

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

/// Runs `tessera fetch`: prints the files' paths; it is an error if too many samples of the picture are invalid.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    check_writable(&args.output)?;
    let files = block_on(async {
        let client = args.access.connect().await?;
        let files = client.fetch(JobId(args.job), &args.output, &mut Show { json: false, quiet: false }.progress()).await?;
        client.close().await;
        Ok(files)
    })?;
    files.iter().for_each(|file| println!("{}", file.display()));
    let manifest =
        files.iter().filter(|file| file.extension().is_some_and(|ending| ending == "json")).find_map(|file| manifest::read(file).ok());
    manifest.map_or(Ok(()), |manifest| check_samples(manifest.image.invalid_samples, manifest.image.sample_count()))
}
