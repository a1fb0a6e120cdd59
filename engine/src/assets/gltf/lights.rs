//! Lights of a file: `KHR_lights_punctual`.

use std::f64::consts::{FRAC_PI_2, FRAC_PI_4};

use glam::{DAffine3, DVec3};
use gltf::json::{Node, Root};
use serde::Deserialize;

use super::{AssetError, hierarchy::Placement};
use crate::assets::{
    files::Context,
    light::{ModelLight, ModelLightKind},
    warnings::Warnings,
};

/// The extension's name.
pub(super) const NAME: &str = "KHR_lights_punctual";

#[derive(Deserialize)]
struct Reference {
    light: usize,
}

#[derive(Default, Deserialize)]
#[serde(default)]
struct List {
    lights: Vec<Entry>,
}

#[derive(Deserialize)]
#[serde(default)]
struct Entry {
    name: Option<String>,
    color: [f32; 3],
    intensity: f32,
    range: Option<f32>,
    spot: Spot,
    #[serde(rename = "type")]
    kind: String,
}

impl Default for Entry {
    fn default() -> Self {
        Self { name: None, color: [1.0; 3], intensity: 1.0, range: None, spot: Spot::default(), kind: String::new() }
    }
}

#[derive(Deserialize)]
#[serde(default, rename_all = "camelCase")]
struct Spot {
    inner_cone_angle: f64,
    outer_cone_angle: f64,
}

impl Default for Spot {
    fn default() -> Self {
        Self { inner_cone_angle: 0.0, outer_cone_angle: FRAC_PI_4 }
    }
}

/// The light of a node, if it has one.
pub(super) fn of_node(node: &Node) -> Result<Option<usize>, AssetError> {
    let Some(value) = node.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME)) else { return Ok(None) };
    match Reference::deserialize(value) {
        Ok(reference) => Ok(Some(reference.light)),
        Err(error) => Err(AssetError::new(format!("{NAME}: {error}"))),
    }
}

/// All lights of a file, where they stand.
pub(super) fn lights(root: &Root, placements: &[Placement], warnings: &mut Warnings) -> Result<Vec<ModelLight>, AssetError> {
    if placements.is_empty() {
        return Ok(Vec::new());
    }
    let value = root.extensions.as_ref().and_then(|extensions| extensions.others.get(NAME));
    let list = value.map(List::deserialize).transpose().map_err(|error| AssetError::new(format!("{NAME}: {error}")))?;
    let list = list.unwrap_or_default().lights;
    let mut lights = Vec::new();
    for Placement { index, transform } in placements {
        let Some(entry) = list.get(*index) else {
            return Err(AssetError::new(format!("light {index} does not exist (there are {})", list.len())));
        };
        let name = entry.name.as_ref().map_or_else(|| index.to_string(), |name| format!("{name:?}"));
        match entry.placed(transform).context(|| format!("light {name}"))? {
            Ok(light) => lights.push(light),
            Err(why) => warnings.object("light", name.clone(), why),
        }
        if entry.range.is_some() {
            warnings.object("light", name, "its range is not modelled; it reaches as far as light does");
        }
    }
    Ok(lights)
}

impl Entry {
    /// The light in model coordinates, or why it shines on nothing.
    fn placed(&self, transform: &DAffine3) -> Result<Result<ModelLight, &'static str>, AssetError> {
        let strength = self.color.map(|color| color.max(0.0) * self.intensity.max(0.0));
        if !strength.iter().all(|x| x.is_finite()) {
            return Err(AssetError::new("its intensity is not finite"));
        }
        // It shines along -z.
        let (position, direction) = (transform.translation, -transform.matrix3.z_axis);
        let kind = match self.kind.as_str() {
            "point" => ModelLightKind::Point { position },
            "spot" | "directional" if direction == DVec3::ZERO => return Ok(Err("is scaled to nothing; left out")),
            "directional" => ModelLightKind::Directional { direction },
            "spot" => {
                let outer = self.spot.outer_cone_angle.min(FRAC_PI_2);
                if outer.is_nan() || outer <= 0.0 {
                    return Ok(Err("its cone is closed; left out"));
                }
                ModelLightKind::Spot { position, direction, inner: self.spot.inner_cone_angle.max(0.0).min(outer), outer }
            }
            _ => return Ok(Err("its type is unknown; left out")),
        };
        Ok(Ok(ModelLight { strength, kind }))
    }
}
