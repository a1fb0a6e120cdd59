//! Nodes that measure cells before a job begins.

use super::*;

/// A job whose every cell is measured by each of these nodes.
fn probing(nodes: u32) -> Bench {
    let mut bench = Bench { farm: Farm::new(FarmConfig::default()), now: Duration::ZERO, said: Vec::new() };
    bench.does(Event::Restarted { build: BUILD, stored: Vec::new() });
    let spec = JobSpec { probe: Probe::EveryNode { scale: 0.25 }, ..spec(Assign::Paper, nodes) };
    bench.does(Event::JobSubmitted { job: JOB, spec });
    (0..nodes).for_each(|node| bench.ready(node, 1));
    (0..nodes).for_each(|node| bench.prepared(node, 1));
    bench
}

/// The cells that were asked for last.
fn asked(bench: &Bench) -> Vec<u32> {
    let cells = |command: &Command| match command {
        Command::Send { message: ToNode::Probe { cells, .. }, .. } => Some(cells.iter().map(|(cell, _)| *cell).collect()),
        _ => None,
    };
    bench.said.iter().find_map(cells).unwrap_or_default()
}

fn answer(bench: &mut Bench, node: u32, cells: &[u32]) {
    let cells = cells.iter().map(|cell| (*cell, 0.01)).collect();
    bench.does(Event::Probed { node: NodeId(node), incarnation: Incarnation(1), job: JOB, cells });
}

/// All of it, not only what every node that comes late is asked.
#[test]
fn a_probe_whose_answer_a_broken_connection_swallowed_is_asked_again() {
    let mut bench = probing(1);
    let first = asked(&bench);
    assert!(first.len() > 1, "{first:?}");
    let info = || NodeInfo { name: "n0".into(), lanes: 1, build: "b".into(), address: "elsewhere".into() };
    bench.does(Event::NodeJoined { node: NodeId(0), incarnation: Incarnation(1), info: info() });
    assert_eq!(asked(&bench), first);
    bench.does(Event::Restarted { build: BUILD, stored: Vec::new() });
    bench.does(Event::NodeJoined { node: NodeId(0), incarnation: Incarnation(1), info: info() });
    assert_eq!(asked(&bench), first);
    answer(&mut bench, 0, &first);
    assert_eq!(bench.count(EventKind::ProbeFinished), 1);
}

#[test]
fn nobody_waits_for_a_node_that_has_lost_its_scene() {
    let mut bench = probing(2);
    let cells = asked(&bench);
    let result = Err("gone".to_owned());
    bench.does(Event::Prepared { node: NodeId(0), incarnation: Incarnation(1), job: JOB, result });
    assert_eq!(bench.count(EventKind::Refused), 1);
    answer(&mut bench, 1, &cells);
    assert_eq!((bench.count(EventKind::ProbeFinished), bench.leases(0).len(), bench.leases(1).len()), (1, 0, 2));
}
