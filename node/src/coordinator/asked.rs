//! What nodes were asked and have not answered: an answer to nothing is not heard, so that no node fills the journal.

use std::collections::BTreeSet;

use crate::{
    farm::JobId,
    schedule::NodeId,
    wire::{FromNode, ToNode},
};

#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Question {
    Prove,
    Prepare(JobId),
    Probe(JobId),
}

/// The questions.
#[derive(Default)]
pub struct Asked(BTreeSet<(NodeId, Question)>);

impl Asked {
    /// Notes what is said to a node.
    pub fn note(&mut self, node: NodeId, message: &ToNode) {
        let question = match message {
            ToNode::Prove { .. } => Question::Prove,
            ToNode::Prepare { job, .. } => Question::Prepare(*job),
            ToNode::Probe { job, .. } => Question::Probe(*job),
            _ => return,
        };
        self.0.insert((node, question));
    }

    /// Whether a node was asked what it answers, or says something else altogether. Each question has one answer.
    pub fn settles(&mut self, node: NodeId, message: &FromNode) -> bool {
        let mut answers = |question| self.0.remove(&(node, question));
        match message {
            FromNode::Proof { .. } => answers(Question::Prove),
            // A node that has lost its scene says so when it is to probe it. One that has it says so twice if it was asked twice.
            FromNode::Prepared { job, result } => answers(Question::Prepare(*job)) || (result.is_err() && answers(Question::Probe(*job))),
            FromNode::Probed { job, .. } => answers(Question::Probe(*job)),
            _ => true,
        }
    }

    /// A node begins anew.
    pub fn forget_node(&mut self, node: NodeId) {
        self.0.retain(|(other, _)| *other != node);
    }

    /// A job is over.
    pub fn forget_job(&mut self, job: JobId) {
        self.0.retain(|(_, question)| !matches!(question, Question::Prepare(other) | Question::Probe(other) if *other == job));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A renewed connection repeats what was asked, and both are answered: the second answer is none to what was asked since.
    #[test]
    fn what_is_asked_twice_and_answered_twice_leaves_later_questions_open() {
        let (mut asked, node, job) = (Asked::default(), NodeId(0), JobId(5));
        let prepare = ToNode::Prepare { job, frame: tessera_engine::description::AssetId::of(b"frame"), assets: Vec::new() };
        let (prepared, lost) = (FromNode::Prepared { job, result: Ok(()) }, FromNode::Prepared { job, result: Err("gone".into()) });
        asked.note(node, &prepare);
        asked.note(node, &prepare);
        assert!(asked.settles(node, &prepared));
        asked.note(node, &ToNode::Probe { job, cells: Vec::new(), stride: 1 });
        assert!(!asked.settles(node, &prepared));
        assert!(asked.settles(node, &FromNode::Probed { job, cells: Vec::new() }));
        assert!(!asked.settles(node, &FromNode::Probed { job, cells: Vec::new() }));
        asked.note(node, &ToNode::Probe { job, cells: Vec::new(), stride: 1 });
        assert!(asked.settles(node, &lost));
    }
}
