//! A node of a farm that renders badly: `tessera-saboteur FAULT COORDINATOR KEYS`. Everything but its renderer is the node that ships.
//!
//! | fault | what it does |
//! | --- | --- |
//! | `hangs` | its lane never comes back from the fourth part, and does not listen to the order to stop |
//! | `miscomputes` | the lowest bit of a number of each part is wrong, and hashed like that |
//! | `crashes` | the process dies of every part in which the pixel [`tessera_tests::farm::POISON`] is |

use std::{
    path::Path,
    sync::atomic::{AtomicBool, AtomicU32, Ordering},
    thread,
};

use tessera_engine::{
    part::{self, Cancelled, Rect, RenderedPart, SampleRange},
    scene::Scene,
};
use tessera_node::{
    limits::{CACHE_BYTES, DRAIN_LIMIT},
    wire::tls::{Identity, Role},
    worker::{self, Options, Renderer},
};
use tessera_tests::farm::POISON;
use tokio::sync::watch;

/// Parts that are rendered well before a lane hangs.
const GOOD_PARTS: u32 = 3;

fn hangs(scene: &Scene, rect: Rect, samples: SampleRange, cancel: &AtomicBool) -> Result<RenderedPart, Cancelled> {
    static PARTS: AtomicU32 = AtomicU32::new(0);
    while PARTS.fetch_add(1, Ordering::Relaxed) >= GOOD_PARTS {
        thread::park();
    }
    part::render(scene, rect, samples, cancel)
}

fn miscomputes(scene: &Scene, rect: Rect, samples: SampleRange, cancel: &AtomicBool) -> Result<RenderedPart, Cancelled> {
    let mut rendered = part::render(scene, rect, samples, cancel)?;
    let middle = rendered.pixels.len() / 2;
    rendered.pixels[middle][0] = f32::from_bits(rendered.pixels[middle][0].to_bits() ^ 1);
    Ok(rendered)
}

fn crashes(scene: &Scene, rect: Rect, samples: SampleRange, cancel: &AtomicBool) -> Result<RenderedPart, Cancelled> {
    let within = |at: u32, from: u32, length: u32| (from..from + length).contains(&at);
    if within(POISON[0], rect.x, rect.width) && within(POISON[1], rect.y, rect.height) {
        std::process::abort();
    }
    part::render(scene, rect, samples, cancel)
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [fault, coordinator, keys] = arguments.as_slice() else { panic!("tessera-saboteur FAULT COORDINATOR KEYS") };
    let render: Renderer = match fault.as_str() {
        "hangs" => hangs,
        "miscomputes" => miscomputes,
        "crashes" => crashes,
        other => panic!("no fault {other}"),
    };
    let identity = Identity::load(Path::new(keys), Role::Node).expect("the keys of a node");
    let options =
        Options { coordinator: coordinator.clone(), identity, lanes: 1, cache: None, cache_bytes: CACHE_BYTES, drain: DRAIN_LIMIT, render };
    let (_never, told) = watch::channel(0);
    worker::run(&options, told).expect("a node that starts");
}
