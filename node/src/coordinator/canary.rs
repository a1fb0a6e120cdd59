//! The canary part.

use tessera_engine::part;

use crate::wire::tls;

/// The canary part: whoever renders it to the same bytes may render others.
#[derive(Clone, Copy)]
pub struct Canary {
    /// Chooses it.
    pub seed: u64,
    /// What it comes to here.
    pub hash: [u8; 32],
}

impl Canary {
    /// Renders it.
    ///
    /// # Errors
    /// In words, when it cannot be rendered here.
    pub fn render() -> std::result::Result<Self, String> {
        let seed = tls::random();
        Ok(Self { seed, hash: part::canary_hash(seed).map_err(|error| error.to_string())? })
    }
}
