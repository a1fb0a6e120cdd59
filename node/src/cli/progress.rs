//! How a job fares, on the terminal: a bar where there is one, plain lines where there is none, JSON lines for programs.

use std::{
    collections::BTreeMap,
    io::{IsTerminal, Write},
    time::{Duration, Instant},
};

use indicatif::{ProgressBar, ProgressStyle};
use serde_json::json;

use crate::{
    farm::NodeState,
    wire::{JobState, JobStatus, NodeStatus},
};

/// Plain lines come no faster than this.
const LINE_INTERVAL: Duration = Duration::from_secs(5);

/// How progress is shown.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::Args)]
pub struct Show {
    /// Print events as JSON, a line each, on stdout.
    #[arg(long)]
    pub json: bool,
    /// Print nothing but errors.
    #[arg(long, short)]
    pub quiet: bool,
}

enum Face {
    Bar(ProgressBar),
    Lines { next: Instant },
    Json,
    Quiet,
}

/// The progress of one job.
pub struct Progress {
    face: Face,
    state: Option<JobState>,
    nodes: BTreeMap<String, NodeState>,
}

impl Show {
    /// Begins to show a job's progress.
    pub fn progress(self) -> Progress {
        let face = match self {
            Self { json: true, .. } => Face::Json,
            Self { quiet: true, .. } => Face::Quiet,
            _ if std::io::stderr().is_terminal() => Face::Bar(bar()),
            _ => Face::Lines { next: Instant::now() },
        };
        Progress { face, state: None, nodes: BTreeMap::new() }
    }
}

fn bar() -> ProgressBar {
    let style = ProgressStyle::with_template("{prefix:>10} [{bar:40}] {msg}").unwrap_or_else(|_| ProgressStyle::default_bar());
    ProgressBar::new(1000).with_style(style.progress_chars("=> "))
}

impl Progress {
    /// Something that the user should know, beside the job's state.
    pub fn say(&self, message: &str) {
        match &self.face {
            Face::Bar(bar) => bar.suspend(|| eprintln!("{message}")),
            Face::Lines { .. } => eprintln!("{message}"),
            Face::Json => event(&json!({ "event": "message", "message": message })),
            Face::Quiet => {}
        }
    }

    /// A local node was started.
    pub fn started(&self, name: &str, pid: u32) {
        if let Face::Json = self.face {
            event(&json!({ "event": "started", "node": name, "pid": pid }));
        }
    }

    /// The job was taken.
    pub fn submitted(&self, job: u64) {
        if let Face::Json = self.face {
            event(&json!({ "event": "submitted", "job": job }));
        }
    }

    /// The job's state, whenever it changed.
    pub fn see(&mut self, job: &JobStatus, nodes: &[NodeStatus]) {
        self.tell_of_nodes(nodes);
        let working = nodes.iter().filter(|node| node.state == NodeState::Ready).count();
        let line = line(job, working);
        match &mut self.face {
            Face::Bar(bar) => {
                bar.set_prefix(word(&job.state));
                bar.set_message(line);
                bar.set_position((job.progress * 1000.0) as u64);
            }
            Face::Lines { next } if self.state.as_ref() != Some(&job.state) || Instant::now() >= *next => {
                *next = Instant::now() + LINE_INTERVAL;
                eprintln!("{}: {line}", word(&job.state));
            }
            Face::Json => event(&json!({ "event": "status", "job": job, "nodes": nodes })),
            Face::Lines { .. } | Face::Quiet => {}
        }
        self.state = Some(job.state.clone());
    }

    /// Nodes that come and go.
    fn tell_of_nodes(&mut self, nodes: &[NodeStatus]) {
        for node in nodes {
            let before = self.nodes.insert(node.name.clone(), node.state);
            if before == Some(node.state) {
                continue;
            }
            match (before, node.state) {
                (_, NodeState::Suspected) => self.say(&format!("{}: not heard of; its parts go to others", node.name)),
                (_, NodeState::Quarantined) => self.say(&format!("{}: in quarantine: {}", node.name, node.reason)),
                (_, NodeState::Lost) => self.say(&format!("{}: lost: {}", node.name, node.reason)),
                (_, NodeState::Refused) => self.say(&format!("{}: gets no work: {}", node.name, node.reason)),
                (Some(NodeState::Suspected), NodeState::Ready) => self.say(&format!("{}: heard again", node.name)),
                (_, NodeState::Draining) => self.say(&format!("{}: about to go; it finishes what its lanes render", node.name)),
                (_, NodeState::Proving | NodeState::Ready) => {}
            }
        }
    }

    /// The job has ended; the line of the bar goes.
    pub fn end(&self) {
        if let Face::Bar(bar) = &self.face {
            bar.finish_and_clear();
        }
    }
}

/// One JSON line on stdout. Whoever reads may have gone; rendering goes on.
pub fn event(value: &serde_json::Value) {
    let mut stdout = std::io::stdout().lock();
    let _ = writeln!(stdout, "{value}").and_then(|()| stdout.flush());
}

fn line(job: &JobStatus, nodes: usize) -> String {
    let nodes = format!("{nodes} node{}", if nodes == 1 { "" } else { "s" });
    let left = job.left.map_or(String::new(), |left| format!(", {} left", duration(left)));
    if job.parts == 0 { nodes } else { format!("{}/{} parts, {nodes}{left}", job.committed, job.parts) }
}

fn duration(seconds: f64) -> String {
    let whole = seconds.max(0.0).round() as u64;
    match (whole / 3600, whole / 60 % 60, whole % 60) {
        (0, 0, s) => format!("{s} s"),
        (0, m, s) => format!("{m}:{s:02} min"),
        (h, m, _) => format!("{h}:{m:02} h"),
    }
}

/// A job's state in a word.
pub fn word(state: &JobState) -> &'static str {
    match state {
        JobState::Waiting => "waiting",
        JobState::Preparing => "preparing",
        JobState::Probing => "probing",
        JobState::Planning => "planning",
        JobState::Rendering => "rendering",
        JobState::Assembling => "writing",
        JobState::Finished => "finished",
        JobState::Failed(_) => "failed",
        JobState::Cancelled(_) => "cancelled",
        JobState::Incomplete(_) => "incomplete",
    }
}
