//! The sandbox: a Luau machine with a whitelist of globals, a memory limit and a time budget.
//!
//! Luau calls an interrupt at every call, return, loop and step of pattern matching; once the time is over, each of them raises an error, so
//! that a script can neither catch the end nor hide from it. What Luau's library does without interrupts in more than linear
//! time is replaced in [`super::library`].

use std::{
    sync::{Arc, Mutex, PoisonError},
    time::{Duration, Instant},
};

use mlua::{Function, Lua, LuaOptions, MultiValue, StdLib, VmState, chunk::ChunkMode};

use super::{
    context::{Context, Files},
    fault::Fault,
    library,
    place::Place,
};
use crate::limits;

/// What a script may use up.
#[derive(Clone, Copy, Debug)]
pub struct Budget {
    /// Bytes of the virtual machine.
    pub memory: usize,
    /// Time until it is interrupted.
    pub time: Duration,
}

impl Default for Budget {
    fn default() -> Self {
        Self { memory: limits::SCRIPT_MEMORY_BYTES, time: limits::SCRIPT_TIME }
    }
}

/// A virtual machine for one script.
pub struct Sandbox {
    lua: Lua,
    guard: Arc<Guard>,
    memory: usize,
}

impl Sandbox {
    /// A fresh machine that holds the library, but no script yet.
    pub fn new(context: Context, memory: usize) -> Result<Self, Fault> {
        let guard = Arc::new(Guard::default());
        // Where scripts make scenes; not where they come from others, and only choose.
        let native = Native(matches!(context.files, Files::Disk));
        let libraries = StdLib::TABLE | StdLib::STRING | StdLib::UTF8 | StdLib::BIT | StdLib::MATH | StdLib::BUFFER | StdLib::VECTOR;
        let make = || {
            let lua = Lua::new_with(libraries, LuaOptions::default())?;
            lua.set_app_data(native);
            lua.set_app_data(context);
            library::install(&lua, &guard)?;
            lua.sandbox(true)?;
            lua.set_memory_limit(memory)?;
            let watch = Arc::clone(&guard);
            lua.set_interrupt(move |lua| watch.check(lua).map(|()| VmState::Continue));
            Ok(lua)
        };
        let lua = make().map_err(|error: mlua::Error| Fault::from(&error))?;
        Ok(Self { lua, guard, memory })
    }

    /// The machine.
    pub fn lua(&self) -> &Lua {
        &self.lua
    }

    /// Runs Lua code, or anything that calls it, for at most `time`.
    ///
    /// # Errors
    /// What the script did wrong; that it ran too long; that its memory is used up, and then the machine is of no use any more.
    pub fn run<T>(&self, time: Duration, work: impl FnOnce(&Lua) -> mlua::Result<T>) -> Result<T, Fault> {
        self.guard.begin(time);
        let result = work(&self.lua);
        if result.as_ref().is_err_and(is_memory_error) {
            self.guard.end(End::Memory);
        }
        match self.guard.ended() {
            Some(End::Time { place }) => Err(place
                .fault(format!("the script ran longer than {} s", time.as_secs_f64()))
                .with_help("look for a loop without end; large meshes are made faster in buffers")),
            Some(End::Memory) => Err(Fault::new(format!("the script used more than {} MiB of memory", self.memory >> 20))
                .with_help("look for a table or text that grows without end; place groups many times with tessera.instance")),
            None => result.map_err(|error| Fault::from(&error)),
        }
    }

    /// Whether the memory ran out: the machine is to be dropped.
    pub fn exhausted(&self) -> bool {
        matches!(self.guard.ended(), Some(End::Memory))
    }
}

/// Whether a machine may make native code of what it loads.
#[derive(Clone, Copy)]
struct Native(bool);

/// Loads a chunk of source; bytecode is refused.
pub fn load(lua: &Lua, name: &str, source: &str) -> mlua::Result<Function> {
    let may_be_native = lua.app_data_ref::<Native>().is_some_and(|native| native.0);
    lua.enable_jit(may_be_native && source.len() <= limits::SCRIPT_NATIVE_BYTES);
    lua.load(source).set_name(format!("={name}")).set_mode(ChunkMode::Text).into_function()
}

/// Loads and calls a chunk of source.
pub fn evaluate(lua: &Lua, name: &str, source: &str) -> mlua::Result<MultiValue> {
    load(lua, name, source)?.call(())
}

/// Whether memory ran out somewhere below this error.
pub fn is_memory_error(error: &mlua::Error) -> bool {
    match error {
        mlua::Error::MemoryError(_) => true,
        mlua::Error::CallbackError { cause, .. } | mlua::Error::WithContext { cause, .. } => is_memory_error(cause),
        _ => false,
    }
}

/// Why a script was ended from outside.
#[derive(Clone)]
pub enum End {
    Time { place: Place },
    Memory,
}

/// Watches over a machine: from the moment at which it ends a script, every interrupt raises an error.
#[derive(Default)]
pub struct Guard {
    state: Mutex<GuardState>,
}

#[derive(Default)]
struct GuardState {
    deadline: Option<Instant>,
    end: Option<End>,
}

impl Guard {
    fn state(&self) -> std::sync::MutexGuard<'_, GuardState> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn begin(&self, time: Duration) {
        let mut state = self.state();
        state.deadline = Instant::now().checked_add(time);
        if !matches!(state.end, Some(End::Memory)) {
            state.end = None;
        }
    }

    pub fn end(&self, end: End) {
        self.state().end.get_or_insert(end);
    }

    fn ended(&self) -> Option<End> {
        self.state().end.clone()
    }

    /// Fails once the script is ended.
    pub fn check(&self, lua: &Lua) -> mlua::Result<()> {
        let mut state = self.state();
        if state.end.is_none() && state.deadline.is_some_and(|deadline| Instant::now() > deadline) {
            state.end = Some(End::Time { place: Place::of_running(lua) });
        }
        if state.end.is_some() { Err(Fault::new("the script was ended").into()) } else { Ok(()) }
    }
}
