//! Wavefront OBJ (Wavefront, "Advanced Visualizer" manual, appendix B1): polygons with positions, texture coordinates, normals, materials
//! and smoothing groups. Errors name the line.
//!
//! Where the file gives no normals and no smoothing groups, surfaces are smooth except over edges sharper than 60 degrees, which shows scans as
//! smooth and cubes as cubes. Positions may carry colours (`v x y z r g b`), taken as sRGB.

use std::{borrow::Cow, collections::BTreeMap};

use glam::DAffine3;

use super::{
    AssetError, Instance, LoadedModel, ModelMaterial,
    files::{Context, Files},
    mesh::fraction,
    mtl::{DEFAULT_GREY, Library},
    normals::Smoothing,
    reference::relative_name,
    soup::{Corner, NONE, Soup},
    warnings::Warnings,
};
use crate::texture::srgb_to_linear;

/// Reads an OBJ file and its material libraries.
pub(super) fn load(files: &Files<'_>) -> Result<LoadedModel, AssetError> {
    let bytes = files.main()?;
    let mut reader = Reader::default();
    for line in lines(&bytes) {
        reader.read(&line, files).context(|| format!("line {}", line.number))?;
    }
    reader.finish()
}

/// Material libraries that an OBJ file names.
pub(super) fn references(bytes: &[u8]) -> Result<Vec<String>, AssetError> {
    let mut names = Vec::new();
    for line in lines(bytes).filter(|line| line.keyword == "mtllib") {
        names.extend(libraries(&line.rest).context(|| format!("line {}", line.number))?);
    }
    Ok(names)
}

/// A statement: its keyword and what follows, without comments and white space at both ends.
pub(super) struct Line<'a> {
    /// From 1; of a statement over several lines, the last.
    pub number: usize,
    pub keyword: Cow<'a, str>,
    pub rest: Cow<'a, str>,
}

/// The statements of an OBJ or MTL file. A backslash at a line's end joins it to the next. Bytes that are not UTF-8 are replaced.
pub(super) fn lines(bytes: &[u8]) -> impl Iterator<Item = Line<'_>> {
    let mut joined: Vec<u8> = Vec::new();
    bytes.split(|&byte| byte == b'\n').zip(1..).filter_map(move |(line, number)| {
        let line = line.trim_ascii();
        if let Some(start) = line.strip_suffix(b"\\") {
            joined.extend_from_slice(start);
            joined.push(b' ');
            return None;
        }
        if joined.is_empty() {
            return statement(String::from_utf8_lossy(line), number);
        }
        joined.extend_from_slice(line);
        let whole = String::from_utf8_lossy(&joined).into_owned();
        joined.clear();
        statement(Cow::Owned(whole), number)
    })
}

fn statement(line: Cow<'_, str>, number: usize) -> Option<Line<'_>> {
    let split = |line: &str| {
        let start = line.len() - line.trim_start().len();
        let end = line[start..].find(char::is_whitespace).map_or(line.len(), |length| start + length);
        (start, end)
    };
    let (start, end) = split(&line);
    if start == end || line[start..].starts_with('#') {
        return None;
    }
    Some(match line {
        Cow::Borrowed(line) => Line { number, keyword: line[start..end].into(), rest: line[end..].trim().into() },
        Cow::Owned(line) => Line { number, keyword: line[start..end].to_owned().into(), rest: line[end..].trim().to_owned().into() },
    })
}

/// Numbers up to the first word that is none (a comment, for instance), eight at the most; all finite.
pub(super) fn numbers(text: &str) -> Result<Numbers, AssetError> {
    let mut numbers = Numbers { values: [0.0; 8], count: 0 };
    for word in text.split_ascii_whitespace().take(numbers.values.len()) {
        let Ok(value) = word.parse::<f32>() else { break };
        if !value.is_finite() {
            return Err(AssetError::new(format!("{word:?} is not a finite number")));
        }
        numbers.values[numbers.count] = value;
        numbers.count += 1;
    }
    Ok(numbers)
}

/// A few numbers.
pub(super) struct Numbers {
    values: [f32; 8],
    count: usize,
}

impl std::ops::Deref for Numbers {
    type Target = [f32];

    fn deref(&self) -> &[f32] {
        &self.values[..self.count]
    }
}

/// The names after `mtllib`: one that may hold spaces, or several that all end in `.mtl`.
fn libraries(rest: &str) -> Result<Vec<String>, AssetError> {
    let ends = |name: &str| name.to_ascii_lowercase().ends_with(".mtl");
    match rest.split_whitespace().all(ends) {
        true => rest.split_whitespace().map(relative_name).collect(),
        false => Ok(vec![relative_name(rest.trim_matches('"'))?]),
    }
}

/// The file as far as it was read.
#[derive(Default)]
struct Reader {
    soup: Soup,
    library: Library,
    warnings: Warnings,
    /// Materials by name, in the order in which faces first used them.
    materials: Vec<String>,
    numbers: BTreeMap<String, u32>,
    /// The name that the last `usemtl` gave.
    material: Option<String>,
    smoothing: Option<Smoothing>,
    corners: Vec<Corner>,
}

/// Name of the material of faces that name none.
const NO_MATERIAL: &str = "default";

impl Reader {
    fn read(&mut self, line: &Line<'_>, files: &Files<'_>) -> Result<(), AssetError> {
        let rest = &*line.rest;
        match &*line.keyword {
            "v" => self.position(rest)?,
            "vt" => match *numbers(rest)? {
                [] => return Err(AssetError::new(format!("vt {rest:?}: one or two numbers are expected"))),
                // The format's v runs upwards.
                [u] => self.soup.uvs.push([u, 1.0]),
                [u, v, ..] => self.soup.uvs.push([u, 1.0 - v]),
            },
            "vn" => match *numbers(rest)? {
                [x, y, z, ..] => self.soup.normals.push([x, y, z]),
                _ => return Err(AssetError::new(format!("vn {rest:?}: three numbers are expected"))),
            },
            "f" | "fo" => self.face(rest)?,
            "s" => self.smoothing = Some(smoothing(rest)),
            "usemtl" => self.material = Some(rest.to_owned()),
            "mtllib" => {
                for library in libraries(rest)? {
                    self.library.add(&library, files, &mut self.warnings)?;
                }
            }
            "l" | "p" => self.warnings.file("points and lines are not modelled; left out"),
            "vp" | "cstype" | "deg" | "curv" | "curv2" | "surf" | "parm" | "trim" | "hole" | "end" | "step" | "con" => {
                self.warnings.file("free-form curves and surfaces are not modelled; left out");
            }
            "o" | "g" | "mg" | "bevel" | "c_interp" | "d_interp" | "lod" => {}
            other => self.warnings.file(format!("the statement {:?} is not known; left out", shortened(other))),
        }
        Ok(())
    }

    fn position(&mut self, rest: &str) -> Result<(), AssetError> {
        let values = numbers(rest)?;
        let [x, y, z, ref more @ ..] = *values else {
            return Err(AssetError::new(format!("v {rest:?}: three numbers are expected")));
        };
        if let [.., r, g, b] = *more {
            // Positions before the first colour are white.
            self.soup.colors.resize(self.soup.positions.len(), [1.0; 4]);
            let [r, g, b] = [r, g, b].map(|value| srgb_to_linear(f64::from(fraction(value))) as f32);
            self.soup.colors.push([r, g, b, 1.0]);
        } else if !self.soup.colors.is_empty() {
            self.soup.colors.push([1.0; 4]);
        }
        self.soup.positions.push([x, y, z]);
        Ok(())
    }

    fn face(&mut self, rest: &str) -> Result<(), AssetError> {
        let mut corners = std::mem::take(&mut self.corners);
        corners.clear();
        for word in rest.split_ascii_whitespace().take_while(|word| !word.starts_with('#')) {
            corners.push(self.corner(word)?);
        }
        match corners.len() {
            0..3 => self.warnings.file("faces of fewer than three corners are left out"),
            _ => {
                let material = self.material_number();
                self.soup.push(&corners, self.smoothing.unwrap_or(Smoothing::Auto), material);
            }
        }
        self.corners = corners;
        Ok(())
    }

    /// `v`, `v/vt`, `v//vn` or `v/vt/vn`.
    fn corner(&self, word: &str) -> Result<Corner, AssetError> {
        let malformed = || AssetError::new(format!("face corner {:?}: v, v/vt, v//vn or v/vt/vn is expected", shortened(word)));
        let mut fields = word.split('/');
        let mut next = |what: &str, count: usize| {
            let field = fields.next().unwrap_or_default();
            if field.is_empty() {
                return Ok(NONE);
            }
            let number: i64 = field.parse().map_err(|_| malformed())?;
            index(number, count).ok_or_else(|| {
                AssetError::new(format!("face corner {:?}: there is no {what} {number} among {count} so far", shortened(word)))
            })
        };
        let position = next("position", self.soup.positions.len())?;
        let uv = next("texture coordinate", self.soup.uvs.len())?;
        let normal = next("normal", self.soup.normals.len())?;
        if position == NONE || fields.next().is_some() {
            return Err(malformed());
        }
        Ok(Corner { position, uv, normal })
    }

    fn material_number(&mut self) -> u32 {
        let name = self.material.as_deref().unwrap_or(NO_MATERIAL);
        if let Some(&number) = self.numbers.get(name) {
            return number;
        }
        let number = self.materials.len() as u32;
        self.numbers.insert(name.to_owned(), number);
        self.materials.push(name.to_owned());
        number
    }

    fn finish(mut self) -> Result<LoadedModel, AssetError> {
        if self.soup.is_empty() {
            return Err(AssetError::new("has no faces").with_help("point clouds and curves are not modelled; export the model as a mesh"));
        }
        let colored = !self.soup.colors.is_empty();
        self.soup.colors.resize(if colored { self.soup.positions.len() } else { 0 }, [1.0; 4]);
        let mut materials = Vec::new();
        for name in &self.materials {
            let found = self.library.find(name).map(|number| self.library.materials[number].clone());
            if found.is_none() && self.material.is_some() && name != NO_MATERIAL {
                self.warnings.object("material", format!("{name:?}"), "is in no library; drawn grey");
            }
            materials.push(found.unwrap_or_else(|| ModelMaterial::matte(name, if colored { 1.0 } else { DEFAULT_GREY }, true)));
        }
        self.warnings.flat_triangles(self.soup.flat);
        let (mut meshes, bad_normals) = self.soup.into_meshes(&self.materials);
        for mesh in meshes.iter_mut().filter(|mesh| mesh.uvs.is_empty() && materials[mesh.material].textures().next().is_some()) {
            mesh.uvs = vec![[0.0; 2]; mesh.positions.len()];
            let text = "has a texture, but the file no texture coordinates (vt); drawn in one of its colours";
            self.warnings.object("material", format!("{:?}", mesh.name), text);
        }
        if bad_normals > 0 {
            self.warnings.file("some normals have no direction; their triangles' are taken there");
        }
        let instances = (0..meshes.len()).map(|mesh| Instance { mesh, transform: DAffine3::IDENTITY }).collect();
        let (textures, warnings) = (self.library.textures, self.warnings.into_texts());
        Ok(LoadedModel { meshes, instances, materials, textures, lights: Vec::new(), warnings })
    }
}

/// An index from 1, or back from the end: -1 is the last of `count`.
fn index(number: i64, count: usize) -> Option<u32> {
    let index = if number < 0 { number.checked_add(count as i64)? } else { number - 1 };
    usize::try_from(index).ok().filter(|&index| index < count).and_then(|index| u32::try_from(index).ok())
}

/// The group after `s`; 0 and `off` stand for none.
fn smoothing(rest: &str) -> Smoothing {
    match rest.split_whitespace().next() {
        None | Some("0" | "off") => Smoothing::Flat,
        Some("on") => Smoothing::Group(1),
        Some(group) => group.parse().map_or(Smoothing::Auto, Smoothing::Group),
    }
}

/// The beginning of a word that may be very long.
fn shortened(word: &str) -> String {
    word.chars().take(40).collect()
}
