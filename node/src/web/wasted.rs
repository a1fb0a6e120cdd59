//! What a job's record tells of time: how much of it was in vain, and how well it was predicted.

use std::collections::BTreeMap;

use crate::{
    farm::JobRecord,
    manifest::{AttemptEntry, AttemptOutcome, PartEntry},
    schedule::NodeId,
};

/// Lane seconds of attempts that did not count. Where a node never said how long its lane worked, that is the time for which it held the
/// part, but no more than the part was predicted to take there: parts wait at their node before a lane takes them.
pub fn seconds(record: &JobRecord) -> f64 {
    let speeds = speeds(record);
    let attempts = record.parts.iter().flat_map(|part| part.attempts.iter().map(move |attempt| (part, attempt)));
    let vain = attempts.filter(|(_, attempt)| !matches!(attempt.outcome, AttemptOutcome::Committed | AttemptOutcome::Running));
    vain.map(|(part, attempt)| attempt.seconds.unwrap_or_else(|| held(attempt).min(predicted(part, attempt, &speeds)))).sum()
}

/// Seconds that committed parts took over those predicted for a lane of their node, where both are known.
pub fn prediction_errors(record: &JobRecord) -> impl Iterator<Item = f64> {
    let speeds = speeds(record);
    let error = move |part: &PartEntry| {
        let attempt = part.attempts.iter().find(|attempt| attempt.outcome == AttemptOutcome::Committed)?;
        let predicted = predicted(part, attempt, &speeds);
        attempt.seconds.map(|seconds| seconds / predicted).filter(|error| predicted > 0.0 && error.is_finite())
    };
    record.parts.iter().filter_map(error)
}

fn held(attempt: &AttemptEntry) -> f64 {
    attempt.end.map_or(0.0, |end| (end - attempt.start).max(0.0))
}

/// What the part was predicted to take on one lane of the attempt's node; endless where the node was never measured.
fn predicted(part: &PartEntry, attempt: &AttemptEntry, speeds: &BTreeMap<NodeId, f64>) -> f64 {
    speeds.get(&attempt.node).map_or(f64::INFINITY, |speed| part.predicted / speed)
}

/// Speeds of one lane of each node that was measured, relative to power 1.
fn speeds(record: &JobRecord) -> BTreeMap<NodeId, f64> {
    let measured = record.nodes.iter().filter(|node| node.power > 0.0 && node.lanes > 0);
    measured.map(|node| (node.id, node.power / f64::from(node.lanes))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::manifest::NodeEntry;

    fn attempt(lease: u64, outcome: AttemptOutcome, start: f64, end: f64, seconds: Option<f64>) -> AttemptEntry {
        AttemptEntry { lease, node: NodeId(0), start, end: Some(end), seconds, outcome, reason: None }
    }

    /// A part of 3 s on a node of two lanes, each half as fast as one of power 1.
    fn record(attempts: Vec<AttemptEntry>) -> JobRecord {
        let node = NodeEntry {
            id: NodeId(0),
            name: "attic".into(),
            lanes: 2,
            build: String::new(),
            power: 1.0,
            parts: 0,
            busy: 0.0,
            finish: 0.0,
            probed: Vec::new(),
        };
        let part = PartEntry {
            id: crate::schedule::PartId(0),
            rect: [0, 0, 8, 8],
            predicted: 3.0,
            planned: None,
            hash: None,
            invalid_samples: 0,
            attempts,
            replaced_by: Vec::new(),
        };
        JobRecord { nodes: vec![node], parts: vec![part], ..empty() }
    }

    fn empty() -> JobRecord {
        use crate::farm;
        let mut farm = farm::Farm::new(farm::FarmConfig::default());
        let spec = farm::JobSpec::plain("empty", 8, 8, 1);
        farm.step(std::time::Duration::ZERO, farm::Event::JobSubmitted { job: farm::JobId(1), spec });
        farm.record(farm::JobId(1)).unwrap()
    }

    #[test]
    fn attempts_that_did_not_count_are_wasted_as_far_as_a_lane_can_have_worked_on_them() {
        use AttemptOutcome::{Cancelled, Committed, Discarded, Lost, Running};
        let attempts = vec![
            attempt(1, Committed, 0.0, 9.0, Some(8.0)),
            attempt(2, Discarded, 0.0, 9.0, Some(7.0)),
            attempt(3, Cancelled, 2.0, 3.0, None), // held for 1 s
            attempt(4, Lost, 2.0, 90.0, None),     // held for longer than it could have taken: 6 s
            attempt(5, Running, 2.0, 90.0, None),
        ];
        let record = record(attempts);
        assert!((seconds(&record) - 14.0).abs() < 1e-9, "{}", seconds(&record));
        let errors: Vec<f64> = prediction_errors(&record).collect();
        assert!(errors.len() == 1 && (errors[0] - 8.0 / 6.0).abs() < 1e-9, "{errors:?}");
    }
}
