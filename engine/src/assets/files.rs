//! The bytes of a model's files.

use std::sync::Arc;

use super::AssetError;
use crate::description::{AssetId, AssetSource, Model};

/// A model's own file, and those that it refers to by name.
pub(super) struct Files<'a> {
    model: &'a Model,
    assets: &'a dyn AssetSource,
}

impl<'a> Files<'a> {
    pub fn new(model: &'a Model, assets: &'a dyn AssetSource) -> Self {
        Self { model, assets }
    }

    /// The model's own file.
    pub fn main(&self) -> Result<Arc<[u8]>, AssetError> {
        self.bytes(self.model.file, "the model")
    }

    /// Whether there is a file that is called `name` in the model's folder.
    pub fn has(&self, name: &str) -> bool {
        self.model.parts.iter().any(|(known, _)| known == name)
    }

    /// The file that is called `name` in the model's folder.
    pub fn part(&self, name: &str) -> Result<Arc<[u8]>, AssetError> {
        let part = self.model.parts.iter().find(|(known, _)| known == name);
        let (_, id) = part.ok_or_else(|| {
            AssetError::new(format!("refers to a file {name:?} that is not there")).with_help("put the file beside the model")
        })?;
        self.bytes(*id, name)
    }

    fn bytes(&self, id: AssetId, name: &str) -> Result<Arc<[u8]>, AssetError> {
        self.assets.bytes(id).ok_or_else(|| AssetError::new(format!("the bytes of {name} ({id}) are not here")))
    }
}

/// Puts the place where an error was found in front of it.
pub(super) trait Context<T> {
    /// `place: message`.
    fn context(self, place: impl FnOnce() -> String) -> Result<T, AssetError>;
}

impl<T> Context<T> for Result<T, AssetError> {
    fn context(self, place: impl FnOnce() -> String) -> Result<T, AssetError> {
        self.map_err(|error| AssetError { message: format!("{}: {}", place(), error.message), help: error.help })
    }
}
