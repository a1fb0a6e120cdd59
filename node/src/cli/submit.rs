//! `tessera submit`: hands a job to a farm.

use std::path::PathBuf;

use super::{
    client::Access,
    farewell::Farewell,
    progress::Show,
    render::check_writable,
    runtime::{block_on_farm, start_logs},
    script::Script,
    sequence::{self, Standing, Submitted},
};
use crate::{error::Result, job::JobDescription};

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
    standing: Standing,
    #[command(flatten)]
    show: Show,
}

/// Runs `tessera submit`: prints the job's number, or those of all frames.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    let (loaded, scene) = args.script.load()?;
    drop(scene);
    if args.wait {
        check_writable(&args.output)?;
    }
    let progress = args.show.progress();
    let farewell = Farewell::default();
    block_on_farm(&farewell, async {
        let client = args.access.connect().await?;
        let taken = |submitted: &Submitted, description: &JobDescription| {
            farewell.and(submitted.job.0);
            description.warnings.iter().for_each(|warning| progress.say(&format!("warning: {warning}")));
            if args.show.json {
                progress.submitted(submitted.job.0);
            } else {
                println!("{}", submitted.job.0);
            }
        };
        let (jobs, submitted) =
            sequence::submit(&client, &args.script, loaded, args.standing.terms(args.min_nodes), &progress, taken).await;
        let done = match args.wait {
            true => submitted.and(sequence::follow(&client, &jobs, args.show, &args.output).await),
            false => submitted.map_err(|error| sequence::going_on(error, &jobs)),
        };
        client.close().await;
        done
    })
}
