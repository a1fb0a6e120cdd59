//! A judge who watches the promises while a simulation runs.

use tessera_engine::part::Rect;

use super::World;
use super::machine::true_hash;
use crate::farm::{JobId, JobRecord, NodeSnapshot, NodeState};
use crate::manifest::{AttemptOutcome, PartEntry};

/// Parts beyond which the books are not checked after every step.
const THICK: usize = 1_000;

impl World {
    /// Checks the farm's books: after every step, or now and then where they are thick.
    pub(super) fn judge(&mut self) {
        let parts = self.farm.jobs().iter().map(|job| job.parts).max().unwrap_or_default();
        if !self.run.steps.is_multiple_of(1 + (parts / THICK) as u64) {
            return;
        }
        if let Err(wrong) = self.farm.check_invariants() {
            self.violation(wrong);
        }
        let innocent = |node: &NodeSnapshot| node.state == NodeState::Quarantined && !self.nodes[node.id.0 as usize].corrupt;
        if self.farm.nodes().iter().any(innocent) {
            self.violation("a node is in quarantine whose pixels are right");
        }
    }

    pub(super) fn note_detections(&mut self) {
        if self.killed.is_empty() {
            return;
        }
        for node in self.farm.nodes() {
            if matches!(node.state, NodeState::Suspected | NodeState::Lost)
                && let Some(at) = self.killed.remove(&(node.id.0 as usize))
            {
                self.run.detections.push(self.now - at);
            }
        }
    }

    /// All pixels are of the build that the job began on, but for those of nodes that compute wrongly; and where every part was compared, there are none
    /// of those.
    pub(super) fn judge_pixels(&mut self, job: JobId, record: &JobRecord) {
        let build = record.build.map_or(0, |build| build.revision);
        let alone = |warning: &String| warning.contains("there is no third to decide") || warning.contains("no other node was there");
        let compared = record.spec.audit >= 1.0 && !record.warnings.iter().any(alone);
        let excused = |part: &PartEntry| {
            let by = part.attempts.iter().find(|attempt| attempt.outcome == AttemptOutcome::Committed);
            !compared && by.is_some_and(|attempt| self.nodes[attempt.node.0 as usize].corrupt)
        };
        let wrong = record.parts.iter().find(|part| {
            let [x, y, width, height] = part.rect;
            let right = true_hash(job, build, Rect { x, y, width, height });
            let right: String = right.iter().map(|byte| format!("{byte:02x}")).collect();
            part.hash.as_ref().is_some_and(|hash| *hash != right) && !excused(part)
        });
        if let Some(part) = wrong {
            self.violation(format!("part {} of job {} has wrong pixels", part.id.0, job.0));
        }
    }
}
