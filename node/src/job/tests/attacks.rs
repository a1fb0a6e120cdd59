//! What a script cannot do: each attack ends within its budget, with the right words.

use std::time::Duration;

use super::{BUDGET, Budget, run};
use crate::job::{
    ScriptBundle,
    context::{Context, Files},
    evaluate::evaluate_bundle,
    fault::Fault,
    library::GLOBALS,
    modules::Modules,
    sandbox::{self, Sandbox},
};

const SHORT: Budget = Budget { memory: 64 << 20, time: Duration::from_millis(300) };
const SMALL: Budget = Budget { memory: 64 << 20, time: Duration::from_secs(60) };

/// Runs an attack and says how it ended: as native code and, as where it travels to, step by step.
fn attack(script: &str, budget: Budget) -> String {
    let ended = |fault: Option<Fault>| fault.map_or("the script came through".to_owned(), |fault| fault.message);
    let native = ended(run(script, &[], &[], budget).err());
    let bundle = ScriptBundle { name: "jobs/job.lua".to_owned(), ..super::bundle(script) };
    assert_eq!(ended(evaluate_bundle(&bundle, &Default::default(), budget).err()), native, "{script}");
    native
}

#[test]
fn no_loop_outlives_its_time() {
    let attacks = [
        "while true do end",
        "while true do pcall(function() while true do end end) end",
        "while true do xpcall(function() while true do end end, function() while true do end end) end",
        "local function f() pcall(f) return f() end f()",
        "local function f() return pcall(pcall, f) end while true do f() end",
        "local s = string.rep('a', 30) .. 'b'; string.find(string.rep('a', 1e6), string.rep('a*', 30) .. 'c')",
        "string.gsub(string.rep('a', 1e6), '(.-)(.-)(.-)(.-)c', '')",
        "while true do string.match(string.rep('(', 1e5), '%b()') end",
        "local text = string.rep('a', 2e7); local needle = string.rep('a', 1e7) .. 'b'; while true do string.find(text, needle, 1, true) end",
        "local text = string.rep('a', 2e7); while true do string.split(text, string.rep('a', 1e6) .. 'b') end",
        "while true do table.move({}, 1, 16777000, 2) end",
        "local t = setmetatable({}, { __index = function(t, k) return t[k + 1] end }); while true do pcall(function() return t[1] end) end",
        "local t = setmetatable({}, { __index = function() while true do end end }); pcall(function() return t.x end) while true do end",
        "local t = setmetatable({}, { __tostring = function() while true do end end }); error(t)",
        "local t = {} for i = 1, 1e5 do t[i] = i end while true do table.sort(t, function(a, b) return a < b end) end",
        "local q = string.rep('x', 1e7) local a, b, t = q .. 'a', q .. 'b', {} for i = 1, 60000 do t[i] = i % 2 == 0 and a or b end table.sort(t)",
        "for i in setmetatable({}, { __iter = function() return function() return 1 end end }) do end",
    ];
    let outcomes = attacks.map(|script| (script, attack(script, SHORT)));
    let wrong = |(_, message): &(&str, String)| !message.contains("ran longer than 0.3 s") || !message.starts_with("jobs/job.lua:1: ");
    let wrong: Vec<_> = outcomes.into_iter().filter(wrong).collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn no_memory_beyond_the_limit() {
    let attacks = [
        "local t = {} while true do t[#t + 1] = {} end",
        "local s = 'x' while true do s = s .. s end",
        "string.rep('x', 1e9)",
        "local t = {} while true do pcall(function() t[#t + 1] = string.rep('x', 1e6) .. #t end) end",
        "buffer.create(1e9)",
        "table.create(6e7, 0)",
        "table.concat(table.create(1e6, string.rep('x', 1e3)))",
        "pcall(string.rep, 'x', 1e9) while true do end",
    ];
    let outcomes = attacks.map(|script| (script, attack(script, SMALL)));
    let wrong: Vec<_> =
        outcomes.into_iter().filter(|(_, message)| message != "jobs/job.lua: the script used more than 64 MiB of memory").collect();
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[test]
fn what_cannot_be_interrupted_is_refused() {
    for name in ["find", "match", "gmatch", "gsub"] {
        let message = attack(&format!("string.{name}(string.rep('a', 1e6), '[' .. string.rep('b', 1e6) .. 'a]*', '')"), SMALL);
        assert_eq!(message, format!("jobs/job.lua:1: string.{name}: a pattern of 1000004 bytes is too long for a text of 1000000"));
    }
    assert_eq!(attack("table.move({}, '1', '2147483000', '2', {})", SMALL), "jobs/job.lua:1: table.move: more than 16777216 elements");
}

#[test]
fn deep_recursion_is_a_plain_error() {
    let message = attack("local function f() return 1 + f() end f()", SMALL);
    assert!(message.contains("stack overflow") && message.starts_with("jobs/job.lua:1:"), "{message}");
    let message = attack("local function f() return 1 + select(2, pcall(f)) end f() error('on')", SMALL);
    assert!(message.starts_with("jobs/job.lua:1:"), "{message}");
    assert_eq!(attack("table.create(1e9, 0)", SMALL), "jobs/job.lua: table overflow");
    let nested = format!("return {}1{}", "(".repeat(100_000), ")".repeat(100_000));
    let message = attack(&nested, SMALL);
    assert!(message.starts_with("jobs/job.lua:1: syntax error:"), "{message}");
}

#[test]
fn objects_outside_the_machine_are_counted() {
    let message = attack("local tessera = require('tessera') while true do tessera.diffuse {} end", SHORT);
    assert!(message.contains("ran longer than") || message.contains("objects"), "{message}");
    let nest = "local tessera = require('tessera') local g = tessera.group {} while true do g = tessera.group { g } end";
    assert_eq!(attack(nest, SMALL), "jobs/job.lua:1: group: more than 32 groups within groups");
}

#[test]
fn nothing_outside_is_reached() {
    let files = [("scenes/ok.lua", "return 1"), ("jobs/notes.txt", "secret")];
    let refused = [
        ("require('os')", "no module \"os\""),
        ("require('../../etc/passwd')", "module names are"),
        ("require('/etc/passwd')", "module names are"),
        ("require('scenes..ok')", "module names are"),
        ("require('tessera').model { file = '/etc/hosts.obj' }", "there is no such file"),
        ("require('tessera').image { file = '../../../../../../etc/passwd' }", "must be an image file"),
        ("require('tessera').probe.from('/etc/hostname')", "lies outside the project"),
        ("io.open('x')", "attempt to index nil with 'open'"),
        ("os.execute('x')", "attempt to index nil with 'execute'"),
        ("debug.info(1, 's')", "attempt to index nil with 'info'"),
        ("loadstring('return 1')", "attempt to call a nil value"),
        ("getfenv(0)", "attempt to call a nil value"),
        ("collectgarbage()", "attempt to call a nil value"),
        ("string.rep = nil", "attempt to modify a readonly table"),
        ("getmetatable('').__index = nil", "attempt to"),
        ("require('tessera').sphere = nil", "attempt to modify a readonly table"),
        ("getmetatable(require('tessera').assign.naive).x = 1", "attempt to index boolean with 'x'"),
        ("error(debug)", "nil"),
    ];
    let mut wrong = Vec::new();
    for (script, expected) in refused {
        let message = run(script, &files, &[], BUDGET).err().map(|fault| fault.message).unwrap_or_default();
        let leaks = ["stack traceback", "mlua", "runtime error"].iter().any(|word| message.contains(word));
        if leaks || !message.contains(expected) {
            wrong.push((script, message));
        }
    }
    assert!(wrong.is_empty(), "{wrong:#?}");
}

#[cfg(unix)]
#[test]
fn links_do_not_lead_outside() {
    let outside = tempfile::tempdir().unwrap();
    std::fs::write(outside.path().join("secret.lua"), "return 1").unwrap();
    let project = tempfile::tempdir().unwrap();
    std::fs::write(project.path().join(".luaurc"), "{}").unwrap();
    std::os::unix::fs::symlink(outside.path().join("secret.lua"), project.path().join("secret.lua")).unwrap();
    std::fs::write(project.path().join("job.lua"), "require('secret')").unwrap();
    let fault = super::load_file(&project.path().join("job.lua"), &[], BUDGET).err().unwrap();
    assert!(fault.message.contains("lies outside the project"), "{fault}");
}

#[test]
fn caught_errors_are_plain_text() {
    let script = "local tessera = require('tessera')
local ok, message = pcall(tessera.sphere, { radius = -1 })
assert(not ok and type(message) == 'string', type(message))
error(message, 0)";
    let fault = run(script, &[], &[], BUDGET).err().unwrap();
    assert_eq!(fault.message, "jobs/job.lua:2: sphere: `radius` must be a number above 0, got -1");
}

/// Globals and the members of their tables: a new one is a decision, not an accident of an update.
#[test]
fn globals_are_a_whitelist() {
    let context = Context::new("job".to_owned(), Files::Inert, Modules::in_bundle(&super::bundle("")), Default::default());
    let sandbox = Sandbox::new(context, 64 << 20).unwrap_or_else(|fault| panic!("{fault}"));
    let list = "local lines = {}
for name, value in getmetatable(_G) and getmetatable(_G).__index or _G do
  local members = {}
  if type(value) == 'table' and name ~= '_G' then for member in value do table.insert(members, member) end end
  table.sort(members)
  table.insert(lines, name .. ': ' .. table.concat(members, ' '))
end
table.sort(lines)
return table.concat(lines, '\\n')";
    let listed = sandbox.run(BUDGET.time, |lua| sandbox::evaluate(lua, "list", list)).unwrap_or_else(|fault| panic!("{fault}"));
    let text = listed.front().unwrap().to_string().unwrap();
    let names: Vec<&str> = text.lines().filter_map(|line| line.split_once(':').map(|(name, _)| name)).collect();
    assert_eq!(names, GLOBALS);
    insta::assert_snapshot!(text);
}

/// Native code computes what a machine without it does, to the last bit; where it cannot be made, nobody needs to know.
#[test]
fn native_code_gives_the_same_numbers() {
    let script = "local lines, x, n = {}, 0.7, 12345
for i = 1, 20000 do
  local a, b = math.sin(i * 0.37) * x, (i % 97 - 48) / (i // 3 + 1)
  x = (a * b + x * 0.999 - math.floor(a * 7.5)) % 3.25 + math.sqrt(math.abs(b)) ^ 1.5
  n = bit32.bxor(bit32.lrotate(n, 5), i) + (i % 3 == 0 and math.max(a, b) or math.min(a, -b)) // 1e-3
  n %= 4294967296
  if i % 500 == 0 then table.insert(lines, string.format('%.17g %.17g', x, n)) end
end
for _, odd in { 0 / 0, -0.0, 1 / 0, 5e-324, 2 ^ 53 + 1, -7 // 2, -7 % 3, 7 % -0.5, math.round(-2.5), math.clamp(3, 1, 2) } do
  table.insert(lines, string.format('%.17g %.17g', odd, math.abs(odd) + 1 / odd))
end
local bytes = buffer.create(64)
for i = 0, 15 do buffer.writef32(bytes, i * 4, x / (i + 1)) lines[#lines + 1] = string.format('%.17g', buffer.readf32(bytes, i * 4) * 3) end
return table.concat(lines, '\\n')";
    let numbers = |files: Files| {
        let context = Context::new("job".to_owned(), files, Modules::in_bundle(&super::bundle("")), Default::default());
        let sandbox = Sandbox::new(context, 64 << 20).unwrap_or_else(|fault| panic!("{fault}"));
        let text = sandbox.run(BUDGET.time, |lua| sandbox::evaluate(lua, "numbers", script)).unwrap_or_else(|fault| panic!("{fault}"));
        text.front().unwrap().to_string().unwrap()
    };
    let native = numbers(Files::Disk);
    assert!(native.lines().count() > 60, "{native}");
    assert_eq!(native, numbers(Files::Inert));
}
