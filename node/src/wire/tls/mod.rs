//! Identities: a farm is a certificate authority; every process has a certificate of it with a role and a name.
//!
//! The role is the certificate's DNS name (`node.tessera`), so TLS itself refuses a coordinator that is none; the name is its common name.
//! What it may be used for stands in it too: a coordinator's serves and cannot connect, all others connect and cannot serve.
//! Keys lie in PEM files that their owner alone may read.

mod authority;
mod certificate;
mod identity;
mod private;
mod revocation;
mod role;
mod token;
#[cfg(test)]
mod tests;

use rustls::crypto::ring;

pub use self::{
    authority::{Authority, check_name},
    certificate::{Certificate, Fingerprint, Peer},
    identity::Identity,
    private::write as write_private,
    revocation::{Revocation, Revocations, Revoked},
    role::{Deed, Role},
    token::Token,
};

/// A number that nobody can guess.
pub fn random() -> u64 {
    let mut bytes = [0; 8];
    if ring::default_provider().secure_random.fill(&mut bytes).is_err() {
        tracing::error!("the system gives no random numbers");
    }
    u64::from_le_bytes(bytes)
}
