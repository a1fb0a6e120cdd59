//! Frames: a message in postcard coding behind its length (u32, little-endian). Every kind of message has a limit of its own.

use std::time::Duration;

use serde::{Serialize, de::DeserializeOwned};
use tokio::io::{AsyncRead, AsyncReadExt, AsyncWrite, AsyncWriteExt};

use crate::limits::{FRAME_PATIENCE, READ_CHUNK_BYTES, SLOWEST_BYTES_PER_SECOND};

/// What is wrong with a frame; the connection that it came from is to be closed.
#[derive(Debug, thiserror::Error)]
pub enum FrameError {
    /// The stream broke.
    #[error("the stream ended: {0}")]
    Io(#[from] std::io::Error),
    /// Longer than its kind may be.
    #[error("a frame of {length} bytes where {limit} are allowed")]
    TooLong {
        /// What the peer announced.
        length: u64,
        /// What is allowed.
        limit: usize,
    },
    /// Not a message of this kind.
    #[error("a frame that is no valid message: {0}")]
    Malformed(#[from] postcard::Error),
    /// A message followed by something else.
    #[error("a frame with {0} bytes after its message")]
    Trailing(usize),
    /// It took longer than the slowest of connections would.
    #[error("a frame that came too slowly")]
    TooSlow,
}

/// The message that `bytes` are, all of them.
///
/// # Errors
/// When they are not exactly one message.
pub fn decode<T: DeserializeOwned>(bytes: &[u8]) -> Result<T, FrameError> {
    let (message, rest) = postcard::take_from_bytes(bytes)?;
    if rest.is_empty() { Ok(message) } else { Err(FrameError::Trailing(rest.len())) }
}

/// The frame of a message, length included.
///
/// # Errors
/// When the message is longer than `limit`.
pub fn encode<T: Serialize>(message: &T, limit: usize) -> Result<Vec<u8>, FrameError> {
    let mut frame = postcard::to_extend(message, vec![0; 4])?;
    let length = frame.len() - 4;
    match u32::try_from(length) {
        Ok(prefix) if length <= limit => {
            frame[..4].copy_from_slice(&prefix.to_le_bytes());
            Ok(frame)
        }
        _ => Err(FrameError::TooLong { length: length as u64, limit }),
    }
}

/// Writes one frame.
///
/// # Errors
/// When the stream is broken or the message longer than `limit`.
pub async fn write<T: Serialize>(stream: &mut (impl AsyncWrite + Unpin), message: &T, limit: usize) -> Result<(), FrameError> {
    Ok(stream.write_all(&encode(message, limit)?).await?)
}

/// Reads one frame.
///
/// # Errors
/// When the stream ends or what comes is not a message of this kind within `limit`.
pub async fn read<T: DeserializeOwned>(stream: &mut (impl AsyncRead + Unpin), limit: usize) -> Result<T, FrameError> {
    let length = stream.read_u32_le().await?;
    decode(&read_exactly(stream, u64::from(length), limit).await?)
}

/// How long it may take a peer to send so many bytes.
pub fn patience(length: u64) -> Duration {
    FRAME_PATIENCE + Duration::from_secs(length / SLOWEST_BYTES_PER_SECOND)
}

/// Reads `length` bytes; memory grows with what has come, not with what was announced.
///
/// # Errors
/// When the stream ends early or `length` is above `limit`.
pub async fn read_exactly(stream: &mut (impl AsyncRead + Unpin), length: u64, limit: usize) -> Result<Vec<u8>, FrameError> {
    let wanted = usize::try_from(length).ok().filter(|&length| length <= limit).ok_or(FrameError::TooLong { length, limit })?;
    let mut bytes = Vec::with_capacity(wanted.min(READ_CHUNK_BYTES));
    stream.take(length).read_to_end(&mut bytes).await?;
    if bytes.len() < wanted {
        return Err(std::io::Error::from(std::io::ErrorKind::UnexpectedEof).into());
    }
    Ok(bytes)
}
