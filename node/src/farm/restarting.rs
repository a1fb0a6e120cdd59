//! Connections and coordinators begin anew: what was said may not have been heard, and is said again.

use super::job::{Job, Phase, Stage};
use super::node::{NodeState, Nodes};
use super::turn::Turn;
use super::{Build, Command, Farm, JobId, LeaseId, ToNode};
use crate::manifest::{AttemptOutcome, EventKind};
use crate::schedule::{NodeId, PartId};

impl Farm {
    /// The coordinator was started anew, perhaps as another build: no connection is left, and names that it gave without having them on disk must not
    /// come again.
    pub(super) fn restarted(&mut self, build: Build, stored: &[(JobId, LeaseId)]) {
        let earlier = self.turn.build.replace(build);
        let in_use: Vec<Build> = self.open_jobs().filter_map(|job| job.build).collect();
        self.earlier_builds.extend(earlier);
        self.earlier_builds.retain(|known| *known != build && in_use.contains(known));
        self.earlier_builds.dedup();
        self.turn.next_epoch();
        let now = self.turn.now;
        self.nodes.values_mut().for_each(|node| node.heard = now);
        for (job, lease) in stored {
            self.with_job(*job, |job, turn, _| job.committed(turn, *lease));
        }
        let jobs: Vec<JobId> = self.jobs.keys().copied().collect();
        for job in jobs {
            self.with_job(job, |job, turn, _| job.restarted(turn));
        }
    }

    /// A renewed connection may have swallowed what was said before.
    pub(super) fn repeat_orders(&mut self, id: NodeId) {
        let Some(node) = self.nodes.get(&id) else { return };
        if node.state == NodeState::Proving {
            self.turn.send(id, node, ToNode::Prove);
        }
        for (job, lease) in self.not_let_go(node) {
            self.turn.send(id, node, ToNode::Cancel { job, lease });
        }
        self.with_open(|job, turn, nodes| job.repeat_orders(turn, nodes, id));
    }
}

impl Job {
    /// The coordinator was started anew: pixels that were not on disk are gone, and what was asked has to be asked again.
    fn restarted(&mut self, turn: &mut Turn) {
        self.question = None;
        (self.deserted, self.gives_up) = (None, None);
        let gone: Vec<PartId> = self.committing.values().copied().collect();
        for part in gone {
            self.take_back(part, AttemptOutcome::Lost, "the coordinator was started anew");
        }
        if self.phase == Phase::Assembling && !self.is_settled() {
            self.phase = Phase::Rendering;
        }
        if self.phase == Phase::Assembling {
            turn.put(Command::Assemble { job: self.id });
        }
    }

    /// A node's connection was renewed. Nodes take a repeated order as one.
    fn repeat_orders(&mut self, turn: &mut Turn, nodes: &mut Nodes, id: NodeId) {
        let (Some(member), Some(node)) = (self.members.get(&id), nodes.get(&id)) else { return };
        match member.stage {
            Stage::Preparing(_) => turn.send(id, node, ToNode::Prepare { job: self.id }),
            Stage::Prepared => self.probe_again(turn, nodes, id),
            _ => {}
        }
        let Some(node) = nodes.get(&id) else { return };
        // Stray attempts too: they may be taken back, and then nobody would notice that the node knows nothing of them.
        for (lease, of) in self.leases.iter().filter(|(_, of)| of.node == id) {
            let (rect, samples) = (self.part(of.part).rect, self.all_samples());
            turn.send(id, node, ToNode::Render { job: self.id, lease: *lease, rect, samples });
        }
    }

    /// No node of the build on which it began is left, but nodes of another are there: it begins anew on that one.
    pub(super) fn begin_anew(&mut self, turn: &mut Turn, nodes: &mut Nodes) {
        let open: Vec<_> = self.leases.keys().copied().collect();
        for lease in open {
            self.call_back(turn, nodes, lease);
            self.close(turn, nodes, lease, AttemptOutcome::Cancelled, "the job began anew on another build");
        }
        let delivered: Vec<PartId> = self.parts.iter().filter(|part| part.is_delivered()).map(|part| part.id).collect();
        delivered.iter().for_each(|part| self.revoke(turn, *part, AttemptOutcome::Revoked, "it is of another build"));
        let (done, all) = (delivered.len(), self.parts.len());
        let detail = format!("no node of the build on which it began is left; {done} of {all} parts were done");
        *self = Self { log: std::mem::take(&mut self.log), ..Self::new(self.id, self.spec.clone(), turn.now) };
        self.log.warn(format!("the job began anew on another build: {detail}"));
        self.log.event(turn.now, EventKind::BegunAnew, None, Vec::new(), detail);
        self.begin(turn, nodes);
    }
}
