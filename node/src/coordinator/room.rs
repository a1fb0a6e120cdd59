//! Room for what peers send: memory for large frames is shared out, and nobody keeps it for long.

use std::sync::Arc;

use serde::de::DeserializeOwned;
use tokio::{
    io::{AsyncRead, AsyncReadExt},
    sync::{OwnedSemaphorePermit, Semaphore},
    time::timeout,
};

use crate::{
    limits::{FRAME_PATIENCE, LARGE_FRAMES_BYTES, READ_CHUNK_BYTES, SMALL_FRAME_BYTES},
    wire::{self, FrameError},
};

/// The room of a coordinator, in chunks.
#[derive(Clone)]
pub struct Room(Arc<Semaphore>);

/// Room that a frame takes up, until this is dropped.
pub struct Taken(#[expect(dead_code, reason = "it is there to be dropped")] Option<OwnedSemaphorePermit>);

impl Room {
    /// All of it is free.
    pub fn new() -> Self {
        Self(Arc::new(Semaphore::new(LARGE_FRAMES_BYTES / READ_CHUNK_BYTES)))
    }

    /// Reads one frame, however long it takes until it begins. A large one waits for its peer's other large ones and for room.
    ///
    /// # Errors
    /// When the stream ends or is too slow, or what comes is not a message of this kind within `limit`.
    pub async fn read<T: DeserializeOwned>(
        &self,
        stream: &mut (impl AsyncRead + Unpin),
        limit: usize,
        of_peer: &Semaphore,
    ) -> Result<(T, Taken), FrameError> {
        let length = stream.read_u32_le().await?;
        self.read_body(stream, length, limit, of_peer).await
    }

    /// The same for a frame that is to begin now.
    ///
    /// # Errors
    /// As [`Self::read`].
    pub async fn read_now<T: DeserializeOwned>(
        &self,
        stream: &mut (impl AsyncRead + Unpin),
        limit: usize,
        of_peer: &Semaphore,
    ) -> Result<(T, Taken), FrameError> {
        let length = timeout(FRAME_PATIENCE, stream.read_u32_le()).await.map_err(|_| FrameError::TooSlow)??;
        self.read_body(stream, length, limit, of_peer).await
    }

    async fn read_body<T: DeserializeOwned>(
        &self,
        stream: &mut (impl AsyncRead + Unpin),
        length: u32,
        limit: usize,
        of_peer: &Semaphore,
    ) -> Result<(T, Taken), FrameError> {
        let wanted = usize::try_from(length).unwrap_or(usize::MAX);
        if wanted > limit {
            return Err(FrameError::TooLong { length: u64::from(length), limit });
        }
        let large = wanted > SMALL_FRAME_BYTES;
        let _turn = if large { of_peer.acquire().await.ok() } else { None };
        let chunks = u32::try_from(wanted.div_ceil(READ_CHUNK_BYTES)).unwrap_or(u32::MAX);
        let taken = if large { self.0.clone().acquire_many_owned(chunks).await.ok() } else { None };
        let reading = timeout(wire::patience(u64::from(length)), wire::read_exactly(stream, u64::from(length), limit));
        let bytes = reading.await.map_err(|_| FrameError::TooSlow)??;
        Ok((wire::decode(&bytes)?, Taken(taken)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Other peers' large frames do not wait for one that never comes, nor do small ones of anybody.
    #[tokio::test]
    async fn one_that_dawdles_holds_up_itself_alone() {
        let room = Room::new();
        let (slow, quick) = (Semaphore::new(1), Semaphore::new(1));
        let (mut never, mut open) = tokio::io::duplex(64);
        tokio::io::AsyncWriteExt::write_all(&mut open, &(1_u32 << 20).to_le_bytes()).await.unwrap();
        let frame = wire::encode(&vec![7_u8; 1 << 20], 2 << 20).unwrap();
        let small = wire::encode(&vec![7_u8; 10], 1 << 10).unwrap();
        let dawdling = room.read::<Vec<u8>>(&mut never, 2 << 20, &slow);
        let others = async {
            let (bytes, _taken) = room.read::<Vec<u8>>(&mut frame.as_slice(), 2 << 20, &quick).await.unwrap();
            assert_eq!(bytes.len(), 1 << 20);
            room.read::<Vec<u8>>(&mut small.as_slice(), 1 << 10, &slow).await.unwrap();
            drop(open);
        };
        let (dawdled, ()) = tokio::join!(dawdling, others);
        assert!(dawdled.is_err());
        assert!(
            room.read::<Vec<u8>>(&mut u32::MAX.to_le_bytes().as_slice(), 1 << 10, &slow)
                .await
                .is_err_and(|error| error.to_string().contains("allowed"))
        );
    }
}
