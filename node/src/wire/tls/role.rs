//! Roles, and what each may do.

use std::fmt;

use serde::{Deserialize, Serialize};

/// What the owner of a certificate is in the farm.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, clap::ValueEnum)]
pub enum Role {
    /// Leads the farm.
    Coordinator,
    /// Renders.
    Node,
    /// Submits jobs; fetches and cancels its own.
    Submitter,
    /// Sees nodes and jobs, and changes nothing.
    Observer,
    /// Does what any client can do, with everybody's jobs.
    Operator,
}

/// What clients ask for, as far as their roles matter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Deed {
    /// To see nodes and jobs.
    Look,
    /// To hand in a job.
    Submit,
    /// To fetch a job's files.
    Fetch,
    /// To end a job.
    Cancel,
    /// To remove a job that is over.
    Delete,
    /// To let a node out of quarantine.
    Release,
    /// To pause, resume or rank a job.
    Move,
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Coordinator => "coordinator",
            Self::Node => "node",
            Self::Submitter => "submitter",
            Self::Observer => "observer",
            Self::Operator => "operator",
        })
    }
}

impl fmt::Display for Deed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Look => "see jobs",
            Self::Submit => "submit jobs",
            Self::Fetch => "fetch files of jobs",
            Self::Cancel => "cancel jobs",
            Self::Delete => "delete jobs",
            Self::Release => "release nodes",
            Self::Move => "pause, resume or rank jobs",
        })
    }
}

impl Role {
    /// Those who ask a coordinator for something.
    pub const CLIENTS: &[Self] = &[Self::Operator, Self::Submitter, Self::Observer];

    /// Those whom an issuer can certify, and so whoever got hold of one.
    pub const JOINING: &[Self] = &[Self::Node, Self::Submitter, Self::Observer];

    /// All of them.
    pub const ALL: &[Self] = &[Self::Coordinator, Self::Node, Self::Submitter, Self::Observer, Self::Operator];

    /// Whether it may do this; `own` says whether the job is its own.
    pub fn may(self, deed: Deed, own: bool) -> bool {
        match (self, deed) {
            (Self::Operator, _) | (Self::Submitter | Self::Observer, Deed::Look) | (Self::Submitter, Deed::Submit) => true,
            (Self::Submitter, Deed::Fetch | Deed::Cancel | Deed::Delete | Deed::Move) => own,
            (Self::Submitter, Deed::Release) | (Self::Observer, _) | (Self::Node | Self::Coordinator, _) => false,
        }
    }

    pub(super) fn dns_name(self) -> String {
        format!("{self}.tessera")
    }
}
