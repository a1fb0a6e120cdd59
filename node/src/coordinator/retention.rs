//! How long jobs that are over are kept.

use std::{
    collections::{BTreeMap, BTreeSet},
    time::Duration,
};

use super::kept::{End, Kept};
use crate::{
    farm::JobId,
    limits::{KEPT_AT_LEAST, KEPT_BYTES, KEPT_FOR},
};

/// What is kept of jobs that are over.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Retention {
    /// For so long.
    pub age: Duration,
    /// And, of all of them together, so many bytes; the oldest go first.
    pub bytes: u64,
}

impl Default for Retention {
    fn default() -> Self {
        Self { age: KEPT_FOR, bytes: KEPT_BYTES }
    }
}

impl Retention {
    /// Jobs that are to go at the moment `now`, oldest first. `assets` tells sizes by name; those that only jobs need that are over count as theirs.
    pub fn surplus(&self, jobs: &[Kept], assets: &BTreeMap<String, u64>, now: u64) -> Vec<JobId> {
        let mut over: Vec<(&End, &Kept)> = jobs.iter().filter_map(|job| Some((job.end.as_ref()?, job))).collect();
        over.sort_by_key(|(end, job)| (end.at, job.job));
        let mut books = Books::new(jobs, assets);
        let mut gone = Vec::new();
        for (end, job) in over {
            let age = Duration::from_secs(now.saturating_sub(end.at));
            if age >= KEPT_AT_LEAST && (age >= self.age || books.total > self.bytes) {
                books.remove(job);
                gone.push(job.job);
            }
        }
        gone
    }
}

/// Bytes of jobs that are over, and of assets that none but they need.
struct Books<'a> {
    assets: &'a BTreeMap<String, u64>,
    /// Assets of jobs that are over and of no others, with how many need each.
    users: BTreeMap<String, usize>,
    total: u64,
}

impl<'a> Books<'a> {
    fn new(jobs: &[Kept], assets: &'a BTreeMap<String, u64>) -> Self {
        let names = |job: &Kept| job.card.assets.iter().map(ToString::to_string).collect::<Vec<_>>();
        let open: BTreeSet<String> = jobs.iter().filter(|job| job.end.is_none()).flat_map(names).collect();
        let mut books = Self { assets, users: BTreeMap::new(), total: 0 };
        for job in jobs.iter().filter(|job| job.end.is_some()) {
            books.total += job.bytes;
            for name in names(job).into_iter().filter(|name| !open.contains(name)) {
                let users = books.users.entry(name.clone()).or_default();
                *users += 1;
                books.total += if *users == 1 { assets.get(&name).copied().unwrap_or(0) } else { 0 };
            }
        }
        books
    }

    fn remove(&mut self, job: &Kept) {
        self.total = self.total.saturating_sub(job.bytes);
        for name in job.card.assets.iter().map(ToString::to_string) {
            let Some(users) = self.users.get_mut(&name) else { continue };
            *users -= 1;
            if *users == 0 {
                self.total = self.total.saturating_sub(self.assets.get(&name).copied().unwrap_or(0));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use proptest::prelude::*;
    use tessera_engine::description::AssetId;

    use super::*;
    use crate::{coordinator::kept::Card, wire::JobState};

    const NOW: u64 = 1_800_000_000;

    /// A job that ended so many days ago, or has not, of so many bytes, with these assets.
    fn job(number: u64, days: Option<u64>, bytes: u64, assets: &[u8]) -> Kept {
        let assets = assets.iter().map(|asset| AssetId([*asset; 32])).collect();
        let card = Card { name: "job".into(), submitted: 0, size: (1, 1), assets };
        Kept { job: JobId(number), card, end: days.map(|days| End { at: NOW - days * 86_400, state: JobState::Finished }), bytes }
    }

    fn sizes() -> BTreeMap<String, u64> {
        (0..8).map(|asset: u8| (AssetId([asset; 32]).to_string(), 100)).collect()
    }

    fn limits(days: u64, bytes: u64) -> Retention {
        Retention { age: Duration::from_secs(days * 86_400), bytes }
    }

    #[test]
    fn the_old_go_and_the_oldest_where_there_are_too_many_bytes() {
        let jobs = [job(1, Some(40), 10, &[]), job(2, Some(20), 10, &[1]), job(3, Some(10), 10, &[1]), job(4, None, 1_000_000, &[2])];
        let gone = |days, bytes| limits(days, bytes).surplus(&jobs, &sizes(), NOW).iter().map(|job| job.0).collect::<Vec<_>>();
        assert_eq!(gone(30, 1000), [1]);
        assert_eq!(gone(100, 130), [] as [u64; 0], "30 bytes of jobs and 100 of the asset that two of them share");
        assert_eq!(gone(100, 120), [1]);
        assert_eq!(gone(100, 115), [1, 2], "the asset stays with the last that needs it");
        assert_eq!(gone(100, 50), [1, 2, 3]);
        assert_eq!(gone(0, 0), [1, 2, 3], "a job that waits or runs stays");
    }

    #[test]
    fn what_has_only_just_ended_stays_to_be_fetched() {
        assert_eq!(limits(0, 0).surplus(&[job(1, Some(0), 10, &[])], &sizes(), NOW), []);
        assert_eq!(limits(0, 0).surplus(&[job(1, Some(0), 10, &[])], &sizes(), NOW + KEPT_AT_LEAST.as_secs()), [JobId(1)]);
    }

    /// Bytes of what is over, counted plainly.
    fn bytes(jobs: &[Kept]) -> u64 {
        let needed = |over: bool| -> BTreeSet<AssetId> {
            jobs.iter().filter(|job| job.end.is_some() == over).flat_map(|job| job.card.assets.iter().copied()).collect()
        };
        let own = needed(true).difference(&needed(false)).count() as u64;
        jobs.iter().filter(|job| job.end.is_some()).map(|job| job.bytes).sum::<u64>() + 100 * own
    }

    proptest! {
        #[test]
        fn no_open_job_goes_and_no_more_than_has_to(
            given in proptest::collection::vec((proptest::option::of(1..60_u64), 0..300_u64, proptest::collection::vec(0..8_u8, 0..4)), 0..12),
            days in 0..60_u64,
            room in 0..1500_u64,
        ) {
            let jobs: Vec<Kept> = (1..).zip(&given).map(|(number, (days, bytes, assets))| job(number, *days, *bytes, assets)).collect();
            let gone = limits(days, room).surplus(&jobs, &sizes(), NOW);
            let left = |gone: &[JobId]| jobs.iter().filter(|job| !gone.contains(&job.job)).cloned().collect::<Vec<_>>();
            let find = |id: &JobId| jobs.iter().find(|job| job.job == *id).unwrap();
            prop_assert!(gone.iter().all(|id| find(id).end.is_some()));
            let rest = left(&gone);
            prop_assert!(bytes(&rest) <= room || rest.iter().all(|job| job.end.is_none()));
            prop_assert!(rest.iter().filter_map(|job| job.end.as_ref()).all(|end| NOW - end.at < days * 86_400));
            // The youngest that went was too old, or there was no room for it.
            if let Some((youngest, others)) = gone.split_last() {
                let old = NOW - find(youngest).end.as_ref().unwrap().at >= days * 86_400;
                prop_assert!(old || bytes(&left(others)) > room);
            }
        }
    }
}
