//! What a script finds in its globals: a whitelist of Luau's library, with those functions replaced that would run long without interrupts,
//! write to the outside, or show the binding's own errors.

use std::{io::Write, sync::Arc};

use memchr::memmem;
use mlua::{Function, Lua, LuaString, MultiValue, Table, Value, Variadic};

use super::{
    api,
    context::Context,
    fault::{Fault, caught},
    keys::describe,
    place::Place,
    sandbox::{self, End, Guard, is_memory_error},
};

/// The globals of a script, sorted.
pub const GLOBALS: [&str; 30] = [
    "_G",
    "_VERSION",
    "assert",
    "bit32",
    "buffer",
    "error",
    "getmetatable",
    "ipairs",
    "math",
    "next",
    "pairs",
    "pcall",
    "print",
    "rawequal",
    "rawget",
    "rawlen",
    "rawset",
    "require",
    "select",
    "setmetatable",
    "string",
    "table",
    "tonumber",
    "tostring",
    "type",
    "typeof",
    "unpack",
    "utf8",
    "vector",
    "xpcall",
];

/// `table.move` of more elements than this is refused; `table.sort` compares them where interrupts happen.
const LONG_LIST: i64 = 1 << 16;

/// Texts longer than this take long to compare.
const LONG_TEXT: usize = 1 << 12;

/// Most that the lengths of a long pattern and of the text may multiply to: all of a set, `[...]`, is compared with each character.
const PATTERN_WORK: usize = 1 << 30;

/// Elements that `table.move` moves at the most.
const MOVE_LIMIT: f64 = 16_777_216.0;

/// `pcall` and `xpcall` hand a script text instead of the binding's error objects, and let no script survive a lack of memory.
const PROTECTED_CALLS: &str = "
local raw_pcall, raw_xpcall, caught = ...
local function settle(ok, ...)
  if ok then return true, ... end
  return false, caught((...))
end
return function(f, ...) return settle(raw_pcall(f, ...)) end,
  function(f, handler, ...) return raw_xpcall(f, function(e) return handler(caught(e)) end, ...) end
";

/// Makes a machine's globals.
pub fn install(lua: &Lua, guard: &Arc<Guard>) -> mlua::Result<()> {
    let globals = lua.globals();
    let strange: Vec<Value> =
        globals.pairs::<Value, Value>().filter_map(Result::ok).map(|(name, _)| name).filter(|name| !is_whitelisted(name)).collect();
    strange.into_iter().try_for_each(|name| globals.raw_set(name, Value::Nil))?;
    install_protected_calls(lua, guard)?;
    install_strings(lua, &globals.get("string")?)?;
    install_tables(lua, &globals.get("table")?)?;
    globals.set("print", lua.create_function(print)?)?;
    globals.set("require", require(lua)?)?;
    globals.get::<Table>("math")?.get::<Function>("randomseed")?.call::<()>(0)
}

fn is_whitelisted(name: &Value) -> bool {
    name.as_string().is_some_and(|name| GLOBALS.iter().any(|known| known.as_bytes() == &*name.as_bytes()))
}

fn install_protected_calls(lua: &Lua, guard: &Arc<Guard>) -> mlua::Result<()> {
    let globals = lua.globals();
    let guard = Arc::clone(guard);
    let caught = lua.create_function(move |lua, error: Value| {
        let out_of_memory = match &error {
            Value::Error(error) => is_memory_error(error),
            Value::String(text) => &*text.as_bytes() == b"not enough memory",
            _ => false,
        };
        if out_of_memory {
            guard.end(End::Memory);
        }
        guard.check(lua)?;
        caught(error).map_or_else(Ok, |text| Ok(Value::String(lua.create_string(text)?)))
    })?;
    let raw = (globals.get::<Function>("pcall")?, globals.get::<Function>("xpcall")?, caught);
    let (pcall, xpcall) = sandbox::load(lua, "[pcall]", PROTECTED_CALLS)?.call::<(Function, Function)>(raw)?;
    globals.set("pcall", pcall)?;
    globals.set("xpcall", xpcall)
}

/// Plain search and `split` compare byte by byte in Luau, in quadratic time.
fn install_strings(lua: &Lua, string: &Table) -> mlua::Result<()> {
    let raw: Function = string.get("find")?;
    let find = move |lua: &Lua, arguments: MultiValue| match plain_search(&arguments) {
        Some((text, pattern, from)) => find_plain(lua, &text, &pattern, from),
        None => match_pattern(lua, "find", &raw, arguments),
    };
    string.set("find", lua.create_function(find)?)?;
    for name in ["match", "gmatch", "gsub"] {
        let raw: Function = string.get(name)?;
        string.set(name, lua.create_function(move |lua: &Lua, arguments| match_pattern(lua, name, &raw, arguments))?)?;
    }
    let raw: Function = string.get("split")?;
    let split = move |lua: &Lua, arguments: MultiValue| match (arguments.front(), arguments.get(1)) {
        (Some(Value::String(text)), Some(Value::String(separator))) if separator.as_bytes().len() > 1 => split(lua, text, separator),
        _ => relay(lua, &raw, arguments),
    };
    string.set("split", lua.create_function(split)?)
}

/// Calls a function of Luau's library that looks for a pattern, its second argument, in its first, unless that might take long.
fn match_pattern(lua: &Lua, name: &str, raw: &Function, arguments: MultiValue) -> mlua::Result<MultiValue> {
    let length = |at: usize| arguments.get(at).and_then(Value::as_string).map_or(0, |text| text.as_bytes().len());
    let (text, pattern) = (length(0), length(1));
    if pattern > LONG_TEXT && text.saturating_mul(pattern) > PATTERN_WORK {
        let what = format!("string.{name}: a pattern of {pattern} bytes is too long for a text of {text}");
        return Err(Place::of_running(lua).fault(what).into());
    }
    relay(lua, raw, arguments)
}

/// The arguments of `string.find`, where it searches for a text and not for a pattern.
fn plain_search(arguments: &MultiValue) -> Option<(LuaString, LuaString, i64)> {
    let (Value::String(text), Value::String(pattern)) = (arguments.front()?, arguments.get(1)?) else { return None };
    let from = match arguments.get(2) {
        None | Some(Value::Nil) => 1,
        Some(from) => from.as_integer()?,
    };
    let plain = arguments.get(3).is_some_and(|plain| !matches!(plain, Value::Nil | Value::Boolean(false)));
    let special = pattern.as_bytes().iter().any(|byte| b"^$*+?.([%-".contains(byte));
    (plain || !special).then(|| (text.clone(), pattern.clone(), from))
}

fn find_plain(lua: &Lua, text: &LuaString, pattern: &LuaString, from: i64) -> mlua::Result<MultiValue> {
    use mlua::IntoLuaMulti;
    let (text, pattern) = (text.as_bytes(), pattern.as_bytes());
    let length = text.len() as i64;
    let from = if from < 0 { (length + 1).saturating_add(from).max(1) } else { from.max(1) };
    if from > length + 1 {
        return Value::Nil.into_lua_multi(lua);
    }
    let start = (from - 1) as usize;
    match memmem::find(&text[start..], &pattern) {
        Some(at) => (start + at + 1, start + at + pattern.len()).into_lua_multi(lua),
        None => Value::Nil.into_lua_multi(lua),
    }
}

fn split(lua: &Lua, text: &LuaString, separator: &LuaString) -> mlua::Result<MultiValue> {
    use mlua::IntoLuaMulti;
    let (text, separator) = (text.as_bytes(), separator.as_bytes());
    let list = lua.create_table()?;
    let mut start = 0;
    for at in memmem::find_iter(&text, &separator).chain([text.len()]) {
        list.raw_push(lua.create_string(&text[start..at])?)?;
        start = at + separator.len();
    }
    list.into_lua_multi(lua)
}

fn install_tables(lua: &Lua, table: &Table) -> mlua::Result<()> {
    let raw: Function = table.get("move")?;
    let shift = move |lua: &Lua, arguments: MultiValue| {
        // Luau takes numbers written as text, too.
        let number = |at: usize| lua.coerce_number(arguments.get(at).cloned().unwrap_or_default()).ok().flatten().unwrap_or(0.0);
        if number(2) - number(1) > MOVE_LIMIT {
            return Err(Place::of_running(lua).fault(format!("table.move: more than {MOVE_LIMIT} elements")).into());
        }
        relay(lua, &raw, arguments)
    };
    table.set("move", lua.create_function(shift)?)?;
    let raw: Function = table.get("sort")?;
    let ascending = sandbox::load(lua, "[sort]", "return function(a, b) return a < b end")?.call::<Function>(())?;
    let sort = move |lua: &Lua, mut arguments: MultiValue| {
        let takes_long = arguments.front().and_then(Value::as_table).is_some_and(takes_long);
        if takes_long && arguments.get(1).is_none_or(Value::is_nil) {
            arguments = MultiValue::from_iter([arguments.pop_front().unwrap_or_default(), Value::Function(ascending.clone())]);
        }
        relay(lua, &raw, arguments)
    };
    table.set("sort", lua.create_function(sort)?)
}

/// Whether a list has so many values, or one so long, that sorting it must be interruptible.
fn takes_long(list: &Table) -> bool {
    let is_long = |value: mlua::Result<Value>| matches!(value, Ok(Value::String(text)) if text.as_bytes().len() > LONG_TEXT);
    list.raw_len() as i64 > LONG_LIST || (1..=list.raw_len()).any(|at| is_long(list.raw_get(at)))
}

/// Calls a function of Luau's library from Rust: what goes wrong in it is put at the script's line.
fn relay(lua: &Lua, raw: &Function, arguments: MultiValue) -> mlua::Result<MultiValue> {
    raw.call(arguments).map_err(|error| match &error {
        mlua::Error::RuntimeError(_) => {
            let fault = Fault::from(&error);
            if fault.names_a_line() { fault.into() } else { Place::of_running(lua).fault(fault.message).into() }
        }
        _ => error,
    })
}

/// Prints to the user's terminal, on stderr: stdout is the program's own answer.
fn print(lua: &Lua, values: Variadic<Value>) -> mlua::Result<()> {
    let texts =
        values.iter().map(|value| caught(value.clone()).map_or_else(|value| value.to_string(), Ok)).collect::<mlua::Result<Vec<_>>>()?;
    let mut text = texts.join("\t").into_bytes();
    text.push(b'\n');
    let room = Context::of(lua)?.print_room(text.len());
    // A closed terminal is no reason to fail.
    let _ = std::io::stderr().write_all(&text[..room]);
    Ok(())
}

/// `require`: "tessera" is the API, anything else a module of the project.
fn require(lua: &Lua) -> mlua::Result<Function> {
    let tessera = api::table(lua)?;
    let loaded = lua.create_table()?;
    lua.create_function(move |lua, name: Value| {
        let place = Place::of_running(lua);
        let fault = |what: String| mlua::Error::from(place.fault(format!("require: {what}")));
        let Some(name) = name.as_string().and_then(|name| name.to_str().ok().map(|name| name.to_owned())) else {
            return Err(fault(format!("expected the name of a module, got {}", describe(lua, &name))));
        };
        if name == "tessera" {
            return Ok(Value::Table(tessera.clone()));
        }
        match loaded.raw_get::<Value>(name.as_str())? {
            Value::Nil => {}
            Value::Boolean(false) => return Err(fault(format!("module {name:?} requires itself"))),
            value => return Ok(value),
        }
        let (file, source) = Context::of(lua)?.modules.find(&name).map_err(fault)?;
        loaded.raw_set(name.as_str(), false)?;
        let values = sandbox::evaluate(lua, &file, &source).inspect_err(|_| {
            // A script may catch the error; the module is not half there then.
            let _ = loaded.raw_set(name.as_str(), Value::Nil);
        })?;
        let value = values.into_iter().next().unwrap_or_default();
        if matches!(value, Value::Nil | Value::Boolean(false)) {
            return Err(fault(format!("module {name:?} ({file}) returns nothing; it should end with `return`")));
        }
        loaded.raw_set(name.as_str(), value.clone())?;
        Ok(value)
    })
}
