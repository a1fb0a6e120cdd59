//! The words of the paper: parts with their cost (its table S_n), nodes with their power (its table R_p), and plans.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tessera_engine::part::Rect;

/// A node of the farm, for as long as its name is known to the coordinator.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(transparent)]
pub struct NodeId(pub u32);

/// A part of one frame: its place in the order in which the split made it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(transparent)]
pub struct PartId(pub u32);

/// A part with what it is expected to cost.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Part {
    /// Its name.
    pub id: PartId,
    /// Its pixels.
    pub rect: Rect,
    /// Predicted seconds on a node of power 1.
    pub cost: f64,
}

/// A node with what it is expected to do.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct NodePower {
    /// Its id.
    pub id: NodeId,
    /// Its name, as the operator gave it.
    pub name: String,
    /// Rendering threads.
    pub lanes: u32,
    /// Throughput of all its lanes together: a node of power p renders parts of total cost c in c / p seconds. Above 0.
    pub power: f64,
}

/// Which node renders which part.
pub type Plan = BTreeMap<PartId, NodeId>;

/// Cost over the frame, as the probe measured it.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CostMap {
    /// Edge of a square cell in pixels; cells at the right and lower border may reach beyond the frame.
    pub cell: u32,
    /// Cells in a row.
    pub columns: u32,
    /// Rows of cells.
    pub rows: u32,
    /// Predicted seconds per *pixel of the frame* in each cell, all samples included, on a node of power 1; row by row.
    pub seconds_per_pixel: Vec<f64>,
}

impl CostMap {
    /// Whether it tells a cost of every cell, and has any.
    pub fn is_sound(&self) -> bool {
        let cells = u64::from(self.columns) * u64::from(self.rows);
        self.cell > 0
            && cells > 0
            && cells == self.seconds_per_pixel.len() as u64
            && self.seconds_per_pixel.iter().all(|cost| cost.is_finite() && *cost >= 0.0)
    }
}

/// How costs and powers are learned before rendering.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Probe {
    /// The paper's: every node renders the whole frame at a fraction `scale` of its resolution.
    EveryNode {
        /// Linear fraction of the resolution, in (0, 1].
        scale: f64,
    },
    /// The cells are shared out over the nodes; a small common patch, rendered by all, makes their times comparable.
    Shared {
        /// Linear fraction of the resolution, in (0, 1].
        scale: f64,
    },
    /// As an earlier job's manifest tells: its costs, and the powers of nodes by name (a node that is not named there counts as the mean).
    Known {
        /// The earlier job's costs.
        costs: CostMap,
        /// The earlier job's powers.
        powers: BTreeMap<String, f64>,
    },
}

/// How the frame becomes parts.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum Split {
    /// Rectangles of `width` x `height` pixels, smaller at the right and lower border.
    Grid {
        /// Columns of a part.
        width: u32,
        /// Rows of a part.
        height: u32,
    },
    /// `count` horizontal strips of the frame's full width, as even as rows allow.
    Strips {
        /// Number of strips.
        count: u32,
    },
    /// The job script's own function.
    Script,
}

/// How parts are given to nodes.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Assign {
    /// Contiguous segments of parts in their order on the film, sized by the nodes' powers alone.
    Naive,
    /// The paper's: the hardest part to the most powerful node, statically.
    Paper,
    /// Every part, hardest first, to the node that would finish it first; a node that runs out takes from the fullest queue.
    EarliestFinish,
    /// The job script's own function: what it says holds, until a node is lost.
    Script,
}
