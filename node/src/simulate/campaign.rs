//! Many schedules of faults, and the smallest that still shows what one of them broke.

use std::collections::BTreeMap;
use std::ops::Range;
use std::thread;

use super::{Fault, Run, Scenario, World};
use crate::farm::{JobId, Outcome};
use crate::manifest::AttemptOutcome;

/// What came of many schedules.
#[derive(Clone, Debug, Default)]
pub struct Campaign {
    /// Schedules that broke a promise, with what they broke.
    pub broken: Vec<(u64, String)>,
    /// Jobs that ended with their picture.
    pub finished: u64,
    /// Attempts that were lost or called back.
    pub attempts_lost: u64,
    /// How often each kind of event happened, by its name.
    pub events: BTreeMap<String, u64>,
}

impl Campaign {
    /// Runs the schedules of [`Scenario::chaos`] with these seeds, on so many threads. What comes out does not depend on the threads.
    pub fn run(seeds: &Range<u64>, threads: u64) -> Self {
        let threads = threads.max(1);
        let share = |thread: u64| seeds.clone().filter(move |seed| seed % threads == thread).map(Self::of);
        let mut all = thread::scope(|scope| {
            let workers: Vec<_> = (0..threads).map(share).map(|shares| scope.spawn(|| shares.fold(Self::default(), Self::with))).collect();
            workers.into_iter().filter_map(|worker| worker.join().ok()).fold(Self::default(), Self::with)
        });
        all.broken.sort();
        all
    }

    fn of(seed: u64) -> Self {
        let scenario = Scenario::chaos(seed);
        let run = World::new(scenario.clone()).run();
        let mut events = BTreeMap::new();
        run.record.events.iter().for_each(|event| *events.entry(format!("{:?}", event.kind)).or_default() += 1);
        let lost = run.attempts(AttemptOutcome::Lost) + run.attempts(AttemptOutcome::Cancelled);
        let broken = broken_by(&scenario, &run);
        Self {
            finished: u64::from(matches!(run.outcome, Some(Outcome::Finished | Outcome::Incomplete { .. }))),
            attempts_lost: lost as u64,
            broken: broken.into_iter().map(|what| (seed, what)).collect(),
            events,
        }
    }

    fn with(mut self, other: Self) -> Self {
        self.broken.extend(other.broken);
        self.finished += other.finished;
        self.attempts_lost += other.attempts_lost;
        other.events.into_iter().for_each(|(kind, count)| *self.events.entry(kind).or_default() += count);
        self
    }
}

/// The promise that a run broke, if it broke one: besides what the judge saw, a job must end as its schedule lets it.
pub fn broken_by(scenario: &Scenario, run: &Run) -> Option<String> {
    if !run.violations.is_empty() {
        return Some(run.violations.join("; "));
    }
    let others = run.others.iter().map(|(job, outcome)| (*job, Some(outcome)));
    let ends = std::iter::once((JobId(1), run.outcome.as_ref())).chain(others);
    ends.filter_map(|(job, outcome)| broken_end(scenario, job, outcome)).next()
}

fn broken_end(scenario: &Scenario, job: JobId, outcome: Option<&Outcome>) -> Option<String> {
    let cancelled = scenario.faults.iter().any(|(_, fault)| *fault == Fault::Cancel(job));
    let awaits = |reason: &str| reason.contains("which it waits for");
    match outcome {
        Some(Outcome::Finished) => None,
        Some(Outcome::Incomplete { holes: 1 }) if scenario.poison.is_some() => None,
        Some(Outcome::Cancelled { .. }) if cancelled => None,
        Some(Outcome::Failed { reason }) if awaits(reason) && (scenario.poison.is_some() || has_cancel(scenario)) => None,
        outcome => Some(format!("job {}: {outcome:?}", job.0)),
    }
}

fn has_cancel(scenario: &Scenario) -> bool {
    scenario.faults.iter().any(|(_, fault)| matches!(fault, Fault::Cancel(_)))
}

/// The scenario without the faults that what it breaks does not need.
pub fn shrink(mut scenario: Scenario) -> Scenario {
    let breaks = |scenario: &Scenario| broken_by(scenario, &World::new(scenario.clone()).run()).is_some();
    let mut at = 0;
    while at < scenario.faults.len() {
        let mut fewer = scenario.clone();
        fewer.faults.remove(at);
        if breaks(&fewer) { scenario = fewer } else { at += 1 }
    }
    scenario
}
