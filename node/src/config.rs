//! Settings of the daemons: flags before environment before the TOML file before the defaults.
//!
//! ```toml
//! [coordinator]
//! listen = "0.0.0.0:7143"
//! data = "/var/lib/tessera"
//! keys = "/etc/tessera/coordinator-coordinator.pem"
//! web = "127.0.0.1:7180"          # the status page
//! submitter_bytes = 68719476736   # assets and jobs of one submitter
//! issuer = "/etc/tessera/issuer.pem"   # certifies those who join
//! revoked = "/etc/tessera/revoked"     # list of revoked certificates
//! no_node_timeout = 60.0          # seconds
//! free_bytes = 1073741824         # stay free on the disk: jobs that would need them are refused
//! keep_days = 30.0                # jobs that are over are deleted after that
//! keep_bytes = 107374182400       # of all of them; the oldest are deleted first
//!
//! [node]
//! coordinator = "farm.example:7143"
//! keys = "/etc/tessera/node-attic.pem"
//! lanes = 8
//! cache = "/var/cache/tessera"
//! cache_bytes = 8589934592
//! drain = 60
//! ```

use std::{
    net::SocketAddr,
    path::{Path, PathBuf},
};

use serde::Deserialize;

use crate::error::{Error, ExitCode, Result};

/// The port of a coordinator, if it is not told otherwise.
pub const PORT: u16 = 7143;

/// The settings file; what is not set in it is as the flags' help says.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct Config {
    /// Settings of `tessera coordinator`.
    pub coordinator: CoordinatorConfig,
    /// Settings of `tessera node`.
    pub node: NodeConfig,
}

/// Settings of `tessera coordinator`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct CoordinatorConfig {
    /// Where it listens.
    pub listen: Option<SocketAddr>,
    /// Its folder.
    pub data: Option<PathBuf>,
    /// Its identity: a file, or a folder that holds one.
    pub keys: Option<PathBuf>,
    /// Certifies those who join: a file, or a folder that holds one.
    pub issuer: Option<PathBuf>,
    /// Bytes that one submitter may leave there.
    pub submitter_bytes: Option<u64>,
    /// The list of revoked certificates.
    pub revoked: Option<PathBuf>,
    /// Where the status page is served.
    pub web: Option<SocketAddr>,
    /// Seconds that a job waits for any node.
    pub no_node_timeout: Option<f64>,
    /// Bytes that stay free on its disk.
    pub free_bytes: Option<u64>,
    /// Days for which jobs that are over are kept.
    pub keep_days: Option<f64>,
    /// Bytes of all jobs that are over.
    pub keep_bytes: Option<u64>,
}

/// Settings of `tessera node`.
#[derive(Clone, Debug, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields, default)]
pub struct NodeConfig {
    /// Host and port of the coordinator.
    pub coordinator: Option<String>,
    /// Its identity: a file, or a folder that holds one.
    pub keys: Option<PathBuf>,
    /// Rendering threads.
    pub lanes: Option<u32>,
    /// Folder of fetched assets.
    pub cache: Option<PathBuf>,
    /// Bytes of fetched assets.
    pub cache_bytes: Option<u64>,
    /// See `tessera node --drain`.
    pub drain: Option<f64>,
}

impl Config {
    /// Reads a settings file; without a file, nothing is set.
    ///
    /// # Errors
    /// When it cannot be read or says something that there is not, with its line.
    pub fn read(path: Option<&Path>) -> Result<Self> {
        let Some(path) = path else { return Ok(Self::default()) };
        let text = std::fs::read_to_string(path).map_err(|error| bad(path, &error))?;
        Self::parse(path, &text)
    }

    /// Reads the text of a settings file; `path` is for messages.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self> {
        toml::from_str(text).map_err(|error| bad(path, &error))
    }
}

fn bad(path: &Path, error: &impl std::fmt::Display) -> Error {
    Error::new(ExitCode::File, format!("{}: {error}", path.display()))
}

/// A setting that must be given somewhere.
///
/// # Errors
/// When it is not.
pub fn required<T>(setting: Option<T>, flag: &str, key: &str) -> Result<T> {
    setting.ok_or_else(|| {
        Error::new(ExitCode::Usage, format!("{flag} is missing")).with_help(format!("give {flag}, or set {key} in the file of --config"))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_example_is_read_and_misspellings_are_not() {
        let text: String = include_str!("config.rs")
            .lines()
            .skip_while(|line| *line != "//! ```toml")
            .skip(1)
            .take_while(|line| *line != "//! ```")
            .map(|line| format!("{}\n", line.trim_start_matches("//!")))
            .collect();
        let config: Config = toml::from_str(&text).unwrap();
        assert_eq!(config.coordinator.listen.unwrap().port(), PORT);
        assert_eq!(config.node.lanes, Some(8));
        let error = toml::from_str::<Config>("[node]\nlane = 8").unwrap_err().to_string();
        assert!(error.contains("line 2") && error.contains("lanes"), "{error}");
    }
}
