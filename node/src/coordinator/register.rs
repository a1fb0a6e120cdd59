//! Who has joined: which tokens were used by which keys, and which names are taken. It is on disk before anybody is told.

use std::{
    collections::{BTreeMap, BTreeSet},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use serde::{Deserialize, Serialize};

use crate::{
    error::{Error, ExitCode, Result},
    files::write_whole,
    limits::REGISTER,
    wire::tls::{Peer, Token},
};

/// The register.
#[derive(Clone)]
pub struct Register {
    pages: Arc<Mutex<Pages>>,
    /// Names that were seen and are not in the pages yet: a thousand that come at once are written together.
    seen: Arc<Mutex<BTreeSet<String>>>,
}

struct Pages {
    path: PathBuf,
    entries: Entries,
}

/// As it stands on disk.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Entries {
    /// Tokens by their numbers.
    tokens: BTreeMap<String, Used>,
    /// Names that are taken: `node attic`.
    names: BTreeSet<String>,
}

/// What became of a token.
#[derive(Clone, Default, Serialize, Deserialize)]
struct Used {
    /// When it need not be known any more, in seconds since 1970.
    expires: u64,
    /// The keys that it certified, by their hashes, and the names that they got.
    keys: BTreeMap<String, String>,
}

impl Register {
    /// Opens the register of a coordinator's folder.
    ///
    /// # Errors
    /// When it is there and cannot be read: a token must not be used once more because of that.
    pub fn open(folder: &Path) -> Result<Self> {
        let path = folder.join("joined.json");
        let bad = |error: String| Error::new(ExitCode::File, format!("{}: {error}", path.display()));
        let entries = match std::fs::read(&path) {
            Ok(bytes) => serde_json::from_slice(&bytes).map_err(|error| bad(error.to_string()))?,
            Err(error) if error.kind() == std::io::ErrorKind::NotFound => Entries::default(),
            Err(error) => return Err(bad(error.to_string())),
        };
        Ok(Self { pages: Arc::new(Mutex::new(Pages { path, entries })), seen: Arc::default() })
    }

    /// Notes a name that somebody has a certificate for. Waits for the disk if it is new.
    pub fn see(&self, peer: &Peer) {
        self.seen().insert(peer.to_string());
        let noted = self.change(|entries| {
            // None are left where another call has written them meanwhile.
            let mut news = std::mem::take(&mut *self.seen());
            news.retain(|name| !entries.names.contains(name));
            let room = REGISTER.saturating_sub(entries.names.len());
            let before = entries.names.len();
            entries.names.extend(news.into_iter().take(room));
            Ok((entries.names.len() > before).then_some(()))
        });
        if let Err(error) = noted {
            tracing::error!(error, "a name could not be noted");
        }
    }

    /// Uses a token for a key, once for each key however often it asks. Returns the name that the key gets. Waits for the disk.
    ///
    /// # Errors
    /// In words, why it is refused.
    pub fn take(&self, token: &Token, wanted: Option<&str>, key: &str, now: u64) -> Result<String, String> {
        let mut given = String::new();
        self.change(|entries| {
            entries.tokens.retain(|_, used| used.expires > now);
            let used = entries.tokens.entry(token.number()).or_insert_with(|| Used { expires: token.expires, ..Used::default() });
            if let Some(name) = used.keys.get(key) {
                given.clone_from(name);
                return Ok(None);
            }
            if used.keys.len() >= token.uses as usize {
                return Err(format!("this join token is used up: it was good for {} and made a key for each of them", token.uses));
            }
            let name = token.name.as_deref().or(wanted).ok_or("the join token says no name: bring one with --name")?.to_owned();
            let peer = Peer { role: token.role, name: name.clone() }.to_string();
            if token.name.is_none() && entries.names.contains(&peer) {
                return Err(format!("there is a {peer} already: choose another name with --name, or take a token that says this one"));
            }
            if entries.names.len() >= REGISTER || entries.tokens.len() > REGISTER {
                return Err(format!("the farm has {REGISTER} names already"));
            }
            entries.names.insert(peer);
            if let Some(used) = entries.tokens.get_mut(&token.number()) {
                used.keys.insert(key.to_owned(), name.clone());
            }
            given = name;
            Ok(Some(()))
        })?;
        Ok(given)
    }

    fn seen(&self) -> MutexGuard<'_, BTreeSet<String>> {
        self.seen.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Changes the entries, if `act` says so; what is not on disk has not happened.
    fn change(&self, act: impl FnOnce(&mut Entries) -> Result<Option<()>, String>) -> Result<(), String> {
        let mut pages = self.pages.lock().unwrap_or_else(PoisonError::into_inner);
        let mut entries = pages.entries.clone();
        if act(&mut entries)?.is_some() {
            let text = serde_json::to_vec(&entries).map_err(|error| error.to_string())?;
            write_whole(&pages.path, &text).map_err(|error| error.message)?;
            pages.entries = entries;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::wire::tls::Role;

    fn token(id: u64, name: Option<&str>, uses: u32) -> Token {
        Token { id, authority: [0; 32], role: Role::Node, name: name.map(str::to_owned), uses, expires: 1000 }
    }

    #[test]
    fn a_token_is_used_as_often_as_it_says_and_that_is_kept() {
        let folder = tempfile::tempdir().unwrap();
        let open = || Register::open(folder.path()).unwrap();
        let once = token(1, None, 1);
        assert_eq!(open().take(&once, Some("attic"), "key 1", 10).unwrap(), "attic");
        assert_eq!(open().take(&once, Some("other"), "key 1", 10).unwrap(), "attic", "the same key again, its answer was lost");
        assert!(open().take(&once, Some("cellar"), "key 2", 10).unwrap_err().contains("used up"));
        let twice = token(2, None, 2);
        assert!(
            open().take(&twice, Some("attic"), "key 2", 10).unwrap_err().contains("already"),
            "no token gives a name away that is taken"
        );
        assert!(open().take(&twice, None, "key 2", 10).unwrap_err().contains("--name"));
        assert_eq!(open().take(&twice, Some("cellar"), "key 2", 10).unwrap(), "cellar");
        assert_eq!(open().take(&twice, Some("roof"), "key 3", 10).unwrap(), "roof");
        assert!(open().take(&twice, Some("tower"), "key 4", 10).is_err());
    }

    #[test]
    fn names_that_were_seen_are_taken_unless_the_token_says_them() {
        let folder = tempfile::tempdir().unwrap();
        let register = Register::open(folder.path()).unwrap();
        register.see(&Peer { role: Role::Node, name: "attic".to_owned() });
        assert!(register.take(&token(1, None, 9), Some("attic"), "key", 10).is_err());
        assert_eq!(register.take(&token(2, Some("attic"), 1), Some("x"), "key", 10).unwrap(), "attic");
    }
}
