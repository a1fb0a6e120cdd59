//! Where `require` finds modules, and what a script may read: nothing outside its project.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use super::{ScriptBundle, context::read_bounded, keys::nearest};
use crate::limits;

/// A folder that holds one of these is the root of a project.
const ROOT_MARKS: [&str; 2] = [".luaurc", ".git"];

/// The Lua files of a job, and every module that was required so far.
pub struct Modules {
    /// Where modules come from; `None`: from `loaded` alone.
    disk: Option<Disk>,
    /// Module name to (file name for messages, source).
    loaded: BTreeMap<String, (String, String)>,
}

struct Disk {
    /// Folders that are searched, nearest first: the script's own, its parents, the project's root.
    search: Vec<PathBuf>,
    /// The folder of every Lua file that was read, by its name in messages.
    folders: BTreeMap<String, PathBuf>,
    /// Files that the user named with `--set`, wherever they lie.
    granted: Vec<PathBuf>,
}

impl Disk {
    fn root(&self) -> &Path {
        self.search.last().map_or(Path::new(""), PathBuf::as_path)
    }
}

impl Modules {
    /// Modules of a script on this machine. `name` is the script's path as the user wrote it.
    pub fn on_disk(name: &str, script: &Path) -> Result<Self, String> {
        let script = script.canonicalize().map_err(|error| format!("cannot read {name}: {error}"))?;
        let folder = script.parent().unwrap_or(Path::new("/")).to_owned();
        let is_root = |folder: &&Path| ROOT_MARKS.iter().any(|mark| folder.join(mark).exists());
        let root = folder.ancestors().find(is_root).unwrap_or(&folder).to_owned();
        let search = folder.ancestors().take_while(|at| at.starts_with(&root)).map(Path::to_owned).collect();
        Ok(Self { disk: Some(Disk { search, folders: [(name.to_owned(), folder)].into(), granted: Vec::new() }), loaded: BTreeMap::new() })
    }

    /// Modules that travel with their script.
    pub fn in_bundle(bundle: &ScriptBundle) -> Self {
        Self { disk: None, loaded: bundle.modules.clone() }
    }

    /// All modules that were required, for a bundle.
    pub fn into_loaded(self) -> BTreeMap<String, (String, String)> {
        self.loaded
    }

    /// The file name and source of a module such as `scenes.mini_demo`.
    pub fn find(&mut self, module: &str) -> Result<(String, String), String> {
        check_name(module)?;
        if let Some(found) = self.loaded.get(module) {
            return Ok(found.clone());
        }
        let disk = self.disk.as_mut().ok_or_else(|| format!("module {module:?} did not travel with the script"))?;
        if self.loaded.len() >= limits::SCRIPT_MODULES {
            return Err(format!("more than {} modules", limits::SCRIPT_MODULES));
        }
        let path = disk.locate(module)?;
        let source = String::from_utf8(read_bounded(&path, limits::SCRIPT_FILE_BYTES)?)
            .map_err(|_| format!("module {module:?}: {} is not UTF-8 text", shown(&path)))?;
        let name = shown(&path);
        disk.folders.insert(name.clone(), path.parent().unwrap_or(Path::new("/")).to_owned());
        self.loaded.insert(module.to_owned(), (name.clone(), source.clone()));
        Ok((name, source))
    }

    /// The path of a file that the Lua file `from` names: relative to that file's folder, and inside the project, unless the user named it.
    pub fn file_named_in(&self, from: &str, name: &str) -> Result<PathBuf, String> {
        let disk = self.disk.as_ref().ok_or("files are not read here")?;
        let folder = disk.folders.get(from).map_or(disk.root(), PathBuf::as_path);
        let path = folder.join(name);
        let real = real(&path)?;
        if real.starts_with(disk.root()) || disk.granted.contains(&real) {
            Ok(real)
        } else {
            Err(format!("{} lies outside the project ({})", shown(&path), shown(disk.root())))
        }
    }

    /// Lets the script read a file that the user named, relative to the working directory. Returns its whole path.
    pub fn grant(&mut self, name: &str) -> Result<PathBuf, String> {
        let real = real(Path::new(name))?;
        self.disk.iter_mut().for_each(|disk| disk.granted.push(real.clone()));
        Ok(real)
    }
}

/// Where a file truly lies.
pub fn real(path: &Path) -> Result<PathBuf, String> {
    path.canonicalize().map_err(|_| format!("cannot read {}: there is no such file", shown(path)))
}

impl Disk {
    /// The name of a module that is there and is nearly called so.
    fn nearest(&self, module: &str) -> Option<String> {
        let (group, _) = module.rsplit_once('.').map_or(("", module), |(group, name)| (group, name));
        let folders = self.search.iter().map(|folder| folder.join(group.replace('.', "/")));
        let files =
            folders.filter_map(|folder| folder.read_dir().ok()).flatten().flatten().take(limits::SCRIPT_MODULES).map(|entry| entry.path());
        let lua = files.filter(|path| path.extension().is_some_and(|ending| ending == "lua" || ending == "luau"));
        let stems = lua.filter_map(|path| Some(path.file_stem()?.to_str()?.to_owned()));
        let names: Vec<String> = stems.map(|stem| if group.is_empty() { stem } else { format!("{group}.{stem}") }).collect();
        nearest(module, names.iter().map(String::as_str).chain(["tessera"])).map(str::to_owned)
    }

    fn locate(&self, module: &str) -> Result<PathBuf, String> {
        let relative = module.replace('.', "/");
        let candidates = || self.search.iter().flat_map(|folder| ["lua", "luau"].map(|ending| folder.join(format!("{relative}.{ending}"))));
        let found = candidates().find(|path| path.is_file()).ok_or_else(|| {
            let tried: Vec<_> = candidates().filter(|path| path.extension().is_some_and(|e| e == "lua")).map(|path| shown(&path)).collect();
            let hint = self.nearest(module).map_or(String::new(), |near| format!("; did you mean {near:?}?"));
            format!("no module {module:?}{hint} (looked for {})", tried.join(", "))
        })?;
        let real = real(&found)?;
        if real.starts_with(self.root()) { Ok(real) } else { Err(format!("module {module:?} lies outside the project")) }
    }
}

/// Module names are plain, so that none can lead anywhere else.
fn check_name(module: &str) -> Result<(), String> {
    let plain = |part: &str| !part.is_empty() && part.bytes().all(|b| matches!(b, b'a'..=b'z' | b'0'..=b'9' | b'_'));
    if module.len() <= 200 && module.split('.').all(plain) {
        Ok(())
    } else {
        Err(format!("module names are a-z, 0-9 and _, with dots between folders; got {module:?}"))
    }
}

/// A path as the user would write it: relative to the working directory where it lies below.
pub fn shown(path: &Path) -> String {
    let here = std::env::current_dir().and_then(|here| here.canonicalize()).unwrap_or_default();
    match path.strip_prefix(&here) {
        Ok(rest) if !rest.as_os_str().is_empty() && here.parent().is_some() => rest.display().to_string(),
        _ => path.display().to_string(),
    }
}
