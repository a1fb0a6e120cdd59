//! Parts that nodes die of.

use super::*;

/// A node dies of the frame's only part; another one, which is at it too, is told to stop, for the part is cut up.
fn called_back(lanes: u32) -> (Bench, u32, LeaseId) {
    let mut bench = Bench { farm: Farm::new(FarmConfig::default()), now: Duration::ZERO, said: Vec::new() };
    bench.does(Event::Restarted { build: BUILD, stored: Vec::new() });
    let whole = Split::Grid { width: 64, height: 64 };
    bench.does(Event::JobSubmitted { job: JOB, spec: JobSpec { attempts: 1, split: whole, ..spec(Assign::Naive, 2) } });
    (0..2).for_each(|node| bench.joins(node, 1, lanes));
    (0..2).for_each(|node| bench.prepared(node, 1));
    let (first, other) = if bench.leases(0).is_empty() { (1, 0) } else { (0, 1) };
    bench.passes(0.8, &[other]);
    let lease = bench.leases(other)[0];
    bench.joins(first, 2, lanes);
    assert_eq!((bench.count(EventKind::Cut), bench.count(EventKind::LeftOut)), (1, 0));
    (bench, other, lease)
}

#[test]
fn a_lane_gets_nothing_before_it_lets_go_of_what_others_died_of() {
    let (mut bench, node, lease) = called_back(1);
    assert_eq!(bench.leases(node), []);
    bench.does(Event::Stopped { node: NodeId(node), incarnation: Incarnation(1), job: JOB, lease });
    assert_eq!(bench.leases(node).len(), 1);
}

#[test]
fn a_node_that_may_die_of_what_it_was_told_to_stop_tells_nothing_of_what_else_it_holds() {
    let (mut bench, node, _) = called_back(2);
    assert_eq!(bench.leases(node).len(), 1);
    bench.joins(node, 2, 2);
    assert_eq!(bench.count(EventKind::Cut), 1);
    bench.prepared(node, 2);
    assert_eq!(bench.leases(node).len(), 1);
    bench.joins(node, 3, 2);
    assert_eq!(bench.count(EventKind::Cut), 2);
}
