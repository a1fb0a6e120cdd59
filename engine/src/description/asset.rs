//! Assets are immutable bytes named by their BLAKE3 hash.

use std::{collections::BTreeMap, fmt, sync::Arc};

use serde::{Deserialize, Serialize};

/// The name of an asset: the BLAKE3 hash of its bytes.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct AssetId(pub [u8; 32]);

impl AssetId {
    /// The id of these bytes.
    pub fn of(bytes: &[u8]) -> Self {
        Self(*blake3::hash(bytes).as_bytes())
    }
}

impl fmt::Display for AssetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.iter().try_for_each(|byte| write!(f, "{byte:02x}"))
    }
}

impl fmt::Debug for AssetId {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "AssetId({self})")
    }
}

/// Why an asset cannot be used. The caller puts the file's name, or the place in the script, in front.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct AssetError {
    /// What is wrong, and where in the file.
    pub message: String,
    /// The way out, where one is known.
    pub help: Option<String>,
}

impl AssetError {
    /// An error without help.
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), help: None }
    }

    /// Adds the way out.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }
}

/// Where a compiling scene finds the bytes of its assets.
pub trait AssetSource {
    /// The bytes of an asset, or `None` if they are not here.
    fn bytes(&self, id: AssetId) -> Option<Arc<[u8]>>;
}

/// Assets held in memory: what a job script collects before a job is submitted.
#[derive(Clone, Debug, Default)]
pub struct MemoryAssets {
    blobs: BTreeMap<AssetId, Arc<[u8]>>,
}

impl MemoryAssets {
    /// Adds bytes and returns their id. The same bytes are kept once.
    pub fn insert(&mut self, bytes: impl Into<Arc<[u8]>>) -> AssetId {
        let bytes = bytes.into();
        let id = AssetId::of(&bytes);
        self.blobs.insert(id, bytes);
        id
    }

    /// All assets in order of their ids.
    pub fn iter(&self) -> impl Iterator<Item = (AssetId, &Arc<[u8]>)> {
        self.blobs.iter().map(|(id, bytes)| (*id, bytes))
    }
}

impl AssetSource for MemoryAssets {
    fn bytes(&self, id: AssetId) -> Option<Arc<[u8]>> {
        self.blobs.get(&id).cloned()
    }
}

/// A triangle mesh made by a script, stored as an asset in postcard coding.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct MeshData {
    /// Vertex positions, finite.
    pub positions: Vec<[f32; 3]>,
    /// Triangles as indices into `positions`; counter-clockwise seen from the front.
    pub triangles: Vec<[u32; 3]>,
    /// One unit normal a vertex, or empty for flat shading.
    pub normals: Vec<[f32; 3]>,
    /// One texture coordinate a vertex, or empty.
    pub uvs: Vec<[f32; 2]>,
}
