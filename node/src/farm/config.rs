//! The farm's timeouts, so that a simulator can move them.

use std::time::Duration;

use crate::limits;

/// How long the farm waits for what. The default is what [`crate::limits`] says.
#[derive(Clone, Debug, PartialEq)]
pub struct FarmConfig {
    /// Silence after which a node is suspected.
    pub suspect_after: Duration,
    /// Silence after which it is dead.
    pub dead_after: Duration,
    /// How long a job waits for any node before it fails.
    pub no_node_timeout: Duration,
    /// How long a job waits for the nodes it asked for.
    pub gather_timeout: Duration,
    /// How long one node may prepare.
    pub prepare_timeout: Duration,
    /// How long preparing nodes hold up prepared ones.
    pub prepare_grace: Duration,
    /// How long a probe without any answer may take.
    pub probe_timeout: Duration,
    /// How long nodes without an answer hold up those with one, at least.
    pub probe_grace: Duration,
    /// How long an answer of a job's own policy may take before rendering.
    pub policy_timeout: Duration,
    /// How long it may think while rendering.
    pub redistribute_policy_timeout: Duration,
    /// Parts a node holds beyond those its lanes render, per lane.
    pub prefetch_per_lane: usize,
}

impl Default for FarmConfig {
    fn default() -> Self {
        Self {
            suspect_after: limits::SUSPECT_AFTER,
            dead_after: limits::DEAD_AFTER,
            no_node_timeout: limits::NO_NODE_TIMEOUT,
            gather_timeout: limits::GATHER_TIMEOUT,
            prepare_timeout: limits::PREPARE_TIMEOUT,
            prepare_grace: limits::PREPARE_GRACE,
            probe_timeout: limits::PROBE_TIMEOUT,
            probe_grace: limits::PROBE_GRACE,
            policy_timeout: limits::POLICY_PATIENCE,
            redistribute_policy_timeout: limits::REDISTRIBUTE_POLICY_TIMEOUT,
            prefetch_per_lane: limits::PREFETCH_PER_LANE,
        }
    }
}
