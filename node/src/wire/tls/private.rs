//! Files with private keys: their owner's alone.

use std::{
    fs,
    io::Write,
    os::unix::fs::{OpenOptionsExt, PermissionsExt},
    path::Path,
};

use crate::{
    error::{Error, ExitCode, Result},
    limits::KEY_FILE_BYTES,
};

/// Writes a new file.
///
/// # Errors
/// When there is one already, or it cannot be written.
pub fn write(path: &Path, text: &str) -> Result<()> {
    let failed = |error: std::io::Error| {
        let is_there = error.kind() == std::io::ErrorKind::AlreadyExists;
        let why = if is_there { "there is such a key already, and it is kept".to_owned() } else { error.to_string() };
        let error = Error::new(ExitCode::File, format!("{}: {why}", path.display()));
        if is_there { error.with_help("choose another name or folder, or move that file away") } else { error }
    };
    let mut file = fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(path).map_err(failed)?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(failed)
}

/// Writes a file in the place of an earlier one, whole or not at all.
///
/// # Errors
/// When it cannot be written; the earlier one is then as it was.
pub fn replace(path: &Path, text: &str) -> Result<()> {
    let failed = |error: std::io::Error| Error::new(ExitCode::File, format!("{}: {error}", path.display()));
    let folder = path.parent().filter(|folder| !folder.as_os_str().is_empty()).unwrap_or(Path::new("."));
    // Temporary files are their owner's alone.
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(failed)?;
    file.write_all(text.as_bytes()).and_then(|()| file.as_file().sync_all()).map_err(failed)?;
    file.persist(path).map_err(|error| failed(error.error))?;
    fs::File::open(folder).and_then(|folder| folder.sync_all()).map_err(failed)
}

/// Reads a file.
///
/// # Errors
/// When others than its owner may read it, or it is too long for a key.
pub fn read(path: &Path) -> Result<String> {
    let failed = |error| Error::new(ExitCode::File, format!("{}: {error}", path.display()));
    let metadata = fs::metadata(path).map_err(failed)?;
    if metadata.permissions().mode() & 0o077 != 0 {
        let message = format!("{}: others than its owner may read or write this key", path.display());
        return Err(Error::new(ExitCode::File, message).with_help(format!("chmod 600 {}", path.display())));
    }
    if metadata.len() > KEY_FILE_BYTES {
        return Err(Error::new(ExitCode::File, format!("{}: too long for a key file", path.display())));
    }
    fs::read_to_string(path).map_err(failed)
}
