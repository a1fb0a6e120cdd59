//! The annotations and the reference say what the API is, no more and no less.

use std::collections::BTreeSet;

use super::{BUDGET, repository, run};
use crate::job::api::{FUNCTIONS, Form, JOB_TABLES, METHODS};

fn file(name: &str) -> String {
    std::fs::read_to_string(repository().join(name)).unwrap_or_else(|error| panic!("{name}: {error}"))
}

/// `split.grid` with `size` becomes `("split.grid", ["size"])`.
fn api() -> Vec<(String, BTreeSet<String>)> {
    let names = |keys: &[&str]| keys.iter().map(ToString::to_string).collect();
    let functions = FUNCTIONS.iter().copied().flatten().map(|function| (function.path.to_owned(), names(function.keys)));
    let methods = METHODS.iter().map(|method| (format!("random:{}", method.name), names(method.parameters)));
    functions.chain(methods).collect()
}

/// A word of Lua: `box`, not a part of `checkbox`.
fn words(text: &str) -> BTreeSet<&str> {
    text.split(|c: char| !c.is_ascii_alphanumeric() && c != '_').filter(|word| !word.is_empty()).collect()
}

/// Every function has a heading, and every key of it a row of the table below.
#[test]
fn the_reference_is_complete() {
    let text = file("scripts/README.md");
    let sections: Vec<(&str, &str)> = text.split("\n### ").skip(1).filter_map(|section| section.split_once('\n')).collect();
    let mut described = BTreeSet::new();
    for (name, keys) in api() {
        let shown = if name.contains(':') { name.clone() } else { format!("tessera.{name}") };
        let section = sections
            .iter()
            .find(|(heading, _)| heading.split('`').nth(1).is_some_and(|code| code.split([' ', '(', '{']).next() == Some(&shown)));
        let (heading, body) = section.unwrap_or_else(|| panic!("no section `{shown}` in scripts/README.md"));
        described.insert(*heading);
        assert_eq!(rows(body), keys, "keys of {shown} in scripts/README.md");
    }
    for (key, keys) in JOB_TABLES {
        let heading = format!("`{key}` of a job");
        let (heading, body) = sections.iter().find(|(found, _)| *found == heading).unwrap_or_else(|| panic!("no section {heading}"));
        described.insert(*heading);
        assert_eq!(rows(body), keys.iter().map(ToString::to_string).collect(), "keys of {heading}");
    }
    let strange: Vec<&str> =
        sections.iter().map(|(heading, _)| *heading).filter(|heading| heading.starts_with('`') && !described.contains(heading)).collect();
    assert!(strange.is_empty(), "scripts/README.md describes what is not there: {strange:?}");
}

/// First column of the section's table.
fn rows(body: &str) -> BTreeSet<String> {
    let body = body.split("\n## ").next().unwrap_or(body);
    body.lines()
        .filter_map(|line| line.strip_prefix("| `"))
        .filter_map(|line| line.split_once('`'))
        .map(|(key, _)| key.to_owned())
        .collect()
}

/// The block of an annotation file that speaks of one function: from a line with its marker to the next marker.
fn block<'t>(text: &'t str, name: &str) -> &'t str {
    let marker = format!("-- @api {name}\n");
    let start = text.find(&marker).unwrap_or_else(|| panic!("no `{}`", marker.trim())) + marker.len();
    text[start..].split("-- @").next().unwrap_or("")
}

fn markers(text: &str) -> BTreeSet<String> {
    text.lines().filter_map(|line| line.trim().strip_prefix("-- @api ")).map(str::to_owned).collect()
}

#[test]
fn annotations_are_complete() {
    for name in ["scripts/types/tessera.d.luau", "scripts/types/tessera.lua"] {
        let text = file(name);
        let mut expected: BTreeSet<String> = BTreeSet::new();
        for (function, keys) in api() {
            let block = block(&text, &function);
            let mut found = keys_of(name, block);
            // The function itself is declared in its block.
            found.retain(|key| !function.ends_with(key.as_str()) || keys.contains(key));
            assert_eq!(found, keys, "keys of {function} in {name}");
            let last = function.rsplit(['.', ':']).next().unwrap_or(&function);
            assert!(words(block).contains(last), "{function} itself in {name}");
            expected.insert(function);
        }
        for (table, keys) in JOB_TABLES {
            let function = format!("job: {table}");
            assert_eq!(keys_of(name, block(&text, &function)), keys.iter().map(ToString::to_string).collect(), "{function} in {name}");
            expected.insert(function);
        }
        assert_eq!(markers(&text), expected, "{name}");
    }
}

/// Keys and parameters that a block declares: `key: type` in `.d.luau`, `---@field key` and `---@param key` in `.lua`.
fn keys_of(file: &str, block: &str) -> BTreeSet<String> {
    if file.ends_with(".lua") {
        let declared = |line: &str| line.trim().strip_prefix("---@field ").or(line.trim().strip_prefix("---@param ")).map(str::to_owned);
        let first = |line: String| line.split([' ', '?']).next().unwrap_or("").to_owned();
        return block.lines().filter_map(declared).map(first).filter(|key| key != "keys" && !key.starts_with('[')).collect();
    }
    let key = |part: &str| {
        let (name, _) = part.split_once(':')?;
        let name = name.trim().trim_start_matches(['(', '{']).trim();
        (!name.is_empty() && name.chars().all(|c| c.is_ascii_alphanumeric() || c == '_')).then(|| name.to_owned())
    };
    // The function's own name, `keys` and `self` are no keys; callbacks are written as types of their own.
    block
        .lines()
        .filter(|line| !line.trim_start().starts_with("--"))
        .flat_map(|line| {
            let line = line.trim();
            let inside = line
                .split_once('(')
                .filter(|_| line.contains("->"))
                .map_or(line, |(_, inside)| inside.split_once(')').map_or(inside, |(inside, _)| inside));
            inside.split(',').filter_map(key).collect::<Vec<_>>()
        })
        .filter(|name| name != "keys" && name != "self")
        .collect()
}

/// The table that scripts get has exactly the functions of the table of contents.
#[test]
fn the_table_of_contents_is_what_scripts_get() {
    let script = "local tessera = require('tessera')
local names = {}
for name, value in tessera do
  if type(value) == 'table' then
    for inner, member in value do table.insert(names, name .. '.' .. inner .. ' ' .. type(member)) end
  else
    table.insert(names, name .. ' ' .. type(value))
  end
end
table.sort(names)
error(table.concat(names, ','), 0)";
    let message = run(script, &[], &[], BUDGET).err().unwrap().message;
    let listed = message.trim_start_matches("jobs/job.lua: ");
    let kind = |form: Form| if form == Form::Value { "userdata" } else { "function" };
    let mut expected: Vec<String> =
        FUNCTIONS.iter().copied().flatten().map(|function| format!("{} {}", function.path, kind(function.form))).collect();
    expected.sort();
    assert_eq!(listed.split(',').collect::<Vec<_>>(), expected);
}
