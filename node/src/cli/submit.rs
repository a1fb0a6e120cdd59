//! `tessera submit`: hands a job to a farm.

use std::path::PathBuf;

use super::{
    client::Access,
    progress::Show,
    render::{check_writable, outcome, report},
    runtime::{block_on, start_logs},
    script::Script,
};
use crate::error::Result;

/// Arguments of `tessera submit`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    script: Script,
    #[command(flatten)]
    access: Access,
    /// Nodes that the job waits for before it begins, for a while.
    #[arg(long, default_value_t = 1)]
    min_nodes: u32,
    /// Wait for the end and fetch the files.
    #[arg(long)]
    wait: bool,
    /// With --wait: folder of the output files, made where it is missing.
    #[arg(long, short, default_value = ".", value_name = "DIR", requires = "wait")]
    output: PathBuf,
    #[command(flatten)]
    show: Show,
}

/// Runs `tessera submit`: prints the job's number.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    let (loaded, scene) = args.script.load()?;
    drop(scene);
    if args.wait {
        check_writable(&args.output)?;
    }
    let mut progress = args.show.progress();
    loaded.description.warnings.iter().for_each(|warning| progress.say(&format!("warning: {warning}")));
    let files = block_on(async {
        let client = args.access.connect().await?;
        let job = client.submit(&loaded.description, &loaded.assets, args.min_nodes).await?;
        if args.show.json {
            progress.submitted(job.0);
        } else {
            println!("{}", job.0);
        }
        let mut files = None;
        if args.wait {
            let state = client.watch(job, |job, nodes| progress.see(job, nodes)).await?;
            progress.end();
            outcome(state)?;
            files = Some(client.fetch(job, &args.output).await?);
        }
        client.close().await;
        Ok(files)
    })?;
    files.map_or(Ok(()), |files| report(args.show, &files, &args.output, &loaded.description))
}
