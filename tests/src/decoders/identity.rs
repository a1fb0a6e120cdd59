//! Who is who: certificates, files with keys, join tokens, the list of those who are not accepted any more.

use std::{path::Path, sync::LazyLock, time::SystemTime};

use tessera_node::wire::{
    requested_key,
    tls::{Authority, Certificate, Identity, Revocations, Role, Token, check_name},
};

/// A certificate, or a request for one, in DER.
pub fn certificate(bytes: &[u8]) -> bool {
    let fingerprint = Certificate::fingerprint(&bytes.into());
    let read = Certificate::read(&[bytes.into(), bytes.into()]);
    if let Ok(certificate) = &read {
        assert_eq!(Ok(certificate.fingerprint), fingerprint);
        assert!(Role::ALL.contains(&certificate.peer.role));
        let _ = certificate.check_time(SystemTime::UNIX_EPOCH);
    }
    requested_key(bytes.to_vec()).is_ok() | read.is_ok()
}

/// A file with a key and certificates.
pub fn identity(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(identity) = Identity::parse(text) else { return false };
    assert!(!identity.certificate.above.is_empty());
    let _ = identity.warning();
    true
}

/// A join token, believed and checked: without the authority's key nobody makes one that it accepts.
pub fn token(bytes: &[u8]) -> bool {
    static FARM: LazyLock<Authority> = LazyLock::new(|| Authority::new().unwrap());
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    assert!(FARM.check_token(text, SystemTime::UNIX_EPOCH).is_err(), "a token that was never made is accepted");
    let Ok(token) = Token::read(text) else { return false };
    assert_eq!(token.number().len(), 16);
    let _ = token.name.as_deref().map(check_name);
    true
}

/// The list of revoked certificates. It is written as it was read.
pub fn revocations(bytes: &[u8]) -> bool {
    let Ok(text) = std::str::from_utf8(bytes) else { return false };
    let Ok(list) = Revocations::parse(Path::new("list"), text) else { return false };
    let written = list.text().unwrap();
    assert_eq!(Revocations::parse(Path::new("list"), &written), Ok(list), "{written:?}");
    true
}
