//! Writes glTF files piece by piece.

use data_encoding::BASE64;
use serde_json::{Value, json};

use super::{CUBE_CORNERS, cube_triangles};

/// A glTF file in the making.
pub struct Gltf {
    /// Its JSON; `bufferViews` and `accessors` grow as data is added.
    pub json: Value,
    pub bin: Vec<u8>,
}

impl Gltf {
    pub fn new(json: Value) -> Self {
        let mut this = Self { json, bin: Vec::new() };
        this.json["asset"] = json!({ "version": "2.0" });
        for list in ["bufferViews", "accessors"] {
            this.json[list] = json!([]);
        }
        this
    }

    /// A cube as mesh 0 with material 0 (if `json` has one), indexed with 16 bits.
    pub fn cube(json: Value) -> Self {
        let mut this = Self::new(json);
        let positions = this.floats(&CUBE_CORNERS, "VEC3");
        let indices: Vec<u16> = cube_triangles().into_flattened().into_iter().map(|index| index as u16).collect();
        let indices = this.accessor(&indices.iter().flat_map(|index| index.to_le_bytes()).collect::<Vec<_>>(), 5123, "SCALAR", 36);
        this.json["meshes"] = json!([{ "name": "cube", "primitives": [{ "attributes": { "POSITION": positions }, "indices": indices }] }]);
        this
    }

    /// Adds bytes and returns their view.
    pub fn view(&mut self, bytes: &[u8]) -> usize {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        let view = json!({ "buffer": 0, "byteOffset": self.bin.len(), "byteLength": bytes.len() });
        self.bin.extend_from_slice(bytes);
        self.push("bufferViews", view)
    }

    pub fn push(&mut self, list: &str, value: Value) -> usize {
        let list = self.json[list].as_array_mut().unwrap();
        list.push(value);
        list.len() - 1
    }

    pub fn accessor(&mut self, bytes: &[u8], component: u32, kind: &str, count: usize) -> usize {
        let view = self.view(bytes);
        self.push("accessors", json!({ "bufferView": view, "componentType": component, "type": kind, "count": count }))
    }

    pub fn floats<const N: usize>(&mut self, values: &[[f32; N]], kind: &str) -> usize {
        let bytes: Vec<u8> = values.as_flattened().iter().flat_map(|value| value.to_le_bytes()).collect();
        self.accessor(&bytes, 5126, kind, values.len())
    }

    /// The attributes of the first primitive.
    pub fn attributes(&mut self) -> &mut Value {
        &mut self.json["meshes"][0]["primitives"][0]["attributes"]
    }

    /// As `.glb`.
    pub fn glb(mut self) -> Vec<u8> {
        self.bin.resize(self.bin.len().next_multiple_of(4), 0);
        self.json["buffers"] = json!([{ "byteLength": self.bin.len() }]);
        let mut json = self.json.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), b' ');
        let chunk = |kind: &[u8; 4], data: &[u8]| [&(data.len() as u32).to_le_bytes()[..], kind, data].concat();
        let chunks = [chunk(b"JSON", &json), chunk(b"BIN\0", &self.bin)].concat();
        [b"glTF".as_slice(), &2u32.to_le_bytes(), &(chunks.len() as u32 + 12).to_le_bytes(), &chunks].concat()
    }

    /// As `.gltf` whose buffer stands behind `uri`; without one, in a `data:` URI.
    pub fn gltf(mut self, uri: Option<&str>) -> (Vec<u8>, Vec<u8>) {
        let data = format!("data:application/octet-stream;base64,{}", BASE64.encode(&self.bin));
        self.json["buffers"] = json!([{ "byteLength": self.bin.len(), "uri": uri.unwrap_or(&data) }]);
        (self.json.to_string().into_bytes(), self.bin)
    }
}
