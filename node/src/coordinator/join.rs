//! Those who want a key certified: with a join token, or with the certificate that they have.

use std::{
    sync::Arc,
    time::{SystemTime, UNIX_EPOCH},
};

use tokio::{sync::Semaphore, time::timeout};

use super::{gate::Joiner, register::Register};
use crate::{
    limits::{CERTIFICATE_VALIDITY, JOIN_BYTES, JOIN_PATIENCE, JOINERS},
    wire::{
        self, CLOSE_DENIED, CLOSE_RESUME, JoinRequest, JoinResponse,
        tls::{Authority, Certificate, Revocations, Role},
    },
};

/// What certifies those who join.
#[derive(Clone)]
pub struct Joining {
    /// Nothing where the operator gave the coordinator none: then nobody joins.
    pub issuer: Option<Arc<Authority>>,
    /// Who has joined.
    pub register: Register,
    room: Arc<Semaphore>,
}

impl Joining {
    /// With this issuer and this register.
    pub fn new(issuer: Option<Authority>, register: Register) -> Self {
        Self { issuer: issuer.map(Arc::new), register, room: Arc::new(Semaphore::new(JOINERS)) }
    }

    /// Answers the one request of a connection.
    pub async fn serve(self, joiner: Joiner, revoked: Arc<Revocations>) {
        let Ok(_room) = self.room.clone().try_acquire_owned() else {
            return joiner.connection.close(CLOSE_RESUME.into(), b"too many join at once: try again");
        };
        let (connection, address) = (joiner.connection.clone(), joiner.address);
        match timeout(JOIN_PATIENCE, self.answer(joiner, revoked)).await {
            Ok(Ok(())) => {}
            Ok(Err(error)) => tracing::info!(%address, error, "a request to join was not answered to its end"),
            Err(_) => connection.close(CLOSE_DENIED.into(), b"too slow"),
        }
    }

    async fn answer(self, joiner: Joiner, revoked: Arc<Revocations>) -> Result<(), String> {
        let Joiner { connection, address, certificate } = joiner;
        let (mut send, mut receive) = connection.accept_bi().await.map_err(|error| error.to_string())?;
        let request: JoinRequest = wire::read(&mut receive, JOIN_BYTES).await.map_err(|error| error.to_string())?;
        let decide = move || self.decide(request, certificate.as_ref(), &revoked);
        let decided = tokio::task::spawn_blocking(decide).await.map_err(|error| error.to_string())?;
        let answer = match decided {
            Ok((who, chain)) => {
                tracing::info!(%address, who, "a key was certified");
                JoinResponse::Certified { chain }
            }
            Err(reason) => {
                tracing::warn!(%address, reason, "a request to join was refused");
                JoinResponse::Refused { reason }
            }
        };
        wire::write(&mut send, &answer, JOIN_BYTES).await.map_err(|error| error.to_string())?;
        send.finish().map_err(|error| error.to_string())?;
        connection.closed().await;
        Ok(())
    }

    /// Whom to certify as what, and the certificate.
    fn decide(&self, request: JoinRequest, certificate: Option<&Certificate>, revoked: &Revocations) -> Result<(String, String), String> {
        let issuer =
            self.issuer.as_ref().ok_or("this coordinator certifies nobody: it was given no issuer (tessera coordinator --issuer)")?;
        let key_hash = blake3::hash(&request.key).to_string();
        let key = wire::requested_key(request.key)?;
        let (role, name) = match (request.token, certificate) {
            (Some(text), _) => {
                let now = SystemTime::now();
                let token = issuer.check_token(&text, now)?;
                if let Some(reason) = revoked.refuse_token(&token.number()) {
                    return Err(reason);
                }
                may_join(token.role)?;
                if let Some(name) = &request.name {
                    wire::tls::check_name(name).map_err(|error| error.message)?;
                }
                let now = now.duration_since(UNIX_EPOCH).map_or(0, |since| since.as_secs());
                (token.role, self.register.take(&token, request.name.as_deref(), &key_hash, now)?)
            }
            (None, Some(certificate)) => {
                may_join(certificate.peer.role)?;
                (certificate.peer.role, certificate.peer.name.clone())
            }
            (None, None) => return Err("it has neither a join token nor a certificate".to_owned()),
        };
        let chain = issuer.certify(role, &name, &key, CERTIFICATE_VALIDITY).map_err(|error| error.message)?;
        Ok((format!("{role} {name}"), chain))
    }
}

fn may_join(role: Role) -> Result<(), String> {
    if Role::JOINING.contains(&role) {
        return Ok(());
    }
    Err(format!("a coordinator certifies no {role}: that takes the farm's authority (tessera keys issue, tessera keys renew --keys)"))
}
