//! One node of the load.

use std::{
    collections::{BTreeMap, VecDeque},
    net::SocketAddr,
    sync::{Arc, Mutex},
    time::Duration,
};

use quinn::{Connection, SendStream};
use tessera_engine::{REVISION, description::AssetId, part, part::Rect};
use tessera_node::{
    farm::{Incarnation, JobId, LeaseId},
    limits::{CONTROL_BYTES, HEARTBEAT_INTERVAL, HELLO_BYTES, PART_HEADER_BYTES},
    wire::{
        self, FromNode, Heartbeat, Hello, NodeStream, PartHeader, ToNode,
        tls::{Identity, random},
    },
};
use tokio::{
    sync::mpsc,
    time::{Instant, MissedTickBehavior, interval_at, sleep, sleep_until},
};

use super::{noise, tally::Tally};

/// The hash of the canary part, rendered once for all.
#[derive(Clone, Default)]
pub struct Canary(Arc<Mutex<Option<[u8; 32]>>>);

impl Canary {
    fn hash(&self, seed: u64) -> [u8; 32] {
        *self.0.lock().expect("no panic").get_or_insert_with(|| part::canary_hash(seed).expect("the canary part"))
    }
}

type Attempt = (JobId, LeaseId);

struct Node {
    connection: Connection,
    say: SendStream,
    canary: Canary,
    tally: Arc<Tally>,
    frames: BTreeMap<JobId, AssetId>,
    /// Parts to be rendered; the first one is.
    queue: VecDeque<(Attempt, Rect)>,
    /// When that is done.
    done: Instant,
    /// When what is not settled was handed in.
    waiting: BTreeMap<Attempt, Instant>,
    /// Spreads the nodes' first parts over the time that one takes.
    share: f64,
}

/// Lives, and begins a new life where a connection ends. `share` in [0, 1) tells the node's place among all.
pub async fn live(identity: Identity, coordinator: SocketAddr, share: f64, canary: Canary, tally: Arc<Tally>) {
    // All at once would be more handshakes than a coordinator lets begin at once.
    sleep(Duration::from_secs_f64(share * 5.0)).await;
    let endpoint = wire::client(&identity, coordinator).expect("a socket");
    loop {
        let reason = match wire::connect(&endpoint, coordinator).await {
            Ok(connection) => live_once(connection, share, canary.clone(), tally.clone()).await,
            Err(error) => error.to_string(),
        };
        tally.note_end(reason);
        sleep(Duration::from_secs(1)).await;
    }
}

/// Lives until the connection ends, and says why it did.
async fn live_once(connection: Connection, share: f64, canary: Canary, tally: Arc<Tally>) -> String {
    let incarnation = Incarnation(random());
    let hello = NodeStream::Control(Hello { incarnation, lanes: 1, build: "load".to_owned(), revision: REVISION });
    let Ok((mut say, mut receive)) = connection.open_bi().await else { return "no stream".to_owned() };
    if let Err(error) = wire::write(&mut say, &hello, HELLO_BYTES).await {
        return error.to_string();
    }
    let (heard, messages) = mpsc::channel(256);
    tokio::spawn(async move {
        while let Ok(message) = wire::read::<ToNode>(&mut receive, CONTROL_BYTES).await {
            if heard.send(message).await.is_err() {
                return;
            }
        }
    });
    let (frames, queue, waiting) = (BTreeMap::new(), VecDeque::new(), BTreeMap::new());
    let done = Instant::now();
    let node = Node { connection: connection.clone(), say, canary, tally: tally.clone(), frames, queue, done, waiting, share };
    tally.count_connected();
    node.work(incarnation, messages).await;
    tally.count_gone();
    let reason = connection.close_reason().map_or_else(|| "it stopped talking".to_owned(), |reason| wire::explain(&reason).to_string());
    connection.close(0_u8.into(), b"");
    reason
}

impl Node {
    async fn work(mut self, incarnation: Incarnation, mut messages: mpsc::Receiver<ToNode>) {
        let heartbeat: Arc<[u8]> = postcard::to_stdvec(&Heartbeat { incarnation }).expect("a message").into();
        let mut beat = interval_at(Instant::now() + HEARTBEAT_INTERVAL.mul_f64(self.share * 7.0 % 1.0), HEARTBEAT_INTERVAL);
        beat.set_missed_tick_behavior(MissedTickBehavior::Delay);
        loop {
            tokio::select! {
                _ = beat.tick() => {
                    if self.connection.send_datagram(bytes::Bytes::from_owner(heartbeat.clone())).is_err() {
                        return;
                    }
                    self.tally.count_beat();
                }
                message = messages.recv() => {
                    let Some(message) = message else { return };
                    if let Some(answer) = self.hear(message)
                        && wire::write(&mut self.say, &answer, CONTROL_BYTES).await.is_err()
                    {
                        return;
                    }
                }
                () = sleep_until(self.done), if !self.queue.is_empty() => self.deliver(),
            }
        }
    }

    fn hear(&mut self, message: ToNode) -> Option<FromNode> {
        match message {
            ToNode::Prove { seed } => return Some(FromNode::Proof { hash: self.canary.hash(seed) }),
            ToNode::Prepare { job, frame, .. } => {
                self.frames.insert(job, frame);
                return Some(FromNode::Prepared { job, result: Ok(()) });
            }
            ToNode::Probe { job, cells, .. } => {
                // As if a part had 64 x 64 pixels of one sample.
                let seconds = self.tally.pace().as_secs_f64() / 4096.0;
                return Some(FromNode::Probed { job, cells: cells.into_iter().map(|(cell, _)| (cell, seconds)).collect() });
            }
            ToNode::Render { job, lease, rect, .. } => {
                if self.queue.is_empty() {
                    let share = std::mem::replace(&mut self.share, 0.0);
                    self.done = Instant::now() + self.tally.pace().mul_f64(1.0 - share);
                }
                self.queue.push_back(((job, lease), rect));
            }
            ToNode::Cancel { job, lease } => {
                self.queue.retain(|(attempt, _)| *attempt != (job, lease));
                self.waiting.remove(&(job, lease));
                return Some(FromNode::Cancelled { job, lease });
            }
            ToNode::Settled { job, lease } => {
                if let Some(since) = self.waiting.remove(&(job, lease)) {
                    self.tally.count_settled(since.elapsed());
                }
            }
            ToNode::Release { job } => {
                self.frames.remove(&job);
                self.queue.retain(|((of, _), _)| *of != job);
            }
        }
        None
    }

    /// The first part of the queue is rendered: hands it in, and begins the next one.
    fn deliver(&mut self) {
        let Some(((job, lease), rect)) = self.queue.pop_front() else { return };
        let pace = self.tally.pace();
        self.done += pace;
        let Some(frame) = self.frames.get(&job).copied() else { return };
        self.waiting.insert((job, lease), Instant::now());
        self.tally.count_delivered();
        let connection = self.connection.clone();
        tokio::spawn(async move {
            let (bytes, hash) = noise::part(rect);
            let header = PartHeader { job, lease, frame, seconds: pace.as_secs_f64(), hash, invalid_samples: 0 };
            let Ok(mut stream) = connection.open_uni().await else { return };
            if wire::write(&mut stream, &header, PART_HEADER_BYTES).await.is_ok() && stream.write_all(&bytes).await.is_ok() {
                let _ = stream.finish();
            }
        });
    }
}
