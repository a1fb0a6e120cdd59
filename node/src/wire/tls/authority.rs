//! A farm's certificate authority: whoever holds its key decides who belongs to the farm.

use std::{
    fs,
    path::{Path, PathBuf},
    time::{Duration, SystemTime, UNIX_EPOCH},
};

use rcgen::{
    BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, GeneralSubtree, IsCa, Issuer, KeyPair, KeyUsagePurpose,
    NameConstraints, PublicKeyData, date_time_ymd,
};
use rustls::pki_types::{CertificateDer, pem::PemObject};

use super::{Certificate, Fingerprint, Identity, Peer, Role, private, random};
use crate::{
    error::{Error, ExitCode, Result},
    limits::{AUTHORITY_VALIDITY, CERTIFICATE_BACKDATE, CERTIFICATE_VALIDITY, NAME_BYTES},
};

/// The file of a farm's authority within its folder of keys.
const AUTHORITY_FILE: &str = "authority.pem";

/// The file of its issuer, in the same folder.
const ISSUER_FILE: &str = "issuer.pem";

/// A key that certifies others, and the certificates from its own up to the farm's authority, as PEM.
pub struct Authority {
    chain: String,
    issuer: Issuer<'static, KeyPair>,
}

impl Authority {
    /// A new authority.
    ///
    /// # Errors
    /// When the machine has no randomness to give.
    pub fn new() -> Result<Self> {
        // Names differ from farm to farm, so that TLS says of a stranger that it is one.
        let mut params = params(&format!("Tessera farm {:016x}", random()), Vec::new(), AUTHORITY_VALIDITY)?;
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(1));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        let key = KeyPair::generate().map_err(crypto)?;
        let chain = params.self_signed(&key).map_err(crypto)?.pem();
        Ok(Self { chain, issuer: Issuer::new(params, key) })
    }

    /// An issuer for a coordinator: it certifies those who join, and its own certificate says that it can certify no one else.
    ///
    /// # Errors
    /// When the machine has no randomness to give.
    pub fn delegate(&self) -> Result<Self> {
        let mut params = params(&format!("Tessera issuer {:016x}", random()), Vec::new(), AUTHORITY_VALIDITY)?;
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        params.extended_key_usages = vec![ExtendedKeyUsagePurpose::ClientAuth];
        let permitted_subtrees = Role::JOINING.iter().map(|role| GeneralSubtree::DnsName(role.dns_name())).collect();
        params.name_constraints = Some(NameConstraints { permitted_subtrees, excluded_subtrees: Vec::new() });
        let key = KeyPair::generate().map_err(crypto)?;
        let certificate = params.signed_by(&key, &self.issuer).map_err(crypto)?;
        Ok(Self { chain: format!("{}{}", certificate.pem(), self.chain), issuer: Issuer::new(params, key) })
    }

    /// The issuer in a file, or in the folder of a farm's authority.
    ///
    /// # Errors
    /// When there is none, or others may read its key.
    pub fn load_issuer(path: &Path) -> Result<Self> {
        let file = if path.is_dir() { path.join(ISSUER_FILE) } else { path.to_owned() };
        Self::read(&file).map_err(|error| error.with_help("make an issuer with: tessera keys issuer --keys DIR"))
    }

    /// Writes the issuer beside the authority.
    ///
    /// # Errors
    /// As [`Self::save`].
    pub fn save_issuer(&self, folder: &Path) -> Result<PathBuf> {
        self.save_as(&folder.join(ISSUER_FILE))
    }

    /// The authority whose keys lie in this folder.
    ///
    /// # Errors
    /// When there is none, or others may read its key.
    pub fn load(folder: &Path) -> Result<Self> {
        if folder.is_file() {
            return Err(Error::new(ExitCode::File, format!("{}: not the folder of a farm's authority, but a file", folder.display()))
                .with_help(format!("name with --keys the folder that holds {AUTHORITY_FILE}")));
        }
        Self::read(&folder.join(AUTHORITY_FILE))
            .map_err(|error| error.or_help(format!("make a farm's authority with: tessera keys init {}", folder.display())))
    }

    fn read(path: &Path) -> Result<Self> {
        let text = private::read(path)?;
        let bad = |error: String| Error::new(ExitCode::File, format!("{}: no authority: {error}", path.display()));
        let key = KeyPair::from_pem(&text).map_err(|error| bad(error.to_string()))?;
        let der = CertificateDer::from_pem_slice(text.as_bytes()).map_err(|error| bad(error.to_string()))?;
        let issuer = Issuer::from_ca_cert_der(&der, key).map_err(|error| bad(error.to_string()))?;
        let chain = text.find("-----BEGIN CERTIFICATE-----").map(|from| text[from..].to_owned());
        Ok(Self { chain: chain.ok_or_else(|| bad("no certificate in it".to_owned()))?, issuer })
    }

    /// Writes the authority into a folder, made where it is missing.
    ///
    /// # Errors
    /// When there is one already, or the folder cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf> {
        fs::create_dir_all(folder).map_err(|error| Error::new(ExitCode::File, format!("{}: {error}", folder.display())))?;
        self.save_as(&folder.join(AUTHORITY_FILE))
    }

    fn save_as(&self, path: &Path) -> Result<PathBuf> {
        private::write(path, &format!("{}{}", self.issuer.key().serialize_pem(), self.chain))?;
        Ok(path.to_owned())
    }

    /// The fingerprint of the farm's authority.
    pub(super) fn root(&self) -> Result<Fingerprint, String> {
        let root = CertificateDer::pem_slice_iter(self.chain.as_bytes()).last().ok_or("no certificate")?;
        Certificate::fingerprint(&root.map_err(|error| error.to_string())?)
    }

    /// Its private key.
    pub(super) fn secret(&self) -> Vec<u8> {
        self.issuer.key().serialize_der()
    }

    /// Certifies a new key.
    ///
    /// # Errors
    /// When the name has other characters than letters, digits, `.`, `_` and `-`.
    pub fn issue(&self, role: Role, name: &str) -> Result<Identity> {
        self.issue_for(role, name, CERTIFICATE_VALIDITY)
    }

    /// The same, for another time than usual.
    ///
    /// # Errors
    /// As [`Self::issue`].
    pub fn issue_for(&self, role: Role, name: &str, validity: Duration) -> Result<Identity> {
        let key = KeyPair::generate().map_err(crypto)?;
        let certificate = self.certify(role, name, &key, validity)?;
        Identity::parse(&format!("{}{certificate}", key.serialize_pem())).map_err(|error| Error::new(ExitCode::Internal, error))
    }

    /// Certifies a key anew, of this farm or of one before: role and name stay.
    ///
    /// # Errors
    /// When the key cannot be used.
    pub fn renew(&self, identity: &Identity) -> Result<Identity> {
        let Peer { role, name } = identity.peer();
        let key = identity.key_pair().map_err(|error| Error::new(ExitCode::File, format!("the key of {role} {name}: {error}")))?;
        let certificate = self.certify(*role, name, &key, CERTIFICATE_VALIDITY)?;
        Identity::parse(&format!("{}{certificate}", key.serialize_pem())).map_err(|error| Error::new(ExitCode::Internal, error))
    }

    /// Certifies a key that another holds; returns the certificate and those above it, as PEM.
    ///
    /// # Errors
    /// As [`Self::issue`].
    pub fn certify(&self, role: Role, name: &str, key: &impl PublicKeyData, validity: Duration) -> Result<String> {
        check_name(name)?;
        let mut params = params(name, vec![role.dns_name()], validity)?;
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![match role {
            Role::Coordinator => ExtendedKeyUsagePurpose::ServerAuth,
            Role::Node | Role::Submitter | Role::Observer | Role::Operator => ExtendedKeyUsagePurpose::ClientAuth,
        }];
        let certificate = params.signed_by(key, &self.issuer).map_err(crypto)?;
        Ok(format!("{}{}", certificate.pem(), self.chain))
    }
}

/// Refuses names that could mislead in a log or a path.
///
/// # Errors
/// Exactly then.
pub fn check_name(name: &str) -> Result<()> {
    let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    if name.is_empty() || name.len() > NAME_BYTES || !name.chars().all(plain) {
        return Err(Error::new(ExitCode::Usage, format!("the name {name:?} cannot stand in a certificate"))
            .with_help(format!("use 1 to {NAME_BYTES} letters, digits, '.', '_' and '-'")));
    }
    Ok(())
}

fn params(name: &str, dns_names: Vec<String>, validity: Duration) -> Result<CertificateParams> {
    let mut params = CertificateParams::new(dns_names).map_err(crypto)?;
    params.distinguished_name.push(DnType::CommonName, name);
    let since_1970 = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default();
    let now = date_time_ymd(1970, 1, 1) + Duration::from_secs(since_1970.as_secs());
    (params.not_before, params.not_after) = (now - CERTIFICATE_BACKDATE, now + validity);
    Ok(params)
}

fn crypto(error: rcgen::Error) -> Error {
    Error::new(ExitCode::Internal, format!("cannot make a certificate: {error}"))
}
