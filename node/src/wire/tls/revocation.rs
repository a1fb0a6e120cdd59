//! Which certificates are no longer accepted: a file of one JSON object a line, which the operator may write by hand too.
//!
//! ```text
//! {"name":"attic","at":1795423456,"reason":"stolen"}        every certificate of this name that was made until then
//! {"certificate":"3f2a...","at":1795423456,"reason":""}     this one
//! ```

use std::{
    collections::BTreeMap,
    fs,
    path::Path,
    time::{SystemTime, UNIX_EPOCH},
};

use serde::{Deserialize, Serialize};

use super::Certificate;
use crate::limits::REVOCATION_BYTES;

/// A line of the list.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Revocation {
    /// What is revoked.
    #[serde(flatten)]
    pub what: Revoked,
    /// When, in seconds since 1970.
    pub at: u64,
    /// Why, for those who are refused.
    #[serde(default)]
    pub reason: String,
}

/// What can be revoked.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Revoked {
    /// Every certificate of this name that was made until then, so that a new key may have the name again.
    Name(String),
    /// The certificate with this fingerprint, or all that it certified.
    Certificate(String),
    /// The join token with this number.
    Token(String),
}

/// The list.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Revocations(BTreeMap<Revoked, Revocation>);

impl Revocations {
    /// Reads a list; one that is not there is empty.
    ///
    /// # Errors
    /// In words, with the line, when it cannot be read: then nobody knows what it would have said.
    pub fn read(path: &Path) -> Result<Self, String> {
        let text = match fs::metadata(path) {
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => return Ok(Self::default()),
            Err(error) => return Err(format!("{}: {error}", path.display())),
            Ok(metadata) if metadata.len() > REVOCATION_BYTES => return Err(format!("{}: too long", path.display())),
            Ok(_) => fs::read_to_string(path).map_err(|error| format!("{}: {error}", path.display()))?,
        };
        Self::parse(path, &text)
    }

    /// Reads the text of a list; `path` is for messages.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub fn parse(path: &Path, text: &str) -> Result<Self, String> {
        let mut list = Self::default();
        for (number, line) in text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty()) {
            let entry = serde_json::from_str(line).map_err(|error| format!("{}:{}: {error}", path.display(), number + 1))?;
            list.add(entry);
        }
        Ok(list)
    }

    /// Adds an entry; of two for the same thing the later one counts.
    pub fn add(&mut self, entry: Revocation) {
        if self.0.get(&entry.what).is_none_or(|known| known.at <= entry.at) {
            self.0.insert(entry.what.clone(), entry);
        }
    }

    /// The list as it stands in its file.
    ///
    /// # Errors
    /// When an entry cannot be written as JSON.
    pub fn text(&self) -> Result<String, serde_json::Error> {
        self.0.values().map(|entry| Ok(serde_json::to_string(entry)? + "\n")).collect()
    }

    /// Number of entries.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// Whether nothing is revoked.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Why a certificate is not accepted, if so.
    pub fn refuse(&self, certificate: &Certificate) -> Option<String> {
        let issued = certificate.issued.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let by_name = self.0.get(&Revoked::Name(certificate.peer.name.clone())).filter(|entry| issued <= entry.at);
        let fingerprints = std::iter::once(&certificate.fingerprint).chain(&certificate.above);
        let by_print = || fingerprints.map(|print| Revoked::Certificate(print.to_string())).find_map(|print| self.0.get(&print));
        by_name.or_else(by_print).map(|entry| entry.because(&format!("the certificate of {}", certificate.peer)))
    }

    /// Why a join token is not accepted, if so.
    pub fn refuse_token(&self, id: &str) -> Option<String> {
        self.0.get(&Revoked::Token(id.to_owned())).map(|entry| entry.because("this join token"))
    }
}

impl Revocation {
    /// An entry of this moment.
    pub fn now(what: Revoked, reason: &str) -> Self {
        let at = SystemTime::now().duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        Self { what, at, reason: reason.to_owned() }
    }

    fn because(&self, what: &str) -> String {
        if self.reason.is_empty() { format!("{what} was revoked") } else { format!("{what} was revoked: {}", self.reason) }
    }
}
