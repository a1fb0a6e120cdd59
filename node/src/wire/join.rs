//! Joining: a machine has a key of its own certified, with a join token or with the certificate that it has already.
//!
//! It is a protocol of its own, under an ALPN of its own: one request, one answer. Whoever has a token has no certificate yet, so what is read of a
//! stranger is this one small frame.

use std::{net::SocketAddr, sync::Arc};

use quinn::Endpoint;
use rcgen::{CertificateParams, CertificateSigningRequestParams, KeyPair, PublicKey};
use rustls::{
    DigitallySignedStruct, RootCertStore, SignatureScheme,
    client::{
        WebPkiServerVerifier,
        danger::{HandshakeSignatureValid, ServerCertVerified, ServerCertVerifier},
    },
    crypto::{CryptoProvider, ring, verify_tls13_signature},
    pki_types::{CertificateDer, CertificateSigningRequestDer, ServerName, UnixTime},
};
use serde::{Deserialize, Serialize};

use super::{
    endpoint::{JOIN_ALPN, client_endpoint},
    tls::{Certificate, Identity},
};
use crate::error::{Error, ExitCode, Result};

/// The request.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct JoinRequest {
    /// The join token; none of who proves itself with the certificate that is to be renewed.
    pub token: Option<String>,
    /// The name that it would have, where the token says none.
    pub name: Option<String>,
    /// A certificate signing request (PKCS #10, DER): the public key, signed with the private one.
    pub key: Vec<u8>,
}

/// The answer.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub enum JoinResponse {
    /// It was refused.
    Refused {
        /// Why.
        reason: String,
    },
    /// The certificate and those above it, as PEM.
    Certified {
        /// Them.
        chain: String,
    },
}

/// A key that was just made and is certified by nobody yet. It never leaves the machine.
pub struct NewKey(KeyPair);

impl NewKey {
    /// Makes one.
    ///
    /// # Errors
    /// When the machine has no randomness to give.
    pub fn make() -> Result<Self> {
        KeyPair::generate().map(Self).map_err(|error| Error::new(ExitCode::Internal, format!("cannot make a key: {error}")))
    }

    /// What proves that one has it.
    ///
    /// # Errors
    /// When it cannot be signed.
    pub fn request(&self) -> Result<Vec<u8>> {
        let request = CertificateParams::default().serialize_request(&self.0);
        let request = request.map_err(|error| Error::new(ExitCode::Internal, format!("cannot ask for a certificate: {error}")))?;
        Ok(request.der().to_vec())
    }

    /// The key with the certificate that came back for it.
    ///
    /// # Errors
    /// In words, when that is none of this key.
    pub fn certified(&self, chain: &str) -> Result<Identity, String> {
        let identity = Identity::parse(&format!("{}{chain}", self.0.serialize_pem()))?;
        identity.check_key()?;
        Ok(identity)
    }
}

/// The key in a request whose signature shows that the asker has its other half.
///
/// # Errors
/// In words, when it is no such request.
pub fn requested_key(der: Vec<u8>) -> Result<PublicKey, String> {
    let request = CertificateSigningRequestParams::from_der(&CertificateSigningRequestDer::from(der));
    request.map(|request| request.public_key).map_err(|error| format!("the request for a certificate: {error}"))
}

/// An endpoint of a machine without a certificate: it talks to nobody but the coordinator of the farm whose authority has this fingerprint.
///
/// # Errors
/// When the machine gives no socket.
pub fn joiner(authority: [u8; 32], to: SocketAddr) -> Result<Endpoint> {
    let provider = Arc::new(ring::default_provider());
    let config = rustls::ClientConfig::builder_with_provider(provider.clone())
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(super::endpoint::tls)?
        .dangerous()
        .with_custom_certificate_verifier(Arc::new(Pinned { authority, provider }))
        .with_no_client_auth();
    client_endpoint(config, JOIN_ALPN, to)
}

/// Accepts a coordinator under the authority with this fingerprint: the authority's certificate comes along and is known by it.
#[derive(Debug)]
struct Pinned {
    authority: [u8; 32],
    provider: Arc<CryptoProvider>,
}

impl ServerCertVerifier for Pinned {
    fn verify_server_cert(
        &self,
        end_entity: &CertificateDer<'_>,
        intermediates: &[CertificateDer<'_>],
        server_name: &ServerName<'_>,
        ocsp_response: &[u8],
        now: UnixTime,
    ) -> Result<ServerCertVerified, rustls::Error> {
        let pinned =
            |der: &&CertificateDer<'_>| Certificate::fingerprint(der).is_ok_and(|print| print == blake3::Hash::from_bytes(self.authority));
        let root = intermediates.iter().find(pinned).ok_or(rustls::CertificateError::UnknownIssuer)?;
        let mut roots = RootCertStore::empty();
        roots.add(root.clone().into_owned())?;
        WebPkiServerVerifier::builder_with_provider(Arc::new(roots), self.provider.clone())
            .build()
            .map_err(|error| rustls::Error::General(error.to_string()))?
            .verify_server_cert(end_entity, intermediates, server_name, ocsp_response, now)
    }

    fn verify_tls12_signature(
        &self,
        _: &[u8],
        _: &CertificateDer<'_>,
        _: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        Err(rustls::Error::General("QUIC has TLS 1.3 alone".to_owned()))
    }

    fn verify_tls13_signature(
        &self,
        message: &[u8],
        certificate: &CertificateDer<'_>,
        signature: &DigitallySignedStruct,
    ) -> Result<HandshakeSignatureValid, rustls::Error> {
        verify_tls13_signature(message, certificate, signature, &self.provider.signature_verification_algorithms)
    }

    fn supported_verify_schemes(&self) -> Vec<SignatureScheme> {
        self.provider.signature_verification_algorithms.supported_schemes()
    }
}
