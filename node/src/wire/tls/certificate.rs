//! What a certificate says.

use std::{
    fmt,
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use rustls::pki_types::CertificateDer;
use x509_parser::{certificate::X509Certificate, extensions::GeneralName};

use super::Role;
use crate::{
    limits::{CERTIFICATE_BACKDATE, EXPIRY_WARNING},
    manifest::rfc3339,
};

/// BLAKE3 of what is signed in a certificate: names one certificate among all. The signature is left out, for whoever holds a certificate can
/// write its signature in another way that is as good.
pub type Fingerprint = blake3::Hash;

/// Who is at the other end of a connection, as its certificate says.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Peer {
    /// What it may do.
    pub role: Role,
    /// Its name.
    pub name: String,
}

impl fmt::Display for Peer {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} {}", self.role, self.name)
    }
}

/// What a certificate says whose signature TLS has checked.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Certificate {
    /// Whose it is.
    pub peer: Peer,
    /// Which it is.
    pub fingerprint: Fingerprint,
    /// Those above it, up to the farm's authority.
    pub above: Vec<Fingerprint>,
    /// When it was made, to the second.
    pub issued: SystemTime,
    /// When it ends.
    pub expires: SystemTime,
}

impl Certificate {
    /// Reads a certificate, which comes first, and those above it.
    ///
    /// # Errors
    /// When it is none of a farm.
    pub fn read(chain: &[CertificateDer<'_>]) -> Result<Self, String> {
        let (der, above) = chain.split_first().ok_or("no certificate")?;
        let (_, parsed) = x509_parser::parse_x509_certificate(der).map_err(|error| format!("unreadable certificate: {error}"))?;
        let name = parsed.subject().iter_common_name().next().and_then(|name| name.as_str().ok()).ok_or("a certificate without a name")?;
        let peer = Peer { role: role(&parsed)?, name: name.to_owned() };
        let validity = parsed.validity();
        Ok(Self {
            peer,
            fingerprint: blake3::hash(parsed.tbs_certificate.as_ref()),
            above: above.iter().map(Self::fingerprint).collect::<Result<_, _>>()?,
            issued: moment(validity.not_before.timestamp()) + CERTIFICATE_BACKDATE,
            expires: moment(validity.not_after.timestamp()),
        })
    }

    /// The fingerprint of any certificate.
    ///
    /// # Errors
    /// When it is none.
    pub fn fingerprint(der: &CertificateDer<'_>) -> Result<Fingerprint, String> {
        let (_, parsed) = x509_parser::parse_x509_certificate(der).map_err(|error| format!("unreadable certificate: {error}"))?;
        Ok(blake3::hash(parsed.tbs_certificate.as_ref()))
    }

    /// What is wrong with its time, if anything.
    ///
    /// # Errors
    /// When it has expired.
    pub fn check_time(&self, now: SystemTime) -> Result<Option<String>, String> {
        let end = rfc3339(self.expires);
        match self.expires.duration_since(now) {
            Err(_) => Err(format!("the certificate of {} expired at {end}", self.peer)),
            Ok(left) if left < EXPIRY_WARNING => {
                Ok(Some(format!("the certificate of {} expires at {end}, in {} days", self.peer, left.as_secs() / 86_400)))
            }
            Ok(_) => Ok(None),
        }
    }
}

/// The one role that a certificate gives.
fn role(certificate: &X509Certificate<'_>) -> Result<Role, String> {
    let extension = certificate.subject_alternative_name().ok().flatten();
    let names: Vec<&GeneralName<'_>> = extension.iter().flat_map(|extension| &extension.value.general_names).collect();
    match names[..] {
        [GeneralName::DNSName(dns)] => {
            let role = Role::ALL.iter().copied().find(|role| role.dns_name() == *dns);
            role.ok_or_else(|| format!("a certificate for {dns:?}, which is no role"))
        }
        _ => Err("a certificate without a role".to_owned()),
    }
}

fn moment(seconds: i64) -> SystemTime {
    UNIX_EPOCH + Duration::from_secs(u64::try_from(seconds).unwrap_or(0))
}
