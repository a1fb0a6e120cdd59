//! Manifests made by hand, for tests.

use std::{collections::BTreeMap, time::UNIX_EPOCH};

use super::*;
use crate::schedule::{NodeId, PartId};

/// A run that is told step by step.
pub struct Example {
    record: JobRecord,
}

impl Example {
    pub fn new() -> Self {
        let probe = ProbeEntry {
            mode: "shared".into(),
            scale: Some(0.0625),
            seconds: 0.5,
            cell: 32,
            columns: 2,
            rows: 2,
            seconds_per_pixel: vec![1e-3, 2e-3, 3e-3, 4e-3],
        };
        let record = JobRecord {
            split: "grid of 32 x 32".into(),
            assign: "earliest finish".into(),
            outcome: "finished".into(),
            probe,
            nodes: Vec::new(),
            parts: Vec::new(),
            events: Vec::new(),
            warnings: Vec::new(),
        };
        Self { record }
    }

    pub fn node(mut self, id: u32, lanes: u32, power: f64) -> Self {
        self.record.nodes.push(NodeEntry {
            id: NodeId(id),
            name: format!("node-{id}"),
            lanes,
            build: "0.1.0".into(),
            power,
            parts: 0,
            busy: 0.0,
            finish: 0.0,
            probed: vec![(0, 1e-4)],
        });
        self
    }

    /// A part of predicted cost `predicted`, committed by `node`, handed out at `start` and committed at `end` after all its lane's time between.
    pub fn part(self, predicted: f64, node: u32, start: f64, end: f64) -> Self {
        self.attempted(predicted, &[(node, start, end, AttemptOutcome::Committed)])
    }

    /// A part with several attempts.
    pub fn attempted(mut self, predicted: f64, attempts: &[(u32, f64, f64, AttemptOutcome)]) -> Self {
        let id = self.record.parts.len() as u32;
        let attempts = attempts.iter().enumerate().map(|(i, &(node, start, end, outcome))| AttemptEntry {
            lease: u64::from(id) * 10 + i as u64,
            node: NodeId(node),
            start,
            end: Some(end),
            seconds: (outcome != AttemptOutcome::Lost).then_some(end - start),
            outcome,
            reason: (outcome != AttemptOutcome::Committed).then(|| "silent for 0.6 s".to_owned()),
        });
        self.record.parts.push(PartEntry {
            id: PartId(id),
            rect: [id % 2 * 32, id / 2 * 32, 32, 32],
            predicted,
            planned: Some(NodeId(0)),
            hash: Some("00".repeat(32)),
            invalid_samples: 0,
            attempts: attempts.collect(),
            replaced_by: Vec::new(),
        });
        self
    }

    pub fn event(mut self, time: f64, kind: EventKind, node: u32, parts: &[u32]) -> Self {
        let parts = parts.iter().map(|&id| PartId(id)).collect();
        self.record.events.push(EventEntry { time, kind, node: Some(NodeId(node)), parts, detail: "silent for 0.6 s".into() });
        self
    }

    pub fn manifest(self) -> Manifest {
        let submission = Submission {
            id: 1,
            name: "example".into(),
            parameters: BTreeMap::from([("spheres".into(), "30".into())]),
            submitted: UNIX_EPOCH,
            warnings: vec!["KHR_materials_sheen is not modelled".into()],
        };
        let image = ImageEntry {
            exr: "example.exr".into(),
            png: Some("example.png".into()),
            width: 64,
            height: 64,
            samples: 4,
            extended_from: None,
            seed: 0,
            image_hash: "11".repeat(32),
            pixel_type: PixelType::Float,
            aovs: Vec::new(),
            pixels_hash: "22".repeat(32),
            is_black: false,
            clamped: 0,
            invalid_samples: 0,
            holes: Vec::new(),
        };
        build(submission, image, self.record, 42.0)
    }
}
