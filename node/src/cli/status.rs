//! `tessera status`: the nodes and jobs of a farm.

use super::{
    client::Access,
    progress::word,
    runtime::{block_on, start_logs},
};
use crate::{
    error::Result,
    farm::NodeState,
    report::lined_up,
    wire::{JobState, JobStatus, NodeStatus, Status},
};

/// Arguments of `tessera status`.
#[derive(clap::Args)]
pub struct Args {
    #[command(flatten)]
    access: Access,
    /// Print JSON.
    #[arg(long)]
    json: bool,
}

/// Runs `tessera status`.
pub fn run(args: Args) -> Result<()> {
    start_logs("error");
    let status = block_on(async {
        let client = args.access.connect().await?;
        let status = client.status().await?;
        client.close().await;
        Ok(status)
    })?;
    if args.json {
        println!("{}", serde_json::json!(status));
    } else {
        print_tables(&status);
    }
    Ok(())
}

fn print_tables(status: &Status) {
    status.refusal.iter().for_each(|refusal| println!("no job is taken now: {refusal}\n"));
    let heads = |heads: &[&str]| heads.iter().map(|head| (*head).to_owned()).collect::<Vec<_>>();
    let nodes = status.nodes.iter().map(node);
    let rows: Vec<_> = std::iter::once(heads(&["node", "lanes", "holds", "state", "address"])).chain(nodes).collect();
    lined_up(&rows).iter().for_each(|line| println!("{line}"));
    let jobs = status.jobs.iter().map(job);
    let rows: Vec<_> = std::iter::once(heads(&["job", "number", "of", "priority", "parts", "seconds", "state"])).chain(jobs).collect();
    println!();
    lined_up(&rows).iter().for_each(|line| println!("{line}"));
}

fn node(node: &NodeStatus) -> Vec<String> {
    let state = match node.state {
        NodeState::Proving => "proving",
        NodeState::Ready => "ready",
        NodeState::Draining => "draining",
        NodeState::Refused => "refused",
        NodeState::Suspected => "suspected",
        NodeState::Lost => "lost",
        NodeState::Quarantined => "in quarantine",
    };
    let state = if node.reason.is_empty() { state.to_owned() } else { format!("{state}: {}", node.reason) };
    vec![node.name.clone(), node.lanes.to_string(), node.holds.to_string(), state, node.address.clone()]
}

fn job(job: &JobStatus) -> Vec<String> {
    let state = match &job.state {
        JobState::Failed(reason) | JobState::Cancelled(reason) => format!("{}: {reason}", word(&job.state)),
        state => {
            [job.paused.then_some("paused"), Some(word(state)), job.trouble.as_deref()].into_iter().flatten().collect::<Vec<_>>().join(": ")
        }
    };
    let (parts, seconds) = (format!("{}/{}", job.committed, job.parts), format!("{:.1}", job.seconds));
    vec![job.name.clone(), job.job.0.to_string(), job.owner.clone(), job.priority.to_string(), parts, seconds, state]
}
