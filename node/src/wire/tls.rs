//! Identities: a farm is a certificate authority; every process has a certificate of it with a role and a name.
//!
//! The role is the certificate's DNS name (`node.tessera`), so TLS itself refuses a coordinator that is none; the name is its common name.
//! Keys lie in PEM files that their owner alone may read.

use std::{
    fmt, fs,
    io::Write,
    os::unix::fs::{OpenOptionsExt, PermissionsExt},
    path::{Path, PathBuf},
};

use rcgen::{BasicConstraints, CertificateParams, DnType, ExtendedKeyUsagePurpose, IsCa, Issuer, KeyPair, KeyUsagePurpose};
use rustls::{
    crypto::ring,
    pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject},
};

use crate::{
    error::{Error, ExitCode, Result},
    limits::{KEY_FILE_BYTES, NAME_BYTES},
};

/// The file of a farm's authority within its folder of keys.
const AUTHORITY_FILE: &str = "authority.pem";

/// What the owner of a certificate may do.
#[derive(Clone, Copy, Debug, PartialEq, Eq, clap::ValueEnum)]
pub enum Role {
    /// Lead the farm.
    Coordinator,
    /// Render.
    Node,
    /// Submit jobs, watch them, fetch their files.
    Client,
}

impl fmt::Display for Role {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(match self {
            Self::Coordinator => "coordinator",
            Self::Node => "node",
            Self::Client => "client",
        })
    }
}

impl Role {
    fn dns_name(self) -> String {
        format!("{self}.tessera")
    }
}

/// Who is at the other end of a connection, as its certificate says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Peer {
    /// What it may do.
    pub role: Role,
    /// Its name.
    pub name: String,
}

/// Reads role and name out of a certificate whose signature TLS has checked.
///
/// # Errors
/// When the certificate is none of a farm.
pub fn peer(certificate: &CertificateDer<'_>) -> Result<Peer, String> {
    let (_, parsed) = x509_parser::parse_x509_certificate(certificate).map_err(|error| format!("unreadable certificate: {error}"))?;
    let name = parsed.subject().iter_common_name().next().and_then(|name| name.as_str().ok()).ok_or("a certificate without a name")?;
    let names = parsed.subject_alternative_name().ok().flatten().map(|extension| &extension.value.general_names);
    let role = names
        .into_iter()
        .flatten()
        .find_map(|general| match general {
            x509_parser::extensions::GeneralName::DNSName(dns) => {
                [Role::Coordinator, Role::Node, Role::Client].into_iter().find(|role| role.dns_name() == *dns)
            }
            _ => None,
        })
        .ok_or("a certificate without a role")?;
    Ok(Peer { role, name: name.to_owned() })
}

/// A farm's certificate authority: whoever holds its key decides who belongs to the farm.
pub struct Authority {
    certificate: String,
    issuer: Issuer<'static, KeyPair>,
}

impl Authority {
    /// A new authority.
    ///
    /// # Errors
    /// When the machine has no randomness to give.
    pub fn new() -> Result<Self> {
        let mut params = CertificateParams::default();
        params.is_ca = IsCa::Ca(BasicConstraints::Constrained(0));
        params.key_usages = vec![KeyUsagePurpose::KeyCertSign];
        params.distinguished_name.push(DnType::CommonName, "Tessera farm");
        let key = KeyPair::generate().map_err(crypto)?;
        let certificate = params.self_signed(&key).map_err(crypto)?.pem();
        Ok(Self { certificate, issuer: Issuer::new(params, key) })
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
        let path = folder.join(AUTHORITY_FILE);
        let text = read_private(&path)
            .map_err(|error| error.with_help(format!("make a farm's authority with: tessera keys init {}", folder.display())))?;
        let bad = |error: String| Error::new(ExitCode::File, format!("{}: no authority: {error}", path.display()));
        let key = KeyPair::from_pem(&text).map_err(|error| bad(error.to_string()))?;
        let der = CertificateDer::from_pem_slice(text.as_bytes()).map_err(|error| bad(error.to_string()))?;
        let issuer = Issuer::from_ca_cert_der(&der, key).map_err(|error| bad(error.to_string()))?;
        let certificate = section(&text, "CERTIFICATE").ok_or_else(|| bad("no certificate in it".to_owned()))?;
        Ok(Self { certificate, issuer })
    }

    /// Writes the authority into a folder, made where it is missing.
    ///
    /// # Errors
    /// When there is one already, or the folder cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf> {
        fs::create_dir_all(folder).map_err(|error| Error::new(ExitCode::File, format!("{}: {error}", folder.display())))?;
        let path = folder.join(AUTHORITY_FILE);
        write_private(&path, &format!("{}{}", self.issuer.key().serialize_pem(), self.certificate))?;
        Ok(path)
    }

    /// Certifies a new key.
    ///
    /// # Errors
    /// When the name has other characters than letters, digits, `.`, `_` and `-`.
    pub fn issue(&self, role: Role, name: &str) -> Result<Identity> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
        if name.is_empty() || name.len() > NAME_BYTES || !name.chars().all(plain) {
            return Err(Error::new(ExitCode::Usage, format!("the name {name:?} cannot stand in a certificate"))
                .with_help(format!("use 1 to {NAME_BYTES} letters, digits, '.', '_' and '-'")));
        }
        let mut params = CertificateParams::new(vec![role.dns_name()]).map_err(crypto)?;
        params.distinguished_name.push(DnType::CommonName, name);
        params.key_usages = vec![KeyUsagePurpose::DigitalSignature];
        params.extended_key_usages = vec![match role {
            Role::Coordinator => ExtendedKeyUsagePurpose::ServerAuth,
            Role::Node | Role::Client => ExtendedKeyUsagePurpose::ClientAuth,
        }];
        let key = KeyPair::generate().map_err(crypto)?;
        let certificate = params.signed_by(&key, &self.issuer).map_err(crypto)?;
        let pem = format!("{}{}{}", key.serialize_pem(), certificate.pem(), self.certificate);
        Identity::parse(&pem).map_err(|error| Error::new(ExitCode::Internal, error))
    }
}

/// What a process proves itself with: its key, its certificate and that of its farm.
pub struct Identity {
    /// Its own role and name.
    pub peer: Peer,
    pub(super) certificate: CertificateDer<'static>,
    pub(super) key: PrivateKeyDer<'static>,
    pub(super) authority: CertificateDer<'static>,
    pem: String,
}

impl Clone for Identity {
    fn clone(&self) -> Self {
        let Self { peer, certificate, key, authority, pem } = self;
        Self { peer: peer.clone(), certificate: certificate.clone(), key: key.clone_key(), authority: authority.clone(), pem: pem.clone() }
    }
}

impl Identity {
    fn parse(pem: &str) -> Result<Self, String> {
        let mut certificates = CertificateDer::pem_slice_iter(pem.as_bytes()).map(|found| found.map_err(|error| error.to_string()));
        let mut next = |what: &str| certificates.next().unwrap_or_else(|| Err(format!("{what} is missing")));
        let (certificate, authority) = (next("its certificate")?, next("the farm's certificate")?);
        let key = PrivateKeyDer::from_pem_slice(pem.as_bytes()).map_err(|error| format!("its key: {error}"))?;
        Ok(Self { peer: peer(&certificate)?, certificate, key, authority, pem: pem.to_owned() })
    }

    /// Reads the identity of a role from its file, or from a folder that holds one of that role.
    ///
    /// # Errors
    /// When there is none or more than one, when it is of another role, or when others may read it.
    pub fn load(path: &Path, role: Role) -> Result<Self> {
        let file = if path.is_dir() { only_bundle(path, role)? } else { path.to_owned() };
        let identity = Self::parse(&read_private(&file)?)
            .map_err(|error| Error::new(ExitCode::File, format!("{}: no identity: {error}", file.display())).with_help(issue_help(role)))?;
        if identity.peer.role != role {
            let message = format!("{}: an identity of a {}, where that of a {role} is needed", file.display(), identity.peer.role);
            return Err(Error::new(ExitCode::File, message).with_help(issue_help(role)));
        }
        Ok(identity)
    }

    /// Writes the identity into a folder as `ROLE-NAME.pem`.
    ///
    /// # Errors
    /// When that file is there already or cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf> {
        let path = folder.join(format!("{}-{}.pem", self.peer.role, self.peer.name));
        write_private(&path, &self.pem)?;
        Ok(path)
    }
}

fn only_bundle(folder: &Path, role: Role) -> Result<PathBuf> {
    let unreadable = |error| Error::new(ExitCode::File, format!("{}: {error}", folder.display()));
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if name.starts_with(&format!("{role}-")) && name.ends_with(".pem") {
            found.push(path);
        }
    }
    found.sort();
    match found.len() {
        1 => Ok(found.remove(0)),
        0 => {
            Err(Error::new(ExitCode::File, format!("{}: no identity of a {role} in this folder", folder.display()))
                .with_help(issue_help(role)))
        }
        _ => Err(Error::new(ExitCode::File, format!("{}: several identities of a {role} in this folder", folder.display()))
            .with_help(format!("name one of them, as in: --keys {}", found[0].display()))),
    }
}

fn issue_help(role: Role) -> String {
    format!("make one with: tessera keys issue --keys DIR --role {role} --name NAME")
}

/// The PEM section with this label, label lines included.
fn section(pem: &str, label: &str) -> Option<String> {
    let (begin, end) = (format!("-----BEGIN {label}-----"), format!("-----END {label}-----"));
    let from = pem.find(&begin)?;
    let to = from + pem[from..].find(&end)? + end.len();
    Some(format!("{}\n", &pem[from..to]))
}

fn write_private(path: &Path, text: &str) -> Result<()> {
    let failed = |error: std::io::Error| {
        let is_there = error.kind() == std::io::ErrorKind::AlreadyExists;
        let why = if is_there { "there is such a key already, and it is kept".to_owned() } else { error.to_string() };
        let error = Error::new(ExitCode::File, format!("{}: {why}", path.display()));
        if is_there { error.with_help("choose another name or folder, or move that file away") } else { error }
    };
    let mut file = fs::OpenOptions::new().write(true).create_new(true).mode(0o600).open(path).map_err(failed)?;
    file.write_all(text.as_bytes()).and_then(|()| file.sync_all()).map_err(failed)
}

fn read_private(path: &Path) -> Result<String> {
    let failed = |error| Error::new(ExitCode::File, format!("{}: {error}", path.display()));
    let metadata = fs::metadata(path).map_err(failed)?;
    if metadata.permissions().mode() & 0o077 != 0 {
        let message = format!("{}: others than its owner may read or write this key", path.display());
        return Err(Error::new(ExitCode::File, message).with_help(format!("chmod 600 {}", path.display())));
    }
    if metadata.len() > KEY_FILE_BYTES {
        return Err(Error::new(ExitCode::File, format!("{}: too long for a key file", path.display())));
    }
    fs::read_to_string(path).map_err(failed)
}

/// A number that nobody can guess.
pub fn random() -> u64 {
    let mut bytes = [0; 8];
    if ring::default_provider().secure_random.fill(&mut bytes).is_err() {
        tracing::error!("the system gives no random numbers");
    }
    u64::from_le_bytes(bytes)
}

fn crypto(error: rcgen::Error) -> Error {
    Error::new(ExitCode::Internal, format!("cannot make a certificate: {error}"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_certificate_says_role_and_name() {
        let authority = Authority::new().unwrap();
        for role in [Role::Coordinator, Role::Node, Role::Client] {
            let identity = authority.issue(role, "attic-2").unwrap();
            assert_eq!(peer(&identity.certificate).unwrap(), Peer { role, name: "attic-2".to_owned() });
        }
        assert!(peer(&authority.issue(Role::Node, "x").unwrap().authority).is_err(), "the authority itself has no role");
    }

    #[test]
    fn names_that_could_mislead_are_refused() {
        let authority = Authority::new().unwrap();
        for name in ["", "a b", "a/b", "a\n", "ä", &"x".repeat(NAME_BYTES + 1)] {
            assert_eq!(authority.issue(Role::Node, name).err().unwrap().code, ExitCode::Usage, "{name:?}");
        }
    }

    #[test]
    fn keys_come_back_from_their_folder_and_are_their_owners_alone() {
        let folder = tempfile::tempdir().unwrap();
        Authority::new().unwrap().save(folder.path()).unwrap();
        let authority = Authority::load(folder.path()).unwrap();
        assert!(authority.save(folder.path()).is_err(), "a second authority never overwrites the first");
        let path = authority.issue(Role::Node, "attic").unwrap().save(folder.path()).unwrap();
        assert_eq!(fs::metadata(&path).unwrap().permissions().mode() & 0o777, 0o600);
        assert_eq!(Identity::load(folder.path(), Role::Node).unwrap().peer.name, "attic");
        assert!(Identity::load(&path, Role::Client).err().unwrap().message.contains("an identity of a node"));
        authority.issue(Role::Node, "cellar").unwrap().save(folder.path()).unwrap();
        assert!(Identity::load(folder.path(), Role::Node).err().unwrap().message.contains("several"));
        fs::set_permissions(&path, fs::Permissions::from_mode(0o644)).unwrap();
        assert!(Identity::load(&path, Role::Node).err().unwrap().help.unwrap().contains("chmod 600"));
    }
}
