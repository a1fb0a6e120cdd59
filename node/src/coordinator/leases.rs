//! Attempts whose pixels may come in: what their connection checks before the core hears of them.

use std::{
    collections::BTreeMap,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use tessera_engine::{
    description::{Aovs, AssetId},
    part::Rect,
};

use crate::{
    farm::{Incarnation, JobId, LeaseId},
    schedule::NodeId,
};

/// An attempt that was handed out.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Lease {
    /// To whom.
    pub node: NodeId,
    /// In which life.
    pub incarnation: Incarnation,
    /// Its frame.
    pub frame: AssetId,
    /// Its pixels.
    pub rect: Rect,
    /// What its frame tells beside colours.
    pub aovs: Aovs,
}

/// All attempts that were handed out and are not settled.
#[derive(Clone, Default)]
pub struct Leases(Arc<Mutex<BTreeMap<(JobId, LeaseId), Lease>>>);

impl Leases {
    fn lock(&self) -> MutexGuard<'_, BTreeMap<(JobId, LeaseId), Lease>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// An attempt is handed out; says whether for the first time.
    pub fn add(&self, job: JobId, id: LeaseId, lease: Lease) -> bool {
        self.lock().insert((job, id), lease).is_none()
    }

    /// An attempt that is handed out.
    pub fn get(&self, job: JobId, id: LeaseId) -> Option<Lease> {
        self.lock().get(&(job, id)).copied()
    }

    /// An attempt is settled.
    pub fn remove(&self, job: JobId, id: LeaseId) {
        self.lock().remove(&(job, id));
    }

    /// An attempt is settled, says this node: of attempts of others it has nothing to say.
    pub fn remove_of(&self, node: NodeId, job: JobId, id: LeaseId) {
        let mut leases = self.lock();
        if leases.get(&(job, id)).is_some_and(|lease| lease.node == node) {
            leases.remove(&(job, id));
        }
    }

    /// A job is over.
    pub fn remove_job(&self, job: JobId) {
        self.lock().retain(|(other, _), _| *other != job);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_node_settles_no_attempt_of_another() {
        let leases = Leases::default();
        let rect = Rect { x: 0, y: 0, width: 1, height: 1 };
        let lease = Lease { node: NodeId(1), incarnation: Incarnation(1), frame: AssetId::of(b"frame"), rect, aovs: Aovs::NONE };
        leases.add(JobId(1), LeaseId(1), lease);
        leases.remove_of(NodeId(2), JobId(1), LeaseId(1));
        assert_eq!(leases.get(JobId(1), LeaseId(1)), Some(lease));
        leases.remove_of(NodeId(1), JobId(1), LeaseId(1));
        assert_eq!(leases.get(JobId(1), LeaseId(1)), None);
    }
}
