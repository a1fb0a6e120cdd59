//! MTL: the materials of OBJ files (Wavefront, "MTL material format", 1995).

use std::{collections::BTreeMap, sync::Arc};

use super::{
    AssetError, ModelMaterial,
    files::{Context, Files},
    mesh::fraction,
    obj::{Line, lines, numbers},
    reference::name_beside,
    warnings::Warnings,
};
use crate::{
    description::{ColorSpace, Wrap},
    texture::{Image, Texture},
};

/// A material as the file says it.
#[derive(Default)]
struct Entry {
    name: String,
    /// Kd, linear; the format's usual grey where it is missing.
    diffuse: Option<[f32; 3]>,
    /// map_Kd, relative to the model's folder.
    texture: Option<Map>,
    /// map_d.
    opacity_texture: Option<String>,
    /// d, or 1 - Tr.
    opacity: f32,
    /// Statements that would change the picture.
    unmodelled: Vec<&'static str>,
}

struct Map {
    file: String,
    wrap: Wrap,
}

/// Grey of surfaces about which a file says nothing.
pub(super) const DEFAULT_GREY: f32 = 0.8;

/// The textures of an MTL file, relative to the model's folder.
pub(super) fn references(name: &str, bytes: &[u8]) -> Result<Vec<String>, AssetError> {
    let entries = parse(name, bytes, &mut Warnings::default())?;
    Ok(entries.into_iter().filter_map(|entry| entry.texture).map(|texture| texture.file).collect())
}

/// Materials and textures of all libraries of an OBJ file.
#[derive(Default)]
pub(super) struct Library {
    pub materials: Vec<ModelMaterial>,
    pub textures: Vec<Texture>,
    images: BTreeMap<String, Arc<Image>>,
}

impl Library {
    /// Adds the materials of the library `name`. Libraries and textures are lost so often on the way of an OBJ file that a warning must do.
    pub fn add(&mut self, name: &str, files: &Files<'_>, warnings: &mut Warnings) -> Result<(), AssetError> {
        if !files.has(name) {
            warnings.file(format!("its material library {name:?} is not there; drawn without it"));
            return Ok(());
        }
        for entry in parse(name, &files.part(name)?, warnings)? {
            let texture = match &entry.texture {
                Some(map) if files.has(&map.file) => {
                    Some(self.texture(map, files).context(|| format!("{name}: material {:?}", entry.name))?)
                }
                Some(map) => {
                    let text = format!("its texture {:?} is not there; drawn without it", map.file);
                    warnings.object("material", format!("{:?}", entry.name), text);
                    None
                }
                None => None,
            };
            self.materials.push(entry.into_material(texture, &self.textures, warnings));
        }
        Ok(())
    }

    /// The number of the material that a file calls by this name: the last of several.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.materials.iter().rposition(|material| material.name == name)
    }

    fn texture(&mut self, map: &Map, files: &Files<'_>) -> Result<usize, AssetError> {
        let image = match self.images.get(&map.file) {
            Some(known) => known.clone(),
            None => {
                let decoded = Image::decode(&files.part(&map.file)?, ColorSpace::Srgb);
                let image = Arc::new(decoded.context(|| map.file.clone())?);
                self.images.insert(map.file.clone(), image.clone());
                image
            }
        };
        self.textures.push(Texture::Image { image, wrap: [map.wrap; 2] });
        Ok(self.textures.len() - 1)
    }
}

impl Entry {
    fn new(name: &str) -> Self {
        Self { name: name.to_owned(), opacity: 1.0, ..Self::default() }
    }

    /// Opacity is rounded: blending is not modelled.
    fn into_material(self, texture: Option<usize>, textures: &[Texture], warnings: &mut Warnings) -> ModelMaterial {
        let mut warn = |wanted: bool, text: String| {
            if wanted {
                warnings.object("material", format!("{:?}", self.name), text);
            }
        };
        for statement in &self.unmodelled {
            warn(true, format!("{statement} not modelled; drawn diffuse"));
        }
        let own_mask = self.opacity_texture.is_some()
            && self.opacity_texture.as_ref() == self.texture.as_ref().map(|map| &map.file)
            && texture.is_some_and(|texture| textures[texture].has_opacity());
        warn(self.opacity < 1.0, "transparency (d, Tr) is not modelled; left out where it is less than half opaque".into());
        warn(
            self.opacity_texture.is_some() && !own_mask,
            "opacity maps (map_d) are modelled only as the opacity of map_Kd's own file".into(),
        );
        let dark = self.texture.is_some() && self.diffuse == Some([0.0; 3]);
        warn(dark, "its Kd is black, which would hide its texture; the texture is drawn as it is".into());
        let default = if texture.is_some() { 1.0 } else { DEFAULT_GREY };
        let [r, g, b] = if dark { [1.0; 3] } else { self.diffuse.unwrap_or([default; 3]) };
        let alpha_cutoff = (own_mask || self.opacity < 1.0).then_some(0.5);
        // Only the file of map_d says that its opacity counts.
        let opacity =
            if own_mask || texture.is_none_or(|texture| !textures[texture].has_opacity()) { self.opacity } else { self.opacity.round() };
        let base_color = [r, g, b, opacity].map(fraction);
        ModelMaterial { name: self.name, base_color, texture, alpha_cutoff, double_sided: true }
    }
}

fn parse(name: &str, bytes: &[u8], warnings: &mut Warnings) -> Result<Vec<Entry>, AssetError> {
    let mut entries: Vec<Entry> = Vec::new();
    for line in lines(bytes) {
        let place = || format!("{name}, line {}", line.number);
        if line.keyword == "newmtl" {
            entries.push(Entry::new(&line.rest));
        } else if let Some(entry) = entries.last_mut() {
            entry.read(name, &line, warnings).context(place)?;
        }
    }
    Ok(entries)
}

impl Entry {
    fn read(&mut self, file: &str, line: &Line<'_>, warnings: &mut Warnings) -> Result<(), AssetError> {
        match &*line.keyword {
            "Kd" => match *numbers(&line.rest)? {
                [grey] => self.diffuse = Some([grey; 3]),
                [r, g, b, ..] => self.diffuse = Some([r, g, b]),
                _ => {
                    let text = format!("Kd {:?} is not modelled; drawn grey", line.rest);
                    warnings.object("material", format!("{:?}", self.name), text);
                }
            },
            "d" => self.opacity = numbers(line.rest.trim_start_matches("-halo"))?.first().copied().unwrap_or(1.0),
            "Tr" => self.opacity = 1.0 - numbers(&line.rest)?.first().copied().unwrap_or(0.0),
            "map_Kd" => self.texture = self.map(file, &line.rest, warnings)?,
            "map_d" => self.opacity_texture = self.map(file, &line.rest, warnings)?.map(|map| map.file),
            "Ke" | "map_Ke" => {
                if numbers(&line.rest).is_ok_and(|values| values.iter().all(|&value| value == 0.0)) {
                    return Ok(());
                }
                self.unmodelled("emission (Ke) is");
            }
            "Ks" | "map_Ks" => {
                if numbers(&line.rest).is_ok_and(|values| values.iter().all(|&value| value == 0.0)) {
                    return Ok(());
                }
                self.unmodelled("gloss (Ks) is");
            }
            "bump" | "map_bump" | "map_Bump" | "norm" => self.unmodelled("bump and normal maps are"),
            "disp" => self.unmodelled("displacement is"),
            _ => {}
        }
        Ok(())
    }

    fn unmodelled(&mut self, what: &'static str) {
        if !self.unmodelled.contains(&what) {
            self.unmodelled.push(what);
        }
    }

    /// A texture map: options, then the file's name, which may hold spaces.
    fn map(&self, file: &str, rest: &str, warnings: &mut Warnings) -> Result<Option<Map>, AssetError> {
        let mut wrap = Wrap::Repeat;
        let mut rest = rest;
        while let Some(option) = rest.split_whitespace().next().filter(|word| word.starts_with('-')) {
            let mut words = rest[option.len()..].trim_start();
            let mut arguments = Vec::new();
            while let Some(word) = words.split_whitespace().next() {
                let enough = match option {
                    "-o" | "-s" | "-t" => arguments.len() == 3 || word.parse::<f32>().is_err(),
                    "-mm" => arguments.len() == 2,
                    _ => arguments.len() == 1,
                };
                if enough {
                    break;
                }
                arguments.push(word);
                words = words[word.len()..].trim_start();
            }
            match (option, arguments.as_slice()) {
                ("-clamp", ["on"]) => wrap = Wrap::Clamp,
                ("-clamp", ["off"]) | ("-blendu" | "-blendv" | "-cc" | "-imfchan" | "-texres" | "-boost" | "-type", _) => {}
                _ => warnings.object("material", format!("{:?}", self.name), format!("the texture option {option} is not modelled")),
            }
            rest = words;
        }
        if rest.is_empty() {
            return Ok(None);
        }
        name_beside(file, rest.trim_matches('"')).map(|file| Some(Map { file, wrap }))
    }
}
