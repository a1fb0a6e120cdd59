//! What users are told who leave before the work is done.

use std::sync::{Mutex, PoisonError};

/// The jobs that a farm goes on with when its client is interrupted.
///
/// One ear hears the interruption, that of [`block_on_farm`](super::runtime::block_on_farm): of two, either may be the first to be told.
#[derive(Default)]
pub struct Farewell(Mutex<Vec<u64>>);

impl Farewell {
    /// Takes note of one job more.
    pub fn and(&self, job: u64) {
        self.0.lock().unwrap_or_else(PoisonError::into_inner).push(job);
    }

    /// Takes note of a job that follows those before it, which are done.
    pub fn now(&self, job: u64) {
        *self.0.lock().unwrap_or_else(PoisonError::into_inner) = vec![job];
    }

    /// What there is to say.
    pub fn help(&self) -> Option<String> {
        let jobs = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        let numbers: Vec<String> = jobs.iter().map(u64::to_string).collect();
        (!numbers.is_empty()).then(|| format!("the farm goes on with it; `tessera cancel {}` ends that", numbers.join(" ")))
    }
}
