//! Errors as the user meets them: what is wrong, where, what to do, and a stable exit code.

use std::fmt;

/// Exit codes; their numbers are a promise to scripts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum ExitCode {
    /// A fault of the program or of the machine below it.
    Internal = 1,
    /// The command line is wrong.
    Usage = 2,
    /// The job script, or a file that it names, is wrong.
    Script = 3,
    /// A file cannot be read or written.
    File = 4,
    /// The farm cannot be reached, or refuses.
    Farm = 5,
    /// The job failed while it ran: no node, or a failed policy.
    Job = 6,
    /// An output does not agree with what was promised.
    Verify = 7,
    /// The farm does not accept this identity, or does not let it do that.
    Denied = 8,
    /// The picture stands, but has holes: parts that no node could render.
    Incomplete = 9,
    /// The picture stands, but too many of its samples are invalid.
    Invalid = 10,
    /// The user interrupted it (128 + SIGINT).
    Interrupted = 130,
}

/// An error on its way to the user.
#[derive(Debug)]
pub struct Error {
    /// The exit code.
    pub code: ExitCode,
    /// What is wrong, and where: `file:line: object: what`.
    pub message: String,
    /// The way out, where one is known.
    pub help: Option<String>,
}

/// Results of this crate.
pub type Result<T, E = Error> = std::result::Result<T, E>;

impl Error {
    /// An error without help.
    pub fn new(code: ExitCode, message: impl Into<String>) -> Self {
        Self { code, message: message.into(), help: None }
    }

    /// Adds the way out.
    #[must_use]
    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Adds a way out where none is known yet.
    #[must_use]
    pub fn or_help(self, help: impl Into<String>) -> Self {
        if self.help.is_some() { self } else { self.with_help(help) }
    }
}

impl fmt::Display for Error {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        self.help.iter().try_for_each(|help| write!(f, "\n  help: {help}"))
    }
}

impl std::error::Error for Error {}

#[cfg(test)]
mod tests {
    use std::collections::BTreeSet;

    /// Codes are a promise to scripts, so every one of them is listed for those who write scripts, and no other.
    #[test]
    fn the_readme_lists_every_exit_code() {
        let codes = include_str!("error.rs").lines().filter_map(|line| line.strip_prefix("    ")?.strip_suffix(',')?.split_once(" = "));
        let codes = codes.filter(|(name, _)| name.chars().all(char::is_alphanumeric)).filter_map(|(_, code)| code.parse().ok());
        let codes: BTreeSet<u8> = codes.chain([0]).collect();
        assert!(codes.contains(&130) && codes.len() > 7, "{codes:?}");
        let readme = include_str!("../../README.md");
        let rows = readme.lines().filter_map(|line| line.strip_prefix("| `")?.split_once('`')?.0.parse().ok());
        assert_eq!(rows.collect::<BTreeSet<u8>>(), codes);
    }
}
