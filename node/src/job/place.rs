//! Places in a script.

use std::fmt;

use mlua::{Function, Lua};

use super::fault::Fault;

/// Frames that are looked through for one of a script: deep enough for any call of the library.
const FRAMES: usize = 16;

/// How names of the library's own chunks begin: they are no place of a script.
const OWN: char = '[';

/// A line of a Lua file.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Place {
    pub file: String,
    /// From 1; 0 where it is not known.
    pub line: u32,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}", self.file, self.line)
    }
}

impl Place {
    /// The line that is being run: of the innermost function that is written in Lua.
    pub fn of_running(lua: &Lua) -> Self {
        (0..FRAMES).find_map(|level| lua.inspect_stack(level, Self::of_frame).flatten()).unwrap_or_default()
    }

    fn of_frame(frame: &mlua::debug::Debug) -> Option<Self> {
        let source = frame.source();
        let line = frame.current_line().and_then(|line| u32::try_from(line).ok())?;
        let file = source.short_src.filter(|file| source.what != "C" && !file.starts_with(OWN))?;
        Some(Self { file: file.into_owned(), line })
    }

    /// The line where a function begins.
    pub fn of_function(function: &Function) -> Self {
        let info = function.info();
        let line = info.line_defined.and_then(|line| u32::try_from(line).ok()).unwrap_or(0);
        Self { file: info.short_src.unwrap_or_default(), line }
    }

    /// A fault at this place.
    pub fn fault(&self, what: impl fmt::Display) -> Fault {
        if self.file.is_empty() { Fault::new(what.to_string()) } else { Fault::new(format!("{self}: {what}")) }
    }
}
