//! What the tests share.
//!
//! Tests of one room stand in that room; here stand those that need the whole.

pub mod decoders;
pub mod farm;
pub mod jobs;
pub mod relay;
pub mod rig;
pub mod load;
pub mod s1;
pub mod seeds;
pub mod stage;
pub mod statistics;
