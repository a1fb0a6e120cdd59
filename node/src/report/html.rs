//! The report as one HTML page that needs nothing else.

use super::{
    costs::{cost_maps, scatter, typical_error},
    style::Style,
    svg::escape,
    table::table,
    text::text,
    timeline::timeline,
};
use crate::manifest::Manifest;

const HEAD: &str = r#"<!DOCTYPE html>
<html lang="en">
<meta charset="utf-8">
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
  :root { color-scheme: light dark; }
  body { font: 15px/1.5 system-ui, sans-serif; max-width: 62rem; margin: 2rem auto; padding: 0 1rem; }
  pre { overflow-x: auto; font-size: 13px; line-height: 1.4; } svg { max-width: 100%; height: auto; }
  figure { display: inline-block; margin: 0 1rem 1rem 0; } figcaption { color: #888; }
  h1 { font-size: 1.5rem; } h2 { font-size: 1.25rem; margin-top: 2.5rem; } h3 { font-size: 1rem; margin-bottom: .3rem; }
</style>
"#;

/// The page: the paper's table over all runs, then for each its report, timeline, cost maps, and predictions against measurements.
pub fn html(manifests: &[Manifest]) -> String {
    let names: Vec<_> = manifests.iter().map(|manifest| escape(&manifest.job.name)).collect();
    let mut page = format!("{HEAD}<title>{}</title>\n<h1>Tessera: {0}</h1>\n", names.join(", "));
    if manifests.len() > 1 {
        page += &format!("<pre>{}</pre>\n", escape(&table(manifests, Style::PLAIN)));
    }
    manifests.iter().for_each(|manifest| page += &section(manifest));
    page + "</html>\n"
}

fn section(manifest: &Manifest) -> String {
    let job = &manifest.job;
    let error = typical_error(manifest).map(|error| format!("Half of the parts lie within {:.1} % of their prediction.", error * 100.0));
    format!(
        "<h2>{}, {} nodes, {}</h2>\n<pre>{}</pre>\n<h3>Timeline</h3>\n<p>Coloured by predicted cost; what came to nothing is outlined.</p>\n{}\n<h3>Cost of a pixel \
         over the frame</h3>\n{}\n<h3>Predicted and measured cost of every part</h3>\n<p>Coloured by node. {}</p>\n{}",
        escape(&job.name),
        manifest.nodes.len(),
        escape(&job.submitted),
        escape(&text(manifest, &[], Style::PLAIN)),
        timeline(manifest),
        cost_maps(manifest),
        error.unwrap_or_default(),
        scatter(manifest)
    )
}
