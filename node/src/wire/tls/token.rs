//! Join tokens: a machine that holds one may have a key of its own certified, for a while and so many times.
//!
//! A token says who made it (so that its holder gives it to no one else), what it is good for and until when, under a code that only the issuer's
//! key can make. So the coordinator, which holds that key too, knows a token that it never saw.

use std::time::{Duration, SystemTime, UNIX_EPOCH};

use data_encoding::BASE32_NOPAD;
use serde::{Deserialize, Serialize};

use super::{Authority, Role, random};

/// What a token begins with, so that people know what it is.
const PREFIX: &str = "tessera-join-";

/// What a token says.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub struct Token {
    /// Its number, unlike any other.
    pub id: u64,
    /// Fingerprint of the farm's authority.
    pub authority: [u8; 32],
    /// The role of those who join.
    pub role: Role,
    /// Their name; without one, each brings a name that is new to the farm.
    pub name: Option<String>,
    /// Keys that may be certified.
    pub uses: u32,
    /// Its end, in seconds since 1970.
    pub expires: u64,
}

impl Token {
    /// What is in a token, believed as it stands: its holder has no way to check it.
    ///
    /// # Errors
    /// When the text is no token.
    pub fn read(text: &str) -> Result<Self, String> {
        let (token, _, _) = parse(text)?;
        Ok(token)
    }

    /// Its number as people write it.
    pub fn number(&self) -> String {
        format!("{:016x}", self.id)
    }
}

fn parse(text: &str) -> Result<(Token, Vec<u8>, blake3::Hash), String> {
    let bad = || "this is no join token: it has to be one line as `tessera keys token` writes it".to_owned();
    let coded = text.trim().strip_prefix(PREFIX).ok_or_else(bad)?.to_ascii_uppercase();
    let bytes = BASE32_NOPAD.decode(coded.as_bytes()).map_err(|_| bad())?;
    let (said, code) = bytes.split_last_chunk::<32>().ok_or_else(bad)?;
    let (token, rest) = postcard::take_from_bytes::<Token>(said).map_err(|_| bad())?;
    if rest.is_empty() { Ok((token, said.to_vec(), blake3::Hash::from_bytes(*code))) } else { Err(bad()) }
}

impl Authority {
    /// Makes a token. Whoever has its text may join.
    ///
    /// # Errors
    /// In words, when it cannot be coded.
    pub fn make_token(&self, role: Role, name: Option<String>, uses: u32, valid: Duration) -> Result<(Token, String), String> {
        let expires = (SystemTime::now() + valid).duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
        let token =
            Token { id: random(), authority: *self.root().map_err(|error| error.to_string())?.as_bytes(), role, name, uses, expires };
        let mut bytes = postcard::to_stdvec(&token).map_err(|error| error.to_string())?;
        let code = self.code(&bytes);
        bytes.extend_from_slice(code.as_bytes());
        let text = format!("{PREFIX}{}", BASE32_NOPAD.encode(&bytes).to_ascii_lowercase());
        Ok((token, text))
    }

    /// What a token says, if it is one of this farm and its time is not over. How often it was used is not known here.
    ///
    /// # Errors
    /// In words, why it is not accepted.
    pub fn check_token(&self, text: &str, now: SystemTime) -> Result<Token, String> {
        let (token, said, code) = parse(text)?;
        // Comparing hashes takes the same time wherever they differ.
        if self.code(&said) != code {
            return Err("this join token was not made with the issuer of this coordinator".to_owned());
        }
        if now.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs()) >= token.expires {
            return Err("this join token has expired: make a new one with tessera keys token".to_owned());
        }
        Ok(token)
    }

    fn code(&self, said: &[u8]) -> blake3::Hash {
        blake3::keyed_hash(&blake3::derive_key("tessera join token", &self.secret()), said)
    }
}
