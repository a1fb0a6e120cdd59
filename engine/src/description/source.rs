//! Where an object came from, for messages that name the place.

use std::fmt;

use serde::{Deserialize, Serialize};

/// Index into [`Sources`]; 0 stands for a place that is not known.
///
/// It stays where the script ran: it is neither sent nor hashed, because it takes no part in what is pictured.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash, PartialOrd, Ord)]
pub struct SourceId(pub u32);

/// The place in a script that made an object.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Source {
    /// The script's name as the user wrote it.
    pub file: String,
    /// Line from 1; 0 where it is not known.
    pub line: u32,
    /// What was made there: `sphere`, or `sphere "sun"` where the script gave a name.
    pub object: String,
}

impl fmt::Display for Source {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}:{}: {}", self.file, self.line, self.object)
    }
}

/// All places of a description.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Sources {
    entries: Vec<Source>,
}

impl Sources {
    /// Keeps a place and returns its id. Entry 0 is the unknown place.
    pub fn insert(&mut self, source: Source) -> SourceId {
        if self.entries.is_empty() {
            self.entries.push(Source::default());
        }
        self.entries.push(source);
        SourceId(u32::try_from(self.entries.len() - 1).unwrap_or(0))
    }

    /// The place behind an id, if it is known.
    pub fn get(&self, id: SourceId) -> Option<&Source> {
        if id == SourceId::default() { None } else { self.entries.get(id.0 as usize) }
    }
}
