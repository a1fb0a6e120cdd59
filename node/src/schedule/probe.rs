//! The probe: the frame at low resolution, in cells, and which node measures which cells.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use tessera_engine::part::Rect;

use super::NodeId;
use crate::limits::{PROBE_CELLS, PROBE_PATCH_PER_AXIS};

/// Lattice points along the edge of a cell, as long as the number of cells stays within its bound.
const POINTS_PER_EDGE: u32 = 4;

/// Geometry of a probe: square cells over the frame, each with a lattice of sample pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Cells {
    /// Distance of the lattice's pixels, at least 1. In each cell the lattice begins at the cell's upper left pixel.
    pub stride: u32,
    /// Edge of a cell in pixels.
    pub cell: u32,
    /// Cells in a row.
    pub columns: u32,
    /// Rows of cells.
    pub rows: u32,
    width: u32,
    height: u32,
}

/// Cells for a probe at a linear fraction `scale` in (0, 1] of the resolution: 4 x 4 lattice points in a cell, more where there would be
/// too many cells.
pub fn cells(width: u32, height: u32, scale: f64) -> Cells {
    let longest = width.max(height).max(1);
    let stride = if scale.is_nan() { 1 } else { (1.0 / scale).round().clamp(1.0, f64::from(longest)) as u32 };
    let mut cell = stride.saturating_mul(POINTS_PER_EDGE);
    while u64::from(width.div_ceil(cell)) * u64::from(height.div_ceil(cell)) > PROBE_CELLS {
        cell = cell.saturating_mul(2);
    }
    Cells { stride, cell, columns: width.div_ceil(cell), rows: height.div_ceil(cell), width, height }
}

impl Cells {
    /// Number of cells.
    pub fn count(&self) -> u32 {
        self.columns * self.rows
    }

    /// Pixels of a cell; those at the right and lower border are cut at the frame.
    pub fn rect(&self, index: u32) -> Rect {
        let (x, y) = ((index % self.columns) * self.cell, (index / self.columns) * self.cell);
        Rect { x, y, width: self.cell.min(self.width - x), height: self.cell.min(self.height - y) }
    }

    /// The common patch: at most 16 cells, spread evenly over the frame.
    pub fn patch(&self) -> Vec<u32> {
        let along = |count: u32| {
            let mut places: Vec<u32> = (0..PROBE_PATCH_PER_AXIS).map(|i| (2 * i + 1) * count / (2 * PROBE_PATCH_PER_AXIS)).collect();
            places.dedup();
            places
        };
        let columns = along(self.columns);
        along(self.rows).iter().flat_map(|row| columns.iter().map(move |column| row * self.columns + column)).collect()
    }
}

/// Which node measures which cells, in ascending order.
pub type Shares = BTreeMap<NodeId, Vec<u32>>;

/// The paper's probe: every node measures every cell.
pub fn every_node(cells: &Cells, nodes: &[(NodeId, u32)]) -> Shares {
    nodes.iter().map(|(node, _)| (*node, (0..cells.count()).collect())).collect()
}

/// The shared probe: all nodes measure the common patch, every other cell is measured by one node; `nodes` are ids with their lanes.
pub fn shared(cells: &Cells, nodes: &[(NodeId, u32)]) -> Shares {
    let patch = cells.patch();
    let rest: Vec<u32> = (0..cells.count()).filter(|cell| !patch.contains(cell)).collect();
    let mut shares = deal(&rest, nodes);
    for (node, _) in nodes {
        let share = shares.entry(*node).or_default();
        share.extend(&patch);
        share.sort_unstable();
    }
    shares
}

/// Deals cells out round robin, to each node as often in a round as it has lanes, so that neighbouring cells go to different nodes.
pub fn deal(cells: &[u32], nodes: &[(NodeId, u32)]) -> Shares {
    let lanes: Vec<NodeId> = nodes.iter().flat_map(|(node, lanes)| (0..(*lanes).max(1)).map(|_| *node)).collect();
    let mut shares = Shares::new();
    for (cell, node) in cells.iter().zip(lanes.iter().cycle()) {
        shares.entry(*node).or_default().push(*cell);
    }
    shares
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cells_tile_the_frame() {
        for (width, height, scale) in [(1024, 768, 1.0 / 16.0), (1, 1, 0.5), (333, 7, 0.3), (65_536, 65_536, 1.0)] {
            let cells = cells(width, height, scale);
            assert!(u64::from(cells.count()) <= PROBE_CELLS);
            let rects: Vec<Rect> = (0..cells.count()).map(|index| cells.rect(index)).collect();
            super::super::split::validate(&rects, width, height).unwrap();
        }
        assert_eq!((cells(1024, 768, 1.0 / 16.0).stride, cells(1024, 768, 1.0 / 16.0).cell), (16, 64));
    }

    #[test]
    fn shares_cover_every_cell_and_all_nodes_share_the_patch() {
        let cells = cells(1024, 768, 1.0 / 16.0);
        let nodes = [(NodeId(3), 1), (NodeId(5), 4), (NodeId(9), 2)];
        let shares = shared(&cells, &nodes);
        let patch = cells.patch();
        assert_eq!(patch.len(), 16);
        for cell in 0..cells.count() {
            let owners = shares.values().filter(|share| share.contains(&cell)).count();
            assert_eq!(owners, if patch.contains(&cell) { 3 } else { 1 }, "cell {cell}");
        }
        let own = |node: u32| shares[&NodeId(node)].len() - patch.len();
        assert_eq!((own(3), own(5), own(9)), (26, 100, 50)); // 176 cells by 1 : 4 : 2 lanes
        assert!(every_node(&cells, &nodes).values().all(|share| share.len() == 192));
    }
}
