//! What a process proves itself with.

use std::{
    fs,
    path::{Path, PathBuf},
    time::SystemTime,
};

use rcgen::KeyPair;
use rustls::{
    crypto::ring,
    pki_types::{CertificateDer, PrivateKeyDer, pem::PemObject},
    sign::CertifiedKey,
};

use super::{Certificate, Fingerprint, Peer, Role, private};
use crate::error::{Error, ExitCode, Result};

/// A key, its certificate, and those above it up to the farm's authority.
pub struct Identity {
    /// What its certificate says.
    pub certificate: Certificate,
    /// Its own certificate first, that of the farm's authority last.
    pub(in crate::wire) chain: Vec<CertificateDer<'static>>,
    pub(in crate::wire) key: PrivateKeyDer<'static>,
    pem: String,
}

impl Clone for Identity {
    fn clone(&self) -> Self {
        let Self { certificate, chain, key, pem } = self;
        Self { certificate: certificate.clone(), chain: chain.clone(), key: key.clone_key(), pem: pem.clone() }
    }
}

impl Identity {
    #[doc(hidden)]
    pub fn parse(pem: &str) -> Result<Self, String> {
        let chain: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(pem.as_bytes()).collect();
        let chain = chain.map_err(|error| error.to_string())?;
        if chain.len() < 2 {
            return Err("the farm's certificate is missing".to_owned());
        }
        let key = PrivateKeyDer::from_pem_slice(pem.as_bytes()).map_err(|error| format!("its key: {error}"))?;
        Ok(Self { certificate: Certificate::read(&chain)?, chain, key, pem: pem.to_owned() })
    }

    /// Whose it is.
    pub fn peer(&self) -> &Peer {
        &self.certificate.peer
    }

    /// The farm's authority.
    pub(in crate::wire) fn authority(&self) -> Option<&CertificateDer<'static>> {
        self.chain.last()
    }

    /// The fingerprint of the farm's authority.
    pub fn authority_fingerprint(&self) -> Option<Fingerprint> {
        self.certificate.above.last().copied()
    }

    /// Whether key and certificate belong together.
    ///
    /// # Errors
    /// In words, when they do not.
    pub(in crate::wire) fn check_key(&self) -> Result<(), String> {
        let pair = CertifiedKey::from_der(self.chain.clone(), self.key.clone_key(), &ring::default_provider());
        pair.map(drop).map_err(|error| error.to_string())
    }

    /// Reads the identity of a role from its file, or from a folder that holds one of that role.
    ///
    /// # Errors
    /// When there is none or more than one, when it is of another role or has expired, or when others may read it.
    pub fn load(path: &Path, role: Role) -> Result<Self> {
        Self::load_one_of(path, &[role])
    }

    /// The same for a client of any role.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_client(path: &Path) -> Result<Self> {
        Self::load_one_of(path, Role::CLIENTS)
    }

    fn load_one_of(path: &Path, roles: &[Role]) -> Result<Self> {
        let file = if path.is_dir() { only_bundle(path, roles)? } else { path.to_owned() };
        let identity = Self::read(&file).map_err(|error| error.or_help(issue_help(roles)))?;
        if !roles.contains(&identity.peer().role) {
            let message =
                format!("{}: an identity of {}, where that of {} is needed", file.display(), words(&[identity.peer().role]), words(roles));
            return Err(Error::new(ExitCode::File, message).with_help(issue_help(roles)));
        }
        identity
            .certificate
            .check_time(SystemTime::now())
            .map_err(|error| Error::new(ExitCode::Denied, format!("{}: {error}", file.display())).with_help(RENEW_HELP))?;
        Ok(identity)
    }

    /// Reads any identity from its file, whatever its role and however old.
    ///
    /// # Errors
    /// When it is none, or others may read it.
    pub fn read(file: &Path) -> Result<Self> {
        Self::parse(&private::read(file)?).map_err(|error| Error::new(ExitCode::File, format!("{}: no identity: {error}", file.display())))
    }

    /// What its user should know before long: that it expires, and what to do.
    pub fn warning(&self) -> Option<String> {
        let warning = self.certificate.check_time(SystemTime::now()).ok()??;
        Some(format!("{warning}; {RENEW_HELP}"))
    }

    /// Writes the identity into a folder as `ROLE-NAME.pem`.
    ///
    /// # Errors
    /// When that file is there already or cannot be written.
    pub fn save(&self, folder: &Path) -> Result<PathBuf> {
        let path = folder.join(format!("{}-{}.pem", self.peer().role, self.peer().name));
        private::write(&path, &self.pem)?;
        Ok(path)
    }

    /// Writes the identity in the place of an earlier one.
    ///
    /// # Errors
    /// When that file cannot be written; it is then as it was.
    pub fn replace(&self, file: &Path) -> Result<()> {
        private::replace(file, &self.pem)
    }

    /// Its private key alone.
    pub(super) fn key_pair(&self) -> Result<KeyPair, String> {
        KeyPair::from_pem(&self.pem).map_err(|error| error.to_string())
    }
}

/// How to get a certificate that lasts longer.
const RENEW_HELP: &str = "renew it with: tessera keys renew --keys DIR FILE";

fn only_bundle(folder: &Path, roles: &[Role]) -> Result<PathBuf> {
    let unreadable = |error| Error::new(ExitCode::File, format!("{}: {error}", folder.display()));
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).map_err(unreadable)? {
        let path = entry.map_err(unreadable)?.path();
        let name = path.file_name().and_then(|name| name.to_str()).unwrap_or_default();
        if name.ends_with(".pem") && roles.iter().any(|role| name.starts_with(&format!("{role}-"))) {
            found.push(path);
        }
    }
    found.sort();
    let words = words(roles);
    match found.len() {
        1 => Ok(found.remove(0)),
        0 => {
            Err(Error::new(ExitCode::File, format!("{}: no identity of {words} in this folder", folder.display()))
                .with_help(issue_help(roles)))
        }
        _ => Err(Error::new(ExitCode::File, format!("{}: several identities of {words} in this folder", folder.display()))
            .with_help(format!("name one of them, as in: --keys {}", found[0].display()))),
    }
}

/// Roles as one reads them: `an operator, submitter or observer`.
fn words(roles: &[Role]) -> String {
    let names: Vec<String> = roles.iter().map(Role::to_string).collect();
    let all = match names.split_last() {
        Some((last, rest)) if !rest.is_empty() => format!("{} or {last}", rest.join(", ")),
        _ => names.concat(),
    };
    format!("{} {all}", if all.starts_with('o') { "an" } else { "a" })
}

fn issue_help(roles: &[Role]) -> String {
    let role = roles.first().map_or(String::new(), Role::to_string);
    format!("make one with: tessera keys issue --keys DIR --role {role} --name NAME")
}
