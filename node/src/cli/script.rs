//! Job scripts on the command line.

use std::{collections::BTreeMap, path::PathBuf};

use tessera_engine::scene::Unbuilt;

use crate::{
    error::Result,
    job::{self, FRAME_PARAMETER, LoadedJob},
};

/// A job script and its parameters.
#[derive(Clone, clap::Args)]
pub struct Script {
    /// The job script.
    #[arg(value_name = "JOB")]
    pub path: PathBuf,
    /// Sets a parameter of the script; may be given several times.
    #[arg(long = "set", value_name = "NAME=VALUE", value_parser = parameter)]
    pub parameters: Vec<(String, String)>,
}

fn parameter(text: &str) -> Result<(String, String), String> {
    match text.split_once('=') {
        Some((name, value)) if !name.is_empty() => Ok((name.to_owned(), value.to_owned())),
        _ => Err("write it as NAME=VALUE".to_owned()),
    }
}

impl Script {
    /// Runs the script and compiles its scene. What is not modelled becomes a warning of the description.
    ///
    /// # Errors
    /// [`crate::error::ExitCode::Script`], with the place in the script.
    pub fn load(&self) -> Result<(LoadedJob, Unbuilt)> {
        job::load(&self.path, &self.parameters())
    }

    /// The same for one frame of a sequence.
    ///
    /// # Errors
    /// As [`Self::load`].
    pub fn load_frame(&self, frame: u32) -> Result<(LoadedJob, Unbuilt)> {
        let mut parameters = self.parameters();
        parameters.insert(FRAME_PARAMETER.to_owned(), frame.to_string());
        job::load(&self.path, &parameters)
    }

    /// What was given with `--set`.
    pub fn parameters(&self) -> BTreeMap<String, String> {
        self.parameters.iter().cloned().collect()
    }
}
