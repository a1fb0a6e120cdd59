//! Assets that were fetched, by content id: on disk where a folder is given, else in memory; the longest unused go first.

use std::{
    collections::BTreeMap,
    fs, io,
    path::{Path, PathBuf},
    sync::{Arc, Mutex, PoisonError},
    time::SystemTime,
};

use tessera_engine::{description::AssetId, output::write_atomically};

/// A cache of assets that several tasks may use at once.
#[derive(Clone)]
pub struct Cache {
    store: Arc<Store>,
    limit: u64,
}

enum Store {
    Memory(Mutex<Memory>),
    Disk(PathBuf),
}

#[derive(Default)]
struct Memory {
    assets: BTreeMap<AssetId, (u64, Arc<[u8]>)>,
    uses: u64,
}

impl Cache {
    /// A cache of `limit` bytes.
    ///
    /// # Errors
    /// When the folder cannot be made.
    pub fn new(folder: Option<&Path>, limit: u64) -> io::Result<Self> {
        let store = match folder {
            Some(folder) => {
                fs::create_dir_all(folder)?;
                Store::Disk(folder.to_owned())
            }
            None => Store::Memory(Mutex::default()),
        };
        Ok(Self { store: Arc::new(store), limit })
    }

    /// The bytes of an asset, checked against its id; bytes on disk that do not agree any more are removed. May wait for the disk.
    pub fn get(&self, id: AssetId) -> Option<Arc<[u8]>> {
        match &*self.store {
            Store::Memory(memory) => memory.lock().unwrap_or_else(PoisonError::into_inner).get(id),
            Store::Disk(folder) => read_checked(&folder.join(id.to_string()), id),
        }
    }

    /// Keeps an asset, and drops what has not been used for the longest time until all fit. Keeping is for speed alone: a disk that refuses
    /// is said in the log.
    pub fn put(&self, id: AssetId, bytes: &Arc<[u8]>) {
        match &*self.store {
            Store::Memory(memory) => memory.lock().unwrap_or_else(PoisonError::into_inner).put(id, bytes.clone(), self.limit),
            Store::Disk(folder) => {
                let written = write_atomically(&folder.join(id.to_string()), |file| io::Write::write_all(file, bytes));
                let kept =
                    written.map_err(|error| error.to_string()).and_then(|()| evict(folder, self.limit).map_err(|error| error.to_string()));
                if let Err(error) = kept {
                    tracing::warn!(%error, "an asset could not be cached");
                }
            }
        }
    }
}

impl Memory {
    fn get(&mut self, id: AssetId) -> Option<Arc<[u8]>> {
        self.uses += 1;
        let (used, bytes) = self.assets.get_mut(&id)?;
        *used = self.uses;
        Some(bytes.clone())
    }

    fn put(&mut self, id: AssetId, bytes: Arc<[u8]>, limit: u64) {
        self.uses += 1;
        self.assets.insert(id, (self.uses, bytes));
        while self.assets.values().map(|(_, bytes)| bytes.len() as u64).sum::<u64>() > limit {
            let Some(oldest) = self.assets.iter().min_by_key(|(_, (used, _))| *used).map(|(id, _)| *id) else { return };
            self.assets.remove(&oldest);
        }
    }
}

fn read_checked(path: &Path, id: AssetId) -> Option<Arc<[u8]>> {
    let bytes = fs::read(path).ok()?;
    if AssetId::of(&bytes) != id {
        tracing::warn!(path = %path.display(), "a cached asset is damaged: it is fetched anew");
        let _ = fs::remove_file(path);
        return None;
    }
    // The time of the last use is the file's; where it cannot be set, the oldest files go first.
    let _ = fs::File::open(path).and_then(|file| file.set_modified(SystemTime::now()));
    Some(bytes.into())
}

fn evict(folder: &Path, limit: u64) -> io::Result<()> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let metadata = entry.metadata()?;
        files.push((metadata.modified()?, metadata.len(), entry.path()));
    }
    files.sort();
    let mut total: u64 = files.iter().map(|(_, length, _)| length).sum();
    for (_, length, path) in files {
        if total <= limit {
            break;
        }
        fs::remove_file(path)?;
        total -= length;
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asset(byte: u8, length: usize) -> (AssetId, Arc<[u8]>) {
        let bytes: Arc<[u8]> = vec![byte; length].into();
        (AssetId::of(&bytes), bytes)
    }

    #[test]
    fn the_longest_unused_asset_goes_first() {
        let cache = Cache::new(None, 250).unwrap();
        let (first, second, third) = (asset(1, 100), asset(2, 100), asset(3, 100));
        cache.put(first.0, &first.1);
        cache.put(second.0, &second.1);
        assert_eq!(cache.get(first.0), Some(first.1));
        cache.put(third.0, &third.1);
        assert!(cache.get(first.0).is_some() && cache.get(second.0).is_none() && cache.get(third.0).is_some());
    }

    #[test]
    fn a_damaged_file_is_no_asset() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(Some(folder.path()), 1000).unwrap();
        let (id, bytes) = asset(1, 100);
        cache.put(id, &bytes);
        assert_eq!(cache.get(id), Some(bytes));
        let path = folder.path().join(id.to_string());
        fs::write(&path, [1; 99]).unwrap();
        assert_eq!(cache.get(id), None);
        assert!(!path.exists());
    }

    #[test]
    fn files_stay_within_the_limit() {
        let folder = tempfile::tempdir().unwrap();
        let cache = Cache::new(Some(folder.path()), 250).unwrap();
        for byte in 0..5 {
            let (id, bytes) = asset(byte, 100);
            cache.put(id, &bytes);
        }
        let total: u64 = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap().metadata().unwrap().len()).sum();
        assert_eq!(total, 200);
    }
}
