//! Everything of Tessera that talks: job scripts, the farm, its wire, its shells, its command line.
//!
//! Rooms are listed in import order: a room imports only from rooms above it (and from the engine). `ARCHITECTURE.md` tells the
//! way data takes.

pub mod limits;
pub mod error;
pub mod throttle;
pub mod files;
pub mod config;
pub mod supervisor;
pub mod schedule;
pub mod manifest;
pub mod report;
pub mod job;
pub mod farm;
pub mod journal;
pub mod wire;
pub mod web;
pub mod coordinator;
pub mod worker;
pub mod simulate;
pub mod cli;
