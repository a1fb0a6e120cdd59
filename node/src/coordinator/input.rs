//! What comes to the one task that owns the farm's core.

use std::net::SocketAddr;

use tokio::sync::{mpsc, oneshot};

use super::room::Taken;
use crate::{
    farm::{Event, JobId, LeaseId},
    job::JobDescription,
    wire::{FromNode, Hello, PartHeader, Place, Terms, ToNode},
};

/// One connection of a node; later ones have higher numbers.
pub type LinkId = u64;

/// To a node's connection.
pub enum Outgoing {
    /// Say this.
    Say(ToNode),
    /// Close it, and say why.
    Close(String),
}

/// Something for the core's task.
pub enum Input {
    /// A node connected.
    Joined {
        /// Its connection.
        link: LinkId,
        /// The name in its certificate.
        name: String,
        /// What it said of itself.
        hello: Hello,
        /// Where it is.
        address: SocketAddr,
        /// The way to it.
        outgoing: mpsc::Sender<Outgoing>,
        /// Told when the core knows of it: what it hands in is read after that.
        known: oneshot::Sender<()>,
    },
    /// A node gave a sign of life.
    Heard(LinkId),
    /// A node said something, which takes up room until it is handled.
    Said(LinkId, FromNode, Taken),
    /// A node handed in a part whose pixels agree with their hash.
    Delivered(LinkId, PartHeader, Vec<u8>),
    /// A part came in damaged.
    Damaged(LinkId, JobId, LeaseId),
    /// A connection ended; where the node left, or was sent away, with the reason.
    Gone(LinkId, Option<String>),
    /// Files of a job cannot be written, for this reason.
    HeldUp(JobId, String),
    /// Files of a job could not be written: it is time to try again.
    Assemble(JobId),
    /// Why the disk takes no events and pixels, or that it takes them again.
    Disk(Option<String>),
    /// That the disk is too full for more jobs, or that it has room again.
    Space(Option<String>),
    /// Somebody wants to know whether the core still takes inputs.
    Ping(oneshot::Sender<()>),
    /// The rest of the program has an event for the core.
    Event(Event),
    /// It is time to shorten the journal, if it is long and nothing goes on.
    Rest,
    /// A client hands in a job whose assets are all here.
    Submit {
        /// The job.
        description: Box<JobDescription>,
        /// How it stands in the queue.
        terms: Terms,
        /// Who may fetch and cancel it.
        owner: String,
        /// Whether they may have so many jobs and no more.
        limited: bool,
        /// The job's number, or why it is refused.
        reply: oneshot::Sender<Result<JobId, String>>,
    },
    /// All that was said of a submitted job is on disk.
    Taken(JobId),
    /// A job that is over goes: nobody is told of it from now on.
    Delete {
        /// The job.
        job: JobId,
        /// Whether it may go.
        reply: oneshot::Sender<Result<(), String>>,
    },
    /// An operator lets a node out of quarantine.
    Release {
        /// Its name.
        node: String,
        /// Whether it was there.
        reply: oneshot::Sender<Result<(), String>>,
    },
    /// A client gives a job another place in the queue.
    Move {
        /// The job.
        job: JobId,
        /// Where to.
        place: Place,
        /// Whether an operator says so.
        operator: bool,
        /// Who.
        reason: String,
        /// Whether there was such a job.
        reply: oneshot::Sender<Result<(), String>>,
    },
    /// A client ends a job.
    Cancel {
        /// The job.
        job: JobId,
        /// Who.
        reason: String,
        /// Whether there was such a job.
        reply: oneshot::Sender<Result<(), String>>,
    },
}
