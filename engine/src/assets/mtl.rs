//! MTL: the materials of OBJ files (Wavefront, "MTL material format", 1995).

use std::{collections::BTreeMap, sync::Arc};

use super::{
    AlphaMode, AssetError, ModelEmission, ModelMaterial, NormalMap,
    files::{Context, Files},
    gloss::Gloss,
    mesh::fraction,
    obj::{Line, lines, numbers},
    reference::name_beside,
    warnings::Warnings,
};
use crate::{
    description::{ColorSpace, Wrap},
    texture::{Coordinates, Image, Texture},
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
    /// Ke.
    emission: Option<[f32; 3]>,
    /// map_Ke.
    emission_texture: Option<Map>,
    /// norm.
    normal: Option<Map>,
    gloss: Gloss,
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
    Ok(entries.into_iter().flat_map(|entry| [entry.texture, entry.emission_texture, entry.normal]).flatten().map(|map| map.file).collect())
}

/// Materials and textures of all libraries of an OBJ file.
#[derive(Default)]
pub(super) struct Library {
    pub materials: Vec<ModelMaterial>,
    pub textures: Vec<Texture>,
    /// By file, and whether its numbers are linear.
    images: BTreeMap<(String, bool), Arc<Image>>,
}

impl Library {
    /// Adds the materials of the library `name`. Libraries and textures are lost so often on the way of an OBJ file that a warning must do.
    pub fn add(&mut self, name: &str, files: &Files<'_>, warnings: &mut Warnings) -> Result<(), AssetError> {
        if !files.has(name) {
            warnings.file(format!("its material library {name:?} is not there; drawn without it"));
            return Ok(());
        }
        for entry in parse(name, &files.part(name)?, warnings)? {
            let mut find = |map: &Option<Map>, space| self.find_texture(name, &entry.name, map.as_ref(), space, files, warnings);
            let texture = find(&entry.texture, ColorSpace::Srgb)?;
            let emission = find(&entry.emission_texture, ColorSpace::Srgb)?;
            let normal = find(&entry.normal, ColorSpace::Linear)?;
            self.materials.push(entry.into_material(texture, emission, normal, &self.textures, warnings));
        }
        Ok(())
    }

    /// The number of the material that a file calls by this name: the last of several.
    pub fn find(&self, name: &str) -> Option<usize> {
        self.materials.iter().rposition(|material| material.name == name)
    }

    /// The number of a material's texture, where its file is there.
    fn find_texture(
        &mut self,
        library: &str,
        material: &str,
        map: Option<&Map>,
        space: ColorSpace,
        files: &Files<'_>,
        warnings: &mut Warnings,
    ) -> Result<Option<usize>, AssetError> {
        match map {
            None => Ok(None),
            Some(map) if files.has(&map.file) => {
                self.texture(map, space, files).map(Some).context(|| format!("{library}: material {material:?}"))
            }
            Some(map) => {
                let text = format!("its texture {:?} is not there; drawn without it", map.file);
                warnings.object("material", format!("{material:?}"), text);
                Ok(None)
            }
        }
    }

    fn texture(&mut self, map: &Map, space: ColorSpace, files: &Files<'_>) -> Result<usize, AssetError> {
        let key = (map.file.clone(), space == ColorSpace::Linear);
        let image = match self.images.get(&key) {
            Some(known) => known.clone(),
            None => {
                let decoded = Image::decode(&files.part(&map.file)?, space);
                let image = Arc::new(decoded.context(|| map.file.clone())?);
                self.images.insert(key, image.clone());
                image
            }
        };
        self.textures.push(Texture::Image { image, pyramid: None, wrap: [map.wrap; 2], coordinates: Coordinates::default() });
        Ok(self.textures.len() - 1)
    }
}

impl Entry {
    fn new(name: &str) -> Self {
        Self { name: name.to_owned(), opacity: 1.0, ..Self::default() }
    }

    fn into_material(
        self,
        texture: Option<usize>,
        emission_texture: Option<usize>,
        normal: Option<usize>,
        textures: &[Texture],
        warnings: &mut Warnings,
    ) -> ModelMaterial {
        let mut warn = |wanted: bool, text: String| {
            if wanted {
                warnings.object("material", format!("{:?}", self.name), text);
            }
        };
        for statement in &self.unmodelled {
            warn(true, format!("{statement} not modelled; drawn without"));
        }
        let own_mask = self.opacity_texture.is_some()
            && self.opacity_texture.as_ref() == self.texture.as_ref().map(|map| &map.file)
            && texture.is_some_and(|texture| textures[texture].has_opacity());
        warn(self.gloss.is_clear(), "refraction (illum) is not modelled; drawn as its opacity (d) says".into());
        warn(
            self.opacity_texture.is_some() && !own_mask,
            "opacity maps (map_d) are modelled only as the opacity of map_Kd's own file".into(),
        );
        let dark = self.texture.is_some() && self.diffuse == Some([0.0; 3]);
        warn(dark, "its Kd is black, which would hide its texture; the texture is drawn as it is".into());
        let default = if texture.is_some() { 1.0 } else { DEFAULT_GREY };
        let [r, g, b] = if dark { [1.0; 3] } else { self.diffuse.unwrap_or([default; 3]) };
        let alpha = if own_mask || self.opacity < 1.0 { AlphaMode::Blend } else { AlphaMode::Opaque };
        // Only the file of map_d says that its opacity counts.
        let opacity =
            if own_mask || texture.is_none_or(|texture| !textures[texture].has_opacity()) { self.opacity } else { self.opacity.round() };
        let radiance = self.emission.unwrap_or([if emission_texture.is_some() { 1.0 } else { 0.0 }; 3]).map(|value| value.max(0.0));
        let mut material = ModelMaterial {
            base_color: [r, g, b, opacity].map(fraction),
            base_color_texture: texture,
            alpha,
            emission: ModelEmission { radiance, texture: emission_texture.filter(|_| radiance != [0.0; 3]) },
            normal: normal.map(|texture| NormalMap { texture, scale: 1.0 }),
            ..ModelMaterial::matte(&self.name, 1.0, true)
        };
        self.gloss.polish(&mut material);
        material
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
            "Ke" => match *numbers(&line.rest)? {
                [grey] => self.emission = Some([grey; 3]),
                [r, g, b, ..] => self.emission = Some([r, g, b]),
                _ => {}
            },
            "map_Ke" => self.emission_texture = self.map(file, &line.rest, warnings)?,
            "norm" => self.normal = self.map(file, &line.rest, warnings)?,
            "bump" | "map_bump" | "map_Bump" => self.unmodelled("bump maps are"),
            "map_Ks" | "map_Ns" | "map_Pr" | "map_Pm" => self.unmodelled("textures of gloss (map_Ks, map_Ns, map_Pr, map_Pm) are"),
            "Ps" | "map_Ps" | "aniso" | "anisor" => self.unmodelled("sheen and anisotropy (Ps, aniso) are"),
            keyword @ ("Ks" | "Ns" | "Ni" | "illum" | "Pr" | "Pm" | "Pc" | "Pcr") => self.gloss.read(keyword, &numbers(&line.rest)?),
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
