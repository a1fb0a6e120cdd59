//! Faults of a script: they travel through the virtual machine as Lua errors and come out as errors of the program.

use std::fmt;

use mlua::Value;

use crate::error::{Error, ExitCode};

/// What a script did wrong.
#[derive(Clone, Debug)]
pub struct Fault {
    /// `file:line: object: what is wrong`.
    pub message: String,
    /// The way out.
    pub help: Option<String>,
}

/// Stands between message and help wherever a fault is text: a script may catch and raise it again.
const HELP: &str = "\n  help: ";

impl Fault {
    pub fn new(message: impl Into<String>) -> Self {
        Self { message: message.into(), help: None }
    }

    pub fn with_help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Whether the message tells a line. Not all that goes wrong below Luau's own library does.
    pub fn names_a_line(&self) -> bool {
        self.message.split(':').skip(1).any(|part| !part.is_empty() && part.bytes().all(|byte| byte.is_ascii_digit()))
    }

    /// The fault at a place, unless its message tells one.
    pub fn or_at(self, place: impl fmt::Display) -> Self {
        if self.names_a_line() { self } else { Self { message: format!("{place}: {}", self.message), ..self } }
    }

    /// With the way out of the machine's own error that is met most.
    fn with_hint(self) -> Self {
        if self.help.is_some() || !self.message.contains("attempt to index nil with") {
            return self;
        }
        self.with_help("what stands before that name is nothing: is it misspelt, or `local tessera = require(\"tessera\")` missing?")
    }

    fn from_text(text: &str) -> Self {
        match text.split_once(HELP) {
            Some((message, help)) => Self::new(message).with_help(help),
            None => Self::new(text),
        }
    }
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}", self.message)?;
        self.help.iter().try_for_each(|help| write!(f, "{HELP}{help}"))
    }
}

impl std::error::Error for Fault {}

impl From<Fault> for mlua::Error {
    fn from(fault: Fault) -> Self {
        Self::external(fault)
    }
}

impl From<Fault> for Error {
    fn from(fault: Fault) -> Self {
        Self { code: ExitCode::Script, message: fault.message, help: fault.help }
    }
}

/// The fault behind a Lua error, without the machine's stack traces and the binding's own words.
impl From<&mlua::Error> for Fault {
    fn from(error: &mlua::Error) -> Self {
        use mlua::Error as E;
        match error {
            E::CallbackError { cause, .. } | E::WithContext { cause, .. } | E::BadArgument { cause, .. } => Self::from(&**cause),
            E::ExternalError(cause) => match cause.downcast_ref::<Self>() {
                Some(fault) => fault.clone(),
                None => Self::new(cause.to_string()),
            },
            E::SyntaxError { message, .. } => Self::new(syntax(message)),
            E::RuntimeError(text) | E::MemoryError(text) => Self::from_text(without_trace(text)).with_hint(),
            E::StackError => Self::new("stack overflow"),
            other => Self::new(other.to_string()),
        }
    }
}

/// Luau puts `file:line: ` in front; say what kind of trouble follows.
fn syntax(message: &str) -> String {
    let message = without_trace(message);
    let place_ends = message.char_indices().filter(|(_, c)| *c == ':').map(|(at, _)| at).find(|at| {
        let before = &message[..*at];
        before.rsplit_once(':').is_some_and(|(_, line)| !line.is_empty() && line.bytes().all(|b| b.is_ascii_digit()))
    });
    match place_ends {
        Some(at) => format!("{}: syntax error: {}", &message[..at], message[at + 1..].trim_start()),
        None => format!("syntax error: {message}"),
    }
}

fn without_trace(text: &str) -> &str {
    let text = text.split_once("\nstack traceback:").map_or(text, |(text, _)| text).trim_end();
    let is_object = ["table: 0x", "function: 0x", "userdata: 0x", "buffer: 0x"].iter().any(|object| text.starts_with(object));
    if is_object { "the script raised an error that is not text" } else { text }
}

/// What a script sees of an error that it catches: text, where the machine would hand out an object of the binding.
pub fn caught(error: Value) -> Result<String, Value> {
    match error {
        Value::Error(error) => Ok(Fault::from(&*error).to_string()),
        other => Err(other),
    }
}
