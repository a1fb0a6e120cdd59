//! The timeline: what every lane of every node did when.

use std::fmt::Write as _;

use super::svg::{escape, heat};
use crate::manifest::{AttemptEntry, AttemptOutcome, Manifest, PartEntry};

const WIDTH: f64 = 960.0;
const LEFT: f64 = 130.0;
const ROW: f64 = 16.0;
const GAP: f64 = 8.0;

/// A stretch of one lane's time.
struct Bar<'a> {
    part: &'a PartEntry,
    attempt: &'a AttemptEntry,
    start: f64,
    end: f64,
}

/// Nodes from top to bottom, time from left to right, attempts coloured by the predicted cost of their part; attempts that came to nothing are outlined.
pub fn timeline(manifest: &Manifest) -> String {
    let end = attempts(manifest).map(|bar| bar.end).fold(manifest.report.makespan, f64::max).max(1e-9);
    let dearest = manifest.parts.iter().map(|part| part.predicted).fold(0.0, f64::max).max(1e-300);
    let mut body = String::new();
    let mut top = GAP;
    for node in &manifest.nodes {
        let lanes = in_lanes(attempts(manifest).filter(|bar| bar.attempt.node == node.id).collect(), node.lanes);
        let _ = writeln!(body, r#"<text x="0" y="{:.1}" fill="currentColor">{}</text>"#, top + 12.0, escape(&node.name));
        for lane in &lanes {
            lane.iter().for_each(|bar| draw(&mut body, bar, top, end, dearest));
            top += ROW;
        }
        top += GAP;
    }
    let marks = (0..=4).map(|i| end * f64::from(i) / 4.0).map(|t| {
        let x = LEFT + t / end * (WIDTH - LEFT - 20.0);
        format!(r#"<text x="{x:.1}" y="{:.1}" text-anchor="middle" fill="currentColor">{t:.1} s</text>"#, top + 14.0)
    });
    let height = top + 24.0;
    format!(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {WIDTH} {height}\" width=\"{WIDTH}\" font-size=\"12\">\n{body}{}\n</svg>\n",
        marks.collect::<String>()
    )
}

/// A lane renders for the seconds that it measured, up to the moment at which it delivered; before that, the part waited for it.
fn attempts(manifest: &Manifest) -> impl Iterator<Item = Bar<'_>> {
    manifest.parts.iter().flat_map(|part| {
        part.attempts.iter().filter_map(move |attempt| {
            let end = attempt.end?;
            let start = attempt.seconds.map_or(attempt.start, |seconds| (end - seconds).max(attempt.start));
            Some(Bar { part, attempt, start, end })
        })
    })
}

/// Puts bars into a row for each lane: each into the first row that is free, or else into the one that is free soonest (an end includes the way to
/// the disk, so neighbours may overlap a little).
fn in_lanes(mut bars: Vec<Bar<'_>>, lanes: u32) -> Vec<Vec<Bar<'_>>> {
    bars.sort_by(|a, b| a.start.total_cmp(&b.start));
    let mut rows: Vec<Vec<Bar<'_>>> = Vec::new();
    rows.resize_with(bars.len().clamp(1, lanes.max(1) as usize), Vec::new);
    for bar in bars {
        let free_at = |row: &Vec<Bar<'_>>| row.last().map_or(0.0, |last| last.end);
        let row = rows.iter().position(|row| free_at(row) <= bar.start);
        let soonest = || (0..rows.len()).min_by(|a, b| free_at(&rows[*a]).total_cmp(&free_at(&rows[*b])));
        if let Some(row) = row.or_else(soonest) {
            rows[row].push(bar);
        }
    }
    rows
}

fn draw(body: &mut String, bar: &Bar<'_>, top: f64, end: f64, dearest: f64) {
    let scale = (WIDTH - LEFT - 20.0) / end;
    let (x, width) = (LEFT + bar.start * scale, ((bar.end - bar.start) * scale - 0.5).max(0.5));
    let paint = match bar.attempt.outcome {
        AttemptOutcome::Committed => format!(r#"fill="{}""#, heat(bar.part.predicted / dearest)),
        _ => r##"fill="none" stroke="#c62" stroke-dasharray="3 2""##.to_owned(),
    };
    let said = format!(
        "part {}, {:?}: {:.3} s to {:.3} s, predicted cost {:.3} s{}",
        bar.part.id.0,
        bar.attempt.outcome,
        bar.start,
        bar.end,
        bar.part.predicted,
        bar.attempt.reason.as_ref().map(|reason| format!(", {reason}")).unwrap_or_default()
    );
    let said = escape(&said);
    let _ = writeln!(
        body,
        r#"<rect x="{x:.2}" y="{top:.1}" width="{width:.2}" height="{:.1}" {paint}><title>{said}</title></rect>"#,
        ROW - 2.0
    );
}
