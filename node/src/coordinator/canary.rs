//! The canary part.

use std::path::Path;

use tessera_engine::part;

use crate::{
    error::{Error, ExitCode, Result},
    files::write_whole,
    wire::tls,
};

/// The canary part: whoever renders it to the same bytes may render others.
#[derive(Clone, Copy)]
pub struct Canary {
    /// Chooses it.
    pub seed: u64,
    /// What it comes to here.
    pub hash: [u8; 32],
}

impl Canary {
    /// Renders it. The seed is drawn once for a coordinator's folder: what earlier builds came to with it can be compared with what nodes come to later.
    ///
    /// # Errors
    /// When the seed cannot be kept, or the engine is at fault.
    pub fn render(data: &Path) -> Result<Self> {
        let seed = seed(&data.join("canary"))?;
        let fault = |error: part::CanaryError| Error::new(ExitCode::Internal, format!("the canary part cannot be rendered: {error}"));
        Ok(Self { seed, hash: part::canary_hash(seed).map_err(fault)? })
    }
}

fn seed(path: &Path) -> Result<u64> {
    match std::fs::read_to_string(path).map(|text| text.trim().parse()) {
        Ok(Ok(seed)) => Ok(seed),
        Ok(Err(error)) => Err(Error::new(ExitCode::File, format!("{}: not the number of a canary part: {error}", path.display()))
            .with_help("remove the file; jobs under way begin anew then if the program is upgraded before they are over")),
        Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
            let seed = tls::random();
            write_whole(path, seed.to_string().as_bytes())?;
            Ok(seed)
        }
        Err(error) => Err(Error::new(ExitCode::File, format!("{}: cannot be read: {error}", path.display()))),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_seed_is_drawn_once() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("canary");
        let first = seed(&path).unwrap();
        assert_eq!(seed(&path).unwrap(), first);
        std::fs::write(&path, "nonsense").unwrap();
        let error = seed(&path).unwrap_err();
        assert!(error.code == ExitCode::File && error.message.contains("canary"), "{error}");
    }
}
