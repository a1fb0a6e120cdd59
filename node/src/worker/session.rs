//! One connection of a node: says hello, hands in what is not settled, then answers until either side ends.

use std::{sync::Arc, time::Duration};

use quinn::{Connection, ConnectionError, RecvStream, SendStream};
use tokio::{
    sync::mpsc,
    time::{Instant, MissedTickBehavior, interval, timeout},
};

use super::{
    cache::Cache,
    drain::{Drain, Step},
    fetch::Fetcher,
    lanes::Lanes,
    life::{Delivery, Done, Life, Reaction},
};
use crate::{
    limits::{CONTROL_BYTES, COORDINATOR_SILENCE, FAREWELL, HEARTBEAT_INTERVAL, HELLO_BYTES, PART_HEADER_BYTES, PEER_QUEUE},
    supervisor::Watchdog,
    wire::{self, FromNode, Heartbeat, Hello, NodeStream, ToNode},
};

/// How a connection ended.
pub enum Ended {
    /// The node was told to stop.
    Stopped,
    /// It broke: this life goes on with the next connection.
    Broken(String),
    /// The coordinator closed it: this life is over, the next one begins anew.
    Closed(String),
}

/// What does not change between connections.
pub struct Node {
    /// Rendering threads.
    pub lanes: Lanes,
    /// Their number.
    pub lane_count: u32,
    /// Assets.
    pub cache: Cache,
    /// Fed with every heartbeat and every attempt to connect.
    pub watchdog: Watchdog,
}

/// Works over one connection until it ends.
pub async fn run(
    node: &Node,
    connection: &Connection,
    life: &mut Life,
    done: &mut mpsc::UnboundedReceiver<Done>,
    drain: &mut Drain,
) -> Ended {
    let (mut say, mut heard) = match open_control(node, connection, life).await {
        Ok(control) => control,
        Err(error) => return broken(connection, &error),
    };
    let fetcher = Fetcher { connection: connection.clone(), cache: node.cache.clone(), lanes: node.lanes.clone(), done: life.done.clone() };
    life.unsettled().into_iter().for_each(|delivery| deliver(connection, delivery));
    if drain.has_begun()
        && let Err(error) = wire::write(&mut say, &FromNode::Draining, CONTROL_BYTES).await
    {
        return broken(connection, &error.to_string());
    }
    let mut pulse = Pulse::new(connection);
    let mut beat = interval(HEARTBEAT_INTERVAL);
    beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
    loop {
        let reaction = tokio::select! {
            biased;
            step = drain.next(life.is_busy()) => match step {
                Step::Begin => Reaction::Say(FromNode::Draining),
                Step::Go => return farewell(connection, say).await,
            },
            _ = beat.tick() => {
                node.watchdog.feed();
                if let Err(error) = pulse.beat(connection, life) {
                    return broken(connection, &error);
                }
                continue;
            }
            message = heard.recv() => match message {
                Some(Ok(message)) => life.hear(message),
                Some(Err(error)) => return broken(connection, &error),
                None => return broken(connection, "the control stream ended"),
            },
            Some(done) = done.recv() => life.take(done),
        };
        match reaction {
            Reaction::Nothing => {}
            Reaction::Say(message) => {
                if let Err(error) = wire::write(&mut say, &message, CONTROL_BYTES).await {
                    return broken(connection, &error.to_string());
                }
            }
            Reaction::Deliver(delivery) => deliver(connection, delivery),
            Reaction::Fetch(job, frame, assets) => drop(tokio::spawn(fetcher.clone().prepare(job, frame, assets))),
        }
    }
}

type Heard = mpsc::Receiver<Result<ToNode, String>>;

async fn open_control(node: &Node, connection: &Connection, life: &Life) -> Result<(SendStream, Heard), String> {
    let (mut say, receive) = connection.open_bi().await.map_err(|error| error.to_string())?;
    let hello = Hello {
        incarnation: life.incarnation,
        lanes: node.lane_count,
        build: crate::manifest::program(),
        revision: tessera_engine::REVISION,
    };
    wire::write(&mut say, &NodeStream::Control(hello), HELLO_BYTES).await.map_err(|error| error.to_string())?;
    let (heard, received) = mpsc::channel(PEER_QUEUE);
    tokio::spawn(read_control(receive, heard));
    Ok((say, received))
}

/// Reading a frame must not be given up halfway, so it has a task of its own.
async fn read_control(mut receive: RecvStream, heard: mpsc::Sender<Result<ToNode, String>>) {
    loop {
        let message = wire::read(&mut receive, CONTROL_BYTES).await.map_err(|error| error.to_string());
        let last = message.is_err();
        if heard.send(message).await.is_err() || last {
            return;
        }
    }
}

/// Sends a part on a stream of its own. If the connection breaks meanwhile, the next one hands it in again.
fn deliver(connection: &Connection, delivery: Arc<Delivery>) {
    let connection = connection.clone();
    tokio::spawn(async move {
        if let Err(error) = upload(&connection, &delivery).await {
            tracing::debug!(error, lease = delivery.header.lease.0, "a part could not be handed in yet");
        }
    });
}

async fn upload(connection: &Connection, delivery: &Delivery) -> Result<(), String> {
    let mut stream = connection.open_uni().await.map_err(|error| error.to_string())?;
    wire::write(&mut stream, &delivery.header, PART_HEADER_BYTES).await.map_err(|error| error.to_string())?;
    stream.write_all(&delivery.bytes).await.map_err(|error| error.to_string())?;
    stream.finish().map_err(|error| error.to_string())
}

/// Heartbeats out, and an eye on whether anything comes in.
struct Pulse {
    received: u64,
    since: Instant,
}

impl Pulse {
    fn new(connection: &Connection) -> Self {
        Self { received: connection.stats().udp_rx.datagrams, since: Instant::now() }
    }

    fn beat(&mut self, connection: &Connection, life: &Life) -> Result<(), String> {
        let heartbeat = postcard::to_stdvec(&Heartbeat { incarnation: life.incarnation }).map_err(|error| error.to_string())?;
        connection.send_datagram(heartbeat.into()).map_err(|error| error.to_string())?;
        let received = connection.stats().udp_rx.datagrams;
        if received != self.received {
            *self = Self { received, since: Instant::now() };
        }
        if self.since.elapsed() > COORDINATOR_SILENCE {
            return Err(format!("nothing heard of the coordinator for {} s", COORDINATOR_SILENCE.as_secs()));
        }
        Ok(())
    }
}

/// Says goodbye, so that others take over at once.
async fn farewell(connection: &Connection, mut say: SendStream) -> Ended {
    let goodbye = async {
        wire::write(&mut say, &FromNode::Goodbye { reason: "the node was stopped".to_owned() }, CONTROL_BYTES).await.ok()?;
        say.finish().ok()?;
        say.stopped().await.ok()
    };
    let _ = timeout(FAREWELL, goodbye).await;
    connection.close(0_u8.into(), b"goodbye");
    Ended::Stopped
}

fn broken(connection: &Connection, error: &str) -> Ended {
    match connection.close_reason() {
        Some(ConnectionError::ApplicationClosed(close)) if close.error_code != wire::CLOSE_RESUME.into() => {
            Ended::Closed(String::from_utf8_lossy(&close.reason).into_owned())
        }
        Some(reason) => Ended::Broken(wire::explain(&reason).to_string()),
        None => {
            connection.close(0_u8.into(), b"");
            Ended::Broken(error.to_owned())
        }
    }
}

/// The pause before the next attempt to connect: doubling, with jitter, so that a farm does not come back all at once.
pub struct Backoff {
    next: Duration,
}

impl Default for Backoff {
    fn default() -> Self {
        Self { next: crate::limits::RECONNECT_PAUSE.0 }
    }
}

impl Backoff {
    /// A random pause between half of the current one and all of it.
    pub fn pause(&mut self) -> Duration {
        let pause = self.next;
        self.next = (pause * 2).min(crate::limits::RECONNECT_PAUSE.1);
        pause.mul_f64(0.5 + 0.5 * (wire::tls::random() as f64 / u64::MAX as f64))
    }
}
