//! What the nodes of a load did, and how fast they are to be.

use std::{
    sync::{
        Mutex, MutexGuard,
        atomic::{AtomicU64, Ordering},
    },
    time::Duration,
};

/// Counters that all nodes of a load share.
#[derive(Default)]
pub struct Tally {
    connected: AtomicU64,
    beats: AtomicU64,
    delivered: AtomicU64,
    settled: AtomicU64,
    micros: AtomicU64,
    waits: Mutex<Vec<f64>>,
    ends: Mutex<Vec<String>>,
}

impl Tally {
    /// A part takes so many seconds.
    pub(super) fn new(seconds: f64) -> Self {
        let tally = Self::default();
        tally.set_seconds(seconds);
        tally
    }

    /// From now on a part takes so many seconds.
    pub fn set_seconds(&self, seconds: f64) {
        self.micros.store((seconds * 1e6) as u64, Ordering::Relaxed);
    }

    /// How long a part takes now.
    pub(super) fn pace(&self) -> Duration {
        Duration::from_micros(self.micros.load(Ordering::Relaxed))
    }

    /// Nodes that are connected and proved themselves.
    pub fn connected(&self) -> u64 {
        self.connected.load(Ordering::Relaxed)
    }

    /// Heartbeats sent.
    pub fn beats(&self) -> u64 {
        self.beats.load(Ordering::Relaxed)
    }

    /// Parts handed in.
    pub fn delivered(&self) -> u64 {
        self.delivered.load(Ordering::Relaxed)
    }

    /// Parts of which the coordinator said that they are on its disk, or not wanted.
    pub fn settled(&self) -> u64 {
        self.settled.load(Ordering::Relaxed)
    }

    /// Seconds from handing in a part to that, for every part since the last call, in ascending order.
    pub fn take_waits(&self) -> Vec<f64> {
        let mut waits = std::mem::take(&mut *self.waits());
        waits.sort_by(f64::total_cmp);
        waits
    }

    /// Why connections ended, or did not come to stand.
    pub fn ends(&self) -> Vec<String> {
        self.ends.lock().expect("no panic").clone()
    }

    pub(super) fn note_end(&self, reason: String) {
        self.ends.lock().expect("no panic").push(reason);
    }

    fn waits(&self) -> MutexGuard<'_, Vec<f64>> {
        self.waits.lock().expect("no panic")
    }

    pub(super) fn count_connected(&self) {
        self.connected.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_gone(&self) {
        self.connected.fetch_sub(1, Ordering::Relaxed);
    }

    pub(super) fn count_beat(&self) {
        self.beats.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_delivered(&self) {
        self.delivered.fetch_add(1, Ordering::Relaxed);
    }

    pub(super) fn count_settled(&self, after: Duration) {
        self.settled.fetch_add(1, Ordering::Relaxed);
        self.waits().push(after.as_secs_f64());
    }
}

/// The value below which a share of ascending values lies; 0 where there are none.
pub fn quantile(ascending: &[f64], share: f64) -> f64 {
    let at = (ascending.len() as f64 * share) as usize;
    ascending.get(at.min(ascending.len().saturating_sub(1))).copied().unwrap_or(0.0)
}
