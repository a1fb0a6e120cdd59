//! Why a frame cannot be compiled.

use std::fmt;

use crate::description::{AssetError, SourceId};

/// Why a frame cannot be compiled. Whoever has the frame's [`crate::description::Sources`] turns `source` into a line of the script.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct CompileError {
    /// The object that is wrong; unknown for what belongs to the frame as a whole.
    pub source: SourceId,
    /// What is wrong.
    pub message: String,
    /// The way out, where one is known.
    pub help: Option<String>,
}

impl fmt::Display for CompileError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.message)
    }
}

impl std::error::Error for CompileError {}

impl CompileError {
    pub(super) fn new(source: SourceId, message: impl Into<String>) -> Self {
        Self { source, message: message.into(), help: None }
    }

    pub(super) fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    pub(super) fn asset(source: SourceId, error: AssetError) -> Self {
        Self { source, message: error.message, help: error.help }
    }
}

/// What a user should know about an object that was compiled nevertheless.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Warning {
    /// The object.
    pub source: SourceId,
    /// What is not as it might be expected.
    pub message: String,
}
