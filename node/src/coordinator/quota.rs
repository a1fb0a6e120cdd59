//! How much each submitter has left with the coordinator: a file for each asset and job under `owners/NAME`, with its bytes. What is removed from the
//! coordinator's folder counts no more.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

/// The books.
#[derive(Clone)]
pub struct Quota {
    data: PathBuf,
    limit: u64,
}

impl Quota {
    /// The books of a coordinator's folder; `limit` is what one submitter may have there, in bytes.
    pub fn new(data: &Path, limit: u64) -> Self {
        Self { data: data.to_owned(), limit }
    }

    /// Bytes that a submitter may still leave.
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn left(&self, owner: &str) -> io::Result<u64> {
        let folder = self.folder(owner);
        let entries = match fs::read_dir(&folder) {
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(self.limit),
            entries => entries?,
        };
        let mut left = self.limit;
        for entry in entries {
            let entry = entry?;
            let thing = entry.file_name().to_string_lossy().replacen('-', "/", 1);
            if self.data.join(thing).exists() {
                left = left.saturating_sub(fs::read_to_string(entry.path())?.trim().parse().unwrap_or(0));
            } else {
                fs::remove_file(entry.path())?;
            }
        }
        Ok(left)
    }

    /// Why a submitter may leave no more.
    pub fn refusal(&self, owner: &str) -> String {
        format!(
            "{owner} may leave {} bytes with this coordinator, and this goes beyond: an operator can make room, or allow more (tessera coordinator \
             --submitter-bytes)",
            self.limit
        )
    }

    /// Notes what a submitter leaves: an asset (`assets/HEX`) or a job (`jobs/NUMBER`).
    ///
    /// # Errors
    /// When the disk refuses.
    pub fn add(&self, owner: &str, thing: &str, bytes: u64) -> io::Result<()> {
        let folder = self.folder(owner);
        fs::create_dir_all(&folder)?;
        fs::write(folder.join(thing.replacen('/', "-", 1)), bytes.to_string())
    }

    fn folder(&self, owner: &str) -> PathBuf {
        // A certificate's name may be `..`.
        self.data.join("owners").join(format!("_{owner}"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_left_counts_until_it_is_gone() {
        let data = tempfile::tempdir().unwrap();
        fs::create_dir_all(data.path().join("assets")).unwrap();
        fs::write(data.path().join("assets/aa"), "").unwrap();
        let quota = Quota::new(data.path(), 100);
        quota.add("anna", "assets/aa", 60).unwrap();
        assert_eq!((quota.left("anna").unwrap(), quota.left("ben").unwrap()), (40, 100));
        quota.add("anna", "assets/bb", 60).unwrap();
        assert_eq!(quota.left("anna").unwrap(), 40, "what never arrived counts nothing");
        fs::remove_file(data.path().join("assets/aa")).unwrap();
        assert_eq!(quota.left("anna").unwrap(), 100);
    }
}
