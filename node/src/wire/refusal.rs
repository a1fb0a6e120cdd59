//! Why there is no connection, in words that say what to do. TLS itself says little more than a number.

use std::fmt;

use quinn::{ConnectionError, TransportErrorCode};

use super::{CLOSE_DENIED, tls::Certificate};

/// Why a connection did not come about, or ended.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Refusal {
    /// What is wrong.
    pub message: String,
    /// What to do.
    pub help: Option<&'static str>,
    /// Whether it is about who asks: trying again does not help.
    pub denied: bool,
}

impl fmt::Display for Refusal {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        self.help.iter().try_for_each(|help| write!(f, "; {help}"))
    }
}

impl Refusal {
    /// A refusal for a reason that is no one's key.
    pub fn other(message: impl Into<String>) -> Self {
        Self { message: message.into(), help: None, denied: false }
    }

    fn denied(message: &str, help: &'static str) -> Self {
        Self { message: message.to_owned(), help: Some(help), denied: true }
    }
}

const FOREIGN: &str = "this key and that coordinator belong to different farms: get a key of its farm (tessera keys issue, or tessera keys join \
                       with a join token), or name the coordinator of this key's farm";
const RENEW: &str = "renew it (tessera keys renew), and see with `date` that the clocks of both machines are right";
const VERSION: &str = "all machines of a farm need the same version of tessera";
const ROLE: &str = "only a coordinator's key can lead a farm, and it is good for nothing else: issue a key of the role that is needed";

/// TLS alerts (RFC 8446, section 6), as they come with certificates.
mod alert {
    pub const BAD_CERTIFICATE: u8 = 42;
    pub const UNSUPPORTED_CERTIFICATE: u8 = 43;
    pub const CERTIFICATE_EXPIRED: u8 = 45;
    pub const CERTIFICATE_UNKNOWN: u8 = 46;
    pub const UNKNOWN_CA: u8 = 48;
    pub const DECRYPT_ERROR: u8 = 51;
    pub const CERTIFICATE_REQUIRED: u8 = 116;
    pub const NO_APPLICATION_PROTOCOL: u8 = 120;
}

fn alert_of(code: TransportErrorCode) -> Option<u8> {
    let code = u64::from(code);
    (0x100..0x200).contains(&code).then_some((code & 0xff) as u8)
}

/// What the end of a connection means to the one that opened it.
pub fn explain(error: &ConnectionError) -> Refusal {
    match error {
        ConnectionError::TransportError(error) => match alert_of(error.code) {
            Some(alert::UNKNOWN_CA | alert::DECRYPT_ERROR) => {
                Refusal::denied("the coordinator's certificate is not of the farm of this key", FOREIGN)
            }
            Some(alert::CERTIFICATE_EXPIRED) => Refusal::denied("the coordinator's certificate is not valid now", RENEW),
            Some(alert::BAD_CERTIFICATE | alert::UNSUPPORTED_CERTIFICATE | alert::CERTIFICATE_UNKNOWN) => {
                Refusal::denied("what answers there has a certificate of this farm, but not that of a coordinator", ROLE)
            }
            _ => Refusal::other(error.to_string()),
        },
        ConnectionError::ConnectionClosed(close) => match alert_of(close.error_code) {
            Some(alert::UNKNOWN_CA | alert::DECRYPT_ERROR) => {
                Refusal::denied("the coordinator refuses this key's certificate: it is not of its farm", FOREIGN)
            }
            Some(alert::CERTIFICATE_EXPIRED) => {
                Refusal::denied("the coordinator refuses this key's certificate: it is not valid now", RENEW)
            }
            Some(alert::BAD_CERTIFICATE | alert::UNSUPPORTED_CERTIFICATE | alert::CERTIFICATE_UNKNOWN) => {
                Refusal::denied("the coordinator refuses this key's certificate: it is not that of a client or a node", ROLE)
            }
            Some(alert::CERTIFICATE_REQUIRED) => {
                Refusal::denied("the coordinator asks for a certificate, and takes no join tokens", "get a key with tessera keys issue")
            }
            Some(alert::NO_APPLICATION_PROTOCOL) => {
                Refusal { message: "the coordinator speaks another protocol".to_owned(), help: Some(VERSION), denied: false }
            }
            _ => Refusal::other(error.to_string()),
        },
        ConnectionError::ApplicationClosed(close) => Refusal {
            message: String::from_utf8_lossy(&close.reason).into_owned(),
            help: None,
            denied: close.error_code == CLOSE_DENIED.into(),
        },
        ConnectionError::TimedOut => Refusal::other("no answer"),
        other => Refusal::other(other.to_string()),
    }
}

/// What a handshake that failed means to the coordinator.
pub fn explain_peer(error: &ConnectionError) -> String {
    match error {
        ConnectionError::TransportError(error) => match alert_of(error.code) {
            Some(alert::UNKNOWN_CA | alert::DECRYPT_ERROR) => "its certificate is not of this farm".to_owned(),
            Some(alert::CERTIFICATE_EXPIRED) => "its certificate is not valid now: it has expired, or a clock is wrong".to_owned(),
            Some(alert::UNSUPPORTED_CERTIFICATE) => "its certificate is a coordinator's, which cannot connect".to_owned(),
            Some(alert::CERTIFICATE_REQUIRED) => "it has no certificate".to_owned(),
            _ => error.to_string(),
        },
        ConnectionError::ConnectionClosed(close) => match alert_of(close.error_code) {
            Some(alert::UNKNOWN_CA | alert::DECRYPT_ERROR) => {
                "it does not know this coordinator's certificate: it is of another farm".to_owned()
            }
            Some(alert::CERTIFICATE_EXPIRED) => {
                "it holds this coordinator's certificate to be not valid now: expired, or a clock is wrong".to_owned()
            }
            _ => error.to_string(),
        },
        other => other.to_string(),
    }
}

/// What the peer proved itself with; nothing if it did not.
pub fn peer_certificate(connection: &quinn::Connection) -> Option<Result<Certificate, String>> {
    let identity = connection.peer_identity()?.downcast::<Vec<rustls::pki_types::CertificateDer<'static>>>().ok()?;
    Some(Certificate::read(&identity))
}
