//! What one evaluation of a script gathers beside its values.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use mlua::{AppDataRefMut, Lua};
use tessera_engine::description::{AssetId, MemoryAssets, Source, SourceId, Sources};

use super::{fault::Fault, modules::Modules};
use crate::limits;

/// Where files that a script names come from.
pub enum Files {
    /// From this machine: relative to the folder of the Lua file that names them, and never outside the project.
    Disk,
    /// From nowhere: the description stands already, and a script evaluated for its policies gets handles without content.
    Inert,
}

/// What one evaluation of a script gathers.
pub struct Context {
    /// The job's name: the script's file name without ending.
    pub name: String,
    pub sources: Sources,
    pub assets: MemoryAssets,
    pub files: Files,
    pub modules: Modules,
    /// Values given with `--set`.
    pub given: BTreeMap<String, String>,
    /// Names that the script asked for.
    pub declared: Vec<String>,
    made: usize,
    asset_bytes: u64,
    printed: usize,
}

impl Context {
    pub fn new(name: String, files: Files, modules: Modules, given: BTreeMap<String, String>) -> Self {
        Self {
            name,
            sources: Sources::default(),
            assets: MemoryAssets::default(),
            files,
            modules,
            given,
            declared: Vec::new(),
            made: 0,
            asset_bytes: 0,
            printed: 0,
        }
    }

    /// The context of the evaluation that runs in this machine.
    pub fn of(lua: &Lua) -> mlua::Result<AppDataRefMut<'_, Self>> {
        lua.try_app_data_mut::<Self>()
            .ok()
            .flatten()
            .ok_or_else(|| Fault::new("the script's context is gone: this is a fault of tessera").into())
    }

    /// Remembers where an object was made, and counts it: objects live outside the virtual machine's own limit.
    pub fn made(&mut self, source: Source) -> mlua::Result<SourceId> {
        self.made += 1;
        if self.made > limits::SCRIPT_OBJECTS {
            return Err(Fault::new(format!("{source}: the script makes more than {} objects", limits::SCRIPT_OBJECTS))
                .with_help("place a group many times with tessera.instance, or make a mesh")
                .into());
        }
        Ok(self.sources.insert(source))
    }

    /// Keeps the bytes of an asset within the limit for all of them.
    pub fn keep(&mut self, bytes: Vec<u8>) -> Result<AssetId, String> {
        self.asset_bytes += bytes.len() as u64;
        if self.asset_bytes > limits::SCRIPT_ASSET_BYTES {
            return Err(format!("the job's files and meshes come to more than {} bytes", limits::SCRIPT_ASSET_BYTES));
        }
        Ok(self.assets.insert(bytes))
    }

    /// Reads a file that the Lua file `from` names, and says where it was found.
    pub fn read(&self, from: &str, name: &str) -> Result<(PathBuf, Vec<u8>), String> {
        let path = self.modules.file_named_in(from, name)?;
        read_bounded(&path, limits::SCRIPT_ASSET_BYTES).map(|bytes| (path, bytes))
    }

    /// How much of a printed text may still be shown.
    pub fn print_room(&mut self, wanted: usize) -> usize {
        let room = wanted.min(limits::SCRIPT_PRINT_BYTES - self.printed);
        self.printed += room;
        room
    }
}

/// Reads a file of at most `limit` bytes.
pub fn read_bounded(path: &Path, limit: u64) -> Result<Vec<u8>, String> {
    use std::io::Read;
    let cannot = |error: std::io::Error| format!("cannot read {}: {}", path.display(), reason(&error));
    // Before it is opened: a pipe would be waited for.
    if !std::fs::metadata(path).map_err(cannot)?.is_file() {
        return Err(format!("cannot read {}: it is not a file", path.display()));
    }
    let file = std::fs::File::open(path).map_err(cannot)?;
    let mut bytes = Vec::new();
    file.take(limit + 1).read_to_end(&mut bytes).map_err(cannot)?;
    if bytes.len() as u64 > limit {
        return Err(format!("{} is larger than {limit} bytes", path.display()));
    }
    Ok(bytes)
}

/// An I/O error in words that are the same on every system.
fn reason(error: &std::io::Error) -> String {
    match error.kind() {
        std::io::ErrorKind::NotFound => "there is no such file".to_owned(),
        std::io::ErrorKind::PermissionDenied => "permission denied".to_owned(),
        _ => error.to_string(),
    }
}
