//! A bad network between a node and its coordinator: a relay of UDP packets that loses, delays, repeats, damages and blocks them as it is told, and
//! changes the address that a node seems to have. What it does to which packet follows from a seed.

use std::{
    cmp::Reverse,
    collections::{BTreeMap, BinaryHeap},
    net::{Ipv4Addr, SocketAddr, UdpSocket},
    sync::{
        Arc, Condvar, Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicU64, Ordering},
    },
    thread,
    time::{Duration, Instant},
};

use tessera_node::simulate::Random;

/// How often threads look whether they are still wanted.
const LOOK: Duration = Duration::from_millis(100);

/// How long a packet is held back that others are to overtake.
const HELD_BACK: Duration = Duration::from_millis(30);

/// What happens to packets of one direction. Shares are from 0 to 1.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Weather {
    /// Nothing comes through.
    pub blocked: bool,
    /// Share that is lost.
    pub loss: f64,
    /// Share that comes twice.
    pub duplicates: f64,
    /// Share in which a byte is changed.
    pub damage: f64,
    /// Share that others overtake.
    pub reorder: f64,
    /// The most that a packet takes; each takes a random share of it.
    pub jitter: Duration,
}

/// No packet comes through.
pub const BLOCKED: Weather = Weather { blocked: true, loss: 0.0, duplicates: 0.0, damage: 0.0, reorder: 0.0, jitter: Duration::ZERO };

/// The directions of a relay.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Way {
    /// From nodes to the coordinator.
    Up,
    /// From the coordinator to nodes.
    Down,
}

/// A relay in front of a coordinator; it ends with its owner.
pub struct Relay {
    /// Where nodes find it.
    pub address: SocketAddr,
    shared: Arc<Shared>,
}

struct Shared {
    coordinator: SocketAddr,
    front: UdpSocket,
    state: Mutex<State>,
    /// Packets under way by the moment of their arrival.
    under_way: Mutex<BinaryHeap<Reverse<Packet>>>,
    added: Condvar,
    numbers: AtomicU64,
    ended: AtomicBool,
}

struct State {
    weather: [Weather; 2],
    random: Random,
    /// By the address of a node's socket: the socket by which the coordinator knows it.
    flows: BTreeMap<SocketAddr, Arc<UdpSocket>>,
}

#[derive(PartialEq, Eq, PartialOrd, Ord)]
struct Packet {
    due: Instant,
    number: u64,
    bytes: Vec<u8>,
    node: SocketAddr,
    up: bool,
}

impl Drop for Relay {
    fn drop(&mut self) {
        self.shared.ended.store(true, Ordering::Relaxed);
        self.shared.added.notify_all();
    }
}

impl Relay {
    /// A relay to this coordinator, in fine weather.
    pub fn start(coordinator: SocketAddr, seed: u64) -> Self {
        let front = socket();
        let address = front.local_addr().expect("a bound socket");
        let state = State { weather: [Weather::default(); 2], random: Random::new(seed), flows: BTreeMap::new() };
        let shared = Arc::new(Shared {
            coordinator,
            front,
            state: Mutex::new(state),
            under_way: Mutex::default(),
            added: Condvar::new(),
            numbers: AtomicU64::new(0),
            ended: AtomicBool::new(false),
        });
        let (hear, carry) = (shared.clone(), shared.clone());
        thread::spawn(move || hear.hear_nodes());
        thread::spawn(move || carry.carry());
        Self { address, shared }
    }

    /// Changes what happens one way.
    pub fn set(&self, way: Way, weather: Weather) {
        lock(&self.shared.state).weather[way as usize] = weather;
    }

    /// Changes what happens both ways.
    pub fn set_both(&self, weather: Weather) {
        lock(&self.shared.state).weather = [weather; 2];
    }

    /// From now on the coordinator sees every node at another address, as behind a router that forgot.
    pub fn rebind(&self) {
        let mut state = lock(&self.shared.state);
        let nodes: Vec<SocketAddr> = state.flows.keys().copied().collect();
        for node in nodes {
            let flow = self.shared.open(node);
            state.flows.insert(node, flow);
        }
    }
}

impl Shared {
    fn hear_nodes(self: &Arc<Self>) {
        receive(&self.front, &self.ended, |from, bytes| {
            let known = || lock(&self.state).flows.contains_key(&from);
            if !known() {
                let flow = self.open(from);
                lock(&self.state).flows.insert(from, flow);
            }
            self.take(Way::Up, from, bytes);
        });
    }

    /// A socket towards the coordinator for this node. Its thread ends once the node has another one.
    fn open(self: &Arc<Self>, node: SocketAddr) -> Arc<UdpSocket> {
        let (flow, shared) = (Arc::new(socket()), self.clone());
        let heard = flow.clone();
        thread::spawn(move || {
            receive(&heard, &shared.ended, |_, bytes| {
                // A packet to an address that is not the node's any more is lost.
                if lock(&shared.state).flows.get(&node).is_some_and(|now| Arc::ptr_eq(now, &heard)) {
                    shared.take(Way::Down, node, bytes);
                }
            });
        });
        flow
    }

    /// Decides what happens to a packet.
    fn take(&self, way: Way, node: SocketAddr, bytes: &[u8]) {
        let mut state = lock(&self.state);
        let weather = state.weather[way as usize];
        let random = &mut state.random;
        if weather.blocked || random.happens(weather.loss) {
            return;
        }
        let mut bytes = bytes.to_vec();
        if random.happens(weather.damage) && !bytes.is_empty() {
            let place = random.below(u32::try_from(bytes.len()).unwrap_or(u32::MAX)) as usize;
            bytes[place] ^= 1 << random.below(8);
        }
        let copies = if random.happens(weather.duplicates) { 2 } else { 1 };
        for _ in 0..copies {
            let held = if random.happens(weather.reorder) { HELD_BACK } else { Duration::ZERO };
            let due = Instant::now() + held + weather.jitter.mul_f64(random.unit());
            let number = self.numbers.fetch_add(1, Ordering::Relaxed);
            lock(&self.under_way).push(Reverse(Packet { due, number, bytes: bytes.clone(), node, up: way == Way::Up }));
        }
        self.added.notify_all();
    }

    fn carry(&self) {
        let mut under_way = lock(&self.under_way);
        while !self.ended.load(Ordering::Relaxed) {
            let now = Instant::now();
            let wait = under_way.peek().map_or(LOOK, |Reverse(next)| next.due.saturating_duration_since(now));
            if !wait.is_zero() {
                under_way = self.added.wait_timeout(under_way, wait.min(LOOK)).unwrap_or_else(PoisonError::into_inner).0;
                continue;
            }
            let Some(Reverse(packet)) = under_way.pop() else { continue };
            drop(under_way);
            self.arrive(&packet);
            under_way = lock(&self.under_way);
        }
    }

    /// What cannot be sent is lost: nobody may listen there at this moment.
    fn arrive(&self, packet: &Packet) {
        if !packet.up {
            let _ = self.front.send_to(&packet.bytes, packet.node);
            return;
        }
        let flow = lock(&self.state).flows.get(&packet.node).cloned();
        let _ = flow.map(|flow| flow.send_to(&packet.bytes, self.coordinator));
    }
}

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

fn socket() -> UdpSocket {
    let socket = UdpSocket::bind((Ipv4Addr::LOCALHOST, 0)).expect("a free port");
    socket.set_read_timeout(Some(LOOK)).expect("a timeout");
    socket
}

/// Hands on each packet of a socket until the relay ends.
fn receive(socket: &UdpSocket, ended: &AtomicBool, mut take: impl FnMut(SocketAddr, &[u8])) {
    let mut bytes = vec![0; 1 << 16];
    while !ended.load(Ordering::Relaxed) {
        // Errors say that nothing came for a while, or that nobody listens at the other end: neither is a reason to end.
        if let Ok((length, from)) = socket.recv_from(&mut bytes) {
            take(from, &bytes[..length]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A peer behind a relay, and what came to it of `count` numbered packets.
    fn arrived(weather: Weather, count: u8) -> Vec<u8> {
        let coordinator = socket();
        let relay = Relay::start(coordinator.local_addr().unwrap(), 1);
        relay.set(Way::Up, weather);
        let node = socket();
        for number in 0..count {
            node.send_to(&[number; 8], relay.address).unwrap();
            thread::sleep(Duration::from_millis(1));
        }
        let (mut came, mut bytes) = (Vec::new(), [0; 64]);
        while let Ok((_, from)) = coordinator.recv_from(&mut bytes) {
            assert_ne!(from, relay.address);
            came.push(bytes[7]);
        }
        came
    }

    #[test]
    fn each_weather_does_what_it_says() {
        let fine: Vec<u8> = (0..200).collect();
        assert_eq!(arrived(Weather::default(), 200), fine);
        assert!(arrived(BLOCKED, 20).is_empty());
        let lossy = arrived(Weather { loss: 0.25, ..Weather::default() }, 200).len();
        assert!((100..200).contains(&lossy), "{lossy}");
        assert_eq!(arrived(Weather { duplicates: 1.0, ..Weather::default() }, 20).len(), 40);
        let mut mixed = arrived(Weather { reorder: 0.3, ..Weather::default() }, 200);
        assert_ne!(mixed, fine);
        mixed.sort_unstable();
        assert_eq!(mixed, fine, "late, but there");
    }

    #[test]
    fn an_address_that_changed_hears_nothing_at_the_old_one() {
        let coordinator = socket();
        let relay = Relay::start(coordinator.local_addr().unwrap(), 1);
        let (node, mut bytes) = (socket(), [0; 64]);
        let mut seen_at = || {
            node.send_to(b"here", relay.address).unwrap();
            coordinator.recv_from(&mut bytes).unwrap().1
        };
        let before = seen_at();
        relay.rebind();
        let after = seen_at();
        assert_ne!(before, after);
        coordinator.send_to(b"old", before).unwrap();
        coordinator.send_to(b"new", after).unwrap();
        let length = node.recv(&mut bytes).unwrap();
        assert_eq!(&bytes[..length], b"new");
    }
}
