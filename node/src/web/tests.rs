//! The status page over real connections, and what its script reads against what the server says.

use std::{collections::BTreeSet, sync::Arc};

use tokio::{
    io::{AsyncReadExt as _, AsyncWriteExt as _},
    net::{TcpListener, TcpStream},
    sync::{oneshot, watch},
};

use super::*;
use tessera_engine::part::Rect;

use crate::{
    farm::{JobPhase, NodeState, PartPhase, PartSnapshot},
    schedule::{NodeId, PartId},
};

pub fn snapshot() -> Snapshot {
    let part = |id: u32, phase, node: Option<u32>| {
        let rect = Rect { x: id * 32, y: 0, width: 32, height: 32 };
        PartSnapshot { id: PartId(id), rect, phase, node: node.map(NodeId) }
    };
    Snapshot {
        program: "tessera 0.1.0".into(),
        refusal: Some("no space".into()),
        nodes: vec![NodeStatus {
            id: NodeId(3),
            name: "</script><b>attic".into(),
            address: "127.0.0.1:4000".into(),
            lanes: 4,
            state: NodeState::Refused,
            reason: "its canary differs".into(),
            power: Some(3.5),
            holds: 1,
        }],
        jobs: vec![JobStatus {
            id: 1,
            name: "mini_demo".into(),
            owner: "someone".into(),
            priority: 0,
            paused: false,
            phase: JobPhase::Rendering,
            outcome: String::new(),
            trouble: Some("its folder is gone".into()),
            width: 96,
            height: 32,
            seconds: 3.0,
            total: 3,
            committed: 1,
            parts: vec![part(0, PartPhase::Committed, Some(3)), part(1, PartPhase::Rendering, Some(3)), part(2, PartPhase::Waiting, None)],
        }],
    }
}

/// Head and body of the answer.
async fn get(address: std::net::SocketAddr, path: &str) -> (String, String) {
    let mut stream = TcpStream::connect(address).await.unwrap();
    stream.write_all(format!("GET {path} HTTP/1.1\r\nHost: {address}\r\nConnection: close\r\n\r\n").as_bytes()).await.unwrap();
    let mut answer = String::new();
    stream.read_to_string(&mut answer).await.unwrap();
    answer.split_once("\r\n\r\n").map(|(head, body)| (head.to_owned(), body.to_owned())).unwrap()
}

#[tokio::test]
async fn the_page_the_status_and_the_health_are_served_until_the_end() {
    let (say, snapshots) = watch::channel(Arc::new(Snapshot::default()));
    let (stop, stopped) = oneshot::channel::<()>();
    let listener = TcpListener::bind("127.0.0.1:0").await.unwrap();
    let address = listener.local_addr().unwrap();
    let server = tokio::spawn(serve(listener, snapshots, Arc::default(), async { stopped.await.unwrap_or(()) }));
    say.send_replace(Arc::new(snapshot()));

    let (head, page) = get(address, "/").await;
    assert!(head.starts_with("HTTP/1.1 200") && head.contains("text/html") && head.contains("default-src 'none'"), "{head}");
    assert!(page.contains("<title>Tessera</title>") && !page.contains("://"), "the page is not self-contained");

    let (head, body) = get(address, "/status.json").await;
    assert!(head.starts_with("HTTP/1.1 200") && head.contains("application/json"), "{head}");
    assert_eq!(serde_json::from_str::<serde_json::Value>(&body).unwrap(), serde_json::to_value(snapshot()).unwrap());

    assert_eq!(get(address, "/healthz").await.1, "ok\n");
    let (head, why) = get(address, "/readyz").await;
    assert!(head.starts_with("HTTP/1.1 503") && why == "no space\n", "{head}\n{why}");
    let (head, metrics) = get(address, "/metrics").await;
    assert!(head.starts_with("HTTP/1.1 200") && head.contains("application/openmetrics-text"), "{head}");
    assert!(metrics.contains("tessera_refuses_jobs 1\n") && metrics.ends_with("# EOF\n"), "{metrics}");
    say.send_replace(Arc::new(Snapshot { refusal: None, ..snapshot() }));
    assert_eq!(get(address, "/readyz").await.1, "ok\n");
    assert!(get(address, "/../etc/passwd").await.0.starts_with("HTTP/1.1 404"));
    drop(say);
    assert!(get(address, "/healthz").await.0.starts_with("HTTP/1.1 503"));

    stop.send(()).unwrap();
    server.await.unwrap().unwrap();
    assert!(TcpStream::connect(address).await.is_err(), "it still listens");
}

/// Names that the script reads from a variable: `variable.name`.
fn read_from(script: &str, variable: &str) -> BTreeSet<String> {
    let pattern = format!("{variable}.");
    let hits =
        script.match_indices(&pattern).filter(|(at, _)| !script[..*at].ends_with(|c: char| c.is_alphanumeric() || ".\"'#".contains(c)));
    hits.map(|(at, _)| script[at + pattern.len()..].chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect()).collect()
}

#[test]
fn the_script_reads_only_what_the_status_holds() {
    let page = include_str!("page.html");
    let script = page.split_once("<script>").unwrap().1;
    let status = serde_json::to_value(snapshot()).unwrap();
    for (variable, object) in
        [("farm", &status), ("node", &status["nodes"][0]), ("job", &status["jobs"][0]), ("part", &status["jobs"][0]["parts"][0])]
    {
        let names = read_from(script, variable);
        assert!(names.len() >= if variable == "farm" { 2 } else { 3 }, "{variable}: {names:?}");
        for name in names {
            assert!(object.get(&name).is_some(), "the page reads {variable}.{name}, which the status has not");
        }
    }
}
