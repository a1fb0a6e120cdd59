//! The house rules that no compiler holds: who imports from whom, how long a file may be, what stands behind each promise, where links lead.

use std::{
    collections::BTreeSet,
    fs,
    path::{Path, PathBuf},
};

const LONGEST_FILE: usize = 500;

fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap()
}

/// All files below a folder with one of these endings, without build output and version control.
fn files(folder: &Path, endings: &[&str]) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display())) {
        let path = entry.unwrap().path();
        let name = path.file_name().unwrap().to_string_lossy().into_owned();
        if path.is_dir() {
            if !["target", ".git", "out"].contains(&name.as_str()) {
                found.extend(files(&path, endings));
            }
        } else if endings.iter().any(|ending| name.ends_with(ending)) {
            found.push(path);
        }
    }
    found.sort();
    found
}

fn relative(path: &Path) -> String {
    path.strip_prefix(root()).unwrap().to_string_lossy().replace('\\', "/")
}

fn report(what: &str, wrong: &[String]) {
    assert!(wrong.is_empty(), "{what}:\n  {}", wrong.join("\n  "));
}

// ---- Rooms import only from rooms above them ---------------------------------------------------------------------------

/// Rooms of a crate in the order in which its `lib.rs` lists them.
fn rooms(lib: &str) -> Vec<String> {
    lib.lines()
        .filter_map(|line| line.strip_prefix("pub(crate) mod ").or_else(|| line.strip_prefix("pub mod "))?.strip_suffix(';'))
        .map(str::to_owned)
        .collect()
}

/// Source without comments and without what is compiled for tests alone.
fn shipped(source: &str) -> String {
    let code: Vec<_> = source.lines().map(|line| line.split("//").next().unwrap()).collect();
    let mut rest = code.join("\n");
    while let Some(at) = rest.find("#[cfg(test)]") {
        let item = &rest[at..];
        let end = match (item.find(';'), item.find('{')) {
            (Some(semicolon), brace) if brace.is_none_or(|brace| semicolon < brace) => at + semicolon + 1,
            (_, Some(brace)) => at + brace + closing(&item[brace..]),
            _ => rest.len(),
        };
        rest.replace_range(at..end, "");
    }
    rest
}

/// Length of a text up to the brace that closes its first one.
fn closing(text: &str) -> usize {
    let mut depth = 0;
    for (i, c) in text.char_indices() {
        depth += i32::from(c == '{') - i32::from(c == '}');
        if depth == 0 {
            return i + 1;
        }
    }
    text.len()
}

/// Names that stand right behind `crate::`, alone or in braces.
fn imports(code: &str) -> BTreeSet<String> {
    let word = |text: &str| text.trim_start().chars().take_while(|c| c.is_alphanumeric() || *c == '_').collect::<String>();
    let mut names = BTreeSet::new();
    for (at, _) in code.match_indices("crate::") {
        if code[..at].ends_with(|c: char| c.is_alphanumeric() || c == '_') {
            continue;
        }
        let behind = &code[at + "crate::".len()..];
        if !behind.starts_with('{') {
            names.insert(word(behind));
            continue;
        }
        let (mut depth, mut start) = (0, 1);
        for (i, c) in behind[..closing(behind)].char_indices() {
            depth += i32::from(c == '{') - i32::from(c == '}');
            if (c == ',' && depth == 1) || depth == 0 {
                names.insert(word(&behind[start..i]));
                start = i + 1;
            }
        }
    }
    names.remove("");
    names
}

/// Rooms that a room's code imports although they stand below it.
fn from_below(rooms: &[String], room: &str, code: &str) -> Vec<String> {
    let place = |name: &str| rooms.iter().position(|other| other == name);
    imports(code).into_iter().filter(|name| place(name).is_some_and(|other| Some(other) > place(room))).collect()
}

/// Files that are modules for tests alone: declared behind `#[cfg(test)]`.
fn test_modules(path: &Path, source: &str) -> Vec<PathBuf> {
    let folder =
        if path.ends_with("mod.rs") || path.ends_with("lib.rs") { path.parent().unwrap().to_owned() } else { path.with_extension("") };
    let behind = source.match_indices("#[cfg(test)]").map(|(at, mark)| &source[at + mark.len()..]);
    let declarations = behind.filter_map(|item| item.split_once(';')).map(|(item, _)| item).filter(|item| !item.contains('{'));
    let names = declarations.filter_map(|item| item.split_once("mod ")).map(|(_, name)| name.trim().to_owned());
    names.flat_map(|name| [folder.join(format!("{name}.rs")), folder.join(name)]).collect()
}

#[test]
fn rooms_import_only_from_rooms_above_them() {
    let mut wrong = Vec::new();
    for member in ["engine", "node"] {
        let source_folder = root().join(member).join("src");
        let rooms = rooms(&fs::read_to_string(source_folder.join("lib.rs")).unwrap());
        assert!(rooms.len() > 5, "{member}: no rooms found");
        let sources: Vec<_> = files(&source_folder, &[".rs"]).into_iter().map(|path| (fs::read_to_string(&path).unwrap(), path)).collect();
        let for_tests: Vec<_> = sources.iter().flat_map(|(source, path)| test_modules(path, source)).collect();
        for (source, path) in &sources {
            let first = path.strip_prefix(&source_folder).unwrap().iter().next().unwrap().to_string_lossy().into_owned();
            let room = first.trim_end_matches(".rs");
            if !rooms.iter().any(|known| known == room) || for_tests.iter().any(|module| path.starts_with(module)) {
                continue;
            }
            wrong.extend(from_below(&rooms, room, &shipped(source)).iter().map(|name| format!("{} imports from {name}", relative(path))));
        }
    }
    report("rooms import only from rooms above them (the order in lib.rs)", &wrong);
}

/// A node gets a frame as plain data: its code takes nothing from job scripts, and neither does the farm's core run any.
#[test]
fn nodes_and_the_core_never_see_scripts() {
    for room in ["worker", "farm"] {
        for path in files(&root().join("node/src").join(room), &[".rs"]) {
            let code = shipped(&fs::read_to_string(&path).unwrap());
            assert!(!imports(&code).contains("job") && !code.contains("mlua"), "{} sees job scripts", relative(&path));
        }
    }
}

#[test]
fn an_import_from_below_is_seen_however_it_is_written() {
    let rooms = rooms("pub mod limits;\npub mod farm;\npub mod cli;\nmod hidden;");
    assert_eq!(rooms, ["limits", "farm", "cli"]);
    for code in [
        "use crate::cli;",
        "use crate::{limits::X, cli::{a, b}};",
        "fn f() { crate::cli::run() }",
        "use crate::{\n    farm::{A, B},\n    cli,\n};",
    ] {
        assert_eq!(from_below(&rooms, "farm", &shipped(code)), ["cli"], "{code}");
    }
    for code in [
        "use crate::limits::cli;",
        "use crate::{limits::{cli, X}, farm};",
        "// use crate::cli;",
        "/// See [`crate::cli`].\nstruct S;",
        "#[cfg(test)]\nmod tests {\n    use crate::cli;\n}\n",
        "#[cfg(test)]\nuse crate::cli;",
        "use other_crate::cli;",
    ] {
        assert_eq!(from_below(&rooms, "farm", &shipped(code)), Vec::<String>::new(), "{code}");
    }
    assert_eq!(from_below(&rooms, "farm", &shipped("#[cfg(test)]\nmod tests { mod inner {} }\nuse crate::cli;")), ["cli"]);
    let declared =
        test_modules(Path::new("src/farm/mod.rs"), "mod a;\n#[cfg(test)]\npub(crate) mod example;\n#[cfg(test)]\nmod b { use x; }");
    assert_eq!(declared, [Path::new("src/farm/example.rs"), Path::new("src/farm/example")]);
}

// ---- Files stay short --------------------------------------------------------------------------------------------------

#[test]
fn files_stay_short() {
    let long =
        |path: &PathBuf| Some((relative(path), fs::read_to_string(path).unwrap().lines().count())).filter(|(_, n)| *n > LONGEST_FILE);
    let wrong: Vec<_> = files(root(), &[".rs"]).iter().filter_map(long).map(|(path, lines)| format!("{path} has {lines} lines")).collect();
    report(&format!("a file of more than {LONGEST_FILE} lines is several concepts"), &wrong);
}

// ---- Promises have a test behind them ----------------------------------------------------------------------------------

/// A promise: its number, and the tests behind it as `(file, function)`.
type Promise = (u32, Vec<(String, String)>);

/// Promises stand as `N. **Title.** text. Held by: `file.rs::test``, `...` over one or more lines.
fn promises(text: &str) -> Vec<Promise> {
    let mut paragraphs: Vec<(u32, String)> = Vec::new();
    let mut open = false;
    for line in text.lines() {
        let number = line.split_once(". **").and_then(|(number, _)| number.parse().ok());
        if let Some(number) = number {
            paragraphs.push((number, String::new()));
            open = true;
        } else if line.trim().is_empty() || line.starts_with('#') {
            open = false;
        }
        if let Some((_, paragraph)) = paragraphs.last_mut().filter(|_| open) {
            *paragraph += line;
            *paragraph += "\n";
        }
    }
    paragraphs.into_iter().map(|(number, paragraph)| (number, held_by(&paragraph))).collect()
}

fn held_by(paragraph: &str) -> Vec<(String, String)> {
    let Some((_, names)) = paragraph.split_once("Held by:") else { return Vec::new() };
    let quoted = names.split('`').skip(1).step_by(2);
    quoted.filter_map(|name| name.split_once("::")).map(|(file, test)| (file.to_owned(), test.to_owned())).collect()
}

/// Whether a source has a test of this name.
fn has_test(source: &str, name: &str) -> bool {
    let Some(at) = source.find(&format!("fn {name}(")) else { return false };
    let above = source[..at].trim_end_matches(|c| c != '\n').lines().rev();
    let mut own = above.map(str::trim_start).take_while(|line| line.starts_with("#[") || line.starts_with("//"));
    own.any(|line| line.contains("#[test]") || line.contains("#[tokio::test"))
}

fn without_test(promises: &[Promise], read: impl Fn(&str) -> Option<String>) -> Vec<String> {
    let mut wrong = Vec::new();
    for (place, (number, tests)) in promises.iter().enumerate() {
        if *number as usize != place + 1 {
            wrong.push(format!("promise {number} stands where {} is expected", place + 1));
        }
        if tests.is_empty() {
            wrong.push(format!("promise {number} names no test (Held by: `file.rs::test`)"));
        }
        for (file, test) in tests {
            match read(file) {
                None => wrong.push(format!("promise {number}: there is no {file}")),
                Some(source) if !has_test(&source, test) => wrong.push(format!("promise {number}: {file} has no test {test}")),
                Some(_) => {}
            }
        }
    }
    wrong
}

#[test]
fn every_promise_has_a_test_behind_it() {
    let promises = promises(&fs::read_to_string(root().join("ARCHITECTURE.md")).unwrap());
    assert!(promises.len() >= 5, "ARCHITECTURE.md: {} promises found", promises.len());
    report("ARCHITECTURE.md", &without_test(&promises, |file| fs::read_to_string(root().join(file)).ok()));
}

#[test]
fn a_promise_without_its_test_is_seen() {
    let source = "#[test]\nfn holds() {}\n\nfn no_test() {}\n#[test]\n#[ignore]\nfn other() {}";
    let read = |file: &str| (file == "a.rs").then(|| source.to_owned());
    let wrong = |text: &str| without_test(&promises(text), read);
    assert_eq!(
        wrong("1. **One.** Text\n   more. Held by: `a.rs::holds`,\n   `a.rs::other`.\n2. **Two.** Held by: `a.rs::holds`."),
        Vec::<String>::new()
    );
    for text in [
        "1. **One.** Text.",
        "1. **One.** Held by: `a.rs::gone`.",
        "1. **One.** Held by: `a.rs::no_test`.",
        "1. **One.** Held by: `b.rs::holds`.",
        "2. **Two.** Held by: `a.rs::holds`.",
    ] {
        assert_eq!(wrong(text).len(), 1, "{text}: {:?}", wrong(text));
    }
}

// ---- Links lead somewhere ----------------------------------------------------------------------------------------------

/// Targets of a page's links and pictures that are files.
fn linked_files(text: &str) -> Vec<String> {
    let targets = text.match_indices("](").filter_map(|(at, mark)| text[at + mark.len()..].split_once(')')).map(|(target, _)| target);
    let local = targets.filter(|target| !target.contains("://") && !target.starts_with(['#', '<']) && !target.starts_with("mailto:"));
    local.map(|target| target.split('#').next().unwrap().to_owned()).collect()
}

#[test]
fn links_of_the_documents_lead_somewhere() {
    let mut wrong = Vec::new();
    for page in files(root(), &[".md"]) {
        let links = linked_files(&fs::read_to_string(&page).unwrap());
        let missing = links.into_iter().filter(|link| !page.parent().unwrap().join(link).exists());
        wrong.extend(missing.map(|link| format!("{} links to {link}", relative(&page))));
    }
    report("links to files that are not there", &wrong);
    assert_eq!(linked_files("[a](b.md#c), ![d](e.png) [f](https://g.example/h) [i](#j)"), ["b.md", "e.png"]);
}

// ---- The project speaks of itself alone --------------------------------------------------------------------------------

#[test]
fn no_path_of_a_machine_stands_anywhere() {
    let words = ["work", "root", "home"].map(|folder| format!("/{folder}/"));
    let mut wrong = Vec::new();
    for path in
        files(root(), &[".rs", ".md", ".lua", ".luau", ".toml", ".sh", ".py", ".service", ".html", ".json", ".snap", "run", "Justfile"])
    {
        let Ok(text) = fs::read_to_string(&path) else { continue };
        for (number, line) in text.lines().enumerate() {
            let found = words.iter().filter(|word| line.contains(word.as_str()));
            wrong.extend(found.map(|word| format!("{}:{} names {word}", relative(&path), number + 1)));
        }
    }
    report("paths of a machine", &wrong);
}
