//! The farm's core on virtual time: nodes, a network, a disk and faults from a seed; also a user's planning tool.
//!
//! It drives the very state machine that the coordinator runs. A [`Scenario`] says what is there and what goes wrong; [`World`] lets it happen;
//! a [`Run`] tells what came of it. The same scenario gives the same run, to the last command.

mod campaign;
mod clock;
mod disk;
mod judge;
mod machine;
mod random;
mod run;
mod scenario;
mod world;

pub use campaign::{Campaign, broken_by, shrink};
pub use random::Random;
pub use run::Run;
pub use scenario::{Fault, Machine, Network, Poison, Scenario, ScriptPolicy};
pub use world::World;
