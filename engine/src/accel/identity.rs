//! What a tree is, in 32 bytes: equal for equal trees on every machine, whatever its byte order.

/// BLAKE3 over numbers as little-endian bytes, gathered before they are hashed: hashing is fast on long runs.
pub struct Identity {
    hasher: blake3::Hasher,
    waiting: Vec<u8>,
}

/// Bytes that are hashed at a time.
const RUN: usize = 1 << 17;

impl Identity {
    /// Of nothing.
    pub fn new() -> Self {
        Self { hasher: blake3::Hasher::new(), waiting: Vec::with_capacity(RUN + 4096) }
    }

    /// Adds numbers.
    pub fn numbers(&mut self, numbers: &[u32]) {
        self.waiting.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        self.hash_runs();
    }

    /// Adds numbers bit by bit, so that 0 and -0 are different.
    pub fn floats(&mut self, numbers: &[f32]) {
        self.waiting.extend(numbers.iter().flat_map(|number| number.to_le_bytes()));
        self.hash_runs();
    }

    fn hash_runs(&mut self) {
        if self.waiting.len() >= RUN {
            self.hasher.update(&self.waiting);
            self.waiting.clear();
        }
    }

    /// The identity of all that was added.
    pub fn finish(mut self) -> [u8; 32] {
        *self.hasher.update(&self.waiting).finalize().as_bytes()
    }
}
