//! Pictures of cost: over the frame as predicted and as measured, and one against the other.

use std::{collections::BTreeMap, fmt::Write as _};

use super::svg::{Axis, Plot, escape, heat, hue};
use crate::{
    manifest::{AttemptEntry, AttemptOutcome, Manifest, NodeFigures, PartEntry, figures},
    schedule::NodeId,
};

/// A part with its measured cost: lane seconds times the speed of its node's lanes, in the unit of predictions.
struct Measured<'a> {
    part: &'a PartEntry,
    attempt: &'a AttemptEntry,
    cost: f64,
}

/// The frame twice, coloured by cost per pixel: the probe's cells, and the parts as they turned out.
pub fn cost_maps(manifest: &Manifest) -> String {
    let probe = &manifest.probe;
    let cells = probe.seconds_per_pixel.iter().enumerate().map(|(i, cost)| {
        let (column, row) = (i as u32 % probe.columns.max(1), i as u32 / probe.columns.max(1));
        ([column * probe.cell, row * probe.cell, probe.cell, probe.cell], *cost, format!("cell {i}"))
    });
    let parts = measured(manifest).into_iter().map(|m| (m.part.rect, m.cost / area(m.part), format!("part {}", m.part.id.0)));
    format!(
        "<figure>{}<figcaption>predicted by the probe</figcaption></figure><figure>{}<figcaption>measured, part by part</figcaption></figure>",
        map(manifest, cells.collect()),
        map(manifest, parts.collect())
    )
}

/// Predicted against measured cost of every part, both in seconds on a node of power 1. A perfect prediction lies on the dashed line.
pub fn scatter(manifest: &Manifest) -> String {
    let all = measured(manifest);
    let axis = |label: &str| Axis::logarithmic(label, all.iter().flat_map(|m| [m.part.predicted, m.cost]));
    let mut plot = Plot::new(axis("predicted cost in seconds"), axis("measured cost in seconds"));
    let ends = all.iter().flat_map(|m| [m.part.predicted, m.cost]).filter(|v| *v > 0.0);
    let (low, high) = ends.fold((f64::INFINITY, 0.0), |(low, high): (f64, f64), v| (low.min(v), high.max(v)));
    if low <= high {
        plot.line(&[(low, low), (high, high)], "currentColor", true);
    }
    let color: BTreeMap<_, _> = manifest.nodes.iter().enumerate().map(|(i, node)| (node.id, hue(i))).collect();
    for m in &all {
        let said = format!("part {}: predicted {:.3} s, measured {:.3} s", m.part.id.0, m.part.predicted, m.cost);
        plot.point(m.part.predicted, m.cost, color.get(&m.attempt.node).map_or("gray", String::as_str), &said);
    }
    plot.finish()
}

/// The median over all parts of how far the measured cost lies from the predicted, as a fraction of it.
pub fn typical_error(manifest: &Manifest) -> Option<f64> {
    let all = measured(manifest);
    let mut errors: Vec<_> = all.iter().filter(|m| m.part.predicted > 0.0).map(|m| (m.cost / m.part.predicted - 1.0).abs()).collect();
    errors.sort_by(f64::total_cmp);
    errors.get(errors.len() / 2).copied()
}

fn measured(manifest: &Manifest) -> Vec<Measured<'_>> {
    let speeds: BTreeMap<NodeId, f64> =
        manifest.nodes.iter().zip(figures(manifest)).map(|(node, figures)| (node.id, speed(&figures))).collect();
    let committed = manifest.parts.iter().flat_map(|part| part.attempts.iter().map(move |attempt| (part, attempt)));
    let committed = committed.filter(|(_, attempt)| attempt.outcome == AttemptOutcome::Committed);
    committed
        .filter_map(|(part, attempt)| {
            let cost = attempt.seconds? * speeds.get(&attempt.node)?;
            Some(Measured { part, attempt, cost })
        })
        .collect()
}

/// Cost per lane second.
fn speed(figures: &NodeFigures) -> f64 {
    if figures.busy > 0.0 { figures.work / figures.busy } else { 0.0 }
}

fn map(manifest: &Manifest, cells: Vec<([u32; 4], f64, String)>) -> String {
    let dearest = cells.iter().map(|(_, cost, _)| *cost).fold(0.0, f64::max).max(1e-300);
    let (width, height) = (manifest.image.width, manifest.image.height);
    let mut body = String::new();
    for ([x, y, w, h], cost, name) in cells {
        let said = escape(&format!("{name}: {cost:.3e} s a pixel"));
        let (w, h) = (w.min(width.saturating_sub(x)), h.min(height.saturating_sub(y)));
        // The root of the cost, so that the cheap half of the picture is not one dark field.
        let fill = heat((cost / dearest).sqrt());
        let _ = writeln!(body, r#"<rect x="{x}" y="{y}" width="{w}" height="{h}" fill="{fill}"><title>{said}</title></rect>"#);
    }
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {width} {height}\" width=\"460\" shape-rendering=\"crispEdges\">\n{body}</svg>\n"
    )
}

fn area(part: &PartEntry) -> f64 {
    f64::from(part.rect[2]) * f64::from(part.rect[3])
}
