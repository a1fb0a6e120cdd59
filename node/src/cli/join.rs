//! `tessera keys join` and online renewal: a machine's own key, certified by the coordinator.

use std::{
    io::Read,
    path::{Path, PathBuf},
};

use quinn::Endpoint;
use tokio::time::timeout;

use super::link::{resolve, unreachable};
use crate::{
    error::{Error, ExitCode, Result},
    limits::{FAREWELL, JOIN_BYTES, JOIN_PATIENCE, TOKEN_BYTES},
    wire::{
        self, JoinRequest, JoinResponse, NewKey, Refusal,
        tls::{Identity, Token},
    },
};

/// The name under which a service manager hands a join token over.
const CREDENTIAL: &str = "join-token";

/// Reads a join token: from a file, from stdin (`-`), or from the credential `join-token` of the service manager.
///
/// # Errors
/// When there is none.
pub fn read_token(path: Option<&Path>) -> Result<String> {
    let credential = std::env::var_os("CREDENTIALS_DIRECTORY").map(|folder| PathBuf::from(folder).join(CREDENTIAL));
    let Some(path) = path.map(Path::to_owned).or(credential) else {
        return Err(Error::new(ExitCode::Usage, "--token is missing")
            .with_help(format!("give --token FILE, --token - to type or pipe it in, or the systemd credential {CREDENTIAL}")));
    };
    let failed = |error: std::io::Error| Error::new(ExitCode::File, format!("the join token in {}: {error}", path.display()));
    let mut text = String::new();
    if path.as_os_str() == "-" {
        std::io::stdin().take(TOKEN_BYTES).read_to_string(&mut text).map_err(failed)?;
    } else {
        std::fs::File::open(&path).and_then(|file| file.take(TOKEN_BYTES).read_to_string(&mut text)).map_err(failed)?;
    }
    Ok(text)
}

/// Makes a key, has it certified with a token, and returns it. The key itself stays here.
///
/// # Errors
/// When the token is none, or the coordinator cannot be reached or refuses.
pub async fn join(coordinator: &str, token: &str, name: Option<String>) -> Result<Identity> {
    let said = Token::read(token).map_err(|error| Error::new(ExitCode::File, error))?;
    let to = resolve(coordinator).map_err(|error| unreachable(coordinator, Refusal::other(error)))?;
    let endpoint = wire::joiner(said.authority, to)?;
    let identity = certify(&endpoint, coordinator, Some(token.trim().to_owned()), name).await?;
    if identity.authority_fingerprint().map(|print| *print.as_bytes()) != Some(said.authority) || identity.peer().role != said.role {
        return Err(Error::new(ExitCode::Denied, format!("the coordinator at {coordinator} certified something else than the token says")));
    }
    Ok(identity)
}

/// Has a new key certified for an identity that is still valid.
///
/// # Errors
/// When the coordinator cannot be reached or refuses.
pub async fn renew(coordinator: &str, identity: &Identity) -> Result<Identity> {
    let to = resolve(coordinator).map_err(|error| unreachable(coordinator, Refusal::other(error)))?;
    let endpoint = wire::renewer(identity, to)?;
    certify(&endpoint, coordinator, None, None).await
}

async fn certify(endpoint: &Endpoint, coordinator: &str, token: Option<String>, name: Option<String>) -> Result<Identity> {
    let key = NewKey::make()?;
    let request = JoinRequest { token, name, key: key.request()? };
    let asking = timeout(JOIN_PATIENCE, ask(endpoint, coordinator, &request)).await;
    let late = || Err(Refusal::other(format!("no answer within {} s", JOIN_PATIENCE.as_secs())));
    let answer = asking.unwrap_or_else(|_| late()).map_err(|refusal| unreachable(coordinator, refusal))?;
    match answer {
        JoinResponse::Refused { reason } => {
            Err(Error::new(ExitCode::Denied, format!("the coordinator at {coordinator} refuses: {reason}")))
        }
        JoinResponse::Certified { chain } => {
            key.certified(&chain).map_err(|error| Error::new(ExitCode::Farm, format!("the coordinator at {coordinator} answers: {error}")))
        }
    }
}

async fn ask(endpoint: &Endpoint, coordinator: &str, request: &JoinRequest) -> Result<JoinResponse, Refusal> {
    let to = resolve(coordinator).map_err(Refusal::other)?;
    let connection = wire::connect(endpoint, to).await?;
    let exchange = async {
        let (mut send, mut receive) = connection.open_bi().await.map_err(|error| error.to_string())?;
        wire::write(&mut send, request, JOIN_BYTES).await.map_err(|error| error.to_string())?;
        wire::read(&mut receive, JOIN_BYTES).await.map_err(|error| error.to_string())
    };
    let answer = exchange.await;
    let ended = connection.close_reason();
    connection.close(0_u8.into(), b"");
    let _ = timeout(FAREWELL, endpoint.wait_idle()).await;
    answer.map_err(|error: String| ended.map_or_else(|| Refusal::other(error), |reason| wire::explain(&reason)))
}
