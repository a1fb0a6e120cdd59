//! Files appear whole or not at all.

use std::{io::Write as _, path::Path};

use tessera_engine::output::write_atomically;

use crate::error::{Error, ExitCode, Result};

/// Writes a file so that its name never shows less than all of `bytes`; an earlier file of that name stays as it is until then.
///
/// # Errors
/// [`ExitCode::File`] where the folder or the disk refuses; an earlier file is then untouched.
pub fn write_whole(path: &Path, bytes: &[u8]) -> Result<()> {
    write_atomically(path, |file| file.write_all(bytes)).map_err(|error| {
        Error::new(ExitCode::File, error.to_string())
            .with_help("choose a folder that exists, is writable and has room; an earlier file of that name is as it was")
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_cannot_be_written_is_named_with_its_exit_code() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("taken");
        std::fs::create_dir(&path).unwrap();
        let error = write_whole(&path, b"bytes").unwrap_err();
        assert_eq!(error.code, ExitCode::File);
        assert!(error.message.contains("taken"), "{error}");
        assert_eq!(write_whole(&folder.path().join("no/such/folder.json"), b"").unwrap_err().code, ExitCode::File);
    }
}
