//! The farm's core under seeded schedules of faults, on virtual time.
//!
//! A failing schedule is printed with the command that replays it. `TESSERA_SCHEDULES` sets how many are tried, `TESSERA_SEED` tries one alone.

use std::time::Duration;

use tessera_node::farm::Outcome;
use tessera_node::manifest::{AttemptOutcome, EventKind};
use tessera_node::schedule::{Assign, Probe, Split};
use tessera_node::simulate::{Campaign, Fault, Poison, Run, Scenario, World, broken_by, shrink};

const SCHEDULES: u64 = 10_000;

fn number(name: &str) -> Option<u64> {
    std::env::var(name).ok().map(|value| value.parse().unwrap_or_else(|_| panic!("{name} is not a number: {value}")))
}

fn run(scenario: Scenario) -> Run {
    let seed = scenario.seed;
    let run = World::new(scenario).run();
    assert!(run.violations.is_empty(), "{}\nreplay it: tessera simulate --schedule {seed}", run.violations.join("\n"));
    run
}

fn grid(size: u32) -> Split {
    Split::Grid { width: size, height: size }
}

/// 15 nodes of the powers 0.5 to 2.
fn farm_of_15() -> Vec<(u32, f64)> {
    (0..15).map(|i| (1 + i % 2, 0.5 + f64::from(i * 7 % 15) / 14.0 * 0.75)).collect()
}

#[test]
fn no_schedule_loses_a_part_or_commits_one_twice() {
    let seeds = number("TESSERA_SEED").map_or(0..number("TESSERA_SCHEDULES").unwrap_or(SCHEDULES), |seed| seed..seed + 1);
    let threads = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let campaign = Campaign::run(&seeds, threads as u64);
    println!("{} finished, {} attempts lost or called back; {:?}", campaign.finished, campaign.attempts_lost, campaign.events);
    let shown: Vec<_> = campaign.broken.iter().take(20).map(|(seed, what)| format!("{seed}: {what}")).collect();
    assert!(
        shown.is_empty(),
        "{} schedules went wrong:\n{}\nreplay one: tessera simulate --schedule NUMBER",
        campaign.broken.len(),
        shown.join("\n")
    );
    if seeds.end - seeds.start >= SCHEDULES {
        // The schedules are worth their time only if what they are for happens in them.
        let wanted = ["Lost", "Suspected", "Recovered", "Reassigned", "PolicyReplaced", "Overdue", "Speculated"];
        let wanted = wanted.into_iter().chain(["Cut", "LeftOut", "Quarantined", "Revoked"]);
        let rare: Vec<_> = wanted.filter(|kind| campaign.events.get(*kind).is_none_or(|count| *count < 100)).collect();
        assert!(rare.is_empty(), "hardly ever: {rare:?}");
        assert!(campaign.finished > SCHEDULES * 9 / 10);
    }
}

/// Schedules of long campaigns, one in many thousands, that broke a promise once, and do without what mended them.
#[test]
fn schedules_that_broke_promises_once_keep_them() {
    let once = [
        (43_050, "a node whose only lane hangs was given back what it could not get to, and nobody noticed"),
        (580_327, "the same, with several jobs"),
        (397_545, "a node was asked twice to compare the same part"),
        (646_610, "attempts found on disk let the farm give names again that a crash had made it forget: wrong pixels"),
        (114_250, "nodes died of a part that they had been told to stop, and another was blamed that they had been given since: two holes"),
        (586_665, "a node was given back what a renewed connection had swallowed, and its lanes were taken to hang for ever"),
        (1_252_579, "one death of a node with three attempts at a part counted as three failures: a hole"),
    ];
    for (seed, what) in once {
        let scenario = Scenario::chaos(seed);
        let broken = broken_by(&scenario, &World::new(scenario.clone()).run());
        assert_eq!(broken, None, "again: {what}\nreplay it: tessera simulate --schedule {seed}");
    }
}

/// A job that all nodes leave for ever is broken for the judge: the one fault that does it is found among others.
#[test]
fn a_broken_schedule_shrinks_to_what_breaks_it() {
    let mut scenario = Scenario::plain(21, &[(1, 1.0)], grid(128), Assign::Paper);
    let at = Duration::from_secs;
    scenario.faults =
        vec![(at(1), Fault::Pause(0, at(2))), (at(5), Fault::Kill(0)), (at(2), Fault::FailPart(0)), (at(3), Fault::Slow(0, 1.5))];
    assert!(broken_by(&scenario, &World::new(scenario.clone()).run()).is_some_and(|what| what.contains("all nodes died")));
    assert_eq!(shrink(scenario).faults, [(at(5), Fault::Kill(0))]);
}

#[test]
fn the_same_seed_gives_the_same_run() {
    for seed in 0..20 {
        let (first, second) = (run(Scenario::chaos(seed)), run(Scenario::chaos(seed)));
        assert_eq!((first.trace, first.steps, first.record), (second.trace, second.steps, second.record), "seed {seed}");
    }
    assert_ne!(run(Scenario::chaos(1)).trace, run(Scenario::chaos(2)).trace);
}

#[test]
fn a_silent_death_is_noticed_within_a_second() {
    let mut detections: Vec<Duration> = (0..200)
        .flat_map(|seed| {
            let mut scenario = Scenario::plain(seed, &[(1, 1.0), (1, 1.0), (1, 1.0), (1, 1.0)], grid(96), Assign::EarliestFinish);
            scenario.work = 40.0;
            scenario.network.delay = (0.001, 0.2);
            scenario.network.loss = 0.05;
            let moment = |share: u64| Duration::from_millis(1_500 + share * 997 % 6_000);
            scenario.faults = vec![(moment(seed), Fault::Kill(1)), (moment(seed * 3 + 1), Fault::Kill(2))];
            let run = run(scenario);
            assert_eq!((run.finished(), run.detections.len()), (true, 2), "seed {seed}");
            run.detections
        })
        .collect();
    detections.sort();
    let p99 = detections[detections.len() * 99 / 100];
    println!("p50 {:?}, p99 {p99:?}, longest {:?}", detections[detections.len() / 2], detections.last());
    assert!(p99 <= Duration::from_secs(1));
}

#[test]
fn nobody_is_suspected_without_a_fault() {
    // Five nodes, a network with 200 ms of jitter and 5 % loss: 500 jobs of some 20 s.
    for seed in 0..500 {
        let mut scenario = Scenario::plain(seed, &[(2, 1.0), (1, 2.0), (1, 0.5), (4, 1.0), (1, 1.0)], grid(128), Assign::EarliestFinish);
        scenario.work = 150.0;
        scenario.network.delay = (0.001, 0.2);
        scenario.network.loss = 0.05;
        let run = run(scenario);
        assert!(run.finished());
        assert_eq!(run.count(EventKind::Suspected) + run.count(EventKind::Lost), 0, "seed {seed}");
    }
}

#[test]
fn fourteen_of_fifteen_die_and_the_job_completes() {
    for assign in [Assign::EarliestFinish, Assign::Paper, Assign::Naive, Assign::Script] {
        let mut scenario = Scenario::plain(3, &farm_of_15(), grid(64), assign);
        scenario.faults = (1..15).map(|node| (Duration::from_millis(3_000 + 700 * node as u64), Fault::Kill(node))).collect();
        let run = run(scenario);
        assert!(run.finished(), "{assign:?}");
        assert_eq!(run.count(EventKind::Suspected), 14);
    }
}

#[test]
fn all_die_and_one_comes_back_in_time_or_too_late() {
    let mut scenario = Scenario::plain(4, &[(1, 1.0), (2, 1.0)], grid(96), Assign::Paper);
    let kills = |at: u64| [(Duration::from_secs(at), Fault::Kill(0)), (Duration::from_secs(at), Fault::Kill(1))];
    scenario.faults = kills(40).into_iter().chain([(Duration::from_secs(90), Fault::Start(1))]).collect();
    let back = run(scenario.clone());
    assert!(back.finished());
    let before = back.record.parts.iter().filter(|part| part.attempts.last().is_some_and(|attempt| attempt.end < Some(40.5))).count();
    let again = back
        .record
        .parts
        .iter()
        .filter(|part| part.attempts.iter().filter(|a| a.outcome == AttemptOutcome::Committed).count() != 1)
        .count();
    assert!(before > 3 && again == 0, "{before} parts were done before; none is done again");
    scenario.faults = kills(40).to_vec();
    let gone = run(scenario);
    let Some(Outcome::Failed { reason }) = gone.outcome else { panic!("{:?}", gone.outcome) };
    assert!(reason.starts_with("all nodes died, and none came within 60 s"), "{reason}");
    assert!((100.0..103.0).contains(&gone.record.seconds), "{}", gone.record.seconds);
}

#[test]
fn a_paused_node_comes_back_and_nothing_is_committed_twice() {
    // 3 s: suspected, heard again. 14 s: declared dead, a zombie.
    for (pause, lost) in [(3, 0), (14, 1)] {
        let mut scenario = Scenario::plain(5, &[(2, 1.0), (2, 1.0), (2, 1.0)], grid(96), Assign::EarliestFinish);
        scenario.work = 200.0;
        scenario.faults = vec![(Duration::from_secs(8), Fault::Pause(1, Duration::from_secs(pause)))];
        let run = run(scenario);
        assert!(run.finished());
        assert_eq!((run.count(EventKind::Suspected), run.count(EventKind::Lost)), (1, lost));
        let late = run.record.parts.iter().flat_map(|part| &part.attempts).filter(|a| a.node.0 == 1 && a.start > 8.0 + pause as f64);
        assert!(late.count() > 0, "after its pause it gets work again");
    }
}

#[test]
fn a_node_that_joins_late_gets_work() {
    let mut scenario = Scenario::plain(6, &[(1, 1.0), (4, 1.0)], grid(64), Assign::EarliestFinish);
    (scenario.job.min_nodes, scenario.work) = (1, 120.0);
    scenario.machines[1].starts = Duration::from_secs(20);
    let run = run(scenario);
    let begins = run.record.parts.iter().flat_map(|part| &part.attempts).filter(|a| a.node.0 == 1).map(|a| a.start);
    let first = begins.fold(f64::INFINITY, f64::min);
    assert!((20.0..22.0).contains(&first), "first part at {first} s");
    assert!(run.makespan() < 50.0, "{} s", run.makespan());
}

/// What cannot be rendered is narrowed down to a few pixels; the rest is delivered.
#[test]
fn a_poison_part_becomes_a_small_hole() {
    for kills in [false, true] {
        let mut scenario = Scenario::plain(7, &[(1, 1.0), (1, 1.0), (1, 1.0), (1, 1.0)], grid(64), Assign::Paper);
        (scenario.work, scenario.poison) = (60.0, Some(Poison { x: 517, y: 300, kills }));
        let run = run(scenario);
        assert_eq!(run.outcome, Some(Outcome::Incomplete { holes: 1 }), "kills: {kills}");
        let left_out: Vec<_> = run.record.events.iter().filter(|event| event.kind == EventKind::LeftOut).collect();
        let hole = &run.record.parts[left_out[0].parts[0].0 as usize];
        let [x, y, width, height] = hole.rect;
        assert!((x..x + width).contains(&517) && (y..y + height).contains(&300) && width * height <= 64, "{:?}", hole.rect);
        let whole = run.record.parts.iter().find(|part| part.rect == [512, 256, 64, 64]).unwrap();
        let failed = whole.attempts.iter().filter(|attempt| matches!(attempt.outcome, AttemptOutcome::Lost | AttemptOutcome::Failed));
        let nodes: std::collections::BTreeSet<_> = failed.map(|attempt| attempt.node).collect();
        assert_eq!(nodes.len(), 3, "three nodes tried before it was cut up: {:?}", whole.attempts);
        assert!(run.record.warnings.iter().any(|warning| warning.starts_with("the picture has a hole: part")), "{:?}", run.record.warnings);
    }
}

#[test]
fn a_job_of_which_nothing_can_be_rendered_fails_with_the_reason() {
    let mut scenario = Scenario::plain(7, &[(1, 1.0), (1, 1.0)], grid(8), Assign::Paper);
    (scenario.job.width, scenario.job.height, scenario.work) = (8, 8, 1.0);
    scenario.poison = Some(Poison { x: 3, y: 3, kills: false });
    let Some(Outcome::Failed { reason }) = run(scenario).outcome else { panic!("it has no part") };
    assert!(
        reason.starts_with("no part could be rendered: part 0 (x = 0, y = 0, width = 8, height = 8) failed 3 times: node-"),
        "{reason}"
    );
}

/// A lane that hangs while its node goes on beating: its part is done elsewhere, and the job ends as if the lane were lost.
#[test]
fn a_lane_that_hangs_loses_its_part_to_others() {
    for assign in [Assign::EarliestFinish, Assign::Paper, Assign::Naive, Assign::Script] {
        let mut scenario = Scenario::plain(11, &[(1, 1.0), (1, 1.0), (2, 1.0)], grid(64), assign);
        (scenario.work, scenario.faults) =
            (120.0, vec![(Duration::from_secs(3), Fault::Hang(1)), (Duration::from_secs(4), Fault::Hang(2))]);
        let run = run(scenario);
        assert!(run.finished(), "{assign:?}");
        assert_eq!((run.count(EventKind::Overdue), run.count(EventKind::Lost)), (2, 0), "{assign:?}");
        let late = run.record.parts.iter().flat_map(|part| &part.attempts).filter(|a| a.node.0 == 2 && a.start > 15.0).count();
        assert!(late > 3, "the node's other lane works on: {late}");
    }
}

/// One node turns 60 % slower halfway: the others take over what it would have held up.
#[test]
fn a_node_that_turns_slow_is_not_waited_for() {
    let mut scenario = Scenario::plain(12, &farm_of_15(), grid(32), Assign::EarliestFinish);
    scenario.work = 2_000.0;
    let speeds: f64 = scenario.machines.iter().map(|machine| machine.speed * f64::from(machine.lanes)).sum();
    let slow = scenario.machines[3].speed * f64::from(scenario.machines[3].lanes);
    let work = scenario.work_of_frame();
    let half = work / speeds / 2.0;
    scenario.faults = vec![(Duration::from_secs_f64(half), Fault::Slow(3, 2.5))];
    let run = run(scenario);
    let ideal = half + work / 2.0 / (speeds - 0.6 * slow);
    println!("{:.2} s, ideal {ideal:.2} s", run.makespan());
    assert!(run.makespan() < 1.03 * ideal, "{} s, ideal {ideal} s", run.makespan());
}

#[test]
fn wrong_pixels_are_found_and_their_node_is_quarantined() {
    let mut scenario = Scenario::plain(13, &[(1, 1.0), (1, 1.0), (1, 1.0), (2, 1.0)], grid(64), Assign::EarliestFinish);
    (scenario.work, scenario.job.audit) = (120.0, 0.1);
    scenario.faults = vec![(Duration::from_secs(6), Fault::Corrupt(2))];
    let run = run(scenario);
    assert!(run.finished());
    assert_eq!((run.count(EventKind::Quarantined), run.count(EventKind::Revoked)), (1, 1));
    let good = |part: &tessera_node::manifest::PartEntry| {
        part.attempts.iter().any(|attempt| attempt.outcome == AttemptOutcome::Committed && attempt.node.0 != 2)
    };
    assert!(run.record.parts.iter().filter(|part| part.replaced_by.is_empty()).all(good), "nothing of it is in the picture");
    assert!(run.record.warnings.iter().any(|warning| warning.starts_with("node node-2 was quarantined")), "{:?}", run.record.warnings);
}

#[test]
fn two_nodes_that_differ_are_told_of_when_no_third_can_decide() {
    let mut scenario = Scenario::plain(14, &[(1, 1.0), (1, 1.0)], grid(128), Assign::EarliestFinish);
    (scenario.work, scenario.job.audit) = (20.0, 1.0);
    scenario.faults = vec![(Duration::ZERO, Fault::Corrupt(1))];
    let run = run(scenario);
    assert!(run.finished());
    assert!(run.record.warnings.iter().any(|warning| warning.contains("there is no third to decide")), "{:?}", run.record.warnings);
}

#[test]
fn damaged_pixels_are_rendered_again() {
    let mut scenario = Scenario::plain(15, &[(1, 1.0), (1, 1.0)], grid(128), Assign::Paper);
    (scenario.work, scenario.faults) = (20.0, vec![(Duration::from_secs(2), Fault::DamagePixels)]);
    let run = run(scenario);
    assert!(run.finished());
    assert_eq!((run.count(EventKind::Revoked), run.count(EventKind::RenderFinished)), (1, 2));
}

#[test]
fn a_node_that_cannot_compile_the_scene_is_left_out_with_its_reason() {
    let mut scenario = Scenario::plain(8, &[(1, 1.0), (1, 1.0)], grid(128), Assign::EarliestFinish);
    scenario.work = 10.0;
    scenario.machines[1].incapable = true;
    let one = run(scenario.clone());
    assert!(one.finished());
    assert_eq!(one.record.warnings, ["node node-1 takes no part in the job: no room for the scene"]);
    scenario.machines[0].incapable = true;
    let none = run(scenario).outcome;
    let reason = "no node can render it: node-0: no room for the scene; node-1: no room for the scene";
    assert_eq!(none, Some(Outcome::Failed { reason: reason.into() }));
}

#[test]
fn a_bad_policy_is_replaced_while_rendering_and_said_so() {
    use tessera_node::simulate::ScriptPolicy::{Fails, Good, Late, Never, Wrong};
    for policy in [Good, Late, Never, Wrong, Fails] {
        let mut scenario = Scenario::plain(9, &[(1, 1.0), (1, 1.0), (1, 1.0)], grid(96), Assign::Script);
        (scenario.policy, scenario.work) = (policy, 60.0);
        scenario.faults = vec![(Duration::from_secs(6), Fault::Kill(1))];
        let run = run(scenario);
        assert!(run.finished());
        assert_eq!(run.count(EventKind::PolicyReplaced), usize::from(policy != Good), "{policy:?}");
        assert_eq!(run.record.warnings.len(), usize::from(policy != Good));
    }
}

#[test]
fn probes_find_the_powers() {
    for probe in [Probe::EveryNode { scale: 1.0 / 16.0 }, Probe::Shared { scale: 1.0 / 16.0 }] {
        let mut scenario = Scenario::plain(10, &farm_of_15(), grid(64), Assign::EarliestFinish);
        scenario.job.probe = probe;
        let run = run(scenario);
        let ratio = |node: &tessera_node::manifest::NodeEntry| node.power / run.powers[&node.id];
        let mut ratios: Vec<f64> = run.record.nodes.iter().map(ratio).collect();
        ratios.sort_by(f64::total_cmp);
        assert!(ratios[14] / ratios[0] < 1.1, "{ratios:?}"); // times jitter by 2 %
        assert_eq!((run.record.power.len(), run.record.difficulty.len()), (15, run.record.parts.len()));
    }
}

#[test]
fn good_policies_are_better_than_bad_ones() {
    let figures = |split: Split, assign| {
        let scenario = Scenario::plain(11, &farm_of_15(), split, assign);
        let work = scenario.work_of_frame();
        run(scenario).figures(work)
    };
    let (_, naive, _) = figures(Split::Strips { count: 15 }, Assign::Naive);
    let (_, ranked, _) = figures(Split::Strips { count: 15 }, Assign::Paper);
    let (_, paper, _) = figures(grid(32), Assign::Paper);
    let (_, stealing, overbalance) = figures(grid(32), Assign::EarliestFinish);
    println!(
        "efficiency: naive {naive:.3}, ranked {ranked:.3}, paper {paper:.3}, earliest_finish {stealing:.3} (overbalance {overbalance:.3})"
    );
    assert!(naive < ranked && ranked < paper && paper < stealing);
    assert!(stealing > 0.96 && paper > 0.9);
}
