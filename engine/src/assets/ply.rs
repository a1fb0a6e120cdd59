//! Stanford PLY (Turk 1994), text and binary of either byte order: vertices and polygons.
//!
//! Colours are taken as sRGB. Where the file gives no normals, surfaces are smooth except over edges sharper than 60 degrees.

use glam::DAffine3;
use ply_rs_bw::{
    parser::{ParseError, Parser, Reader},
    ply::{ElementDef, Encoding, Header, Property, PropertyAccess, PropertyAccessResult, PropertyType, ScalarType},
};

use super::{
    AssetError, Instance, LoadedModel, ModelMaterial,
    files::Files,
    mesh::fraction,
    mtl::DEFAULT_GREY,
    normals::Smoothing,
    soup::{Corner, NONE, Soup},
    warnings::Warnings,
};
use crate::texture::srgb_to_linear;

/// Reads a PLY file.
pub(super) fn load(files: &Files<'_>) -> Result<LoadedModel, AssetError> {
    let bytes = files.main()?;
    let mut reader = Reader::new(&*bytes);
    let header = Parser::<Vertex>::new().read_header(&mut reader).map_err(|e| damaged(&e))?;
    let mut warnings = Warnings::default();
    check(&header, bytes.len(), &mut warnings)?;
    let mut soup = Soup::default();
    let mut vertices: Option<Vertices> = None;
    for element in header.elements.values() {
        match element.name.as_str() {
            "vertex" => {
                let read = Parser::<Vertex>::new().read_payload_for_element(&mut reader, element, &header);
                vertices = Some(Vertices::new(element, read.map_err(|e| damaged(&e))?, &mut soup)?);
            }
            "face" => {
                let read = Parser::<Face>::new().read_payload_for_element(&mut reader, element, &header);
                let vertices = vertices.as_ref().ok_or_else(|| AssetError::new("its faces stand before its vertices"))?;
                add_faces(&read.map_err(|e| damaged(&e))?, vertices, &mut soup)?;
            }
            _ => {
                Parser::<Skipped>::new().read_payload_for_element(&mut reader, element, &header).map_err(|e| damaged(&e))?;
            }
        }
    }
    finish(soup, warnings)
}

fn finish(soup: Soup, mut warnings: Warnings) -> Result<LoadedModel, AssetError> {
    if soup.is_empty() {
        return Err(AssetError::new("has no faces with an area"));
    }
    let grey = if soup.colors.is_empty() { DEFAULT_GREY } else { 1.0 };
    let materials = vec![ModelMaterial::matte("default", grey, true)];
    warnings.flat_triangles(soup.flat);
    let (meshes, bad_normals) = soup.into_meshes(&["default".to_owned()]);
    if bad_normals > 0 {
        warnings.file("some normals have no direction; their triangles' are taken there");
    }
    let instances = (0..meshes.len()).map(|mesh| Instance { mesh, transform: DAffine3::IDENTITY }).collect();
    Ok(LoadedModel { meshes, instances, materials, warnings: warnings.into_texts(), ..LoadedModel::default() })
}

/// The reader's message says the same thing over several lines: the first one and the text that it is about are enough.
fn damaged(error: &ParseError) -> AssetError {
    let text = error.to_string();
    let first = text.lines().next().unwrap_or_default().trim_end_matches('.');
    let place = error.line().map_or_else(String::new, |line| format!("line {line}: "));
    let what = first.split_once(": ").filter(|(start, _)| start.starts_with("Line ")).map_or(first, |(_, what)| what);
    let about = text.split_once("String: '").and_then(|(_, about)| about.lines().next()).map(|about| about.trim_end_matches('\''));
    let about = about.map_or_else(String::new, |about| format!(": {:?}", about.chars().take(60).collect::<String>()));
    AssetError::new(format!("{place}{what}{about}")).with_help("the file is damaged or was cut off; export it again")
}

/// Refuses what the header alone tells to be unreadable: above all more elements than the file can hold.
fn check(header: &Header, file: usize, warnings: &mut Warnings) -> Result<(), AssetError> {
    let names = |name: &str| header.elements.contains_key(name);
    if names("tristrips") && !names("face") {
        return Err(AssetError::new("triangle strips (element tristrips) are not read").with_help("export the model with an element face"));
    }
    if header.elements.get("face").is_none_or(|face| face.count == 0) {
        return Err(AssetError::new("has no faces: point clouds are not modelled")
            .with_help("make a mesh of it, for instance by surface reconstruction"));
    }
    for element in header.elements.values() {
        let least: usize = match header.encoding {
            // A digit and what separates it from the next.
            Encoding::Ascii => 2 * element.properties.len(),
            _ => element.properties.values().map(|property| least_bytes(&property.data_type)).sum(),
        };
        if element.count > file / least.max(1) {
            let message =
                format!("its header promises {} elements {:?}, more than a file of {file} bytes holds", element.count, element.name);
            return Err(AssetError::new(message).with_help("the file is damaged or was cut off; export it again"));
        }
        match element.name.as_str() {
            "vertex" => {}
            "face" => {
                let has = |name| element.properties.contains_key(name);
                if has("red") || has("r") {
                    warnings.file("colours of faces are not modelled");
                }
                if has("texcoord") {
                    warnings.file("texture coordinates of faces are not modelled");
                }
            }
            other => warnings.file(format!("the element {other:?} is not modelled")),
        }
    }
    if header.comments.iter().any(|comment| comment.to_ascii_lowercase().starts_with("texturefile")) {
        warnings.file("its texture file is not modelled; give the model a material of your own");
    }
    Ok(())
}

/// Bytes that a property takes at the least in a binary file.
fn least_bytes(data_type: &PropertyType) -> usize {
    let (PropertyType::Scalar(scalar) | PropertyType::List(scalar, _)) = data_type;
    match scalar {
        ScalarType::Char | ScalarType::UChar => 1,
        ScalarType::Short | ScalarType::UShort => 2,
        ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
        ScalarType::Double => 8,
    }
}

/// A vertex as the parser fills it in. What the file does not have stays 0.
#[derive(Clone, Copy, Default)]
struct Vertex {
    position: [f32; 3],
    normal: [f32; 3],
    uv: [f32; 2],
    color: [f32; 4],
}

impl Vertex {
    fn field(&mut self, name: &str) -> Option<&mut f32> {
        Some(match name {
            "x" => &mut self.position[0],
            "y" => &mut self.position[1],
            "z" => &mut self.position[2],
            "nx" => &mut self.normal[0],
            "ny" => &mut self.normal[1],
            "nz" => &mut self.normal[2],
            "s" | "u" | "texture_u" => &mut self.uv[0],
            "t" | "v" | "texture_v" => &mut self.uv[1],
            "red" | "r" | "diffuse_red" => &mut self.color[0],
            "green" | "g" | "diffuse_green" => &mut self.color[1],
            "blue" | "b" | "diffuse_blue" => &mut self.color[2],
            "alpha" | "a" => &mut self.color[3],
            _ => return None,
        })
    }
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        let Some(field) = self.field(name) else { return PropertyAccessResult::Ignored };
        let Some(value) = property.to_f32_lossy() else { return PropertyAccessResult::UnsupportedType };
        *field = value;
        PropertyAccessResult::Set
    }
}

/// The corners of a polygon.
#[derive(Default)]
struct Face {
    corners: Vec<u32>,
    /// Whether a corner is negative.
    negative: bool,
}

impl PropertyAccess for Face {
    fn new() -> Self {
        Self::default()
    }

    fn set_property(&mut self, name: &str, property: Property) -> PropertyAccessResult {
        if name != "vertex_indices" && name != "vertex_index" {
            return PropertyAccessResult::Ignored;
        }
        if matches!(property, Property::ListFloat(_) | Property::ListDouble(_)) || property.to_f32_lossy().is_some() {
            return PropertyAccessResult::UnsupportedType;
        }
        match property.to_u32_list() {
            Some(corners) => self.corners = corners,
            None => self.negative = true,
        }
        PropertyAccessResult::Set
    }
}

/// An element that is only passed over.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}

/// What the vertices have besides positions.
struct Vertices {
    count: usize,
    normals: bool,
    uvs: bool,
}

impl Vertices {
    /// Puts vertices into the lists of a soup.
    fn new(element: &ElementDef, vertices: Vec<Vertex>, soup: &mut Soup) -> Result<Self, AssetError> {
        let has = |names: [&str; 3]| names.iter().any(|name| element.properties.contains_key(*name));
        if !["x", "y", "z"].iter().all(|axis| element.properties.contains_key(*axis)) {
            return Err(AssetError::new("its vertices have no x, y and z"));
        }
        let count = vertices.len();
        soup.positions = vertices.iter().map(|vertex| vertex.position).collect();
        if let Some(bad) = soup.positions.iter().position(|position| position.iter().any(|x| !x.is_finite())) {
            return Err(AssetError::new(format!("the position of vertex {bad} is not finite")));
        }
        let normals = has(["nx", "nx", "nx"]);
        if normals {
            soup.normals = vertices.iter().map(|vertex| vertex.normal).collect();
        }
        let uvs = has(["s", "u", "texture_u"]);
        if uvs {
            // The format's v runs upwards.
            let finite = |x: f32| if x.is_finite() { x } else { 0.0 };
            soup.uvs = vertices.iter().map(|vertex| [finite(vertex.uv[0]), finite(1.0 - vertex.uv[1])]).collect();
        }
        if has(["red", "r", "diffuse_red"]) {
            let scale = element.properties.get("red").or(element.properties.get("r")).or(element.properties.get("diffuse_red"));
            let scale = scale.map_or(1.0, |property| range(&property.data_type));
            let opaque = !has(["alpha", "a", "a"]);
            soup.colors = vertices.iter().map(|vertex| color(vertex.color, scale, opaque)).collect();
        }
        Ok(Self { count, normals, uvs })
    }
}

/// The number that stands for full light.
fn range(data_type: &PropertyType) -> f32 {
    match data_type {
        PropertyType::Scalar(ScalarType::UChar | ScalarType::Int | ScalarType::UInt) => 255.0,
        PropertyType::Scalar(ScalarType::Char) => 127.0,
        PropertyType::Scalar(ScalarType::UShort) => 65535.0,
        PropertyType::Scalar(ScalarType::Short) => 32767.0,
        _ => 1.0,
    }
}

fn color(color: [f32; 4], scale: f32, opaque: bool) -> [f32; 4] {
    let [r, g, b, a] = color.map(|value| fraction(value / scale));
    let [r, g, b] = [r, g, b].map(|value| srgb_to_linear(f64::from(value)) as f32);
    [r, g, b, if opaque { 1.0 } else { a }]
}

fn add_faces(faces: &[Face], vertices: &Vertices, soup: &mut Soup) -> Result<(), AssetError> {
    let mut corners = Vec::new();
    for (number, face) in faces.iter().enumerate() {
        let bad = face.corners.iter().find(|&&index| index as usize >= vertices.count);
        if face.negative || bad.is_some() {
            let index = bad.map_or_else(|| "below 0".to_owned(), ToString::to_string);
            return Err(AssetError::new(format!("face {number}: vertex {index} does not exist (there are {})", vertices.count)));
        }
        corners.clear();
        corners.extend(face.corners.iter().map(|&index| Corner {
            position: index,
            uv: if vertices.uvs { index } else { NONE },
            normal: if vertices.normals { index } else { NONE },
        }));
        soup.push(&corners, Smoothing::Auto, 0);
    }
    Ok(())
}
