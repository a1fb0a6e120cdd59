//! `tessera pause`, `resume` and `rank`: give jobs another place in the queue.

use super::{
    client::{Access, Jobs, each_job},
    runtime::{block_on, start_logs},
};
use crate::{error::Result, limits::PRIORITY, wire::Place};

/// Arguments of `tessera pause` and `tessera resume`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    access: Access,
}

/// Arguments of `tessera rank`.
#[derive(clap::Args)]
pub struct RankArgs {
    /// The new priority. Above 0 takes an operator's key.
    #[arg(long, value_parser = clap::value_parser!(i32).range(i64::from(-PRIORITY)..=i64::from(PRIORITY)), allow_negative_numbers = true)]
    priority: i32,
    #[command(flatten)]
    jobs: Jobs,
    #[command(flatten)]
    access: Access,
}

/// Runs `tessera pause`.
pub fn pause(args: &Args) -> Result<()> {
    place(&args.jobs, &args.access, Place::Paused, "is paused: nodes finish what they hold of it, and get nothing new")
}

/// Runs `tessera resume`.
pub fn resume(args: &Args) -> Result<()> {
    place(&args.jobs, &args.access, Place::Resumed, "goes on")
}

/// Runs `tessera rank`.
pub fn rank(args: &RankArgs) -> Result<()> {
    place(&args.jobs, &args.access, Place::Ranked(args.priority), &format!("has priority {}", args.priority))
}

fn place(jobs: &Jobs, access: &Access, place: Place, said: &str) -> Result<()> {
    start_logs("error");
    block_on(async {
        let client = access.connect().await?;
        let done = each_job(jobs, said, |job| client.move_job(job, place)).await;
        client.close().await;
        done
    })
}
