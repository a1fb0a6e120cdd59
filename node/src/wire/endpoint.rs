//! QUIC endpoints with mutual TLS.

use std::{net::SocketAddr, sync::Arc, time::Duration};

use quinn::{
    ClientConfig, Connection, ConnectionId, ConnectionIdGenerator, Endpoint, EndpointConfig, IdleTimeout, ServerConfig, TransportConfig,
    VarInt,
    crypto::{
        CryptoError, HmacKey,
        rustls::{QuicClientConfig, QuicServerConfig},
    },
};
use rustix::net::sockopt;
use rustls::{RootCertStore, crypto::ring, server::WebPkiClientVerifier};

use super::{
    ALPN, COORDINATOR_NAME,
    refusal::{Refusal, explain},
    tls::{Identity, random},
};
use crate::{
    error::{Error, ExitCode, Result},
    limits::{
        FIRST_STREAMS, FIRST_WINDOW_BYTES, IDLE_TIMEOUT, KEEP_ALIVE, OVERTAKING_PACKETS, OVERTAKING_TIME, RECEIVE_WINDOW_BYTES,
        SOCKET_BYTES, STREAM_WINDOW_BYTES, STREAMS_PER_PEER,
    },
};

/// The protocol of those who have a key certified, see [`super::JoinRequest`].
pub const JOIN_ALPN: &[u8] = b"tessera-join/1";

/// An endpoint that listens. Whoever has a certificate of another farm is refused in the handshake; so is who has none, unless `strangers` are let
/// in to join. Until the gate opens it, little room is made for what a peer sends.
///
/// # Errors
/// When the address is taken or not ours.
pub fn server(address: SocketAddr, identity: &Identity, strangers: bool) -> Result<Endpoint> {
    let verifier = WebPkiClientVerifier::builder_with_provider(roots(identity)?, Arc::new(ring::default_provider()));
    let verifier = if strangers { verifier.allow_unauthenticated() } else { verifier }.build().map_err(tls)?;
    let mut crypto = rustls::ServerConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(tls)?
        .with_client_cert_verifier(verifier)
        .with_single_cert(identity.chain.clone(), identity.key.clone_key())
        .map_err(tls)?;
    crypto.alpn_protocols = vec![ALPN.to_vec(), JOIN_ALPN.to_vec()];
    let mut config = ServerConfig::with_crypto(Arc::new(QuicServerConfig::try_from(crypto).map_err(tls)?));
    config.transport_config(transport(FIRST_WINDOW_BYTES, (FIRST_STREAMS, 0)));
    let socket = std::net::UdpSocket::bind(address).map_err(|error| {
        Error::new(ExitCode::Farm, format!("cannot listen on {address}: {error}"))
            .with_help("another program has this port: end it, or choose another one with --listen")
    })?;
    make_room(&socket);
    endpoint(lasting(identity), Some(config), socket)
}

/// Makes room for what many peers send at once: packets that find none are lost, and come again only after a while.
fn make_room(socket: &std::net::UdpSocket) {
    // Beyond the system's own bound where this process may; else up to that.
    let _ = sockopt::set_socket_recv_buffer_size_force(socket, SOCKET_BYTES)
        .or_else(|_| sockopt::set_socket_recv_buffer_size(socket, SOCKET_BYTES));
    if let Some(bytes) = sockopt::socket_recv_buffer_size(socket).ok().filter(|&bytes| bytes < SOCKET_BYTES) {
        tracing::info!(
            bytes,
            "little room for incoming packets: a farm of hundreds of nodes needs `sysctl net.core.rmem_max={SOCKET_BYTES}`"
        );
    }
}

/// An endpoint that connects, with this identity.
///
/// # Errors
/// When the machine gives no socket.
pub fn client(identity: &Identity, to: SocketAddr) -> Result<Endpoint> {
    client_endpoint(with_identity(identity)?, ALPN, to)
}

/// The same, to have that identity renewed.
///
/// # Errors
/// When the machine gives no socket.
pub fn renewer(identity: &Identity, to: SocketAddr) -> Result<Endpoint> {
    client_endpoint(with_identity(identity)?, JOIN_ALPN, to)
}

fn with_identity(identity: &Identity) -> Result<rustls::ClientConfig> {
    rustls::ClientConfig::builder_with_provider(Arc::new(ring::default_provider()))
        .with_protocol_versions(&[&rustls::version::TLS13])
        .map_err(tls)?
        .with_root_certificates(roots(identity)?)
        .with_client_auth_cert(identity.chain.clone(), identity.key.clone_key())
        .map_err(tls)
}

pub(super) fn client_endpoint(mut crypto: rustls::ClientConfig, alpn: &[u8], to: SocketAddr) -> Result<Endpoint> {
    crypto.alpn_protocols = vec![alpn.to_vec()];
    let mut config = ClientConfig::new(Arc::new(QuicClientConfig::try_from(crypto).map_err(tls)?));
    config.transport_config(transport(RECEIVE_WINDOW_BYTES, (STREAMS_PER_PEER, STREAMS_PER_PEER)));
    let any = if to.is_ipv4() { "0.0.0.0:0" } else { "[::]:0" };
    let socket = std::net::UdpSocket::bind(any).map_err(|error| Error::new(ExitCode::Farm, format!("no UDP socket: {error}")))?;
    let mut endpoint = endpoint(EndpointConfig::default(), None, socket)?;
    endpoint.set_default_client_config(config);
    Ok(endpoint)
}

/// Connects to a coordinator.
///
/// # Errors
/// When it cannot be reached, or either side refuses the other's certificate.
pub async fn connect(endpoint: &Endpoint, to: SocketAddr) -> Result<Connection, Refusal> {
    let connecting = endpoint.connect(to, COORDINATOR_NAME).map_err(|error| Refusal::other(error.to_string()))?;
    connecting.await.map_err(|error| explain(&error))
}

fn endpoint(config: EndpointConfig, server: Option<ServerConfig>, socket: std::net::UdpSocket) -> Result<Endpoint> {
    let runtime = quinn::default_runtime().ok_or_else(|| Error::new(ExitCode::Internal, "no runtime for the network"))?;
    Endpoint::new(config, server, socket, runtime).map_err(|error| Error::new(ExitCode::Farm, format!("cannot use the socket: {error}")))
}

/// Stateless resets are signed with a key that outlives the process, and answer packets for connections of an earlier process, so that peers of a
/// restarted coordinator notice at once.
fn lasting(identity: &Identity) -> EndpointConfig {
    let mut config = EndpointConfig::new(Arc::new(ResetKey(blake3::derive_key("tessera stateless reset", identity.key.secret_der()))));
    config.cid_generator(|| Box::new(PlainIds));
    config
}

/// Random connection ids. Those that quinn makes by itself are signed with a key of the process; what another process made is dropped in silence.
struct PlainIds;

impl ConnectionIdGenerator for PlainIds {
    fn generate_cid(&mut self) -> ConnectionId {
        ConnectionId::new(&random().to_le_bytes())
    }

    fn cid_len(&self) -> usize {
        8
    }

    fn cid_lifetime(&self) -> Option<Duration> {
        None
    }
}

struct ResetKey([u8; 32]);

impl HmacKey for ResetKey {
    fn sign(&self, data: &[u8], signature_out: &mut [u8]) {
        blake3::Hasher::new_keyed(&self.0).update(data).finalize_xof().fill(signature_out);
    }

    fn signature_len(&self) -> usize {
        32
    }

    fn verify(&self, data: &[u8], signature: &[u8]) -> Result<(), CryptoError> {
        // Comparing `blake3::Hash`es takes the same time wherever they differ.
        let expected = blake3::keyed_hash(&self.0, data);
        let given: [u8; 32] = signature.try_into().map_err(|_| CryptoError)?;
        if expected == blake3::Hash::from_bytes(given) { Ok(()) } else { Err(CryptoError) }
    }
}

fn transport(receive_window: u32, (bidirectional, unidirectional): (u32, u32)) -> Arc<TransportConfig> {
    let mut config = TransportConfig::default();
    config
        .max_idle_timeout(IdleTimeout::try_from(IDLE_TIMEOUT).ok())
        .keep_alive_interval(Some(KEEP_ALIVE))
        .packet_threshold(OVERTAKING_PACKETS)
        .time_threshold(OVERTAKING_TIME)
        .max_concurrent_bidi_streams(VarInt::from_u32(bidirectional))
        .max_concurrent_uni_streams(VarInt::from_u32(unidirectional))
        .stream_receive_window(VarInt::from_u32(STREAM_WINDOW_BYTES))
        .receive_window(VarInt::from_u32(receive_window))
        .send_window(u64::from(RECEIVE_WINDOW_BYTES));
    Arc::new(config)
}

fn roots(identity: &Identity) -> Result<Arc<RootCertStore>> {
    let mut roots = RootCertStore::empty();
    if let Some(authority) = identity.authority() {
        roots.add(authority.clone()).map_err(tls)?;
    }
    Ok(Arc::new(roots))
}

pub(super) fn tls(error: impl std::fmt::Display) -> Error {
    Error::new(ExitCode::File, format!("these keys cannot be used: {error}"))
}
