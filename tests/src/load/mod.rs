//! Load for a coordinator: many nodes in one process that speak the real wire protocol and render nothing.
//!
//! A node of the load answers like one that renders: it proves itself, probes, and delivers parts, each after the time that a part is said to take. Its
//! pixels are noise that depends on their place alone, so that nothing shrinks on the way and the picture that has to come out is known.

mod meter;
mod noise;
mod node;
mod tally;

use std::{net::SocketAddr, path::Path, sync::Arc};

use tessera_node::wire::tls::{Authority, Role};
use tokio::runtime::{Builder, Runtime};

pub use self::{
    meter::{Meter, Usage},
    noise::noise,
    tally::{Tally, quantile},
};

/// Nodes of the load, all connected or on their way; they end with this.
pub struct Fleet {
    /// What they did.
    pub tally: Arc<Tally>,
    _runtime: Runtime,
}

impl Fleet {
    /// Starts `count` nodes of one lane, certified by the farm whose keys lie in `keys`; a part takes each `seconds`.
    pub fn start(count: usize, keys: &Path, coordinator: SocketAddr, seconds: f64) -> Self {
        let authority = Authority::load(keys).expect("the farm's keys");
        let canary = node::Canary::default();
        let tally = Arc::new(Tally::new(seconds));
        let runtime = Builder::new_multi_thread().worker_threads(1).enable_all().build().expect("a runtime");
        for index in 0..count {
            let identity = authority.issue(Role::Node, &format!("load-{index}")).expect("an identity");
            let share = index as f64 / count as f64;
            runtime.spawn(node::live(identity, coordinator, share, canary.clone(), tally.clone()));
        }
        Self { tally, _runtime: runtime }
    }
}
