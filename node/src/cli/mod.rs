//! The command line: one file a subcommand.
//!
//! A subcommand is a module with `struct Args` (a `clap::Args`; its fields' docs are its help) and `fn run(Args) -> Result<()>`. It is mounted by
//! three lines below: its `mod`, its variant (whose doc is its line in `--help`), its arm in `run`. What it prints on stdout is its answer;
//! progress, logs and errors go to stderr.

mod cancel;
mod check;
mod client;
mod coordinator;
mod delete;
mod direct;
mod extend;
mod farewell;
mod fetch;
mod here;
mod join;
mod keys;
mod link;
mod list;
mod local;
mod node;
mod plan;
mod progress;
mod queue;
mod real_farm;
mod release;
mod render;
mod report;
mod runtime;
mod script;
mod sequence;
mod simulate;
mod status;
mod submit;
mod tradeoff;
mod verify;
mod verify_farm;
mod watch;

use std::{io::Write, process};

use clap::{Parser, Subcommand};

use crate::error::{ExitCode, Result};

/// Renders one heavy frame on every machine you have; any of them may die meanwhile.
#[derive(Parser)]
#[command(name = "tessera", version)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// Renders a job: on nodes of this machine, or on a farm.
    Render(render::Args),
    /// Leads a farm.
    Coordinator(coordinator::Args),
    /// Renders for a farm.
    Node(node::Args),
    /// Hands a job to a farm.
    Submit(submit::Args),
    /// Shows the nodes and jobs of a farm.
    Status(status::Args),
    /// Follows a job to its end.
    Watch(watch::Args),
    /// Brings a job's files here.
    Fetch(fetch::Args),
    /// Ends jobs.
    Cancel(cancel::Args),
    /// Lets jobs wait: nodes finish what they hold of them, and get nothing new.
    Pause(queue::Args),
    /// Lets jobs go on.
    Resume(queue::Args),
    /// Gives jobs another priority.
    Rank(queue::RankArgs),
    /// Lists the jobs that a farm keeps, also those that are over.
    List(list::Args),
    /// Removes jobs that are over from the farm's disk.
    Delete(delete::Args),
    /// Lets a node out of quarantine that delivered wrong pixels.
    Release(release::Args),
    /// Runs a job script and says what would be rendered.
    Check(check::Args),
    /// The farm's authority, and the identities that it certifies.
    Keys(keys::Args),
    /// Shows how a farm would split and assign a job, and when it would be done.
    Plan(plan::Args),
    /// Renders a job with ladders of samples and depths: error against time.
    Tradeoff(tradeoff::Args),
    /// Shows what came of jobs: one in detail, several in the paper's table.
    Report(report::Args),
    /// Runs the farm's scheduler on virtual time: plans a farm, or replays a schedule of faults.
    Simulate(simulate::Args),
    /// Checks a picture against its manifest, or the farm against its promises.
    Verify(verify::Args),
}

fn run(command: Command) -> Result<()> {
    match command {
        Command::Render(args) => render::run(args),
        Command::Coordinator(args) => coordinator::run(args),
        Command::Node(args) => node::run(args),
        Command::Submit(args) => submit::run(args),
        Command::Status(args) => status::run(args),
        Command::Watch(args) => watch::run(args),
        Command::Fetch(args) => fetch::run(args),
        Command::Cancel(args) => cancel::run(args),
        Command::Pause(args) => queue::pause(&args),
        Command::Resume(args) => queue::resume(&args),
        Command::Rank(args) => queue::rank(&args),
        Command::List(args) => list::run(args),
        Command::Delete(args) => delete::run(args),
        Command::Release(args) => release::run(args),
        Command::Check(args) => check::run(args),
        Command::Keys(args) => keys::run(args),
        Command::Plan(args) => plan::run(args),
        Command::Tradeoff(args) => tradeoff::run(args),
        Command::Report(args) => report::run(args),
        Command::Simulate(args) => simulate::run(args),
        Command::Verify(args) => verify::run(args),
    }
}

/// Whoever reads what is printed may stop reading, as `head` does: that is no fault. A disk that takes no more of it is one of a file.
fn end_with_reader() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |panic| {
        let message = panic.payload().downcast_ref::<String>().map_or("", String::as_str);
        if message.starts_with("failed printing to stdout") && message.contains("Broken pipe") {
            process::exit(0);
        }
        if let Some(why) = message.strip_prefix("failed printing to std") {
            let _ = writeln!(std::io::stderr(), "error: nothing can be written to std{why}");
            process::exit(ExitCode::File as i32);
        }
        usual(panic);
    }));
}

/// The program: reads the command line, runs the subcommand, says an error on stderr. The exit code is that of [`crate::error::ExitCode`].
pub fn main() -> process::ExitCode {
    end_with_reader();
    match run(CommandLine::parse().command) {
        Ok(()) => process::ExitCode::SUCCESS,
        Err(error) => {
            // What came of it is told by the exit code all the same.
            let _ = writeln!(std::io::stderr(), "error: {error}");
            process::ExitCode::from(error.code as u8)
        }
    }
}
